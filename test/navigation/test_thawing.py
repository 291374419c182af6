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
"""A policy that has frozen is helped out, one that waits for somebody is not."""

import numpy as np
import pytest

from wallnav_ros.navigation.base import BaseLimits
from wallnav_ros.navigation.thawing import AFTER, NEAR, Thaw
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.state import Agents, Observation, Robot

STANDING, DRIVING = np.zeros(2), np.array([0.5, 0.0])


def seen(goal=(5.0, 0.0), agents=None):
    robot = Robot(np.zeros(3), np.zeros(2), np.array(goal), np.float64(0.2), np.float64(0.8))
    return Observation(robot, agents or Agents.none(), DistanceField.empty())


def offer_after(seconds, observation=None, wanted=STANDING, limits=BaseLimits()):
    thaw, observation = Thaw(), observation or seen()
    thaw.offer(observation, wanted, limits, 100.0)
    return thaw.offer(observation, wanted, limits, 100.0 + seconds)


def test_a_policy_is_given_time():
    assert offer_after(0.9 * AFTER) is None
    assert offer_after(1.1 * AFTER) is not None


def test_a_policy_that_drives_is_left_alone():
    assert offer_after(10.0, wanted=DRIVING) is None


def test_time_starts_anew_when_the_policy_has_driven_in_between():
    thaw = Thaw()
    for now, wanted in ((100.0, STANDING), (101.0, DRIVING), (101.5, STANDING)):
        thaw.offer(seen(), wanted, BaseLimits(), now)
    assert thaw.offer(seen(), STANDING, BaseLimits(), 101.0 + AFTER) is None


@pytest.mark.parametrize('distance, speed, waits', [
    (NEAR, 1.0, True), (NEAR + 1.0, 1.0, False), (NEAR, 0.0, False)])
def test_waiting_for_somebody_who_walks_nearby_is_not_freezing(distance, speed, waits):
    walker = Agents.of([[0.0, distance]], [[speed, 0.0]], [0.3])
    assert (offer_after(10.0, seen(agents=walker)) is None) == waits


def test_a_sub_goal_ahead_is_driven_to_the_fastest_offer_first():
    offered = offer_after(10.0)
    np.testing.assert_allclose(offered[:3], [[0.4, 0.0], [0.2, 0.0], [0.1, 0.0]])


def test_a_sub_goal_to_the_side_is_turned_to_on_the_spot():
    np.testing.assert_allclose(offer_after(10.0, seen((0.0, 5.0))), [[0.0, 2.0]])
    np.testing.assert_allclose(offer_after(10.0, seen((4.0, -1.0))),
                               [[0.0, -2.0 * np.arctan2(1.0, 4.0)]])


def test_a_base_that_cannot_turn_slowly_drives_straight_or_turns_as_slowly_as_it_can():
    offered = offer_after(10.0, seen((5.0, 0.5)), limits=BaseLimits(min_turn_rate=0.6))
    assert (offered[:3, 1] == 0.0).all()
    np.testing.assert_allclose(offered[3], [0.0, 0.6])
