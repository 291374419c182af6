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
Decision by looking ahead: reward along the way plus the discounted value at its end.

Paper section 4; horizons longer than one step hold the heading an action turns to.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.policy import features
from wallnav_ros.policy.actions import make_actions, STOP
from wallnav_ros.policy.motion import WALKING
from wallnav_ros.policy.outcomes import roll_out, Rule
from wallnav_ros.world.geometry import lengths
from wallnav_ros.world.state import Agents, Robot

MOST_AGENTS = 16          # the nearest so many are looked at: as many as training knows
CONTENDERS = 16           # actions that are looked at over every horizon, not over one alone
CLEAR = 0.9               # chance of touching nobody, above which a way needs no other way out
WAITING = 5.0             # m, within which a robot may wait for somebody who walks


@dataclass(frozen=True)
class Decision:
    """
    One decision.

    command: (2,) m/s and rad/s. action: its index. safe: False when every action is predicted
    to collide within one step (the command then stops). path: (K, 3) poses predicted along
    the action, in the observation's frame. scores: (A,), -inf where a collision is predicted
    within one step, where one horizon says that CONTENDERS others are better, and for STOP
    where nobody walks within WAITING metres.
    """

    command: np.ndarray
    action: int
    safe: bool
    path: np.ndarray
    scores: np.ndarray


