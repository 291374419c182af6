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
Walls of an occupancy map: the outlines of its occupied cells, simplified, in metres.

A wall lies on the edges between cells, not on their centres: one cell of wall is two-sided.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.mapping.boundary_tracing import trace_boundary
from wallnav_ros.mapping.loop_simplification import simplify_loops
from wallnav_ros.mapping.occupancy_map import FREE, OccupancyMap, UNKNOWN
from wallnav_ros.world.geometry import to_parent
from wallnav_ros.world.walls import Walls


@dataclass(frozen=True)
class WallExtraction:
    """
    The walls of a map, in the `map` frame.

    polylines: closed outlines, each (K, 2) metres, the first point repeated at the end.
    stats: what was found, with the settings it was found by (docs/mapping.md).
    """

    polylines: list
    stats: dict

    @property
    def walls(self):
        """Return the outlines as segments."""
        return Walls.from_polylines(self.polylines)


def extract_walls(occupancy_map: OccupancyMap, tolerance=None, min_size=0.0) -> WallExtraction:
    """
    Return the outlines of the occupied cells of a map.

    tolerance: metres that no part of a wall may be moved by, half a cell where None.
    min_size: metres; outlines smaller than this along both of the grid's axes are speckle and
        left out, as are holes of that size within walls. At 0 everything is kept.
    Raises ValueError where `tolerance` or `min_size` is negative or not finite.
    """
    resolution = occupancy_map.resolution
    tolerance = 0.5 * resolution if tolerance is None else tolerance
    for name, value in (('tolerance', tolerance), ('min_size', min_size)):
        if not (np.isfinite(value) and value >= 0.0):
            raise ValueError(f'{name}: expected 0 or more metres, got {value}')
    corners, starts = trace_boundary(occupancy_map.occupied)
    found = len(starts) - 1
    corners, starts = _without_speckle(corners, starts, min_size / resolution)
    points, first = simplify_loops(corners, starts, tolerance / resolution)
    points = to_parent(occupancy_map.origin, points * resolution)
    polylines = np.split(points, first[1:-1]) if len(points) else []
    stats = {
        'polylines': len(polylines),
        'segments': len(points) - len(polylines),
        'speckles_dropped': found - len(polylines),
        'length': round(_length(points, first), 3),
        'tolerance': tolerance,
        'min_size': min_size,
        **_count_cells(occupancy_map),
    }
    return WallExtraction(polylines, stats)


def _without_speckle(corners, starts, least):
    """Return the loops that are at least `least` cells wide or high."""
    if len(starts) < 2 or least <= 0.0:
        return corners, starts
    extent = (np.maximum.reduceat(corners, starts[:-1])
              - np.minimum.reduceat(corners, starts[:-1])).max(axis=1)
    # 0.3 m at 0.1 m must be three cells, whatever the last bit of the quotient says.
    stays = extent >= least - 1e-6
    size = np.diff(starts)
    return corners[np.repeat(stays, size)], np.concatenate(([0], np.cumsum(size[stays])))


def _length(points, first):
    """Return the metres of wall, both sides of thin ones counted."""
    step = np.hypot(*np.diff(points, axis=0).T)
    step[first[1:-1] - 1] = 0.0
    return float(step.sum())


def _count_cells(occupancy_map):
    cells = occupancy_map.cells
    return {'width': cells.shape[1], 'height': cells.shape[0],
            'occupied_cells': int(occupancy_map.occupied.sum()),
            'free_cells': int((cells == FREE).sum()),
            'unknown_cells': int((cells == UNKNOWN).sum())}
