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
"""A policy that gets nowhere is helped out, one that waits for somebody is not."""

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.navigation.base import BaseLimits
from wallnav_ros.navigation.stopping import stoppable
from wallnav_ros.navigation.thawing import AFTER, DETOUR, HELPED, Thaw
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import drive_unicycle
from wallnav_ros.world.state import Agents, Observation, Robot
from wallnav_ros.world.walls import Walls


def seen(goal=(5.0, 0.0), agents=None, x=0.0, beyond=0.0):
    robot = Robot(np.array([x, 0.0, 0.0]), np.zeros(2), np.array(goal), np.float64(0.2),
                  np.float64(0.8), np.float64(beyond))
    return Observation(robot, agents or Agents.none(), DistanceField.empty())


def offer_after(seconds, observation=None, limits=BaseLimits()):
    thaw, observation = Thaw(), observation or seen()
    thaw.offer(observation, limits, 100.0)
    return thaw.offer(observation, limits, 100.0 + seconds)


def test_a_policy_is_given_time():
    assert offer_after(0.9 * AFTER) is None
    assert offer_after(1.1 * AFTER) is not None


def test_a_policy_that_gets_on_is_left_alone_however_slowly():
    thaw = Thaw()
    for second in range(20):
        assert thaw.offer(seen(x=0.2 * second), BaseLimits(), 100.0 + second) is None


def test_driving_to_and_fro_is_not_getting_on():
    thaw = Thaw()
    offers = [thaw.offer(seen(x=0.8 * (second % 2)), BaseLimits(), 100.0 + second)
              for second in range(10)]
    assert offers[0] is None and offers[-1] is not None


def test_help_lasts_for_a_while_and_ends():
    thaw = Thaw()
    thaw.offer(seen(), BaseLimits(), 100.0)
    assert thaw.offer(seen(), BaseLimits(), 101.0 + AFTER) is not None
    assert thaw.offer(seen(x=0.9 * HELPED), BaseLimits(), 102.0 + AFTER) is not None
    assert thaw.offer(seen(x=1.1 * HELPED), BaseLimits(), 103.0 + AFTER) is None


def test_another_goal_is_another_beginning():
    thaw = Thaw()
    thaw.offer(seen(), BaseLimits(), 100.0)
    assert thaw.offer(seen(), BaseLimits(), 101.0 + AFTER) is not None
    assert thaw.offer(seen(beyond=1.5 * DETOUR), BaseLimits(), 102.0 + AFTER) is None


@pytest.mark.parametrize('place, velocity, waits', [
    ((0.8, 2.0), (0.0, -1.0), True), ((0.8, 2.0), (0.0, 1.0), False),
    ((0.8, 4.0), (0.0, -1.0), False), ((0.8, 0.7), (0.0, 0.0), False),
    ((-2.0, 0.0), (1.0, 0.0), True)])
def test_waiting_for_somebody_who_will_cross_the_way_is_not_freezing(place, velocity, waits):
    walker = Agents.of([place], [velocity], [0.3])
    assert (offer_after(10.0, seen(agents=walker)) is None) == waits


def test_a_sub_goal_ahead_is_driven_to_straight():
    offered = offer_after(10.0)
    np.testing.assert_allclose(offered[0], [0.4, 0.0])


@pytest.mark.parametrize('goal, side', [((0.0, 5.0), 1.0), ((-4.0, -3.0), -1.0)])
def test_a_sub_goal_to_the_side_is_turned_to_as_fast_as_may_be(goal, side):
    offered = offer_after(10.0, seen(goal), BaseLimits(max_turn_rate=1.5))
    assert offered[0, 1] == 1.5 * side
    assert np.abs(offered[:, 1]).max() == 1.5


def test_a_base_that_cannot_turn_slowly_is_never_told_to():
    offered = offer_after(10.0, seen((5.0, 0.5)), BaseLimits(min_turn_rate=0.6))
    rates = np.abs(offered[:, 1])
    assert ((rates == 0.0) | (rates >= 0.6)).all() and (rates == 0.0).any()


def test_a_corner_that_the_straight_line_grazes_is_gone_round():
    # The robot stands 3 cm from the corner of a wall, and its sub-goal lies past it: straight
    # ahead would end within the clearance at once, and turning there alone leads nowhere.
    corner = distance_field(Walls.from_polylines([[(0.15, 0.176), (0.15, 3.0), (2.0, 3.0)]]))
    thaw, limits, pose = Thaw(), BaseLimits(), np.zeros(3)
    start = replace(seen((2.0, 0.0)), walls=corner)
    thaw.offer(start, limits, 0.0)
    for step in range(24):
        observation = replace(start, robot=replace(start.robot, pose=pose))
        offered = thaw.offer(observation, limits, 1.1 * AFTER + 0.25 * step)
        allowed = stoppable(observation, offered, 0.25, limits)
        pose = drive_unicycle(pose, *offered[allowed.argmax()], 0.25)
        assert allowed.any() and corner.at(pose[:2]) > start.robot.radius
        if pose[0] > 1.0:
            return
    raise AssertionError(f'still at {pose}')


def test_somebody_who_stands_before_the_sub_goal_is_gone_round():
    someone = Agents.of([(1.0, 0.0)], [(0.0, 0.0)], [0.3])
    offered = offer_after(10.0, seen((2.0, 0.0), someone))
    # 1.5 s straight on would end 0.2 m inside.
    assert offered[0, 0] > 0.0 and offered[0, 1] != 0.0
