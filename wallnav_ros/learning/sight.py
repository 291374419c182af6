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
What our network is told of an episode: robot, agents and walls, as in `policy.features`.

Every kind of network has such a sight; `evaluation.joint_state` is that of the baselines.
"""

from dataclasses import dataclass

from wallnav_ros.learning.memory import mirror
from wallnav_ros.policy import features
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.simulation.rollout import GreedyPolicy


@dataclass(frozen=True)
class WallSight:
    """Sees everything; own and agent are the widths of what a network reads."""

    own = len(features.ROBOT) + features.WALL_RAYS
    agent = len(features.AGENT)
    mirror = staticmethod(mirror)
    describe = staticmethod(features.describe)

    def view(self, batch):
        """Return the EpisodeBatch as it is seen."""
        return batch

    def features(self, robot, agents, walls):
        """Return the Features (S,) of states in one world."""
        return features.extract(robot, agents, features.agent_clearance(agents, walls), walls)

    def lookahead(self, value, actions, rule, motion=None):
        """Return the Lookahead that decides with `value`, and a MotionModel if there is one."""
        return Lookahead(value, actions, rule, motion)

    def policy(self, lookahead):
        """Return the policy that follows such a Lookahead greedily."""
        return GreedyPolicy(lookahead)
