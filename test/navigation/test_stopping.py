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
"""A robot that only does what it can stop after touches nothing that stands still."""

import numpy as np
import pytest

from wallnav_ros.navigation.base import BaseLimits
from wallnav_ros.navigation.stopping import STEP, stoppable
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import drive_unicycle
from wallnav_ros.world.state import Agents, Observation, Robot

STOP, AHEAD, TURN = [0.0, 0.0], [0.8, 0.0], [0.0, 1.0]
LIMITS = BaseLimits(acceleration=2.0, turn_acceleration=5.0, latency=0.1, clearance=0.03)


def observation(speed=0.0, agents=None, walls=None, pose=(0.0, 0.0, 0.0), turn_rate=0.0):
    robot = Robot(np.array(pose), np.array([speed, turn_rate]), np.array([9.0, 0.0]),
                  np.float64(0.2), np.float64(0.8))
    return Observation(robot, agents or Agents.none(), walls or DistanceField.empty())


def disc(x, y, radius=0.3, vx=0.0, vy=0.0):
    return Agents.of([[x, y]], [[vx, vy]], [radius])


def allows(seen, *commands, duration=0.25):
    return stoppable(seen, np.array(commands), duration, LIMITS).tolist()


@pytest.mark.parametrize('gap, expected', [(0.50, True), (0.42, False)])
def test_braking_distance_latency_and_clearance_decide(gap, expected):
    # At 0.8 m/s: 0.1 s late and 0.25 s held give 0.28 m, braking at 2 m/s^2 another 0.16 m less
    # half a step's worth, and 0.03 m are kept: about 0.45 m in all.
    seen = observation(0.8, disc(0.2 + 0.3 + gap, 0.0))
    assert allows(seen, AHEAD) == [expected]


def test_a_wall_counts_like_anything_else_that_stands():
    nodes = -5.0 + 0.05 * np.arange(201)
    for wall, expected in ((0.70, True), (0.62, False)):
        field = DistanceField(np.broadcast_to(np.abs(nodes - wall), (201, 201)).astype(np.float32),
                              np.array([-5.0, -5.0, 0.0]), 0.05)
        assert allows(observation(0.8, walls=field), AHEAD) == [expected]


def test_someone_who_walks_into_a_standing_robot_does_not_forbid_standing():
    seen = observation(0.0, disc(1.0, 0.0, vx=-1.0))
    assert allows(seen, STOP, AHEAD) == [True, False]


def test_someone_walking_away_may_be_followed():
    assert allows(observation(0.8, disc(0.8, 0.0, vx=0.8)), AHEAD) == [True]


def test_a_robot_in_contact_may_leave_but_not_press_on():
    seen = observation(0.0, disc(0.45, 0.0))
    back_off = [-0.3, 0.0]
    assert allows(seen, AHEAD, TURN, back_off, STOP) == [False, True, True, True]


def test_what_cannot_be_seen_by_the_robots_velocity_is_not_forbidden():
    assert allows(observation(0.8, disc(-0.6, 0.0)), AHEAD, [0.8, 0.5]) == [True, True]


def test_no_sequence_of_allowed_commands_touches_anything_that_stands(rng):
    """Drive 40 random worlds by random allowed commands; the base is as it was assumed."""
    commands = np.stack(np.meshgrid([0.0, 0.2, 0.4, 0.8], np.linspace(-1.8, 1.8, 9)), -1)
    commands = commands.reshape(-1, 2)
    least = np.inf
    for _ in range(40):
        centres = rng.uniform(-2.5, 2.5, (12, 2))
        centres = centres[np.linalg.norm(centres, axis=1) > 0.7]
        agents = Agents.of(centres, np.zeros_like(centres), np.full(len(centres), 0.3))
        pose, velocity, late = np.zeros(3), np.zeros(2), np.zeros(2)
        for _ in range(25):
            seen = observation(velocity[0], agents, pose=pose, turn_rate=velocity[1])
            allowed = np.flatnonzero(stoppable(seen, commands, 0.25, LIMITS))
            command = commands[rng.choice(allowed)] if len(allowed) else np.zeros(2)
            for step in range(5):
                # The command before holds for the latency.
                wanted = late if step * STEP < LIMITS.latency - 1e-9 else command
                change = np.array([LIMITS.acceleration, LIMITS.turn_acceleration]) * STEP
                velocity = velocity + np.clip(wanted - velocity, -change, change)
                pose = drive_unicycle(pose, *velocity, STEP)
                gap = np.linalg.norm(centres - pose[:2], axis=1).min() - 0.5
                least = min(least, gap)
            late = command
    assert 0.0 < least < 0.1
