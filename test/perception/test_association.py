# Copyright 2026 The wallnav_ros authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""Which track caused which detections: gates, optimal pairs, two legs to a person."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from track_tables import make_detections, make_discs, make_table

from wallnav_ros.perception.association import associate
from wallnav_ros.perception.settings import TrackerSettings

SETTINGS = TrackerSettings(
    body_noise=0.03, leg_noise=0.1, gate=3.0, human_gate=4.0, stride=0.8, thin_radius=0.035)
# Of a thing: 2 * 0.03 for where its centre is, 0.03 of the detection, so 0.067 m together.
DEVIATION = np.hypot(0.06, 0.03)
LEG = {'radius': 0.07, 'leg': True}
WALKER = {'motion': 3.0, 'human': True, 'radius': 0.1}


def pairs(table, detections):
    """Return [(first, second)] of each track, and the detections that belong to none."""
    found = associate(table, detections, SETTINGS)
    return (list(zip(found.first.tolist(), found.second.tolist())),
            np.flatnonzero(~found.used).tolist())


@pytest.mark.parametrize('gap, within', [(2.9 * DEVIATION, True), (3.1 * DEVIATION, False)])
def test_a_thing_is_found_within_three_standard_deviations(gap, within):
    table = make_table([[1.0, 2.0]], radius=0.2)
    expected = ([(0, -1)], []) if within else ([(-1, -1)], [0])
    assert pairs(table, make_detections([[1.0 + gap, 2.0]])) == expected


def test_the_gate_grows_with_what_is_not_known_of_the_track():
    detection = make_detections([[0.5, 0.0]])
    assert pairs(make_table([[0.0, 0.0]], radius=0.2), detection)[0] == [(-1, -1)]
    unsure = make_table([[0.0, 0.0]], radius=0.2, covariance=[0.2 ** 2, 0.0, 1.0])
    assert pairs(unsure, detection)[0] == [(0, -1)]


def test_people_may_turn_more_sharply_than_things():
    gap = 3.5 * np.hypot(0.1, 0.03)
    for human in (True, False):
        table = make_table([[0.0, 0.0]], motion=1.0, human=human, radius=0.2)
        found, _ = pairs(table, make_detections([[gap, 0.0]]))
        assert found == [(0 if human else -1, -1)]


def test_the_pairs_are_the_best_together_not_one_by_one():
    # The second track is nearest to the first detection, but then the first one has nothing.
    table = make_table([[0.0, 0.0], [0.15, 0.0]], radius=0.2)
    found, _ = pairs(table, make_detections([[0.09, 0.0], [0.25, 0.0]]))
    assert found == [(0, -1), (1, -1)]


def test_a_walker_has_two_legs_and_a_thing_one_place():
    legs = make_detections([[0.0, 0.12], [0.0, -0.12]], **LEG)
    found, left = pairs(make_table([[0.0, 0.0]], **WALKER), legs)
    assert sorted(found[0]) == [0, 1] and not left
    thing = make_table([[0.0, 0.0]], radius=0.1, covariance=[0.01, 0.0, 0.01])
    found, left = pairs(thing, legs)
    assert found[0][1] == -1 and len(left) == 1


def test_a_leg_of_ones_own_goes_before_another_ones_second():
    # It lies nearer to the first person, who has a leg already.
    people = make_table([[0.0, 0.0], [0.0, 0.3]], **WALKER)
    found, _ = pairs(people, make_detections([[0.0, -0.05], [0.0, 0.12]], **LEG))
    assert found == [(0, -1), (1, -1)]


@pytest.mark.parametrize('second', [
    {'leg': [True, False], 'radius': [0.07, 0.3]},     # a body is no second leg
    {'leg': True, 'radius': 0.02}])                    # nor is a pole
def test_only_legs_come_in_twos(second):
    table = make_table([[0.0, 0.0]], **WALKER)
    found, left = pairs(table, make_detections([[0.0, 0.12], [0.0, -0.12]], **second))
    assert found[0][1] == -1 and len(left) == 1


def test_legs_further_apart_than_a_stride_are_not_of_one_person():
    unsure = make_table([[0.0, 0.0]], **WALKER, covariance=[0.2, 0.0, 1.0])
    found, left = pairs(unsure, make_detections([[0.0, 0.39], [0.0, -0.39]], **LEG))
    assert sorted(found[0]) == [0, 1]
    found, left = pairs(unsure, make_detections([[0.0, 0.42], [0.0, -0.42]], **LEG))
    assert found[0][1] == -1 and len(left) == 1


def test_one_who_walks_is_not_taken_for_what_always_stood_there():
    walker = make_table([[0.0, 0.0]], **WALKER, velocity=[1.0, 0.0])
    found, _ = pairs(walker, make_detections([[0.1, 0.0], [-0.12, 0.0]], still=[1.0, 0.0]))
    assert found[0][0] == 1
    # One who stands may be: the nearer one is taken.
    standing = make_table([[0.0, 0.0]], **WALKER)
    found, _ = pairs(standing, make_detections([[0.1, 0.0], [-0.12, 0.0]], still=[1.0, 0.0]))
    assert found[0][0] == 0


