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
A motion model for tests, whose two ways are known beforehand.

As `policy.motion.MotionModel`.
"""

import numpy as np
from wallnav_ros.policy.motion import constant_velocity, Forecast


class TwoWays:
    """Everyone keeps their velocity, or with `chance` is at `place` instead, give or take."""

    def __init__(self, chance, place, spread=0.0):
        self.chance, self.place, self.spread = chance, np.array(place, dtype=float), spread

    def forecast(self, agents, walls, steps, time_step):
        """Return the Forecast of `agents` over `steps` of `time_step` seconds."""
        certain = constant_velocity(agents, steps, time_step)
        other = np.broadcast_to(self.place, certain.position.shape)
        shape = agents.radius.shape
        return Forecast(
            np.stack((np.full(shape, 1.0 - self.chance), np.full(shape, self.chance)), axis=-1),
            np.concatenate((certain.position, other), axis=2),
            np.full((*shape, 2, steps), self.spread))
