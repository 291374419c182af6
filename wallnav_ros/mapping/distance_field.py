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
Walls to a distance field: the exact distance at every node of a grid laid over them.

Vector distance transform (Danielsson 1980): nodes hand on which segment is nearest to them.
"""

import numpy as np
from scipy import ndimage

from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.walls import Walls

# 64 MB of float32: 200 m x 200 m at 0.05 m.
MOST_NODES = 16_000_000
# Nodes are measured this many at a time, so that the temporaries stay small.
_BLOCK = 1 << 18
# In cells: what a node must gain to be changed; less is rounding.
_GAIN = np.float32(1e-3)
# Metres from a wall within which distances matter to a robot, and are made exact.
_EXACT_WITHIN = 4.0


def distance_field(walls: Walls, resolution=0.05, margin=1.0) -> DistanceField:
    """
    Return the distance to `walls`, sampled every `resolution` metres, `margin` m beyond them.

    At nodes within 4 m of a wall the distance is exact (to 8 mm where segments shorter than
    `resolution` crowd), farther off it may be 0.71 `resolution` too large. Between nodes, where
    the field is looked up bilinearly, it errs by up to 0.71 `resolution` beside a wall.
    Walls without a segment give `DistanceField.empty()`.

    Raises ValueError where a coordinate, `resolution` or `margin` is not finite and positive,
    or where the grid would need more than `MOST_NODES` nodes.
    """
    if not len(walls):
        return DistanceField.empty()
    corner, shape = _lay_grid(walls.segments, resolution, margin)
    # Cells of the grid as the unit: float32 then resolves 1e-6 of a cell near the origin.
    segments = ((walls.segments - corner) / resolution).astype(np.float32)
    lines = _tabulate(segments)
    nearest, known = _nearest_at_walls(segments, lines, shape)
    nearest = _spread(nearest, known)
    distance = _measure_all(lines, nearest)
    _hand_on(lines, nearest, distance, _EXACT_WITHIN / resolution)
    pose = np.array([corner[0], corner[1], 0.0])
    return DistanceField(distance * np.float32(resolution), pose, float(resolution))


def _lay_grid(segments, resolution, margin):
    """Return the corner (2,) in metres and the shape (rows, columns) of the grid."""
    for name, value in (('resolution', resolution), ('margin', margin)):
        if not (np.isfinite(value) and value > 0.0):
            raise ValueError(f'{name}: expected a positive number of metres, got {value}')
    if not np.isfinite(segments).all():
        raise ValueError('walls: a coordinate is not finite')
    points = segments.reshape(-1, 2)
    corner = points.min(axis=0) - margin
    extent = points.max(axis=0) + margin - corner
    columns, rows = (np.ceil(extent / resolution) + 1.0)
    if columns * rows > MOST_NODES:
        coarse = resolution * np.sqrt(columns * rows / MOST_NODES)
        raise ValueError(
            f'walls span {extent[0]:.0f} m x {extent[1]:.0f} m: too many nodes at resolution '
            f'{resolution:g} m; use {coarse:.2g} m or more, or remove far-off walls')
    return corner, (int(rows), int(columns))


def _tabulate(segments):
    """Return start x, y, extent x, y and extent / length squared x, y of segments, each (M,)."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    squared = (along * along).sum(axis=1)
    scaled = along / np.where(squared > 0.0, squared, 1.0)[:, None]
    return np.ascontiguousarray(np.hstack((start, along, scaled)).T)