def test_what_stood_is_not_taken_for_one_who_has_just_arrived():
    table = make_table([[0.0, 0.0]], motion=-3.0, radius=0.2)
    found, _ = pairs(table, make_detections([[0.1, 0.0], [-0.12, 0.0]], fresh=[1.0, 0.0]))
    assert found[0][0] == 1


def test_of_two_as_near_the_one_of_the_same_size_is_taken():
    table = make_table([[0.0, 0.0]], radius=0.3)
    found, _ = pairs(table, make_detections([[0.1, 0.0], [-0.1, 0.0]], radius=[0.05, 0.3]))
    assert found[0][0] == 1


def test_who_is_known_goes_before_what_may_be_a_flicker():
    # A new thing lies nearer to the only cluster than the one that has been seen for long.
    tracks = [[0.0, 0.0], [0.15, 0.0]]
    table = make_table(tracks, radius=0.2, score=[1.0, 0.4])
    assert pairs(table, make_detections([[0.1, 0.0]]))[0] == [(0, -1), (-1, -1)]
    table = make_table(tracks, radius=0.2, score=[1.0, 1.0])
    assert pairs(table, make_detections([[0.1, 0.0]]))[0] == [(-1, -1), (0, -1)]


def test_a_flake_next_to_a_person_does_not_take_their_leg():
    # As in snow: the flake's track could have the leg, and the person's track the next flake.
    person_and_flake = make_table([[0.0, 0.0], [0.3, 0.0]], human=[True, False],
                                  motion=[3.0, 0.0], radius=[0.1, 0.01], score=[1.0, 0.4],
                                  covariance=[0.03, 0.0, 1.0])
    leg_and_flake = make_detections([[0.1, 0.0], [-0.3, 0.1]], radius=[0.07, 0.01], leg=True)
    found, _ = pairs(person_and_flake, leg_and_flake)
    assert 0 in found[0] and found[1] == (-1, -1)


def test_the_track_of_a_speck_takes_a_leg_only_for_want_of_specks():
    table = make_table([[0.0, 0.0]], radius=0.02)
    found, _ = pairs(table, make_detections([[0.05, 0.0], [-0.1, 0.0]], radius=[0.07, 0.02]))
    assert found == [(1, -1)]
    assert pairs(table, make_detections([[0.05, 0.0]], radius=0.07))[0] == [(0, -1)]


def test_a_solid_body_does_not_walk_on_two_legs():
    legs = make_detections([[0.0, 0.12], [0.0, -0.12]], **LEG)
    body = make_table([[0.0, 0.0]], motion=3.0, human=True, radius=0.3, roundness=1.0,
                      covariance=[0.03, 0.0, 1.0])
    found, left = pairs(body, legs)
    assert found[0][1] == -1 and len(left) == 1


def test_a_solid_body_is_looked_for_where_the_disc_is_not_where_its_visible_part_is():
    # The cluster's middle lies 0.3 m beside the body of which it shows one side.
    seen = make_detections([[0.3, 0.0]], discs=make_discs([[0.0, 0.0]], fits=True))
    for roundness, found in ((1.0, [(0, -1)]), (0.5, [(-1, -1)])):
        body = make_table([[0.0, 0.0]], radius=0.3, roundness=roundness)
        assert pairs(body, seen)[0] == found


@pytest.mark.parametrize('tracks, things', [(0, 0), (0, 3), (3, 0)])
def test_nothing_is_paired_with_nothing(tracks, things):
    found, left = pairs(make_table(np.zeros((tracks, 2))), make_detections(np.zeros((things, 2))))
    assert found == [(-1, -1)] * tracks and left == list(range(things))


PLACES = st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), max_size=8)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(PLACES, PLACES, st.integers(0, 2 ** 32 - 1))
def test_no_detection_is_shared_and_only_walkers_have_a_second(tracks, things, seed):
    rng = np.random.default_rng(seed)
    table = make_table(tracks, motion=rng.uniform(-3.0, 3.0, len(tracks)),
                       radius=0.1, covariance=[0.1, 0.0, 1.0])
    detections = make_detections(things, radius=rng.uniform(0.02, 0.3, len(things)),
                                 leg=rng.random(len(things)) < 0.7)
    found = associate(table, detections, SETTINGS)
    taken = np.concatenate((found.first, found.second))
    taken = taken[taken >= 0]
    assert len(set(taken.tolist())) == len(taken)
    assert sorted(taken.tolist()) == np.flatnonzero(found.used).tolist()
    paired = found.second >= 0
    assert (found.first[paired] >= 0).all() and (table.motion[paired] > 0.0).all()
