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
"""Walls as segments: exact distances, and rays that meet the first wall in their way."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
import shapely

from wallnav_ros.world.walls import Walls

ROOM = Walls.from_polylines([[(0, 0), (6, 0), (6, 4), (0, 4)]], closed=True)
DECIMETRES = st.integers(-50, 50)


def test_polylines_become_the_segments_between_their_points():
    walls = Walls.from_polylines([[(0, 0), (1, 0), (1, 2)], [(5, 5), (6, 5)]])

    assert walls.segments.tolist() == [
        [[0, 0], [1, 0]], [[1, 0], [1, 2]], [[5, 5], [6, 5]]]
    assert len(walls) == 3


def test_closed_polylines_end_where_they_begin():
    assert ROOM.segments[-1].tolist() == [[0, 4], [0, 0]]
    assert len(ROOM) == 4


@pytest.mark.parametrize('polyline, problem', [
    ([(0, 0)], 'at least two'), ([], 'at least two'), ([1, 2, 3], 'at least two'),
    ([(0, 0, 0), (1, 1, 1)], 'at least two'), ([(0, 0), (np.inf, 1)], 'not finite')])
def test_a_malformed_wall_is_refused_by_its_number(polyline, problem):
    with pytest.raises(ValueError, match=f'^wall 1: .*{problem}'):
        Walls.from_polylines([[(0, 0), (1, 1)], polyline])


def test_distance_is_that_to_the_nearest_wall():
    np.testing.assert_allclose(
        ROOM.distance([[1.0, 2.0], [3.0, 3.5], [6.0, 1.0], [9.0, 8.0]]), [1.0, 0.5, 0.0, 5.0])


def test_without_walls_everything_is_out_of_reach():
    nothing = Walls.from_polylines([])

    assert nothing.distance(np.zeros((2, 2))).tolist() == [np.inf, np.inf]
    assert nothing.raycast(np.zeros(2), np.zeros(3), 10.0).tolist() == [np.inf] * 3


def test_rays_in_a_room_end_at_its_sides():
    ranges = ROOM.raycast(np.array([1.0, 1.0]), np.radians([0.0, 90.0, 180.0, 270.0, 45.0]), 10.0)

    np.testing.assert_allclose(ranges, [5.0, 3.0, 1.0, 1.0, 3.0 * np.sqrt(2.0)])


@pytest.mark.parametrize('turns', [-3, -1, 0, 1, 5])
def test_a_ray_may_be_given_any_number_of_turns(turns):
    angles = np.radians([0.0, 200.0, -10.0]) + 2.0 * np.pi * turns

    ranges = ROOM.raycast(np.array([3.0, 2.0]), angles, 10.0)

    np.testing.assert_allclose(ranges, 3.0 / np.abs(np.cos(angles)))


def test_a_wall_beyond_the_range_is_not_seen():
    ranges = ROOM.raycast(np.array([1.0, 1.0]), np.radians([0.0, 180.0]), 4.9)

    assert ranges.tolist() == [np.inf, 1.0]


def test_the_nearer_of_two_walls_hides_the_other():
    walls = Walls.from_polylines([[(3, -1), (3, 1)], [(2, -1), (2, 1)]])

    assert walls.raycast(np.zeros(2), np.zeros(1), 10.0) == pytest.approx([2.0])


def test_no_ray_slips_through_a_corner(rng):
    # All rays at the exact bearings of a room's corners, seen from many places in it.
    for origin in rng.uniform([0.1, 0.1], [5.9, 3.9], (200, 2)):
        gap = ROOM.segments[:, 0] - origin
        ranges = ROOM.raycast(origin, np.arctan2(gap[:, 1], gap[:, 0]), 10.0)
        np.testing.assert_allclose(ranges, np.hypot(*gap.T), rtol=1e-6)


@settings(max_examples=120, deadline=None, derandomize=True)
@given(ends=st.lists(st.tuples(DECIMETRES, DECIMETRES, DECIMETRES, DECIMETRES), min_size=1,
                     max_size=12),
       seed=st.integers(0, 2 ** 32 - 1))
def test_any_walls_agree_with_an_independent_geometry_library(ends, seed):
    walls = Walls(np.array(ends, dtype=float).reshape(-1, 2, 2) / 10.0)
    rng = np.random.default_rng(seed)
    origin = rng.uniform(-6.0, 6.0, 2)
    angles = rng.uniform(-np.pi, np.pi, 16)
    lines = shapely.MultiLineString(list(walls.segments))

    assert walls.distance(origin[None])[0] == pytest.approx(
        shapely.distance(shapely.Point(origin), lines), abs=1e-9)
    for angle, found in zip(angles, walls.raycast(origin, angles, 20.0)):
        ray = shapely.LineString([origin, origin + 20.0 * np.array([np.cos(angle),
                                                                    np.sin(angle)])])
        met = shapely.intersection(ray, lines)
        if met.is_empty:
            assert np.isinf(found)
        else:
            assert found == pytest.approx(shapely.distance(shapely.Point(origin), met), abs=1e-6)
