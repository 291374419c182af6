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
Poses by time, so that a scan is placed where the robot was when it was taken.

REP-105: odometry is continuous, so interpolating between two of its poses is sound.
"""

from bisect import bisect_right
import math

import numpy as np

from wallnav_ros.world.geometry import wrap_angle


class PoseBuffer:
    """
    The last seconds of a pose (x, y, yaw), answered at any stamp within reach.

    duration: seconds of history kept.
    extrapolation: seconds beyond the newest pose that are bridged at the last velocity.
    max_gap: seconds between two poses that are still interpolated.
    """

    def __init__(self, duration=5.0, extrapolation=0.3, max_gap=1.0):
        self.duration = duration
        self.extrapolation = extrapolation
        self.max_gap = max_gap
        self._stamps = []
        self._poses = []

    def __len__(self):
        """Return the number of poses held."""
        return len(self._stamps)

    def add(self, stamp, pose):
        """
        Remember `pose` (3,) at `stamp` seconds; returns whether it was usable.

        A pose that is not finite is dropped. A stamp older than the newest by more than
        `max_gap` means the clock was set back: the history is forgotten. Slightly
        older stamps are messages out of order and are dropped.
        """
        pose = np.asarray(pose, dtype=float)
        # For three numbers, `math` takes a tenth of NumPy's time; odometry comes at 100 Hz.
        if pose.shape != (3,) or not all(map(math.isfinite, (*pose.tolist(), stamp))):
            return False
        if self._stamps and stamp <= self._stamps[-1]:
            if stamp >= self._stamps[-1] - self.max_gap:
                return False
            self.clear()
        self._stamps.append(float(stamp))
        self._poses.append(pose)
        stale = bisect_right(self._stamps, stamp - self.duration)
        if stale > 256:
            del self._stamps[:stale], self._poses[:stale]
        return True

    def clear(self):
        """Forget every pose."""
        self._stamps.clear()
        self._poses.clear()

    def at(self, stamp):
        """Return the pose (3,) at `stamp` seconds, or None when it cannot be told."""
        if not self._stamps or not np.isfinite(stamp):
            return None
        after = bisect_right(self._stamps, stamp)
        if after == 0:
            first = self._stamps[0]
            return self._poses[0].copy() if first - stamp <= self.extrapolation else None
        if after == len(self._stamps):
            if stamp - self._stamps[-1] > self.extrapolation:
                return None
            if after == 1:
                return self._poses[-1].copy()
            after -= 1
        return self._between(after - 1, after, stamp)

    def _between(self, before, after, stamp):
        """Return the pose on the line through two entries; the nearer one across a gap."""
        start, end = self._stamps[before], self._stamps[after]
        if end - start > self.max_gap:
            near = before if stamp - start < end - stamp else after
            if abs(stamp - self._stamps[near]) > self.extrapolation:
                return None
            return self._poses[near].copy()
        fraction = (stamp - start) / (end - start)
        change = self._poses[after] - self._poses[before]
        change[2] = wrap_angle(change[2])
        pose = self._poses[before] + fraction * change
        pose[2] = wrap_angle(pose[2])
        return pose
