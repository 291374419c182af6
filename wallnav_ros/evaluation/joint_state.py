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
What a network that sees no walls is told: robot and agents, now and a few steps ago.

The joint state of Chen et al. (CADRL, SARL) and, with earlier frames, of Yang et al. (ST2).
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.policy.features import AGENT_SCALE, Features, GOAL_LIMIT, GOAL_SCALE
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.simulation.rollout import GreedyPolicy
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import rotate
from wallnav_ros.world.state import Agents, Robot

VERSION = 1            # raised when a column changes meaning: older weights are then refused
ROBOT = ('goal_distance', 'preferred_speed', 'radius', 'heading_cos', 'heading_sin', 'speed')
AGENT = ('x', 'y', 'vx', 'vy', 'radius', 'reach', 'gap')
OPEN = DistanceField.empty()


@dataclass(frozen=True)
class FollowedAgents(Agents):
    """
    Agents and what they did before.

    past: (..., K, N, 4) positions in metres and velocities in m/s, the latest first.
    """

    past: np.ndarray = None


class FollowedBatch:
    """An EpisodeBatch whose agents come with their last `count` steps."""

    def __init__(self, batch, count):
        self.episodes = batch.episodes
        # A baseline heads for the goal itself: a way around walls would tell of them.
        self.robot = self.guided = batch.robot
        self._batch = batch
        self._count = count

    def agents(self, rows):
        """Return the FollowedAgents (len(rows), N)."""
        now = self._batch.agents(rows)
        past = [_frame(self._batch.past(rows, 1 + number)) for number in range(self._count)]
        past = np.stack(past, axis=1) if past else _frame(now)[:, None][:, :0]
        return FollowedAgents(**vars(now), past=past)


@dataclass(frozen=True)
class JointSight:
    """
    The sight of a baseline: no walls, and the agents of `frames` steps, this one included.

    own and agent are the widths of what a network reads; an agent's columns are those of AGENT
    once per frame, the latest first, all in the robot's present frame.
    """

    frames: int = 1
    own = len(ROBOT)

    @property
    def agent(self):
        """Return how many columns an agent has."""
        return self.frames * len(AGENT)

    def describe(self):
        """Return what a weight file must have been trained on to be used with this sight."""
        return {'version': VERSION, 'robot': list(ROBOT), 'agent': list(AGENT),
                'frames': self.frames}

    def view(self, batch):
        """Return the EpisodeBatch as it is seen."""
        return FollowedBatch(batch, self.frames - 1)

    def features(self, robot, agents, walls):
        """Return the Features (S,) of states; their walls are empty."""
        frames = np.concatenate((_frame(agents)[:, None], agents.past), axis=1)
        return joint_state(robot, frames, agents.radius, agents.present)

    def mirror(self, own, agents):
        """Reflect states in place across the line to the goal (y changes sign)."""
        own[:, ROBOT.index('heading_sin')] *= -1.0
        for name in ('y', 'vy'):
            agents[..., AGENT.index(name)::len(AGENT)] *= -1.0

    def lookahead(self, value, actions, rule, motion=None):
        """Return the Lookahead that decides with `value`; baselines foresee constant velocity."""
        return BlindLookahead(value, actions, rule, self)

    def policy(self, lookahead):
        """Return the policy that follows such a Lookahead greedily."""
        return BlindPolicy(lookahead)


class BlindLookahead(Lookahead):
    """Looks ahead as ours does, in a world without walls."""

    def __init__(self, value, actions, rule, sight):
        super().__init__(value, actions, rule)
        self.sight = sight

    def evaluate(self, robot, agents, walls):
        """Return scores (B, A) and the Rollout of every action; `walls` are not looked at."""
        return super().evaluate(robot, agents, OPEN)

    def _leaves(self, robot, agents, walls, rollout):
        """Return a function to the Features after horizon `number` of `action` in `state`."""
        commands = self.actions.commands(robot.preferred_speed)[:, rollout.action]
        horizons = np.array(self.rule.horizons)
        frames = np.stack([self._frames(agents, horizon) for horizon in horizons], axis=1)

        def features_of(state, action, number):
            later = Robot(rollout.poses[state, action, horizons[number] - 1],
                          commands[state, action], robot.goal[state], robot.radius[state],
                          robot.preferred_speed[state])
            return joint_state(later, frames[state, number], agents.radius[state],
                               agents.present[state])
        return features_of

    def _frames(self, agents, horizon):
        """Return the agents (B, frames, N, 4) of the steps up to `horizon` ahead, latest first."""
        ahead = self.rule.time_step * np.arange(horizon, 0, -1)[:, None, None]
        velocity = np.broadcast_to(agents.velocity[:, None],
                                   (len(agents.velocity), horizon, *agents.velocity.shape[1:]))
        foreseen = np.concatenate((agents.position[:, None] + ahead * velocity, velocity), axis=-1)
        return np.concatenate((foreseen, _frame(agents)[:, None], agents.past),
                              axis=1)[:, :self.sight.frames]


class BlindPolicy(GreedyPolicy):
    """Follows a BlindLookahead greedily."""

    def __call__(self, batch, rows, field):
        """Return the index (len(rows),) of the action for each of `rows` of `batch`."""
        return super().__call__(self.lookahead.sight.view(batch), rows, field)


def joint_state(robot, frames, radius, present):
    """
    Return the Features (S,) of robots (S,) and agents in `frames` (S, F, N, 4).

    frames: positions and velocities, the present first; radius, present: (S, N).
    """
    to_goal = robot.goal - robot.position
    distance = np.hypot(to_goal[:, 0], to_goal[:, 1])
    bearing = np.arctan2(to_goal[:, 1], to_goal[:, 0])
    heading = robot.pose[:, 2] - bearing
    own = np.stack((np.minimum(distance, GOAL_LIMIT) / GOAL_SCALE, robot.preferred_speed,
                    robot.radius, np.cos(heading), np.sin(heading), robot.velocity[:, 0]), axis=-1)
    turn = -bearing[:, None, None]
    offset = rotate(frames[..., :2] - robot.position[:, None, None], turn)
    velocity = rotate(frames[..., 2:], turn)
    radius = np.broadcast_to(radius[:, None], offset.shape[:-1])
    reach = radius + np.asarray(robot.radius)[:, None, None]
    gap = np.hypot(offset[..., 0], offset[..., 1]) - reach
    rows = np.stack((offset[..., 0] / AGENT_SCALE, offset[..., 1] / AGENT_SCALE, velocity[..., 0],
                     velocity[..., 1], radius, reach, gap / AGENT_SCALE), axis=-1)
    rows = np.moveaxis(np.where(present[:, None, :, None], rows, 0.0), 1, 2)
    columns = rows.shape[2] * rows.shape[3]
    return Features(own.astype(np.float32), np.zeros((len(own), 0), np.float32),
                    rows.reshape(*rows.shape[:2], columns).astype(np.float32), present)


def _frame(agents):
    return np.concatenate((agents.position, agents.velocity), axis=-1)
