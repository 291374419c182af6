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
"""Crowds for tests: everybody's way over a number of steps."""

import numpy as np

from wallnav_ros.simulation.crowd import Crowd


def run_crowd(episode, steps, time_step):
    """Return positions and velocities (steps + 1, N, 2) of a crowd that sees no robot."""
    crowd = Crowd(episode, time_step)
    agents = [crowd.agents(), *(crowd.step() for _ in range(steps))]
    return (np.array([each.position for each in agents]),
            np.array([each.velocity for each in agents]))
