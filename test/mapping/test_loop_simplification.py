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
"""Simplification: few points, and neither side ever further from the other than the tolerance."""

import numpy as np
import pytest
import shapely

from wallnav_ros.mapping.boundary_tracing import trace_boundary
from wallnav_ros.mapping.loop_simplification import simplify_loops


def simplified(mask, tolerance):
    """Return the loops of a mask and their simplification, both as closed LineStrings."""
    corners, starts = trace_boundary(np.array(mask, dtype=bool))
    points, first = simplify_loops(corners, starts, tolerance)
    exact = [shapely.LinearRing(corners[a:b]) for a, b in zip(starts[:-1], starts[1:])]
    return exact, [shapely.LineString(points[a:b]) for a, b in zip(first[:-1], first[1:])]


def half_plane(slope, size=60, offset=0.3):
    """Return a mask (size, size) of the cells whose centres lie below a line of that slope."""
    x, y = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
    return y < slope * (x - size / 2) + size / 2 + offset


def disc(radius, centre):
    size = int(2 * radius + 6)
    x, y = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
    return np.hypot(x - size / 2 - centre, y - size / 2) < radius


def test_nothing_stays_nothing():
    points, first = simplify_loops(np.empty((0, 2), np.int32), np.zeros(1, int), 0.5)

    assert points.shape == (0, 2)
    assert first.tolist() == [0]


def test_a_rectangle_keeps_its_corners_exactly():
    _, (line,) = simplified(np.ones((7, 20)), 0.5)

    assert len(line.coords) == 5
    assert line.is_closed
    assert shapely.Polygon(line).equals(shapely.box(0, 0, 20, 7))


@pytest.mark.parametrize('length', [1, 2, 30])
def test_a_wall_of_one_cell_keeps_both_sides(length):
    _, (line,) = simplified(np.ones((1, length)), 0.5)

    assert shapely.Polygon(line).equals(shapely.box(0, 0, length, 1))


def test_a_diagonal_wall_runs_through_the_middles_of_its_steps():
    # At 45 degrees the corners of a staircase are 0.35 cells from the line through its middles.
    _, (line,) = simplified(half_plane(1.0, offset=0.0), 0.5)

    assert len(line.coords) <= 6
    assert line.length == pytest.approx((2 + np.sqrt(2)) * 60, rel=0.02)


def test_no_tolerance_keeps_every_corner(rng):
    mask = rng.random((20, 20)) < 0.4

    exact, lines = simplified(mask, 0.0)

    for ring, line in zip(exact, lines):
        assert set(line.coords) == set(ring.coords)


def test_no_loop_shrinks_to_a_point():
    _, lines = simplified([[1, 0, 1], [0, 0, 0]], 50.0)

    assert all(line.length > 1.0 for line in lines)


@pytest.mark.parametrize('tolerance', [0.0, 0.25, 0.5, 0.8, 2.0])
def test_no_part_moves_by_more_than_the_tolerance(rng, tolerance):
    masks = [half_plane(slope) for slope in (0.013, 0.3, 0.5, 2 / 3, 0.97, 7.0)]
    masks += [disc(radius, 0.2) for radius in (0.7, 2.0, 9.3, 40.0)]
    masks += [rng.random((25, 25)) < share for share in (0.05, 0.5, 0.9)]
    for mask in masks:
        exact, lines = simplified(mask, tolerance)
        for ring, line in zip(exact, lines):
            # By points every eighth of a cell, for the distance can be greatest within pieces.
            for one, other in ((ring, line), (line, ring)):
                points = shapely.get_coordinates(shapely.segmentize(one, 1 / 8))
                off = shapely.distance(shapely.points(points), other)
                assert off.max() <= tolerance + 1e-6


def test_a_straight_wall_of_any_slope_needs_few_points():
    for slope in (0.013, 0.1, 0.31, 0.5, 0.77):
        exact, lines = simplified(half_plane(slope, size=200), 0.5)
        corners = sum(len(ring.coords) for ring in exact)
        assert sum(len(line.coords) for line in lines) < max(0.35 * corners, 12)
