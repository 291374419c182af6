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
"""
Where agents may stand: the cells that can be reached from the robot's start.

Worked on two rooms with a partition between them.
"""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.simulation.free_space import (
    CELL, CLEARANCE, free_points, Passage, within_polygon)
from wallnav_ros.world.walls import Walls

ROOMS = Walls.from_polylines([[[0, 0], [4, 0], [4, 2], [0, 2]], [[2, 0], [2, 1.9]]], closed=True)
START, GOAL = np.array([1.0, 1.0]), np.array([1.5, 1.5])


def test_points_keep_clear_of_walls_and_lie_a_cell_apart():
    points = free_points(ROOMS, distance_field(ROOMS), START, GOAL)

    assert ROOMS.distance(points).min() > CLEARANCE - 0.02
    assert np.unique(np.round(np.diff(np.unique(points[:, 0])), 6)).tolist() == [CELL]


def test_a_gap_too_narrow_for_anyone_does_not_join_two_rooms():
    """The partition leaves 0.1 m: the far room is not free space of this task."""
    points = free_points(ROOMS, distance_field(ROOMS), START, GOAL)

    assert points[:, 0].max() < 2.0


def test_a_door_does():
    door = Walls(ROOMS.segments.copy())
    door.segments[4:, :, 1] *= 0.5 / 0.95

    points = free_points(door, distance_field(door), START, GOAL)

    assert points[:, 0].max() > 3.7


def test_a_start_against_a_wall_has_no_free_space():
    assert len(free_points(ROOMS, distance_field(ROOMS), np.array([0.05, 1.0]), GOAL)) == 0


def test_a_margin_opens_the_way_round_the_outside():
    wall = Walls(np.array([[[2.0, 0.0], [2.0, 2.0]]]))
    start, goal = np.array([0.0, 1.0]), np.array([4.0, 1.0])
    field = distance_field(wall)

    parted = free_points(wall, field, start, goal)
    joined = free_points(wall, field, start, goal, margin=1.0)

    assert parted[:, 0].max() < 2.0
    assert joined[:, 0].max() > 4.0


@pytest.mark.parametrize('point, inside', [
    ((0.5, 0.5), True), ((1.5, 0.5), False), ((0.5, 1.8), True), ((1.5, 1.8), True),
    ((2.5, 1.8), False), ((-0.1, 0.5), False), ((1.0, 3.0), False)])
def test_a_point_lies_within_a_polygon_by_the_even_odd_rule(point, inside):
    """An L: the unit square and a bar 2 m long on top of it."""
    shape = np.array([[0, 0], [1, 0], [1, 1.5], [2, 1.5], [2, 2], [0, 2]], dtype=float)

    assert within_polygon(np.array([point]), shape).tolist() == [inside]


@pytest.fixture
def corridor_passage():
    """Return the passage of a disc that needs 0.3 m to each side, in a corridor of 2 m x 6 m."""
    walls = Walls.from_polylines([[[0, 0], [6, 0], [6, 2], [0, 2]]], closed=True)
    field = distance_field(walls)
    start, goal = np.array([0.5, 1.0]), np.array([5.5, 1.0])
    return Passage(free_points(walls, field, start, goal), field, start, goal, 0.3)


@pytest.mark.parametrize('y, radius, admitted', [
    (1.0, 0.1, True),      # 0.9 m to each side
    (1.0, 0.5, False),     # 0.5 m to each side, 0.6 m are needed
    (0.5, 0.5, True),      # 1 m on one side
])
def test_a_disc_is_admitted_where_it_leaves_a_way(corridor_passage, y, radius, admitted):
    assert corridor_passage.admits(np.array([3.0, y]), radius) == admitted


def test_two_discs_that_each_leave_a_way_may_close_it_together(corridor_passage):
    low, high = np.array([3.0, 0.5]), np.array([3.0, 1.8])
    assert corridor_passage.admits(low, 0.5)
    assert corridor_passage.admits(high, 0.2)

    corridor_passage.block(low, 0.5)

    # 0.6 m would be enough, 1.8 - 0.2 - 1.0 = 0.6 m between them is not: nodes are 0.1 m apart.
    assert not corridor_passage.admits(high, 0.25)
