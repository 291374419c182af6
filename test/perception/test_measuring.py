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
"""Where a track is: one cluster, two legs or a disc, and how well each shows it."""

import numpy as np
import pytest
from track_tables import make_detections, make_discs, make_table

from wallnav_ros.perception.measuring import measure
from wallnav_ros.perception.settings import TrackerSettings

SETTINGS = TrackerSettings(
    leg_width=0.25, apart_distance=0.4, leg_noise=0.1, hidden_noise=0.1, hidden_width=0.2,
    roundness=0.75)
# A track taken for a disc of 0.26 m, and what is seen of it: 0.24 m, known as well.
DISC = {'disc': 0.26, 'disc_variance': 0.02 ** 2, 'radius': 0.3, 'centre': np.nan}
SEEN = make_discs([[2.1, 0.05]], 0.24, pull=(1.0, 0.5), doubt=0.02, fits=True)
HIDDEN = {'left': (0.0, 0.5), 'right': (0.5, 0.0), 'both': (0.5, 0.5)}


def measured(table, seen, two=0, elapsed=0.0):
    """Return what the first detection, and that of index `two`, say of the only track."""
    return measure(table, np.array([0]), seen, np.array([0]), np.array([two]),
                   np.array([elapsed]), SETTINGS)


def test_one_cluster_is_where_it_is():
    table = make_table([[0.0, 0.0]], radius=0.2, centre=np.nan)
    found = measured(table, make_detections([[2.0, 0.5]], radius=0.22, noise=0.04))
    np.testing.assert_allclose(found.position, [[2.0, 0.5]])
    assert found.radius[0] == pytest.approx(0.22) and found.noise[0] == pytest.approx(0.04)
    assert not found.covered[0] and not found.disc[0] and not found.solid[0]


def test_two_legs_are_their_middle_and_wide_enough_for_both():
    table = make_table([[2.0, 0.0]], radius=0.1, pair=0.5, centre=np.nan)
    legs = make_detections([[2.0, -0.1], [2.2, 0.1]], radius=[0.06, 0.08], leg=True)
    found = measured(table, legs, two=1)
    np.testing.assert_allclose(found.position, [[2.1, 0.0]])
    # The wider leg, and half of the 0.2 * sqrt(2) m between the two.
    assert found.radius[0] == pytest.approx(0.08 + 0.1 * np.sqrt(2.0))
    assert found.noise[0] == pytest.approx(0.03)


def test_tracks_are_measured_each_by_its_own():
    table = make_table(np.zeros((3, 2)), radius=0.1, pair=0.5, centre=np.nan)
    seen = make_detections([[1.0, 0.0], [2.0, -0.1], [2.0, 0.3]], radius=[0.2, 0.07, 0.07])
    found = measure(table, np.array([2, 0]), seen, np.array([1, 0]), np.array([2, 0]),
                    np.full(2, 0.1), SETTINGS)
    np.testing.assert_allclose(found.position, [[2.0, 0.1], [1.0, 0.0]])
    np.testing.assert_allclose(found.radius, [0.27, 0.2])


@pytest.mark.parametrize('hidden', [(0.0, 0.0), *HIDDEN.values()])
def test_what_has_proved_to_be_a_disc_is_where_its_disc_is(hidden):
    table = make_table([[2.0, 0.0]], **DISC, roundness=0.95)
    found = measured(table, make_detections(
        [[2.0, 0.2]], SEEN, radius=0.15, hidden=hidden, sight=(1.0, 0.0)))
    # Halfway between the radii 0.26 and 0.24; 1 cm more than seen moves the centre by its pull.
    assert found.radius[0] == table.disc[0] == pytest.approx(0.25)
    np.testing.assert_allclose(found.position, [[2.11, 0.055]])
    assert found.disc[0] and found.solid[0]


def test_what_has_not_proved_to_be_a_disc_is_where_its_cluster_is():
    table = make_table([[2.0, 0.0]], **DISC, roundness=0.5)
    found = measured(table, make_detections([[2.0, 0.2]], SEEN, radius=0.15))
    np.testing.assert_allclose(found.position, [[2.0, 0.2]])
    assert found.radius[0] == pytest.approx(0.15)
    assert found.disc[0] and not found.solid[0]


def test_the_scan_that_proves_a_disc_is_the_first_to_be_read_as_one():
    table = make_table([[2.0, 0.0]], **DISC, roundness=0.7)
    solid = [bool(measured(table, make_detections([[2.0, 0.2]], SEEN), elapsed=0.1).solid[0])
             for _ in range(2)]
    assert table.roundness[0] == pytest.approx(0.808)     # 0.7, 0.76, 0.808
    assert solid == [True, True]


def test_a_disc_no_wider_than_a_leg_is_never_solid():
    table = make_table([[2.0, 0.0]], **{**DISC, 'radius': 0.12}, roundness=1.0)
    found = measured(table, make_detections([[2.0, 0.2]], SEEN, radius=0.12))
    assert found.disc[0] and not found.solid[0]
    np.testing.assert_allclose(found.position, [[2.0, 0.2]])


def test_a_disc_whose_beams_do_not_lie_on_it_is_where_its_cluster_is():
    table = make_table([[2.0, 0.0]], **DISC, roundness=1.0)
    other = make_discs([[2.1, 0.05]], 0.24, fits=False)
    found = measured(table, make_detections([[2.0, 0.2]], other, radius=0.15), elapsed=0.1)
    assert not found.disc[0] and not found.solid[0]
    np.testing.assert_allclose(found.position, [[2.0, 0.2]])
    assert table.roundness[0] == pytest.approx(0.8)
    assert np.isnan(table.centre[0]).all()


