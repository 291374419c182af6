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
"""Human or obstacle: hysteresis of the label, and the gait of legs."""

import numpy as np
import pytest
from track_tables import make_table

from wallnav_ros.perception.classification import (
    find_gait, settle_labels, weigh_gait, weigh_motion)
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.track_table import TRAIL

SETTINGS = TrackerSettings(human_odds=2.0, swing=0.12, stride=0.8, leg_width=0.25,
                           thin_radius=0.035)
CERTAIN = {'score': 1.0, 'reach': 1.0, 'hits': 1.0, 'apart': 1.0}
NOBODY_BARRED = np.zeros(1, dtype=bool)


def label(**columns):
    """Return whether a track with `columns` is human after the labels are settled."""
    table = make_table([[0.0, 0.0]], **{**CERTAIN, **columns})
    settle_labels(table, NOBODY_BARRED, SETTINGS)
    return bool(table.human[0])


@pytest.mark.parametrize('motion, before, after', [
    (2.1, False, True),       # 89 % sure that it moves
    (1.9, False, False),      # not quite
    (-1.9, True, True),       # one who stands keeps the name
    (-2.1, True, False),      # until it is as sure that nothing moves
    (0.0, True, True), (0.0, False, False)])
def test_the_name_is_given_and_taken_at_different_odds(motion, before, after):
    assert label(motion=motion, human=before) == after


@pytest.mark.parametrize('doubt', [
    {'score': 0.9}, {'reach': 0.1}, {'hits': 0.5}, {'apart': 0.2}])
def test_what_is_uncertain_gets_no_name_but_does_not_lose_it(doubt):
    assert not label(motion=4.0, **doubt)
    assert label(motion=4.0, human=True, **doubt)


def test_where_the_map_tells_the_walls_a_name_is_given_after_fewer_sightings():
    table = make_table([[0.0, 0.0]], motion=4.0, **{**CERTAIN, 'hits': 0.4})
    settle_labels(table, NOBODY_BARRED, SETTINGS)
    assert not table.human[0]
    settle_labels(table, NOBODY_BARRED, SETTINGS, plain=np.ones(1, dtype=bool))
    assert table.human[0]


def test_who_is_barred_gets_no_name_but_does_not_lose_it():
    table = make_table(np.zeros((3, 2)), motion=4.0, human=[False, True, False], **CERTAIN)
    settle_labels(table, np.array([True, True, False]), SETTINGS)
    assert table.human.tolist() == [False, True, True]


LEG = {'radius': 0.07, 'apart': 1.0, 'hits': 1.0}


def walk(ahead_now, ahead_before, side=0.15, **columns):
    """Return the gait of two legs `side` m apart, one ahead by so much, now and on the trail."""
    position = np.array([[2.0 + ahead_now, side], [2.0, 0.0]])
    before = np.array([[2.0 + ahead_before, side], [2.0, 0.0]])
    trail = np.repeat(position[:, None], TRAIL, axis=1)
    trail[:, 1:] = before[:, None]
    table = make_table(position, trail=trail, **{**LEG, **columns})
    return (np.asarray(find_gait(table, SETTINGS)) > 0).tolist()


def test_legs_that_change_places_walk():
    assert walk(0.2, -0.2) == [True, True]


def test_the_legs_of_a_chair_keep_their_distance_whatever_the_robot_does():
    assert walk(0.2, 0.2) == [False, False]
    assert walk(0.2, 0.15) == [False, False]


@pytest.mark.parametrize('no_leg', [
    {'radius': 0.2}, {'radius': [0.07, 0.02]}, {'apart': 0.5}, {'hits': 0.2}, {'side': 0.9}])
def test_only_legs_that_stand_clear_within_a_stride_have_a_gait(no_leg):
    assert walk(0.2, -0.2, **no_leg) == [False, False]


