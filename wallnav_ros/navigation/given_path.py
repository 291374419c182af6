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
A path handed in by a planner, followed by sub-goals as the robot's own routes are.

nav_msgs/Path of Nav2's planners; the sub-goals of `mapping.route`.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.mapping.route import in_sight, SIGHT
from wallnav_ros.world.distance_field import DistanceField

OPEN_SIGHT = 2.0       # m that a sub-goal is ahead where no map says what is in sight


@dataclass(frozen=True)
class GivenPath:
    """
    A way to a goal as points, in the state frame.

    points: (K, 2) m, the last one the goal, K >= 1. walls: DistanceField of that frame, or None.
    radius: m, of the robot with what it keeps clear.
    """

    points: np.ndarray
    walls: DistanceField | None
    radius: float

    def to_go(self, position):
        """Return the metres to go from `position` (2,): to the nearest point and on from it."""
        nearest, left = self._place(position)
        return float(np.hypot(*(self.points[nearest] - position)) + left[nearest])

    def guide(self, position):
        """Return the sub-goal (2,) for a robot at `position` (2,), and the metres beyond it."""
        nearest, left = self._place(position)
        sight = SIGHT if self.walls is not None else OPEN_SIGHT
        ahead = np.arange(nearest, len(self.points))
        ahead = ahead[left[nearest] - left[ahead] <= sight]
        seen = np.ones(len(ahead), dtype=bool)
        if self.walls is not None:
            seen = in_sight(self.walls, self.radius, position[None],
                            self.points[ahead][None])[0]
        # Where nothing is in sight, the path itself is the best there is.
        last = ahead[np.flatnonzero(seen)[-1]] if seen.any() else min(
            nearest + 1, len(self.points) - 1)
        return self.points[last], float(left[last])

    def path(self, position):
        """Return what is left of the way (K, 2) from `position` (2,)."""
        nearest, _ = self._place(position)
        return np.vstack((position, self.points[nearest:]))

    def _place(self, position):
        """Return the index of the point nearest to `position`, and the metres (K,) from each."""
        gap = np.hypot(*(self.points - position).T)
        strides = np.hypot(*np.diff(self.points, axis=0).T)
        left = np.append(np.cumsum(strides[::-1])[::-1], 0.0)
        # Of points equally near, as where a way crosses itself, the one with least to go.
        return int(np.flatnonzero(gap <= gap.min() + 1e-6)[-1]), left
