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
Where agents may stand: the cells that the robot could reach from its start.

Works alike for solid blocks, rooms and maps, whichever side of a wall line is the free one.
"""

import cv2
import numpy as np

CELL = 0.1         # m, spacing of the grid that free space is sought on
CLEARANCE = 0.12   # m, no gap narrower than twice this lets the search through


def free_points(walls, field, start, goal, margin=0.0):
    """
    Return the grid points (P, 2), in metres, connected to `start` (2,) without meeting a wall.

    The grid spans `walls`, `start` and `goal` (2,), an open world (no walls) 10 m to each side
    of the start besides, and `margin` m around it all; `field` gives the distances. P is 0 when
    the start touches a wall.
    """
    corners = (walls.segments.reshape(-1, 2) if len(walls)
               else np.asarray(start) + np.array([[-10.0, -10.0], [10.0, 10.0]]))
    corners = np.vstack((corners, start, goal))
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    columns, rows = np.maximum(1, np.floor((high - low) / CELL).astype(int))
    grid = np.stack(np.meshgrid(low[0] + CELL * (0.5 + np.arange(columns)),
                                low[1] + CELL * (0.5 + np.arange(rows))), axis=-1)
    free = field.at(grid) > CLEARANCE
    _, label = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    column, row = np.clip(((np.asarray(start) - low) / CELL).astype(int), 0,
                          (columns - 1, rows - 1))
    if not free[row, column]:
        return np.empty((0, 2))
    return grid[label == label[row, column]]


class Passage:
    """
    Whether a disc can still get from `start` to `goal` (2,) between those that stand about.

    points: (P, 2) of `free_points`; field: the walls' distances; radius: of the disc, with the
    room it needs, in metres. All in one frame.
    """

    def __init__(self, points, field, start, goal, radius):
        self._points, self._radius = points, radius
        low = points.min(axis=0)
        self._cells = np.round((points - low) / CELL).astype(int)
        self._ends = [int(np.linalg.norm(points - end, axis=1).argmin()) for end in (start, goal)]
        self._open = field.at(points) > radius
        # Both ends were asked for, so they count as open however tight the place is.
        self._open[self._ends] = True

    def admits(self, position, radius):
        """Return whether a way is left beside one more disc at `position` (2,) of `radius` m."""
        return self._connected(self._open & self._clear_of(position, radius))

    def block(self, position, radius):
        """Let a disc at `position` (2,) of `radius` metres stand there from now on."""
        self._open &= self._clear_of(position, radius)

    def _clear_of(self, position, radius):
        offset = self._points - position
        return np.einsum('ij,ij->i', offset, offset) > (radius + self._radius) ** 2

    def _connected(self, is_open):
        grid = np.zeros(self._cells.max(axis=0) + 1, dtype=np.uint8)
        grid[tuple(self._cells[is_open].T)] = 1
        _, label = cv2.connectedComponents(grid, connectivity=8)
        start, goal = (label[tuple(self._cells[end])] for end in self._ends)
        return bool(start == goal != 0)


def within_polygon(points, polygon):
    """Return which of `points` (P, 2) lie inside `polygon` (K, 2), by the even-odd rule."""
    x, y = points[:, 0, None], points[:, 1, None]
    x0, y0 = polygon[:, 0], polygon[:, 1]
    x1, y1 = np.roll(polygon, -1, axis=0).T
    crosses = (y0 > y) != (y1 > y)
    with np.errstate(divide='ignore', invalid='ignore'):
        left = x < x0 + (y - y0) * (x1 - x0) / (y1 - y0)
    return (crosses & left).sum(axis=1) % 2 == 1
