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
"""Walls of maps, in metres: where the cells say, within the tolerance, quickly."""

import time

from map_files import MISPLACED_MAPS, REAL_MAPS
import numpy as np
import pytest
import shapely

from wallnav_ros.mapping.boundary_tracing import trace_boundary
from wallnav_ros.mapping.occupancy_map import load_map, OccupancyMap
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.world.geometry import to_parent


def map_of(occupied, resolution=0.1, origin=(0.0, 0.0, 0.0)):
    cells = np.where(np.array(occupied, dtype=bool), 100, 0).astype(np.int8)
    return OccupancyMap(cells, resolution, np.array(origin))


def boundary_of(occupied_map):
    """Return the exact edges (M, 2, 2) between occupied cells and others, in metres."""
    corners, starts = trace_boundary(occupied_map.occupied)
    following = np.arange(len(corners)) + 1
    following[starts[1:] - 1] = starts[:-1]
    edges = np.stack((corners, corners[following]), axis=1) * occupied_map.resolution
    return to_parent(occupied_map.origin, edges)


def farthest(segments, others, spacing):
    """Return how far any point of `segments` is from the nearest of `others`, sampled."""
    along = segments[:, 1] - segments[:, 0]
    count = np.ceil(np.hypot(*along.T) / spacing).astype(int) + 1
    owner = np.repeat(np.arange(len(segments)), count)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    fraction = step / np.maximum(count - 1, 1)[owner]
    points = shapely.points(segments[owner, 0] + fraction[:, None] * along[owner])
    tree = shapely.STRtree(shapely.linestrings(others))
    return tree.query_nearest(points, all_matches=False, return_distance=True)[1].max()


def outline(polyline):
    return shapely.Polygon(polyline).normalize()


def test_walls_lie_on_the_edges_of_the_cells_in_metres():
    extraction = extract_walls(map_of([[0, 0, 0], [0, 1, 1]], 0.5, (10.0, 20.0, 0.0)))

    polyline, = extraction.polylines
    assert polyline[0].tolist() == polyline[-1].tolist()
    assert outline(polyline).equals(shapely.box(10.5, 20.5, 11.5, 21.0))
    assert len(extraction.walls) == 4


def test_the_yaw_of_the_origin_turns_the_walls():
    extraction = extract_walls(map_of([[1, 0]], 1.0, (2.0, 3.0, np.pi / 2)))

    # The cell at the lower left, turned a quarter: to the left of the origin and above it.
    assert outline(extraction.polylines[0]).equals_exact(shapely.box(1, 3, 2, 4).normalize(), 1e-9)


def test_a_map_without_walls_has_none():
    extraction = extract_walls(map_of(np.zeros((5, 5))))

    assert extraction.polylines == []
    assert len(extraction.walls) == 0
    assert extraction.stats['length'] == 0.0


def test_the_stats_count_what_was_found():
    cells = np.array([[100, 100, 0, 0, 100], [-1, -1, -1, 0, 0]], np.int8)

    stats = extract_walls(OccupancyMap(cells, 0.1, np.zeros(3)), min_size=0.15).stats

    assert stats == {
        'polylines': 1, 'segments': 4, 'speckles_dropped': 1, 'length': 0.6, 'tolerance': 0.05,
        'min_size': 0.15, 'width': 5, 'height': 2, 'occupied_cells': 3, 'free_cells': 4,
        'unknown_cells': 3}


def test_speckle_is_what_is_smaller_along_both_axes():
    occupied = np.zeros((12, 12))
    occupied[1, 1] = 1              # one cell
    occupied[3, 1:4] = 1            # a thin wall of three cells
    occupied[6:12, 6:12] = 1        # a block ...
    occupied[8, 8] = 0              # ... with a hole of one cell

    def kept(min_size):
        return sorted(round(outline(polyline).area, 6) for polyline in
                      extract_walls(map_of(occupied, 1.0), min_size=min_size).polylines)

    assert kept(0.0) == [1.0, 1.0, 3.0, 36.0]
    assert kept(1.0) == [1.0, 1.0, 3.0, 36.0]
    assert kept(2.0) == [3.0, 36.0]
    assert kept(3.0) == [3.0, 36.0]
    assert kept(3.1) == [36.0]


def test_a_size_of_three_cells_is_three_cells():
    assert extract_walls(map_of([[1, 1, 1]], 0.1), min_size=0.3).polylines != []


@pytest.mark.parametrize('setting', ['tolerance', 'min_size'])
@pytest.mark.parametrize('value', [-0.1, np.nan, np.inf])
def test_a_setting_that_means_nothing_is_refused(setting, value):
    with pytest.raises(ValueError, match=f'^{setting}: '):
        extract_walls(map_of([[1]]), **{setting: value})


@pytest.mark.parametrize('tolerance', [None, 0.0, 0.03, 0.2])
def test_tolerance_holds_both_ways_on_a_turned_synthetic_map(rng, tolerance):
    x, y = np.meshgrid(np.arange(120) + 0.5, np.arange(90) + 0.5)
    occupied = (np.abs(np.hypot(x - 60, y - 45) - 38) < 2.5) | (np.abs(y - 0.37 * x - 20) < 0.8)
    occupied |= rng.random(occupied.shape) < 0.01
    occupancy_map = map_of(occupied, 0.1, (-3.0, 7.0, 0.7))

    walls = extract_walls(occupancy_map, tolerance).walls.segments

    limit = (0.05 if tolerance is None else tolerance) + 1e-6
    exact = boundary_of(occupancy_map)
    assert farthest(exact, walls, 0.02) <= limit
    assert farthest(walls, exact, 0.02) <= limit


@pytest.mark.parametrize('name', REAL_MAPS)
def test_no_wall_of_a_real_map_moves_by_more_than_half_a_cell(shared_data, name):
    check_half_a_cell(load_map(shared_data / 'maps' / name))


@pytest.mark.parametrize('name', MISPLACED_MAPS)
def test_nor_of_one_whose_image_path_is_put_right(shared_data, name, tmp_path):
    published = shared_data / 'maps' / name
    image = published.with_suffix('.pgm')
    lines = [f'image: {image}' if line.startswith('image:') else line
             for line in published.read_text().splitlines()]
    mended = tmp_path / 'map.yaml'
    mended.write_text('\n'.join(lines))

    check_half_a_cell(load_map(mended))


def check_half_a_cell(occupancy_map):
    exact, cell = boundary_of(occupancy_map), occupancy_map.resolution

    walls = extract_walls(occupancy_map).walls.segments

    assert farthest(exact, walls, cell) <= 0.5 * cell + 1e-6
    assert farthest(walls, exact, cell) <= 0.5 * cell + 1e-6
    assert len(walls) <= len(exact)


def test_a_map_of_2736_x_1280_pixels_takes_half_a_second_at_most(shared_data):
    path = shared_data / 'maps' / 'asl_office_j' / 'asl_office_j.yaml'
    taken = []
    for _ in range(3):
        # Of this process alone: a busy machine must not fail the test.
        started = time.process_time()
        extract_walls(load_map(path)).walls.distance(np.zeros((1, 2)))
        taken.append(time.process_time() - started)

    assert min(taken) <= 0.5