def test_a_third_leg_beside_makes_it_furniture():
    position = np.array([[2.2, 0.15], [2.0, 0.0], [2.3, -0.2]])
    trail = np.repeat(position[:, None], TRAIL, axis=1)
    trail[0, 1:, 0] -= 0.4
    gait = find_gait(make_table(position, trail=trail, **LEG), SETTINGS)
    assert not np.any(gait)


def test_a_leg_that_has_stood_for_long_does_not_swing_unless_nothing_is_known_to_stand():
    swings, still = np.array([True, True, False]), np.array([0.2, 0.9, 0.2])
    rate = SETTINGS.gait_rate
    assert weigh_gait(swings, still, True, SETTINGS).tolist() == [rate, 0.0, 0.0]
    assert (weigh_gait(swings, still, False, SETTINGS) > rate).tolist() == [True, True, False]


def test_nobody_has_no_gait():
    assert len(find_gait(make_table(np.empty((0, 2))), SETTINGS)) == 0


def evidence(steps, moved_rate=3.0, leap_share=0.5):
    """Return the log-odds after one scan of what came by `steps` (TRAIL,) m, newest first."""
    trail = np.zeros((1, TRAIL, 2))
    trail[0, :, 0] = -np.cumsum(steps)
    table = make_table([[0.0, 0.0]], trail=trail, velocity=[1.0, 0.0], radius=0.1,
                       covariance=[0.0009, 0.0, 0.04])
    none = np.zeros(1)
    weigh_motion(table, np.array([0]), none, none, np.full(1, moved_rate), none.astype(bool), none,
                 0.1, SETTINGS, leap_share)
    return float(table.motion[0])


def test_a_way_is_motion_and_one_leap_of_the_same_length_is_none():
    even, leap = np.full(TRAIL, 0.4 / TRAIL), np.zeros(TRAIL)
    leap[3] = 0.4
    # 0.4 m less half a step of 0.025 m: beyond 0.25 m; less half the leap: 0.2 m is not.
    assert evidence(even) == pytest.approx(0.3)
    assert evidence(leap) == 0.0
    assert evidence(leap, leap_share=0.0) == pytest.approx(0.3)


def slid(way, noise=0.0, seen=True, discs=True):
    """Return the log-odds after 0.1 s of a slow disc whose centre came by `way` m in 0.8 s."""
    centres = np.full((1, TRAIL + 1, 2), np.nan)
    centres[0, :9] = np.linspace([0.0, 0.0], [-way, 0.0], 9)
    # To and fro about that line: deviations of `noise` along and across.
    centres[0, :9] += noise * np.array([[1, 1], [-1, 1], [0, -2]] * 3)
    if not seen:
        centres[0, 0] = np.nan
    table = make_table([[0.0, 0.0]], centres=centres[:, 1:], centre=centres[:, 0],
                       velocity=[0.1, 0.0], radius=0.3)
    none = np.zeros(1)
    weigh_motion(table, np.array([0]), none, none, none, none.astype(bool), none, 0.1, SETTINGS,
                 discs=np.array([discs]))
    return float(table.motion[0])


def test_the_centre_of_a_disc_tells_a_step_of_ten_centimetres():
    assert slid(0.11) == pytest.approx(0.1 * SETTINGS.disc_rate)
    assert slid(0.09) == 0.0


def test_a_centre_that_jitters_by_as_much_tells_none():
    # The line is 0.2 m long. With 0.05 m of noise its end is known to about 0.05 m, which
    # is no fourth of it; with 0.01 m of noise it is known to 0.015 m.
    assert slid(0.2, noise=0.05) == 0.0
    assert slid(0.2, noise=0.01) > 0.0


def test_a_disc_that_is_not_seen_all_across_tells_no_step():
    assert slid(0.3, seen=False) == 0.0
    assert slid(0.3, discs=False) == 0.0


def test_what_moves_counts_for_nothing_where_its_surroundings_seem_to_move():
    assert evidence(np.full(TRAIL, 0.05), moved_rate=0.0) == 0.0
