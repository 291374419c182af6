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
Which beam ends are the map's walls, given how well the robot knows where it is.

First-order propagation of a pose's covariance to a place seen from it (Smith, Self and
Cheeseman 1990), taken across the wall: along it, an error moves no beam end off the wall.
"""

import numpy as np


def lie_on_walls(ends, laser, walls, covariance, settings):
    """
    Return (P,) bool: the beam `ends` (P, 2) that `walls` explain.

    laser: (2,) where the beams began; ends, laser and walls, a DistanceField, in one frame.
    covariance: (3, 3) of the laser's x, y (m) and yaw (rad) relative to the walls, along the
    axes of that frame; None where nobody tells.
    """
    if covariance is None:
        covariance = np.diag(np.square(
            (settings.pose_noise, settings.pose_noise, settings.heading_noise)))
    distance = walls.at(ends)
    least = settings.wall_deviations * np.hypot(settings.match_noise, settings.map_noise)
    most = max(settings.wall_reach, least)
    explained = distance <= least
    doubtful = np.flatnonzero(~explained & (distance <= most))
    spread = _spread_across(ends[doubtful], laser, walls, covariance)
    margin = np.hypot(least, settings.wall_deviations * spread)
    explained[doubtful] = distance[doubtful] <= np.minimum(margin, most)
    return explained


def _spread_across(ends, laser, walls, covariance):
    """Return (P,) m: the standard deviation that `covariance` gives `ends` across the walls."""
    step = walls.resolution
    ahead, behind, left, right = walls.at(
        ends + step * np.array([[[1, 0]], [[-1, 0]], [[0, 1]], [[0, -1]]]))
    across_x, across_y = (ahead - behind) / (2.0 * step), (left - right) / (2.0 * step)
    # A turn of the laser moves an end at right angles to its beam.
    x, y = (ends - laser).T
    turning = across_y * x - across_x * y
    change = np.array((across_x, across_y, turning))
    return np.sqrt(np.maximum(np.einsum('ip,ij,jp->p', change, covariance, change), 0.0))
