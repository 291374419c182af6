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
Ways around people who stand, for simulated robots: the map does not know who stands where.

`navigation.detours` does it on the robot, which has tracks to go by and only time for a piece of
the map; here it is told who stands, and simulated worlds are small.
"""

import numpy as np

from wallnav_ros.mapping.route import plan_round, RouteError
from wallnav_ros.world.geometry import lengths, nearest_on_segments

PATIENCE = 4           # steps after which who has not moved is taken to stand, and is looked for
STILL = 0.05           # m that who stands has moved at most in that time
NEAR = 8.0             # m, within which people are stood around
ROOM = 0.05            # m to spare on each side of the robot


class Detours:
    """Remembers for robots (B,) whom their ways go round, and plans others when that changes."""

    def __init__(self, count):
        self._standing = [frozenset()] * count
        self._steps = np.zeros(count, dtype=int)

    def restart(self, row):
        """Forget whom the robot of `row` has gone round."""
        self._standing[row], self._steps[row] = frozenset(), 0

    def due(self):
        """Count a step; return (B,) for which robots it is time to look who stands."""
        self._steps += 1
        return self._steps % PATIENCE == 0

    def seek(self, row, walls, robot, agents, route):
        """
        Return the Route of the robot of `row` around those who stand, None to keep its `route`.

        `walls` is the DistanceField that says nothing of the `agents` (N,); `robot` has no
        leading axis. It keeps its route where nobody new stands in its way.
        """
        trail = agents.trail[:, :PATIENCE]
        moved = np.nan_to_num(lengths(trail - agents.position[:, None]), nan=np.inf).max(
            axis=1, initial=0.0)
        beside = lengths(agents.position - robot.position) < NEAR
        stands = agents.present & beside & (moved < STILL)
        standing = frozenset(np.flatnonzero(stands).tolist())
        new = np.array(sorted(standing - self._standing[row]), dtype=int)
        if not len(new) or _is_clear(route, robot, agents.position[new], agents.radius[new]):
            return None
        self._standing[row] = standing
        try:
            return plan_round(walls, robot.position, robot.goal, float(robot.radius) + ROOM,
                              agents.position[stands], agents.radius[stands])
        except RouteError:
            return None


def _is_clear(route, robot, position, radius):
    """Return whether the way of `route` passes discs at `position` (K, 2) of `radius` (K,) m."""
    if not np.isfinite(route.to_go(robot.position)):
        return False
    path = route.path(robot.position)
    legs = np.stack((path[:-1], path[1:]), axis=1)
    gap = lengths(nearest_on_segments(position, legs) - position[:, None]).min(axis=1) - radius
    return bool((gap > robot.radius + ROOM).all())
