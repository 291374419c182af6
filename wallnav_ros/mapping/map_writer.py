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
Polygons and lines in metres to a map file: PNG + YAML that every map server reads.

The YAML keys are those of nav2_map_server; cells are occupied (black) or free (white).
"""

from pathlib import Path

import cv2
import numpy as np
import shapely
from wallnav_ros.mapping.map_image import MOST_PIXELS
from wallnav_ros.world.files import atomic_write
from wallnav_ros.world.walls import Walls
import yaml

FREE, OCCUPIED = 255, 0


def write_map(yaml_path, solids, lines=(), bounds=None, resolution=0.05):
    """
    Write a map of `solids` and `lines`, and an image of the same name beside it.

    solids: closed polygons, each (K, 2) metres, K >= 3; a cell whose centre lies in one is
        occupied, so an edge is at most 0.71 cells from where it should be, a sharp tip one.
        Parts thinner than a cell are drawn like `lines` rather than lost.
    lines: thin walls, each (K, 2) metres, K >= 2, one cell wide.
    bounds: (x_min, y_min, x_max, y_max) of the map; else all of it and two free cells around.

    Raises ValueError, naming the polygon or argument, where a shape is malformed.
    """
    solids = [_checked(solid, number) for number, solid in enumerate(solids)]
    outlines = Walls.from_polylines(solids, closed=True)
    thin = Walls.from_polylines(lines)
    segments = np.concatenate((outlines.segments, thin.segments))
    corner, shape = _lay_grid(segments, bounds, resolution)
    occupied = np.zeros(shape, bool)
    for solid in solids:
        _fill(occupied, (solid - corner) / resolution)
    _draw_lost(occupied, (outlines.segments - corner) / resolution)
    column, row = _cells_along((thin.segments - corner) / resolution, shape)
    occupied[row, column] = True
    _save(Path(yaml_path), occupied, corner, resolution)


def _checked(solid, number):
    """Return polygon `number` as an array (K, 2); raise ValueError where it is none."""
    points = np.asarray(solid, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
        raise ValueError(f'polygon {number}: expected at least three [x, y] points')
    if not np.isfinite(points).all():
        raise ValueError(f'polygon {number}: a coordinate is not finite')
    if not shapely.Polygon(points).is_valid:
        raise ValueError(f'polygon {number}: its outline crosses itself or has no area')
    return points


def _lay_grid(segments, bounds, resolution):
    """Return the corner (2,) in metres of cell (0, 0) and the shape (rows, columns)."""
    if not (np.isfinite(resolution) and resolution > 0.0):
        raise ValueError(f'resolution: expected a positive number of metres, got {resolution}')
    if bounds is None:
        if not len(segments):
            raise ValueError('bounds: needed where there is neither a polygon nor a line')
        points = segments.reshape(-1, 2)
        bounds = (*(points.min(axis=0) - 2.0 * resolution),
                  *(points.max(axis=0) + 2.0 * resolution))
    bounds = np.asarray(bounds, dtype=float)
    if bounds.shape != (4,) or not np.isfinite(bounds).all() or (bounds[2:] <= bounds[:2]).any():
        raise ValueError('bounds: expected x_min, y_min, x_max, y_max in rising order')
    # Rounded first: 10.0 m at 0.05 m is 200 cells, whatever the last bit of the quotient says.
    columns, rows = np.ceil(np.round((bounds[2:] - bounds[:2]) / resolution, 6))
    # What could not be read again is not written.
    if columns * rows > MOST_PIXELS:
        raise ValueError(f'bounds: {columns:.0f} x {rows:.0f} cells are too many to write: '
                         'use a coarser resolution')
    return bounds[:2], (int(rows), int(columns))


def _fill(occupied, polygon):
    """Mark the cells whose centres lie in `polygon` (K, 2), given in cells, in place."""
    limits = np.array(occupied.shape)[::-1]
    low = np.clip(np.floor(polygon.min(axis=0)), 0, limits).astype(int)
    high = np.clip(np.ceil(polygon.max(axis=0)), 0, limits).astype(int)
    x, y = np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5
    area = shapely.Polygon(polygon)
    shapely.prepare(area)
    inside = shapely.contains_xy(area, *np.meshgrid(x, y))
    occupied[low[1]:high[1], low[0]:high[0]] |= inside


def _draw_lost(occupied, segments):
    """Mark the cells along those parts of `segments` that have no occupied cell near, in place."""
    column, row = _cells_along(segments, occupied.shape)
    near = cv2.dilate(occupied.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    lost = ~near[row, column]
    occupied[row[lost], column[lost]] = True


def _cells_along(segments, shape):
    """Return columns and rows of the cells that `segments` (M, 2, 2), in cells, run through."""
    along = segments[:, 1] - segments[:, 0]
    # A quarter of a cell between samples: only corners cut by less than that are left out.
    count = np.ceil(4.0 * np.hypot(along[:, 0], along[:, 1])).astype(int) + 1
    owner = np.repeat(np.arange(len(segments)), count)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    fraction = step / np.maximum(count - 1, 1)[owner]
    cell = np.floor(segments[owner, 0] + fraction[:, None] * along[owner]).astype(int)
    return cell[((cell >= 0) & (cell < np.array(shape)[::-1])).all(axis=1)].T


def _save(yaml_path, occupied, corner, resolution):
    image_path = yaml_path.with_suffix('.png')
    pixels = np.where(occupied[::-1], OCCUPIED, FREE).astype(np.uint8)
    _, encoded = cv2.imencode('.png', pixels)
    with atomic_write(image_path, 'wb') as stream:
        stream.write(encoded.tobytes())
    fields = {'image': image_path.name, 'mode': 'trinary', 'resolution': float(resolution),
              'origin': [float(corner[0]), float(corner[1]), 0.0], 'negate': 0,
              'occupied_thresh': 0.65, 'free_thresh': 0.196}
    with atomic_write(yaml_path) as stream:
        yaml.safe_dump(fields, stream, default_flow_style=None, sort_keys=False)
