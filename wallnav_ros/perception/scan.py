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
One sweep of a planar scanner: which beams count, and where their ends lie.

The rules are those of sensor_msgs/LaserScan and REP-117 (meaning of inf and NaN).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

# Beyond one turn a bearing would name two beams; drivers overlap by a beam or two at most.
LARGEST_SPAN = 2.0 * np.pi * 1.02


class ScanError(ValueError):
    """A scan that cannot be used at all; the message names the field."""


@dataclass(frozen=True)
class Scan:
    """
    A laser scan in its own frame; beam i points at `angle_min + i * angle_increment`.

    stamp: seconds, when the first beam was taken.
    ranges: (B,) metres, as the driver sent them (NaN, inf, zero and nonsense included).
    angle_min, angle_increment: radians, either sign.
    range_min, range_max: metres, the ranges the scanner can measure.
    time_increment: seconds from beam to beam, 0 when unknown.

    Raises ScanError for a scan without beams or with meaningless geometry.
    """

    stamp: float
    ranges: np.ndarray
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    time_increment: float = 0.0

    def __post_init__(self):
        object.__setattr__(self, 'ranges', np.asarray(self.ranges, dtype=np.float64))
        for name in ('stamp', 'angle_min', 'angle_increment', 'range_min'):
            if not np.isfinite(getattr(self, name)):
                raise ScanError(f'{name}: not finite')
        if self.ranges.ndim != 1 or not len(self.ranges):
            raise ScanError('ranges: no beams')
        if not self.range_max > max(self.range_min, 0.0):
            raise ScanError('range_max: not above range_min and zero')
        if len(self.ranges) > 1 and self.angle_increment == 0.0:
            raise ScanError('angle_increment: zero, with more than one beam')
        if abs(self.angle_increment) * (len(self.ranges) - 1) > LARGEST_SPAN:
            raise ScanError('angle_increment: the beams span more than one turn')
        if not abs(self.angle_min) <= 1e3:
            raise ScanError('angle_min: more than 1000 rad')

    @cached_property
    def angles(self):
        """Return the bearing (B,) of every beam in radians, not wrapped."""
        return self.angle_min + self.angle_increment * np.arange(len(self.ranges))

    @cached_property
    def hits(self):
        """Return (B,) bool: beams that met something within the scanner's limits."""
        with np.errstate(invalid='ignore'):
            inside = (self.ranges >= self.range_min) & (self.ranges <= self.range_max)
        return inside & np.isfinite(self.ranges) & (self.ranges > 0.0)

    @cached_property
    def clear(self):
        """Return (B,) bool: beams that met nothing up to `range_max` (REP-117: +inf)."""
        with np.errstate(invalid='ignore'):
            return self.ranges > self.range_max

    @property
    def full_circle(self):
        """Return whether the last beam is next to the first."""
        step = abs(self.angle_increment)
        return len(self.ranges) > 2 and step * (len(self.ranges) + 0.5) >= 2.0 * np.pi

    @property
    def sweep_time(self):
        """Return the seconds from the first beam to the last; 0 when unknown or absurd."""
        duration = self.time_increment * (len(self.ranges) - 1)
        return float(duration) if 0.0 < duration < 1.0 else 0.0
