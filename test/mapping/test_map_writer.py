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
"""Maps written from shapes: read back, they have walls where the shapes have edges."""

import numpy as np
import pytest
import shapely
from wallnav_ros.mapping.map_writer import write_map
from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.wall_extraction import extract_walls
import yaml


def written(folder, *arguments, **options):
    """Write a map and return it as load_map reads it."""
    write_map(folder / 'made.yaml', *arguments, **options)
    return load_map(folder / 'made.yaml')


def ngon(centre, radius, count, turn=0.0):
    angles = turn + 2.0 * np.pi * np.arange(count) / count
    return np.array(centre) + radius * np.stack((np.cos(angles), np.sin(angles)), axis=1)


def distance_both_ways(shape, polylines):
    walls = shapely.MultiLineString(polylines)
    return shapely.hausdorff_distance(shape.boundary, walls, densify=0.01)


def test_a_box_on_the_grid_is_reproduced_exactly(tmp_path):
    occupancy_map = written(tmp_path, [[(0, 0), (1, 0), (1, 0.5), (0, 0.5)]], resolution=0.1)

    assert occupancy_map.cells.shape == (9, 14)
    assert occupancy_map.origin.tolist() == [-0.2, -0.2, 0.0]
    assert occupancy_map.occupied.sum() == 50
    polyline, = extract_walls(occupancy_map).polylines
    assert shapely.Polygon(polyline).normalize().equals_exact(
        shapely.box(0, 0, 1, 0.5).normalize(), 1e-9)


def test_the_files_are_those_of_a_map_server(tmp_path):
    write_map(tmp_path / 'made.yaml', [ngon((0, 0), 1.0, 5)], resolution=0.05)

    fields = yaml.safe_load((tmp_path / 'made.yaml').read_text())
    assert fields == {'image': 'made.png', 'mode': 'trinary', 'resolution': 0.05,
                      'origin': fields['origin'], 'negate': 0, 'occupied_thresh': 0.65,
                      'free_thresh': 0.196}
    assert sorted(path.name for path in tmp_path.iterdir()) == ['made.png', 'made.yaml']


def test_the_same_shapes_give_the_same_bytes(tmp_path):
    for name in ('a', 'b'):
        (tmp_path / name).mkdir()
        write_map(tmp_path / name / 'made.yaml', [ngon((0, 0), 1.0, 5)], [[(0, 2), (1, 3)]])

    assert (tmp_path / 'a/made.png').read_bytes() == (tmp_path / 'b/made.png').read_bytes()
    assert (tmp_path / 'a/made.yaml').read_bytes() == (tmp_path / 'b/made.yaml').read_bytes()


@pytest.mark.parametrize('polygon', [
    ngon((1.0, 2.0), 1.7, 4, 0.3), ngon((0, 0), 2.0, 40),
    [(0, 0), (3, 0.4), (3.1, 2), (2, 1.9), (1.9, 1.2), (-0.2, 0.9)]],
    ids=['turned square', 'disc', 'bent'])
@pytest.mark.parametrize('resolution', [0.05, 0.02])
def test_walls_come_back_within_half_a_cell_and_the_tolerance(tmp_path, polygon, resolution):
    extraction = extract_walls(written(tmp_path, [polygon], resolution=resolution))

    off = distance_both_ways(shapely.Polygon(polygon), extraction.polylines)
    assert off <= 0.5 * resolution + extraction.stats['tolerance']


def test_a_sharp_tip_loses_a_cell_at_most(tmp_path):
    for turn in np.linspace(0.0, 2.0, 9):
        tip = ngon((0, 0), 1.3, 3, turn) * [1.0, 0.3]
        extraction = extract_walls(written(tmp_path, [tip], resolution=0.02))

        off = distance_both_ways(shapely.Polygon(tip), extraction.polylines)
        assert off <= 0.02 + extraction.stats['tolerance']


def test_free_space_between_solids_stays_free(tmp_path):
    # A corridor 1 m wide along x, between two solid blocks.
    occupancy_map = written(
        tmp_path, [[(0, 1), (5, 1), (5, 3), (0, 3)], [(0, 0), (5, 0), (5, -2), (0, -2)]],
        bounds=(0.0, -2.0, 5.0, 3.0))

    free = ~occupancy_map.occupied
    assert free.sum() == 20 * 100
    assert free[40:60].all()


def test_solids_thinner_than_a_cell_are_not_lost(tmp_path):
    sliver = [(0, 0.01), (3, 1.01), (3, 1.03), (0, 0.03)]

    occupancy_map = written(tmp_path, [sliver], resolution=0.1)

    polylines = extract_walls(occupancy_map).polylines
    assert distance_both_ways(shapely.Polygon(sliver), polylines) <= 0.2


def test_lines_are_one_cell_wide(tmp_path):
    occupancy_map = written(tmp_path, [], [[(0, 0.05), (1, 0.05), (1, 0.95)]], resolution=0.1,
                            bounds=(0, 0, 2, 1))

    assert occupancy_map.occupied[0].tolist() == [True] * 11 + [False] * 9
    assert occupancy_map.occupied[:, 10].all()
    assert occupancy_map.occupied.sum() == 20


def test_what_lies_beyond_the_bounds_is_left_out(tmp_path):
    occupancy_map = written(tmp_path, [ngon((0, 0), 50.0, 4)], [[(-90, 0), (90, 0)]],
                            bounds=(-1, -1, 1, 1), resolution=0.5)

    assert occupancy_map.cells.tolist() == [[100] * 4] * 4


@pytest.mark.parametrize('arguments, problem', [
    (([],), '^bounds: needed'),
    (([[(0, 0), (1, 1)]],), '^polygon 0: expected at least three'),
    (([ngon((0, 0), 1, 5), [(0, 0), (1, np.nan), (1, 1)]],), '^polygon 1: .* not finite'),
    (([[(0, 0), (1, 1), (1, 0), (0, 1)]],), '^polygon 0: its outline crosses itself'),
    (([], [[(0, 0)]]), '^wall 0: expected at least two'),
    (([ngon((0, 0), 1, 5)], [], (0, 0, -1, 1)), '^bounds: expected'),
    (([ngon((0, 0), 1, 5)], [], None, 0.0), '^resolution: '),
    (([ngon((0, 0), 1e6, 5)],), '^bounds: .* too many'),
    # 67 million cells: more than a map may have that is read.
    (([ngon((0, 0), 1, 5)], [], (0, 0, 410, 410)), '^bounds: 8200 x 8200 cells are too many'),
])
def test_a_malformed_shape_is_refused_and_nothing_is_written(tmp_path, arguments, problem):
    with pytest.raises(ValueError, match=problem):
        write_map(tmp_path / 'made.yaml', *arguments)

    assert list(tmp_path.iterdir()) == []
