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
The discrete actions of the unicycle: stop, and 5 speeds x 16 turn rates.

Paper section 1; speeds spaced exponentially as in CrowdNav (Chen et al. 2019).
"""

from dataclasses import dataclass

import numpy as np
from wallnav_ros.world.geometry import joined

SPEEDS = 5
TURNS = 16
STOP = 0           # index of the stop action


@dataclass(frozen=True)
class ActionSet:
    """
    Actions that any robot can scale to its preferred speed.

    speed: (A,) fractions of the preferred speed, in [0, 1]; turn_rate: (A,) rad/s.
    """

    speed: np.ndarray
    turn_rate: np.ndarray

    def commands(self, preferred_speed):
        """Return (..., A, 2) m/s and rad/s for robots of `preferred_speed` (...) m/s."""
        speed = np.asarray(preferred_speed, dtype=float)[..., None] * self.speed
        return joined(speed, self.turn_rate)


def make_actions(max_turn_rate=1.8, speeds=SPEEDS, turns=TURNS):
    """
    Return 1 + `speeds` x `turns` actions; action 0 stops.

    Turn rates are evenly spaced in [-max, max) rad/s, so that an even number of them holds
    straight ahead (a robot that cannot go straight weaves along corridors).
    """
    speed = np.expm1(np.arange(1, speeds + 1) / speeds) / np.expm1(1.0)
    turn_rate = max_turn_rate * (np.arange(turns) / (turns / 2.0) - 1.0)
    speed, turn_rate = np.meshgrid(speed, turn_rate, indexing='ij')
    return ActionSet(np.append(0.0, speed), np.append(0.0, turn_rate))
