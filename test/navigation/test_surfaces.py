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
"""What neither map nor tracks explain becomes a wall, and nothing else does."""

import numpy as np
import pytest

from wallnav_ros.navigation.surfaces import add_surfaces, assign_points, scan_points
from wallnav_ros.perception.scan import Scan
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.state import Agents


def wall_at_x(x):
    """Return the DistanceField of a wall along x = `x` within 10 m of the origin."""
    nodes = -10.0 + 0.05 * np.arange(401)
    distance = np.broadcast_to(np.abs(nodes - x), (401, 401)).astype(np.float32)
    return DistanceField(distance.copy(), np.array([-10.0, -10.0, 0.0]), 0.05)


def test_only_beams_that_hit_something_have_an_end():
    scan = Scan(0.0, [2.0, np.inf, np.nan, 0.01], np.pi / 2.0, np.pi / 2.0, 0.05, 10.0)
    # The first beam points to the left.
    np.testing.assert_allclose(scan_points(scan), [[0.0, 2.0]], atol=1e-12)


def beam_ends(centre, radius, beams=720):
    """Return where beams from the origin end on a disc, as a scanner sees it."""
    angles = 2.0 * np.pi / beams * np.arange(beams)
    along = np.cos(angles) * centre[0] + np.sin(angles) * centre[1]
    depth = radius ** 2 - (np.sum(np.square(centre)) - along ** 2)
    reach = along - np.sqrt(np.maximum(depth, 0.0))
    reach, angles = reach[(depth > 0.0) & (along > 0.0)], angles[(depth > 0.0) & (along > 0.0)]
    return reach[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)


def test_points_on_a_mapped_wall_or_a_tracked_agent_are_explained():
    points = np.array([[3.05, 0.0], [0.0, 2.0], [-2.0, -2.0]])
    person = Agents.of([[0.0, 2.25]], [[0.0, 0.0]], [0.25])
    seen, left = assign_points(points, person, wall_at_x(3.0), np.zeros(2))
    np.testing.assert_allclose(left, [[-2.0, -2.0]])
    np.testing.assert_allclose(seen.radius, [0.25])


@pytest.mark.parametrize('centre', [(1.0, 0.0), (-2.5, 0.5), (0.3, -3.0)])
def test_an_agent_that_is_tracked_too_small_and_too_near_is_set_right(centre):
    centre = np.array(centre)
    tracked = Agents.of([centre * (1.0 - 0.15 / np.hypot(*centre))], [[0.0, 1.0]], [0.3])
    seen, left = assign_points(beam_ends(centre, 0.45), tracked, None, np.zeros(2))
    assert not len(left)
    np.testing.assert_allclose(seen.radius, [0.45], atol=0.03)
    np.testing.assert_allclose(seen.position, [centre], atol=0.03)
    np.testing.assert_allclose(seen.velocity, [[0.0, 1.0]])


def test_an_agent_of_which_less_is_seen_stays_as_it_is_tracked():
    centre = np.array([2.0, 0.0])
    half = beam_ends(centre, 0.4)
    tracked = Agents.of([centre], [[0.0, 0.0]], [0.4])
    seen, _ = assign_points(half[half[:, 1] > 0.0], tracked, None, np.zeros(2))
    np.testing.assert_allclose(seen.radius, [0.4])
    np.testing.assert_allclose(seen.position, [centre])


def test_a_point_belongs_to_the_agent_whose_edge_is_nearest_and_to_none_far_off():
    two = Agents.of([[1.0, 0.0], [2.0, 0.0]], np.zeros((2, 2)), [0.1, 0.5])
    _, left = assign_points(np.array([[1.3, 0.0], [2.0, 0.9]]), two, None, np.zeros(2))
    np.testing.assert_allclose(left, [[2.0, 0.9]])


def test_without_map_and_tracks_everything_is_unexplained():
    points = np.array([[3.0, 0.0]])
    np.testing.assert_allclose(assign_points(points, Agents.none(), None, np.zeros(2))[1], points)


def test_nothing_unexplained_leaves_the_walls_as_they_are():
    walls = wall_at_x(3.0)
    assert add_surfaces(np.empty((0, 2)), walls, np.zeros(2)) is walls


def test_distances_are_to_the_nearer_of_wall_and_surface(rng):
    points = rng.uniform(-4.0, 4.0, (40, 2))
    field = add_surfaces(points, wall_at_x(3.0), np.zeros(2))
    probes = rng.uniform(-4.0, 4.0, (200, 2))
    exact = np.linalg.norm(probes[:, None] - points, axis=2).min(axis=1)
    exact = np.minimum(exact, np.abs(probes[:, 0] - 3.0))
    # A point is moved by at most half a cell's diagonal; look-ups between nodes add as much.
    np.testing.assert_allclose(field.at(probes), exact, atol=0.075)


def test_mapped_walls_are_carried_over_whatever_the_grid_they_are_on(rng):
    # A smooth field on a grid that is turned, coarser and ends 3 m to the right.
    pose = np.array([-6.0, -9.0, 0.4])
    rows, columns = np.mgrid[:160, :120] * 0.08
    walls = DistanceField((2.0 + 0.3 * rows + 0.2 * columns).astype(np.float32), pose, 0.08)
    field = add_surfaces(np.array([[7.9, 7.9]]), walls, np.zeros(2))
    probes = rng.uniform(-6.0, 6.0, (200, 2))
    probes = probes[np.linalg.norm(probes - 7.9, axis=1) > 8.0]
    np.testing.assert_allclose(field.at(probes), walls.at(probes), atol=0.02)


def test_surfaces_far_from_the_robot_do_not_count():
    field = add_surfaces(np.array([[20.0, 0.0]]), None, np.zeros(2))
    assert field.at(np.array([0.0, 0.0])) > 10.0


@pytest.mark.parametrize('centre', [(0.0, 0.0), (100.0, -50.0)])
def test_the_field_goes_with_the_robot(centre):
    point = np.array(centre) + (1.0, 0.0)
    field = add_surfaces(point[None], None, np.array(centre))
    assert field.at(np.array(centre)) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize('reach', [0.49, 0.76, 0.79, 1.0, 3.333])
def test_a_surface_anywhere_within_reach_fits_in_the_field(reach):
    corner = np.full(2, reach - 1e-6)
    for point in (corner, -corner):
        field = add_surfaces(point[None], None, np.zeros(2), reach)
        assert field.at(point) == pytest.approx(0.0, abs=0.05)