class Lookahead:
    """
    Chooses among the actions with a value function.

    value: callable from Features with leading axis (S,) to values (S,); NumPy or a wrapped
    torch network alike. motion: the MotionModel that says where agents will be; without one
    they are taken to keep their velocity, as in the paper.
    """

    def __init__(self, value, actions, rule=Rule(), motion=None):
        self.value = value
        self.actions = actions
        self.rule = rule
        self.motion = motion

    @classmethod
    def from_weights(cls, value_function, horizons=None, caution=None, constant_velocity=False,
                     turns=None):
        """
        Return the Lookahead that weights were trained for.

        `horizons`, `caution`, `constant_velocity` (agents are foreseen to keep theirs) and
        `turns` override its rule: (1,), 0, True and (1,) give the paper's.
        """
        about = value_function.metadata
        own = about['decision']
        rule = Rule(tuple(horizons or own['horizons']), about['time_step'], about['discount'],
                    about['reward'], own['caution'] if caution is None else caution,
                    0.0 if constant_velocity else own.get('aversion', 0.0),
                    tuple(turns or own.get('turns', (1,))))
        motion = None if constant_velocity else value_function.motion
        return cls(value_function, make_actions(**about['actions']), rule, motion)

    def decide(self, observation):
        """Return the Decision for one Observation."""
        robot, agents = observation.robot, _nearest(observation.agents, observation.robot)
        batch = Robot(*(np.asarray(part)[None] for part in vars(robot).values()))
        crowd = Agents(*(part[None] for part in vars(agents).values()))
        scores, rollout = self.evaluate(batch, crowd, observation.walls)
        scores = np.where(rollout.collided[0], -np.inf, scores[0])
        safe = bool(np.isfinite(scores).any())
        action = int(scores.argmax()) if safe else STOP
        command = self.actions.commands(robot.preferred_speed)[action]
        path = np.concatenate((robot.pose[None], rollout.poses[0, action]))
        return Decision(command, action, safe, path, scores)

    def evaluate(self, robot, agents, walls):
        """
        Return the score (B, A) of every action in B states, and the Rollout behind it.

        `robot` has leading axis (B,), `agents` (B, N), `walls` is their common DistanceField.
        """
        rule = self.rule
        rollout = self.roll_out(robot, agents, walls)
        horizons = np.array(rule.horizons)
        step_discount = rule.discount ** (rule.time_step * robot.preferred_speed)
        powers = step_discount[:, None, None] ** np.arange(horizons.max() + 1)
        before = np.concatenate((np.ones_like(rollout.survival[..., :1]),
                                 rollout.survival[..., :-1]), axis=-1)
        expected = before * rollout.rewards - rule.aversion * (before - rollout.survival)
        gained = np.cumsum(powers[..., :-1] * expected, axis=-1)[..., horizons - 1]
        weight = powers[..., horizons] * rollout.survival[..., horizons - 1]
        looked_at = self._worth_asking(rollout)
        asked = ~rollout.over[..., horizons - 1] & looked_at[..., None]
        # One look ahead tells which actions are worth the others.
        one = np.zeros_like(asked)
        one[..., len(horizons) // 2] = True
        leaves = self._leaves(robot, agents, walls, rollout)
        worth = gained + weight * self._values(leaves, asked & one)
        scores = np.where(looked_at, worth[..., len(horizons) // 2], -np.inf)
        if len(horizons) > 1:
            promising = _best(np.where(rollout.collided, -np.inf, scores), CONTENDERS)[..., None]
            worth += weight * self._values(leaves, asked & ~one & promising)
            scores = np.where(promising[..., 0], worth.mean(axis=-1), -np.inf)
        if len(rule.turns) > 1:
            scores, rollout = self._best_ways(scores, rollout)
        # Where nobody walks, waiting changes nothing: its value is that of waiting for ever.
        scores[~_somebody_walks(robot, agents), STOP] = -np.inf
        return scores, rollout

    def _worth_asking(self, rollout):
        """Return (B, P) which ways are looked at: those that turn on only where they lead out."""
        count = len(self.actions.speed)
        clear = ~rollout.over[:, :count, -1] & (rollout.survival[:, :count, -1] > CLEAR)
        every = np.arange(len(rollout.action))
        return (every < count) | ~clear[:, rollout.action]

    def _best_ways(self, scores, rollout):
        """Return (B, A) the best of `scores` (B, P) of each action, and the Rollout along it."""
        count, every = len(self.actions.speed), np.arange(len(rollout.action))
        # Of the ways of an action the one that turns for least comes first, and wins a tie.
        order = np.lexsort((every, rollout.action))
        first = np.searchsorted(rollout.action[order], np.arange(count))
        best = np.maximum.reduceat(scores[:, order], first, axis=1)
        rank = np.where(scores == best[:, rollout.action], every, len(every))
        way = np.minimum.reduceat(rank[:, order], first, axis=1)
        return best, rollout.along(way)

    def _values(self, leaves, asked):
        """Return the values (B, A, K) at the ends of horizons that are `asked`, 0 elsewhere."""
        value = np.zeros(asked.shape)
        rows = np.nonzero(asked)
        if len(rows[0]):
            # All horizons in one question: each would cost the network's overhead again.
            value[rows] = self.value(leaves(*rows))
        return value

    def roll_out(self, robot, agents, walls):
        """Return the Rollout of every action from B states, as in `evaluate`."""
        return roll_out(self.rule, self.actions, self.motion, robot, agents, walls)

    def _leaves(self, robot, agents, walls, rollout):
        """Return a function to the Features after horizon `number` of `action` in `state`."""
        commands = self.actions.commands(robot.preferred_speed)[:, rollout.action]
        steps = np.array(self.rule.horizons) - 1
        crowd = Agents(rollout.crowd.position[:, steps], rollout.crowd.velocity[:, steps],
                       rollout.crowd.radius[:, steps], rollout.crowd.present[:, steps])
        clearance = features.agent_clearance(crowd, walls)

        def features_of(state, action, number):
            later = Robot(rollout.poses[state, action, steps[number]], commands[state, action],
                          robot.goal[state], robot.radius[state], robot.preferred_speed[state],
                          robot.beyond[state])
            around = Agents(crowd.position[state, number], crowd.velocity[state, number],
                            agents.radius[state], agents.present[state])
            return features.extract(later, around, clearance[state, number], walls)
        return features_of


def _best(scores, count):
    """Return (B, A) which of `scores` (B, A) are among the `count` best of their state."""
    least = np.partition(scores, -min(count, scores.shape[1]), axis=1)[:, -count:].min(
        axis=1, keepdims=True)
    return (scores >= least) & np.isfinite(scores)


def _nearest(agents, robot):
    """Return the MOST_AGENTS of `agents` (N,) whose gap to the robot is least."""
    if len(agents.radius) <= MOST_AGENTS:
        return agents
    gap = np.linalg.norm(agents.position - robot.position, axis=1) - agents.radius
    rows = np.sort(np.argsort(np.where(agents.present, gap, np.inf), kind='stable')[:MOST_AGENTS])
    return Agents(*(part[rows] for part in vars(agents).values()))


def _somebody_walks(robot, agents):
    """Return (B,) whether anybody who walks is within WAITING metres, worth waiting for."""
    near = lengths(agents.position - robot.position[:, None]) < WAITING
    return (agents.present & near & (lengths(agents.velocity) > WALKING)).any(axis=1)
