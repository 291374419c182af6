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

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.navigation.base import BaseLimits
from wallnav_ros.navigation.driving import HELD_PERIODS
from wallnav_ros.navigation.stopping import stoppable
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


def test_each_command_may_be_held_for_a_time_of_its_own():
    for gap in np.linspace(0.2, 0.8, 25):
        seen = observation(0.8, disc(0.2 + 0.3 + gap, 0.1))
        commands, held = [AHEAD, AHEAD, (0.5, 1.0), (0.0, 0.0)], [0.05, 0.4, 0.25, 0.1]
        each = [allows(seen, command, duration=duration)[0]
                for command, duration in zip(commands, held)]
        assert allows(seen, *commands, duration=np.array(held)) == each


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


SIDE = 10.0                # m, of the square world of the guarantee
PERIOD = 0.05              # s between two commands
SUBSTEPS = 3               # of the true motion within a period
PILLARS = 20


def pillar_world(rng):
    """Return pillars (K, 3) x, y, radius in a square room, and the DistanceField of them all."""
    pillars = np.column_stack((rng.uniform(0.0, SIDE, (PILLARS, 2)),
                               rng.uniform(0.05, 0.5, PILLARS)))
    nodes = 0.05 * np.arange(int(SIDE / 0.05) + 1)
    points = np.stack(np.meshgrid(nodes, nodes), axis=-1)
    field = DistanceField(true_distance(pillars, points).astype(np.float32), np.zeros(3), 0.05)
    return pillars, field


def true_distance(pillars, points):
    """Return the distance (...) of `points` (..., 2) from pillars and the room's walls."""
    gap = np.hypot(points[..., None, 0] - pillars[:, 0], points[..., None, 1] - pillars[:, 1])
    to_walls = np.minimum(points, SIDE - points).min(axis=-1)
    return np.minimum((gap - pillars[:, 2]).min(axis=-1), to_walls)


def random_states(rng, count, agents=2):
    """Return an Observation of robots and walkers anywhere, and the commands on their way."""
    velocity = np.column_stack((rng.uniform(0.0, 1.0, count), rng.uniform(-2.0, 2.0, count)))
    pose = np.column_stack((rng.uniform(0.3, SIDE - 0.3, (count, 2)),
                            rng.uniform(-np.pi, np.pi, count)))
    robot = Robot(pose, velocity, np.zeros((count, 2)), np.full(count, 0.2), np.full(count, 0.8))
    crowd = Agents.of(pose[:, None, :2] + rng.uniform(-2.0, 2.0, (count, agents, 2)),
                      rng.uniform(-1.5, 1.5, (count, agents, 2)),
                      rng.uniform(0.1, 0.5, (count, agents)))
    change = rng.uniform(-1.0, 1.0, (count, 1, 2)) * (LIMITS.acceleration * PERIOD,
                                                      LIMITS.turn_acceleration * PERIOD)
    return robot, crowd, np.repeat(velocity[:, None] + change, 2, axis=1)


def drive_one_period(robot, crowd, command, pillars):
    """Return robot, crowd and the least gaps to what stands and, while moving, to walkers."""
    duration = PERIOD / SUBSTEPS
    change = np.array([LIMITS.acceleration, LIMITS.turn_acceleration]) * duration
    pose, velocity, position = robot.pose, robot.velocity, crowd.position
    static, walkers = [], []
    for _ in range(SUBSTEPS):
        before, velocity = velocity, velocity + np.clip(command - velocity, -change, change)
        pose = drive_unicycle(pose, *(0.5 * (before + velocity)).T, duration)
        position = position + duration * crowd.velocity
        gap = np.hypot(*np.moveaxis(position - pose[:, None, :2], -1, 0)) - crowd.radius
        moves = np.abs(before[:, 0]) > 1e-3
        static.append(true_distance(pillars, pose[:, :2]) - robot.radius)
        walkers.append(np.where(moves, gap.min(axis=1) - robot.radius, np.inf))
    return (replace(robot, pose=pose, velocity=velocity), replace(crowd, position=position),
            np.min(static, axis=0), np.min(walkers, axis=0))


def may(robot, crowd, field, commands, in_effect):
    seen = Observation(robot, crowd, field)
    return np.all([stoppable(seen, commands, number * PERIOD, LIMITS, in_effect)
                   for number in HELD_PERIODS], axis=0)


@pytest.mark.slow
def test_the_guarantee_of_docs_safety_holds_for_a_hundred_thousand_random_states(rng):
    """Drive random states by the fastest random commands that are allowed, then brake."""
    kept, least_static, least_walker, refused = 0, np.inf, np.inf, 0
    while kept < 100_000:
        pillars, field = pillar_world(rng)
        robot, crowd, queue = random_states(rng, 2000)
        stops = may(robot, crowd, field, np.zeros((2000, 1, 2)), queue)[:, 0]
        stops &= true_distance(pillars, robot.position) - robot.radius > LIMITS.clearance
        apart = np.linalg.norm(crowd.position - robot.position[:, None], axis=-1) - crowd.radius
        stops &= apart.min(axis=1) - robot.radius > LIMITS.clearance
        robot, crowd = (type(part)(*(values[stops] for values in vars(part).values()))
                        for part in (robot, crowd))
        queue, count = queue[stops], int(stops.sum())
        kept += count
        for check in range(17):
            wanted = np.stack((rng.uniform(0.0, 1.0, (count, 3)),
                               rng.uniform(-2.0, 2.0, (count, 3))), axis=-1)
            command = np.zeros((count, 2))
            if check < 4:
                allowed = may(robot, crowd, field, wanted, queue)
                refused += int((~allowed).sum())
                speed = np.where(allowed, wanted[..., 0], -1.0)
                best = speed.argmax(axis=1)
                rows = np.flatnonzero(speed.max(axis=1) >= 0.0)
                command[rows] = wanted[rows, best[rows]]
            # A latency of two periods: what is sent now takes effect after the two before it.
            queue = np.concatenate((queue, command[:, None]), axis=1)
            robot, crowd, static, walker = drive_one_period(robot, crowd, queue[:, 0], pillars)
            queue = queue[:, 1:]
            least_static = min(least_static, float(static.min()))
            least_walker = min(least_walker, float(walker.min()))
        assert np.abs(robot.velocity).max() < 1e-3
    assert refused > 0.1 * kept
    assert 0.0 < least_static < 0.04
    assert 0.0 < least_walker < 0.04
