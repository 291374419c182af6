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
"""Detours: who stands, and the way round them."""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.route import plan_route
from wallnav_ros.policy.motion import PAST
from wallnav_ros.simulation.detours import Detours, PATIENCE
from wallnav_ros.world.state import Agents, Robot
from wallnav_ros.world.walls import Walls

# A corridor 4 m wide along x; the robot at its beginning, bound for its end.
CORRIDOR = distance_field(Walls.from_polylines(
    [[(-1, -2), (9, -2), (9, 2), (-1, 2)]], closed=True))
WAY = plan_route(CORRIDOR, np.array([8.0, 0.0]), 0.2)
ROBOT = Robot(np.zeros(3), np.zeros(2), np.array([8.0, 0.0]), np.float64(0.2), np.float64(0.8))


def standing(*rows, seconds=10.0):
    """Return Agents (N,) that have stood at (x, y, radius) for `seconds`."""
    x, y, radius = np.array(rows, dtype=float).T
    position = np.stack((x, y), axis=1)
    trail = np.repeat(position[:, None], PAST, axis=1)
    trail[:, int(4 * seconds):] = np.nan
    return Agents(position, np.zeros_like(position), radius, np.ones(len(x), dtype=bool), trail)


def seek(agents, detours=None):
    return (detours or Detours(1)).seek(0, CORRIDOR, ROBOT, agents, WAY)


def test_it_is_looked_for_who_stands_once_a_second():
    detours = Detours(2)
    detours.due()
    detours.restart(1)

    # The second began a step later.
    assert [detours.due().tolist() for _ in range(PATIENCE)] == [
        [False, False], [False, False], [True, False], [False, True]]


def test_the_way_goes_round_who_stands_in_it():
    person = standing((3.0, 0.3, 0.5))
    path = seek(person).path(ROBOT.position)

    dense = np.concatenate([np.linspace(a, b, 50) for a, b in zip(path[:-1], path[1:])])
    gap = np.linalg.norm(dense - person.position[0], axis=1) - 0.5 - 0.2
    assert gap.min() > 0.0
    # 0.3 m to the left: the way on the right is shorter.
    assert dense[np.abs(dense[:, 0] - 3.0) < 0.1, 1].max() < -0.3


def test_a_way_is_planned_once_for_the_same_people_and_again_when_one_more_stands():
    detours, one, two = Detours(1), standing((3.0, 0.3, 0.5)), standing(
        (3.0, 0.3, 0.5), (5.0, -0.3, 0.5))

    assert seek(one, detours) is not None
    assert seek(one, detours) is None
    assert seek(two, detours) is not None
    # Who has gone on does not make the way round them wrong.
    assert seek(one, detours) is None
    detours.restart(0)
    assert seek(one, detours) is not None


@pytest.mark.parametrize(('y', 'in_the_way'), [(0.74, True), (0.76, False)])
def test_who_stands_beside_the_way_leaves_it_as_it_is(y, in_the_way):
    # The way is straight: 0.5 m of person, 0.2 m of robot and 0.05 m to spare.
    assert (seek(standing((3.0, y, 0.5))) is not None) == in_the_way


def test_who_walks_is_not_gone_round():
    person = standing((3.0, 0.0, 0.5))
    person.trail[:, :, 0] += 0.05 * np.arange(1, PAST + 1)

    assert seek(person) is None


@pytest.mark.parametrize(('seconds', 'known'), [(0.75, False), (1.0, True)])
def test_who_has_stood_for_a_moment_only_is_not_gone_round(seconds, known):
    assert (seek(standing((3.0, 0.0, 0.5), seconds=seconds)) is not None) == known


def test_where_no_way_is_left_there_is_no_detour():
    assert seek(standing((3.0, -1.2, 0.8), (3.0, 0.4, 0.8), (3.0, 1.6, 0.4))) is None
