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
Distance to the nearest wall on a grid: constant-time look-ups however many walls there are.

Built by `mapping.distance_field`; rays are found by sphere tracing (Hart 1996).
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.world.geometry import to_child


@dataclass(frozen=True)
class DistanceField:
    """
    Distances sampled at grid nodes, looked up bilinearly.

    distance: (H, W) float32, metres to the nearest wall at node (row j, column i).
    pose: (3,) x, y, yaw of node (0, 0) and of the grid's axes in the walls' frame.
    resolution: node spacing in metres.

    Outside the grid the nearest edge node answers: lay the grid a margin beyond the walls.
    """

    distance: np.ndarray
    pose: np.ndarray
    resolution: float

    @classmethod
    def empty(cls, clearance=100.0):
        """Return the field of a world with no walls: `clearance` metres everywhere."""
        return cls(np.full((2, 2), clearance, dtype=np.float32), np.zeros(3), 1.0)

    def with_discs(self, position, radius):
        """Return the field with discs at `position` (K, 2) of `radius` (K,) metres in it."""
        row, column = np.ogrid[tuple(slice(count) for count in self.distance.shape)]
        centre = to_child(self.pose, position) / self.resolution
        distance = self.distance
        for (x, y), size in zip(centre, radius):
            away = np.hypot(column - x, row - y) * self.resolution - size
            distance = np.minimum(distance, np.maximum(away, 0.0))
        return DistanceField(distance.astype(np.float32), self.pose, self.resolution)

    def at(self, points):
        """Return the distance (...) in metres at `points` (..., 2) of the walls' frame."""
        cells = to_child(self.pose, points) / self.resolution
        return self._look_up(cells[..., 0], cells[..., 1])

    def raycast(self, origins, angles, max_range, steps=12):
        """
        Return the ranges (...) of rays from `origins` (..., 2) at `angles` (...), in metres.

        Angles are in the walls' frame. Ranges are clipped to `max_range`. Each of the `steps`
        advances by the free distance and a ray stops within one `resolution` of a wall, so a
        result is never beyond the wall; a ray that grazes one for long ends short of the hit.
        """
        cells = to_child(self.pose, origins) / self.resolution
        turned = np.asarray(angles) - self.pose[2]
        dx, dy = np.cos(turned) / self.resolution, np.sin(turned) / self.resolution
        x, y = cells[..., 0], cells[..., 1]
        reach = np.zeros(np.broadcast(x, turned).shape)
        for _ in range(steps):
            free = self._look_up(x + reach * dx, y + reach * dy)
            # Between nodes on both sides of a wall the look-up does not fall to zero: a ray that
            # trusted it there would creep through.
            reach = np.minimum(reach + np.where(free > self.resolution, free, 0.0), max_range)
        return reach

    def _look_up(self, x, y):
        height, width = self.distance.shape
        x = np.minimum(np.maximum(x, 0.0), width - 1.001)
        y = np.minimum(np.maximum(y, 0.0), height - 1.001)
        column, row = x.astype(np.intp), y.astype(np.intp)
        x -= column
        y -= row
        corner = row * width
        corner += column
        flat = self.distance.ravel()
        first, right, below, last = (
            flat[shift:].take(corner) for shift in (0, 1, width, width + 1))
        low = first + (right - first) * x
        high = below + (last - below) * x
        return low + (high - low) * y
