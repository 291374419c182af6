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
What the policy is told: the robot, the agents around it and the walls.

Paper section 2 (state); every array may carry leading batch axes, written `...`.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.world.distance_field import DistanceField


@dataclass(frozen=True)
class Robot:
    """
    The robot as a disc that moves as a unicycle, in the state frame (`map` or `odom`).

    pose: (..., 3) x, y in metres and yaw in radians.
    velocity: (..., 2) linear (m/s, along its heading) and angular (rad/s).
    goal: (..., 2) metres; the next sub-goal where the way bends.
    radius, preferred_speed: (...) metres and m/s.
    beyond: (...) metres of way left from `goal` on; 0 where it is the final one.
    """

    pose: np.ndarray
    velocity: np.ndarray
    goal: np.ndarray
    radius: np.ndarray
    preferred_speed: np.ndarray
    beyond: np.ndarray = 0.0

    def __post_init__(self):
        """Give every part the leading axes, so that all can be indexed alike."""
        object.__setattr__(self, 'beyond', np.broadcast_to(self.beyond, np.shape(self.radius)))

    @property
    def position(self):
        """Return x, y (..., 2) in metres."""
        return self.pose[..., :2]


@dataclass(frozen=True)
class Agents:
    """
    Humans and static obstacles as discs, in the state frame.

    position, velocity: (..., N, 2) metres and m/s; N may be 0.
    radius: (..., N) metres.
    present: (..., N) bool; False marks padding, whose other values mean nothing.
    trail: (..., N, L, 2) metres, where each was 1, 2, ... L time steps of a decision ago, NaN
    where that is not known; L may be 0.
    """

    position: np.ndarray
    velocity: np.ndarray
    radius: np.ndarray
    present: np.ndarray
    trail: np.ndarray = None

    def __post_init__(self):
        """Give agents of whom no past is told an empty one."""
        if self.trail is None:
            object.__setattr__(self, 'trail', np.empty(np.shape(self.radius) + (0, 2)))

    @classmethod
    def of(cls, position, velocity, radius):
        """Return agents that are all present, from (..., N, 2), (..., N, 2) and (..., N)."""
        radius = np.asarray(radius, dtype=float)
        shape = radius.shape + (2,)
        return cls(np.asarray(position, dtype=float).reshape(shape),
                   np.asarray(velocity, dtype=float).reshape(shape),
                   radius, np.ones(radius.shape, dtype=bool))

    @classmethod
    def none(cls):
        """Return an empty set of agents (N = 0)."""
        return cls.of(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))


@dataclass(frozen=True)
class Observation:
    """Everything one decision is taken on; all parts in the same frame."""

    robot: Robot
    agents: Agents
    walls: DistanceField