def _nearest_at_walls(segments, lines, shape):
    """
    Return the nearest segment at the nodes around the walls, and which nodes those are.

    Both arrays have `shape`; the first is int32 and means nothing where the second is False.
    """
    along = segments[:, 1] - segments[:, 0]
    # One cell at most between samples, and 4 x 4 nodes around each: none beside a wall is missed,
    # and a segment too short to be nearest to a node of its own cell still gets some.
    count = np.ceil(np.hypot(along[:, 0], along[:, 1])).astype(np.intp) + 1
    owner = np.repeat(np.arange(len(segments), dtype=np.int32), count)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    fraction = (step / np.maximum(count - 1, 1)[owner]).astype(np.float32)
    cell = np.floor(segments[owner, 0] + fraction[:, None] * along[owner]).astype(np.int32)
    rows, columns = shape
    steps = np.arange(-1, 3, dtype=np.int32)
    column = np.clip(cell[:, :1] + np.tile(steps, 4), 0, columns - 1).ravel()
    row = np.clip(cell[:, 1:] + np.repeat(steps, 4), 0, rows - 1).ravel()
    owner = np.repeat(owner, 16)
    distance = _squared_distance(lines, owner, row, column)
    # Written in order of falling distance, so that the nearest owner of a node stays.
    order = np.argsort(-distance, kind='stable')
    nearest, known = np.zeros(shape, np.int32), np.zeros(shape, bool)
    nearest[row[order], column[order]] = owner[order]
    known[row, column] = True
    return nearest, known


def _spread(nearest, known):
    """Give every node the segment of the nearest node that has one."""
    row, column = ndimage.distance_transform_edt(
        ~known, return_distances=False, return_indices=True)
    return nearest[row, column]


def _measure_all(lines, nearest):
    """Return the distance (H, W) in cells of each node to the segment it was given."""
    rows, columns = nearest.shape
    distance = np.empty(nearest.shape, np.float32)
    at_once = max(1, _BLOCK // columns)
    for first in range(0, rows, at_once):
        part = slice(first, min(first + at_once, rows))
        row = np.arange(part.start, part.stop)[:, None]
        distance[part] = _squared_distance(lines, nearest[part], row, np.arange(columns))
    return np.sqrt(distance, out=distance)


def _hand_on(lines, nearest, distance, within):
    """
    Let neighbours offer each other their segments until no node gains by it, in place.

    A segment does not pass through its nodes: only those along the borders between two segments'
    nodes can have got the wrong one. Nodes more than `within` cells from a wall are left.
    """
    rows, columns = nearest.shape
    flat_nearest, flat_distance = nearest.ravel(), distance.ravel()
    suspect = np.flatnonzero(_borders(nearest) & (distance <= within))
    while len(suspect):
        gained = []
        row, column = np.divmod(suspect, columns)
        for down, right in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            inside = ((row + down >= 0) & (row + down < rows)
                      & (column + right >= 0) & (column + right < columns))
            giver = suspect[inside]
            taker = giver + down * columns + right
            offer = flat_nearest[giver]
            differs = offer != flat_nearest[taker]
            taker, offer = taker[differs], offer[differs]
            offered = np.sqrt(_squared_distance(lines, offer, *np.divmod(taker, columns)))
            nearer = offered < flat_distance[taker] - _GAIN
            taker = taker[nearer]
            flat_nearest[taker], flat_distance[taker] = offer[nearer], offered[nearer]
            gained.append(taker)
        suspect = np.unique(np.concatenate(gained))
        suspect = suspect[flat_distance[suspect] <= within]


def _borders(nearest):
    """Return which nodes (H, W) bool have a neighbour that was given another segment."""
    border = np.zeros(nearest.shape, bool)
    for there, here in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        differs = nearest[there] != nearest[here]
        border[there] |= differs
        border[here] |= differs
    return border


def _squared_distance(lines, owner, row, column):
    """Return the squared distance (...) of nodes (row, column) to the segments they are given."""
    x, y, along_x, along_y, scaled_x, scaled_y = (part[owner] for part in lines)
    x = np.float32(column) - x
    y = np.float32(row) - y
    fraction = x * scaled_x + y * scaled_y
    np.clip(fraction, 0.0, 1.0, out=fraction)
    x -= fraction * along_x
    y -= fraction * along_y
    return x * x + y * y
