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
What the navigator is told about its robot, and what it says to do.

Paper section 8 (the real robot): a linear and an angular velocity come out.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.navigation.base import BaseLimits
from wallnav_ros.navigation.watchdogs import Stop


@dataclass(frozen=True)
class NavigatorSettings:
    """
    The robot and what it waits for.

    radius, goal_tolerance: m. preferred_speed: m/s. scan_timeout, odom_timeout,
    tracks_timeout, localisation_timeout: s. localisation_jump: m that a new pose in the map may
    move the robot by without making it doubt where it is. control_period: s between two commands.
    tracks_given: tracks come from another process instead of the tracker in this one.
    base: what the base can do.
    """

    radius: float = 0.2
    preferred_speed: float = 0.8
    goal_tolerance: float = 0.15
    scan_timeout: float = 0.4
    odom_timeout: float = 0.4
    tracks_timeout: float = 0.4
    localisation_timeout: float = 2.0
    localisation_jump: float = 0.5
    control_period: float = 0.05
    tracks_given: bool = False
    base: BaseLimits = BaseLimits()


@dataclass(frozen=True)
class Plan:
    """
    A decision and what it was taken on.

    stamp: seconds, of the scan. command: (2,) m/s and rad/s. stop: the Stop that holds instead
    of it, such as when every action is predicted to collide, or None. waits: the policy chose to
    stand. path: (K, 3) poses predicted, and goal: (2,), the sub-goal headed for,
    in `frame`.
    """

    stamp: float
    command: np.ndarray
    stop: Stop | None
    waits: bool
    path: np.ndarray
    goal: np.ndarray
    frame: str


@dataclass(frozen=True)
class Status:
    """
    What the robot shall do now.

    command: (2,) m/s and rad/s. state: `stopped`, `driving` or `waiting` (the policy chose to
    stand). stop: the Stop behind a zero command that the policy did not choose, else None.
    """

    command: np.ndarray
    state: str
    stop: Stop | None
