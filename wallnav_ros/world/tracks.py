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
What perception reports: tracked humans and static obstacles.

The fields are those of the `tracks` topic (docs/perception.md).
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.world.state import Agents

OBSTACLE = 0
HUMAN = 1


@dataclass(frozen=True)
class Tracks:
    """
    Tracks at one instant, in the frame the tracker was given poses in (`odom` or `map`).

    stamp: seconds, the scan's own time.
    id: (N,) uint32, never reused.
    position, velocity: (N, 2) metres and m/s.
    radius: (N,) metres.
    label: (N,) uint8, OBSTACLE or HUMAN.
    """

    stamp: float
    id: np.ndarray  # noqa: A003
    position: np.ndarray
    velocity: np.ndarray
    radius: np.ndarray
    label: np.ndarray

    @classmethod
    def none(cls, stamp):
        """Return no tracks at `stamp` seconds."""
        return cls(stamp, np.empty(0, np.uint32), np.empty((0, 2)), np.empty((0, 2)),
                   np.empty(0), np.empty(0, np.uint8))

    def __len__(self):
        """Return the number of tracks."""
        return len(self.id)

    def agents(self):
        """Return the tracks as the policy's agents, in the same frame."""
        return Agents.of(self.position, self.velocity, self.radius)
