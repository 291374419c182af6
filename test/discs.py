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
"""Discs as a laser scanner sees them, for tests that make scans by hand."""

import numpy as np
from wallnav_ros.world.geometry import to_child


def before(ranges, angles, pose, discs):
    """Return `ranges` (N,) at `angles` (N,) from `pose` (3,) cut by discs (x, y, radius)."""
    for x, y, radius in discs:
        centre = to_child(pose, np.array([x, y]))
        along = np.cos(angles) * centre[0] + np.sin(angles) * centre[1]
        depth = radius ** 2 - (centre @ centre - along ** 2)
        hit = (along > 0.0) & (depth > 0.0)
        ranges = np.where(hit, np.minimum(ranges, along - np.sqrt(np.maximum(depth, 0))), ranges)
    return ranges