def test_two_clusters_are_no_disc():
    table = make_table([[2.0, 0.0]], **DISC, roundness=1.0)
    discs = make_discs([[2.1, 0.05], [2.1, 0.05]], 0.24, fits=True)
    found = measured(table, make_detections([[2.0, 0.2], [2.0, -0.2]], discs), two=1, elapsed=0.1)
    assert not found.disc[0] and not found.solid[0]
    np.testing.assert_allclose(found.position, [[2.0, 0.0]])
    assert table.roundness[0] == pytest.approx(0.8)
    assert np.isnan(table.centre[0]).all()


@pytest.mark.parametrize('roundness', [0.5, 0.95])
def test_the_centre_of_a_disc_is_kept_where_both_limbs_are_seen(roundness):
    table = make_table([[2.0, 0.0]], **DISC, roundness=roundness)
    measured(table, make_detections([[2.0, 0.2]], SEEN))
    np.testing.assert_allclose(table.centre, [[2.11, 0.055]])


@pytest.mark.parametrize('hidden', HIDDEN.values(), ids=HIDDEN.keys())
def test_no_centre_is_kept_where_a_limb_is_hidden(hidden):
    table = make_table([[2.0, 0.0]], **DISC, roundness=0.95)
    found = measured(table, make_detections(
        [[2.0, 0.2]], SEEN, hidden=hidden, sight=(1.0, 0.0)))
    assert found.disc[0] and np.isnan(table.centre[0]).all()


@pytest.mark.parametrize('side, aside', [('left', 0.05), ('right', -0.05)])
def test_a_body_half_hidden_is_one_radius_from_the_limb_in_sight(side, aside):
    # 0.3 m of one 0.4 m wide, seen along x: the limb in sight is 0.15 m from what is seen.
    table = make_table([[2.0, 0.0]], radius=0.2, centre=np.nan)
    found = measured(table, make_detections(
        [[2.0, 0.0]], radius=0.15, hidden=HIDDEN[side], sight=(1.0, 0.0)))
    assert found.position[0, 1] == pytest.approx(aside)
    assert found.covered[0] and not found.solid[0]


def test_who_walks_on_two_legs_is_not_taken_for_a_body_half_hidden():
    table = make_table([[2.0, 0.0]], radius=0.2, pair=0.5, centre=np.nan)
    found = measured(table, make_detections(
        [[2.0, 0.0]], radius=0.15, hidden=HIDDEN['left'], sight=(1.0, 0.0)))
    np.testing.assert_allclose(found.position, [[2.0, 0.0]])
    assert found.covered[0]


@pytest.mark.parametrize('roundness', [0.5, 0.95])
@pytest.mark.parametrize('hidden, unknown', [
    ((0.0, 0.0), 0.0), (HIDDEN['left'], 0.05), (HIDDEN['right'], 0.05), (HIDDEN['both'], 0.1)])
def test_the_place_is_known_less_well_by_half_a_doubt_for_each_hidden_side(
        hidden, unknown, roundness):
    table = make_table([[2.0, 0.0]], **DISC, roundness=roundness)
    found = measured(table, make_detections(
        [[2.0, 0.2]], SEEN, hidden=hidden, sight=(1.0, 0.0)))
    assert found.noise[0] == pytest.approx(np.hypot(0.03, unknown))
    assert found.covered[0] == (unknown > 0.0)


@pytest.mark.parametrize('columns, cover, covered', [
    ({'radius': 0.2}, 0.15, True),                    # a body that something just before it covers
    ({'radius': 0.07}, 0.3, False),                   # a leg behind the other one
    ({'radius': 0.07}, 0.5, True),                    # a leg behind something else
    ({'radius': 0.2, 'pair': 0.1}, 0.3, False),       # legs as well, seen as one
    ({'radius': 0.2, 'pair': 0.1}, 0.5, True)])
def test_a_leg_before_the_other_covers_nothing(columns, cover, covered):
    table = make_table([[2.0, 0.0]], **columns, centre=np.nan)
    found = measured(table, make_detections(
        [[2.0, 0.0]], radius=0.07, hidden=(cover, 0.0), sight=(1.0, 0.0)))
    assert found.covered[0] == covered
    assert found.noise[0] == pytest.approx(np.hypot(0.03, 0.05) if covered else 0.03)


@pytest.mark.parametrize('pair', [0.0, 0.5])      # also where they are seen for the first time
@pytest.mark.parametrize('which', [0, 1])
def test_of_two_legs_either_may_be_covered(which, pair):
    table = make_table([[2.0, 0.0]], radius=0.1, pair=pair, centre=np.nan)
    hidden = np.zeros((2, 2))
    hidden[which, 1] = 0.5
    found = measured(table, make_detections(
        [[2.0, -0.1], [2.0, 0.1]], radius=0.07, leg=True, hidden=hidden, sight=(1.0, 0.0)),
        two=1)
    assert found.covered[0]
    # With both in sight, their middle is where the person is.
    np.testing.assert_allclose(found.position, [[2.0, 0.0]])
    assert found.noise[0] == pytest.approx(0.03)


@pytest.mark.parametrize('pair, leg, noise', [
    (0.5, True, 0.1),         # the body is a quarter of a stride away
    (0.5, False, 0.03),       # both legs in one cluster
    (0.2, True, 0.03)])       # a thing no wider than a leg
def test_a_lone_leg_of_two_tells_less_of_the_body(pair, leg, noise):
    table = make_table([[2.0, 0.0]], radius=0.1, pair=pair, centre=np.nan)
    found = measured(table, make_detections([[2.0, 0.1]], radius=0.07, leg=leg))
    assert found.noise[0] == pytest.approx(noise)
