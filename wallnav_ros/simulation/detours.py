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
Ways around people who stand in the way, for robots that have stopped getting anywhere.

What `navigation.guidance` does on the robot: the map does not know who stands where.
"""

from collections import deque

import numpy as np

from wallnav_ros.mapping.route import plan_route, RouteError
from wallnav_ros.world.geometry import lengths

PATIENCE = 8           # steps
PROGRESS = 0.3         # m driven in that time, below which a robot has stopped getting anywhere
STILL = 0.05           # m that who stands has moved at most in that time
NEAR = 6.0             # m, within which people are stood around
ROOM = 0.05            # m to spare on each side of the robot


class Detours:
    """Watches robots (B,) and plans another Route for those that are stuck."""

    def __init__(self):
        self._places = deque(maxlen=PATIENCE + 1)

    def restart(self, row):
        """Forget where the robot of `row` has been."""
        for place in self._places:
            place[row] = np.nan

    def seek(self, position, rows):
        """Note robots at `position` (B, 2); return which of `rows` (R,) are stuck."""
        self._places.append(position.copy())
        moved = lengths(position - self._places[0])[rows]
        # Far from NaN: who has just started is not stuck yet.
        stuck = rows[moved < PROGRESS] if len(self._places) > PATIENCE else rows[:0]
        for row in stuck:
            self.restart(row)
        return stuck


def around(walls, robot, agents):
    """
    Return the Route of a `robot` (no leading axis) around the `agents` (N,) that stand, or None.

    `walls` is the DistanceField that says nothing of them.
    """
    trail = agents.trail[:, :PATIENCE]
    moved = np.nan_to_num(lengths(trail - agents.position[:, None]), nan=np.inf).max(
        axis=1, initial=0.0)
    beside = lengths(agents.position - robot.position) < NEAR
    stands = agents.present & beside & (moved < STILL)
    if not stands.any():
        return None
    field = walls.with_discs(agents.position[stands], agents.radius[stands])
    try:
        route = plan_route(field, robot.goal, float(robot.radius) + ROOM)
    except RouteError:
        return None
    return route if np.isfinite(route.to_go(robot.position)) else None
