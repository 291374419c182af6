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
Replay memory: a ring of states with the return that followed them.

Paper algorithm 1 (memory E); states are kept as network inputs.
"""

import numpy as np

from wallnav_ros.policy import features as feature_set
from wallnav_ros.policy.lookahead import MOST_AGENTS


class ReplayMemory:
    """The last `capacity` states, as `sight` tells them, with their target values."""

    def __init__(self, capacity, sight):
        self.mirror = sight.mirror
        self.own = np.zeros((capacity, sight.own), np.float32)
        self.agents = np.zeros((capacity, MOST_AGENTS, sight.agent), np.float32)
        self.present = np.zeros((capacity, MOST_AGENTS), bool)
        self.target = np.zeros(capacity, np.float32)
        self.stored = 0

    def __len__(self):
        """Return how many states are held."""
        return min(self.stored, len(self.target))

    def add(self, features, target):
        """Store states given as Features with leading axis (S,) and their targets (S,)."""
        count, agents = features.present.shape
        if agents > MOST_AGENTS:
            raise ValueError(f'{agents} agents at once, the memory holds {MOST_AGENTS}')
        rows = (self.stored + np.arange(count)) % len(self.target)
        self.own[rows] = np.concatenate((features.robot, features.walls), axis=-1)
        self.agents[rows] = 0.0
        self.agents[rows, :agents] = features.agents
        self.present[rows] = False
        self.present[rows, :agents] = features.present
        self.target[rows] = target
        self.stored += count

    def sample(self, rng, count):
        """
        Return own, agents, present and target of `count` random states.

        Half of them are mirrored left to right: the world has no preferred side.
        """
        rows = rng.integers(len(self), size=count)
        own, agents = self.own[rows], self.agents[rows]
        half = count // 2
        self.mirror(own[:half], agents[:half])
        return own, agents, self.present[rows], self.target[rows]

    def state(self):
        """Return what a checkpoint needs, as {name: array}."""
        held = slice(0, len(self))
        return {'own': self.own[held], 'agents': self.agents[held],
                'present': self.present[held], 'target': self.target[held],
                'stored': np.array(self.stored)}

    def restore(self, state):
        """Take up a checkpoint's `state`."""
        count = len(state['target'])
        for name in ('own', 'agents', 'present', 'target'):
            getattr(self, name)[:count] = state[name]
        self.stored = int(state['stored'])


def mirror(own, agents):
    """Reflect states in place across the line to the goal (y changes sign)."""
    robot = len(feature_set.ROBOT)
    own[:, feature_set.ROBOT.index('heading_sin')] *= -1.0
    # Ray k looks towards 2 pi k / n: its mirror image is ray n - k.
    own[:, robot + 1:] = own[:, :robot:-1].copy()
    for name in ('y', 'vy'):
        agents[..., feature_set.AGENT.index(name)] *= -1.0
