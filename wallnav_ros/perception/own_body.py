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
The robot's own body in the scan: near returns that stay while the robot travels.

Anything that keeps its bearing and range over a metre of driving is carried along.
"""

import numpy as np


class OwnBody:
    """Learns, beam by beam, which near returns belong to the robot itself."""

    def __init__(self, settings):
        self.settings = settings
        self._travelled = 0.0
        self._range = np.empty(0)
        self._since = np.empty(0)

    def find(self, scan, step):
        """
        Return (B,) bool: beams of `scan` that end on the robot.

        step: (3,) the laser's motion since the scan before, in its own frame.
        """
        settings = self.settings
        self._travelled += float(np.hypot(step[0], step[1])) + settings.own_reach * abs(step[2])
        if len(self._range) != len(scan.ranges):
            self._range = np.full(len(scan.ranges), np.inf)
            self._since = np.full(len(scan.ranges), self._travelled)
        near = scan.hits & (scan.ranges < settings.own_reach)
        ranges = np.where(near, scan.ranges, np.inf)
        same = near & (np.abs(ranges - np.where(near, self._range, 0.0)) < settings.own_margin)
        # A beam that is lost for a scan proves nothing; one that passes or stops short does.
        changed = scan.hits & ~same
        self._since[changed] = self._travelled
        self._range[changed] = ranges[changed]
        return same & (self._travelled - self._since > settings.own_travel)
