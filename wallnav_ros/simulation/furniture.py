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
Furniture as a laser sees it: what stands in a room and is on no map.

Chairs of the paper's laboratory tests (section 8): four thin legs each.
"""

import numpy as np

from wallnav_ros.world.geometry import to_parent

SEAT = 0.40            # m between the centres of two legs
LEG = 0.03             # m across a leg
_SQUARE = 0.5 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


def chair_legs(pose):
    """Return the four legs of a chair at `pose` (3,) as polygons (4, 2) in metres."""
    return tuple(to_parent(pose, SEAT * corner + LEG * _SQUARE) for corner in _SQUARE)
