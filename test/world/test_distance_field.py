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
"""The look-up in a grid of distances: bilinear, in any frame, and rays that stop at walls."""

import numpy as np
import pytest

from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import to_parent

# A wall along x = 0, sampled every 0.1 m for x from -1 to 3 and y from 0 to 2.
_X = -1.0 + 0.1 * np.arange(41)
WALL = DistanceField(np.tile(np.abs(_X), (21, 1)).astype(np.float32),
                     np.array([-1.0, 0.0, 0.0]), 0.1)


def test_nodes_and_the_middles_between_them():
    grid = DistanceField(np.array([[0.0, 1.0], [2.0, 5.0]], np.float32), np.zeros(3), 2.0)

    points = np.array([[0, 0], [1, 0], [0, 1], [1, 1], [0.5, 1.5]])
    # A quarter right and three quarters up: 0 to 0.25 below, 2 to 2.75 above, 2.125 between.
    np.testing.assert_allclose(grid.at(points), [0.0, 0.5, 1.0, 2.0, 2.125])
    # The last row and column are looked up a thousandth of a cell before them.
    assert grid.at(np.array([2.0, 2.0])) == pytest.approx(5.0, abs=0.01)


def test_beyond_the_grid_its_edge_answers():
    np.testing.assert_allclose(WALL.at(np.array([[50.0, 1.0], [-9.0, -9.0]])), [3.0, 1.0],
                               atol=1e-3)


def test_points_may_have_any_leading_axes():
    points = np.zeros((4, 3, 2)) + [0.5, 1.0]

    assert WALL.at(points).shape == (4, 3)
    np.testing.assert_allclose(WALL.at(points), 0.5, atol=1e-6)
    assert WALL.at(points[0, 0]).shape == ()


def test_a_turned_grid_answers_in_the_frame_of_the_walls(rng):
    pose = np.array([3.0, -2.0, 0.8])
    turned = DistanceField(WALL.distance, pose, WALL.resolution)
    points = rng.uniform([0.0, 0.0], [4.0, 2.0], (50, 2))

    np.testing.assert_allclose(turned.at(to_parent(pose, points)), WALL.at(points + [-1.0, 0.0]),
                               atol=1e-6)


def test_an_empty_world_is_clear_everywhere():
    assert DistanceField.empty().at(np.array([1e4, -1e4])) == 100.0
    assert DistanceField.empty(7.0).at(np.zeros((2, 2))).tolist() == [7.0, 7.0]


def test_a_ray_straight_at_the_wall_stops_within_a_cell_before_it():
    reach = WALL.raycast(np.array([2.0, 1.0]), np.pi, 10.0)

    assert 2.0 - 0.1 <= reach <= 2.0 + 1e-6


@pytest.mark.parametrize('angle', np.radians([100.0, 130.0, 160.0, 200.0, 240.0]))
def test_a_slanted_ray_is_never_longer_than_to_the_wall(angle):
    reach = WALL.raycast(np.array([1.0, 1.0]), angle, 10.0, steps=40)

    assert reach <= 1.0 / -np.cos(angle) + 1e-6


def test_a_ray_away_from_walls_ends_at_the_range():
    assert WALL.raycast(np.array([1.0, 1.0]), 0.0, 1.5) == 1.5


def test_rays_of_several_origins_broadcast():
    origins = np.array([[1.0, 1.0], [2.0, 1.0]])[:, None]

    reach = WALL.raycast(origins, np.array([0.0, np.pi, -np.pi]), 0.8)

    assert reach.shape == (2, 3)
    np.testing.assert_allclose(reach, 0.8)


def test_discs_stand_in_a_field_besides_its_walls():
    field = DistanceField.empty(clearance=5.0).with_discs(np.array([[0.0, 0.0]]), np.array([0.3]))

    assert field.at(np.array([1.0, 0.0])) == pytest.approx(0.7, abs=0.01)
    assert field.at(np.array([0.0, 0.0])) == 0.0
