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
What the scanner sees that neither the map nor a track explains, as walls.

Keeps furniture, closed doors and unmapped walls from being driven into; without a map it is
all the walls there are. Distances by Euclidean distance transform (Felzenszwalb 2012).
"""

import cv2
import numpy as np

from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import to_parent

RESOLUTION = 0.05      # m
REACH = 8.0            # m around the robot; the policy feels walls up to 5 m from where it looks
TRACK_MARGIN = 0.2     # m beyond a track's radius; beams end on its surface and it moves
WALL_MARGIN = 0.15     # m; as the tracker's own rule for what a mapped wall explains


def scan_points(scan, laser_pose):
    """Return where the beams of a Scan ended (K, 2) in the frame of `laser_pose` (3,)."""
    angles, ranges = scan.angles[scan.hits], scan.ranges[scan.hits]
    return to_parent(laser_pose, np.stack((ranges * np.cos(angles), ranges * np.sin(angles)), 1))


def unexplained(points, agents, walls):
    """
    Return those of `points` (K, 2) that lie on no agent and, where given, on no mapped wall.

    All in one frame; `walls` is a DistanceField or None.
    """
    if walls is not None and len(points):
        points = points[walls.at(points) > WALL_MARGIN]
    if len(points) and agents.radius.size:
        gap = np.linalg.norm(points[:, None] - agents.position, axis=2) - agents.radius
        points = points[gap.min(axis=1) > TRACK_MARGIN]
    return points


def add_surfaces(points, walls, centre):
    """
    Return the DistanceField of `points` (K, 2) and `walls` (DistanceField or None) together.

    It covers REACH metres around `centre` (2,); where there is nothing to add, `walls` itself.
    """
    points = points[(np.abs(points - centre) < REACH).all(axis=1)]
    if not len(points):
        return DistanceField.empty() if walls is None else walls
    size = int(2 * REACH / RESOLUTION) + 1
    corner = np.asarray(centre, dtype=float) - REACH
    free = np.ones((size, size), np.uint8)
    column, row = np.rint((points - corner) / RESOLUTION).astype(np.intp).T
    free[row, column] = 0
    distance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_5) * RESOLUTION
    if walls is not None:
        steps = RESOLUTION * np.arange(size)
        nodes = np.stack(np.meshgrid(corner[0] + steps, corner[1] + steps), axis=-1)
        distance = np.minimum(distance, walls.at(nodes).astype(np.float32))
    return DistanceField(distance, np.array([*corner, 0.0]), RESOLUTION)
