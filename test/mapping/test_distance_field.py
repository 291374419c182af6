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
"""Distance fields of walls: as exact at their nodes as the walls themselves."""

from hypothesis import given, settings
from hypothesis import strategies as st
from map_files import REAL_MAPS
import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.world.walls import Walls

SQUARE = Walls.from_polylines([[(0, 0), (4, 0), (4, 4), (0, 4)]], closed=True)


def nodes_of(field, rng, count, within):
    """Return positions (K, 2) and values (K,) of nodes that are `within` m of a wall."""
    row, column = np.nonzero(field.distance < within)
    chosen = rng.integers(0, len(row), count)
    row, column = row[chosen], column[chosen]
    points = field.pose[:2] + field.resolution * np.stack((column, row), axis=1)
    return points, field.distance[row, column]


def exact(walls, points):
    return np.concatenate([walls.distance(part) for part in np.array_split(points, 20)])


def test_the_grid_lies_a_margin_beyond_the_walls():
    field = distance_field(SQUARE, resolution=0.5, margin=1.0)

    assert field.pose.tolist() == [-1.0, -1.0, 0.0]
    assert field.distance.shape == (13, 13)
    assert field.resolution == 0.5


def test_distances_in_a_square_room_are_those_to_its_nearest_side():
    field = distance_field(SQUARE)

    assert field.at(np.array([2.0, 2.0])) == pytest.approx(2.0, abs=1e-5)
    assert field.at(np.array([0.5, 2.0])) == pytest.approx(0.5, abs=1e-5)
    assert field.at(np.array([-0.6, -0.8])) == pytest.approx(1.0, abs=1e-3)


def test_no_walls_are_far_away():
    assert distance_field(Walls.from_polylines([])).at(np.zeros((3, 2))).tolist() == [100.0] * 3


def test_a_wall_may_be_a_point():
    field = distance_field(Walls(np.array([[[1.0, 1.0], [1.0, 1.0]]])))

    assert field.at(np.array([1.3, 1.4])) == pytest.approx(0.5, abs=0.005)


def test_a_ray_through_the_field_ends_at_the_wall():
    field = distance_field(SQUARE)

    assert field.raycast(np.array([1.0, 2.0]), 0.0, 10.0) == pytest.approx(3.0, abs=0.01)


@pytest.mark.parametrize('offset', [0.0, 1e6, -3e5])
def test_the_place_on_earth_does_not_matter(offset):
    field = distance_field(Walls(SQUARE.segments + offset))

    assert field.at(np.array([0.5, 2.0]) + offset) == pytest.approx(0.5, abs=1e-4)


# Coordinates in whole centimetres: walls that cross, touch, repeat and shrink to points.
CENTIMETRES = st.integers(-400, 400)
SEGMENTS = st.lists(st.tuples(CENTIMETRES, CENTIMETRES, CENTIMETRES, CENTIMETRES),
                    min_size=1, max_size=30)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(coordinates=SEGMENTS, seed=st.integers(0, 2 ** 32 - 1))
def test_any_walls_give_distances_within_5_mm_at_nodes_within_4_m(coordinates, seed):
    walls = Walls(np.array(coordinates, dtype=float).reshape(-1, 2, 2) / 100.0)
    field = distance_field(walls)

    points, found = nodes_of(field, np.random.default_rng(seed), 300, within=4.0)

    np.testing.assert_allclose(found, exact(walls, points), atol=0.005)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(coordinates=SEGMENTS, seed=st.integers(0, 2 ** 32 - 1))
def test_between_nodes_the_error_stays_below_a_cell(coordinates, seed):
    walls = Walls(np.array(coordinates, dtype=float).reshape(-1, 2, 2) / 100.0)
    field = distance_field(walls)
    rng = np.random.default_rng(seed)
    points, _ = nodes_of(field, rng, 300, within=3.0)
    points += rng.uniform(-0.025, 0.025, points.shape)

    np.testing.assert_allclose(field.at(points), exact(walls, points), atol=0.036)


@pytest.mark.parametrize('name', [
    name for name in REAL_MAPS if name.startswith(('asl', 'intel', 'mit_s', 'spiel', 'turtle'))])
def test_real_walls_give_distances_within_5_mm_at_nodes_within_4_m(shared_data, rng, name):
    walls = extract_walls(load_map(shared_data / 'maps' / name)).walls
    field = distance_field(walls)

    # Half of the nodes beside walls, where a short segment could be overlooked.
    for within in (0.2, 4.0):
        points, found = nodes_of(field, rng, 200, within)
        np.testing.assert_allclose(found, exact(walls, points), atol=0.005)


@pytest.mark.parametrize('change, problem', [
    ({'resolution': 0.0}, '^resolution: '), ({'resolution': np.nan}, '^resolution: '),
    ({'margin': -1.0}, '^margin: '), ({'margin': np.inf}, '^margin: '),
    ({'walls': Walls(np.full((1, 2, 2), np.nan))}, '^walls: a coordinate is not finite'),
    ({'walls': Walls(SQUARE.segments * 1000.0)}, '4002 m x 4002 m: .* use 1 m or more'),
])
def test_what_cannot_be_a_field_is_refused(change, problem):
    with pytest.raises(ValueError, match=problem):
        distance_field(**{'walls': SQUARE, **change})
