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
"""Detours: who is stuck, and the way round who stands there."""

import numpy as np

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.policy.motion import PAST
from wallnav_ros.simulation.detours import around, Detours, PATIENCE
from wallnav_ros.world.state import Agents, Robot
from wallnav_ros.world.walls import Walls

# A corridor 4 m wide along x; the robot at its beginning, bound for its end.
CORRIDOR = distance_field(Walls.from_polylines(
    [[(-1, -2), (9, -2), (9, 2), (-1, 2)]], closed=True))
ROBOT = Robot(np.zeros(3), np.zeros(2), np.array([8.0, 0.0]), np.float64(0.2), np.float64(0.8))


def standing(*rows, seconds=10.0):
    """Return Agents (N,) that have stood at (x, y, radius) for `seconds`."""
    x, y, radius = np.array(rows, dtype=float).T
    position = np.stack((x, y), axis=1)
    trail = np.repeat(position[:, None], PAST, axis=1)
    trail[:, int(4 * seconds):] = np.nan
    return Agents(position, np.zeros_like(position), radius, np.ones(len(x), dtype=bool), trail)


def test_who_gets_nowhere_for_two_seconds_is_stuck():
    detours, rows = Detours(), np.arange(2)
    for step in range(PATIENCE + 1):
        # The first drives 0.2 m a step, the second 0.03 m.
        stuck = detours.seek(np.array([[0.2 * step, 0.0], [0.03 * step, 0.0]]), rows)

        assert stuck.tolist() == ([1] if step == PATIENCE else [])


def test_who_has_just_been_helped_or_started_anew_is_not_stuck():
    detours, rows = Detours(), np.arange(1)
    for _ in range(PATIENCE + 1):
        stuck = detours.seek(np.zeros((1, 2)), rows)
    assert stuck.tolist() == [0]
    for _ in range(PATIENCE - 1):
        assert detours.seek(np.zeros((1, 2)), rows).tolist() == []
    detours.restart(0)
    for _ in range(PATIENCE):
        assert detours.seek(np.zeros((1, 2)), rows).tolist() == []
    assert detours.seek(np.zeros((1, 2)), rows).tolist() == [0]


def test_the_way_goes_round_who_stands_in_it():
    person = standing((3.0, 0.3, 0.5))
    route = around(CORRIDOR, ROBOT, person)
    path = route.path(ROBOT.position)

    dense = np.concatenate([np.linspace(a, b, 50) for a, b in zip(path[:-1], path[1:])])
    gap = np.linalg.norm(dense - person.position[0], axis=1) - 0.5 - 0.2
    assert gap.min() > 0.0
    # 0.3 m to the left: the way on the right is shorter.
    assert dense[np.abs(dense[:, 0] - 3.0) < 0.1, 1].max() < -0.3


def test_who_walks_is_not_gone_round():
    person = standing((3.0, 0.0, 0.5))
    person.trail[:, :, 0] += 0.05 * np.arange(1, PAST + 1)

    assert around(CORRIDOR, ROBOT, person) is None


def test_who_has_stood_for_a_moment_only_is_not_gone_round():
    assert around(CORRIDOR, ROBOT, standing((3.0, 0.0, 0.5), seconds=1.0)) is None


def test_where_no_way_is_left_there_is_no_detour():
    assert around(CORRIDOR, ROBOT, standing((3.0, -1.2, 0.8), (3.0, 0.4, 0.8),
                                            (3.0, 1.6, 0.4))) is None
