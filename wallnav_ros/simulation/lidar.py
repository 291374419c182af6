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
A 2-D LiDAR: exact ray casting against walls and agents, with range noise.

Beam order and range conventions are those of sensor_msgs/LaserScan.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Lidar:
    """
    A scanner's geometry, in its own frame (x forward, angles counter-clockwise).

    angle_min, angle_increment: radians; range_min, range_max: metres; noise: standard
    deviation of a range, metres.
    """

    beams: int = 360
    angle_min: float = -np.pi
    angle_increment: float = 2.0 * np.pi / 360
    range_min: float = 0.05
    range_max: float = 12.0
    noise: float = 0.01

    def angles(self):
        """Return the bearing (beams,) of each beam in the scanner's frame."""
        return self.angle_min + self.angle_increment * np.arange(self.beams)

    def scan(self, pose, walls, agents, rng):
        """
        Return the ranges (beams,), float32 metres, seen from `pose` (3,); inf is no return.

        `walls` and `agents` are in the frame of `pose`. A return nearer than range_min
        is reported as no return, as real scanners do.
        """
        bearings = self.angles() + pose[2]
        ranges = np.minimum(
            walls.raycast(pose[:2], bearings, self.range_max),
            _raycast_discs(pose[:2], bearings, agents.position, agents.radius))
        ranges = ranges + rng.normal(0.0, self.noise, self.beams)
        ranges[(ranges < self.range_min) | (ranges > self.range_max)] = np.inf
        return ranges.astype(np.float32)


def _raycast_discs(origin, bearings, centre, radius):
    if not len(radius):
        return np.full(len(bearings), np.inf)
    offset = centre - origin
    along = np.cos(bearings)[:, None] * offset[:, 0] + np.sin(bearings)[:, None] * offset[:, 1]
    depth = radius ** 2 - (np.sum(offset ** 2, axis=1) - along ** 2)
    reach = along - np.sqrt(np.maximum(depth, 0.0))
    return np.where((depth > 0.0) & (reach > 0.0), reach, np.inf).min(axis=1)
