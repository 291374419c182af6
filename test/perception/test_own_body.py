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
"""Near returns that travel with the robot are its own body; nothing else is."""

import numpy as np
import pytest

from wallnav_ros.perception.own_body import OwnBody
from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.settings import TrackerSettings

# Parts of a robot lie within 0.8 m and keep their range to 5 cm over 1 m of driving.
SETTINGS = TrackerSettings(own_reach=0.8, own_margin=0.05, own_travel=1.0)
FORTH, STILL = (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)


def scan_of(ranges):
    return Scan(0.0, ranges, 0.0, 0.1, 0.05, 10.0)


def after(steps, *looks, body=None):
    """Return what is own in the last of `looks` (lists of ranges), each after a step."""
    body = body or OwnBody(SETTINGS)
    for look, step in zip(looks, steps):
        found = body.find(scan_of(look), np.array(step))
    return found.tolist()


def test_a_near_return_that_stays_over_a_metre_of_driving_is_the_robot():
    looks = [[0.4, 3.0 - 0.1 * number, 0.3] for number in range(13)]
    assert after([FORTH] * 13, *looks) == [True, False, True]


@pytest.mark.parametrize('count, own', [(11, False), (13, True)])
def test_the_way_that_counts_is_that_since_it_was_first_seen(count, own):
    # The first scan starts the count: eleven more steps of 0.1 m are more than a metre.
    assert after([FORTH] * count, *[[0.4]] * count) == [own]


def test_nothing_is_told_while_the_robot_stands():
    assert after([STILL] * 100, *[[0.4, 0.3]] * 100) == [False, False]


def test_turning_on_the_spot_is_motion_too():
    # 0.2 rad move what is 0.8 m away by 0.16 m.
    assert after([(0.0, 0.0, 0.2)] * 9, *[[0.4]] * 9) == [True]
    assert after([(0.0, 0.0, -0.2)] * 9, *[[0.4]] * 9) == [True]


def test_what_stays_beyond_reach_is_a_companion_not_the_robot():
    assert after([FORTH] * 30, *[[0.79, 0.81]] * 30) == [True, False]


def test_range_noise_is_forgiven_and_a_change_is_not():
    rng = np.random.default_rng(3)
    noisy = [[0.4 + noise] for noise in rng.uniform(-0.02, 0.02, 30)]
    assert after([FORTH] * 30, *noisy) == [True]
    creeping = [[0.4 - 0.01 * number] for number in range(30)]
    assert after([FORTH] * 30, *creeping) == [False]


@pytest.mark.parametrize('gap, own', [(np.nan, True), (0.0, True), (np.inf, True),
                                      (3.0, False), (0.2, False)])
def test_a_beam_lost_for_a_scan_proves_nothing_but_one_that_passes_does(gap, own):
    looks = [[0.4]] * 12 + [[gap]] + [[0.4]]
    assert after([FORTH] * 14, *looks) == [own]


def test_a_lost_beam_is_no_part_of_the_robot_while_it_is_lost():
    assert after([FORTH] * 13, *[[0.4]] * 12, [np.nan]) == [False]


def test_a_scanner_with_another_number_of_beams_starts_anew():
    body = OwnBody(SETTINGS)
    assert after([FORTH] * 13, *[[0.4]] * 13, body=body) == [True]
    assert after([FORTH], [0.4, 0.4], body=body) == [False, False]
