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
What comes of every action: where it leads, what it earns, and the chance of touching nobody.

Paper sections 4 and 5; people go the ways that a motion model foresees.
"""

from dataclasses import dataclass, replace

import numpy as np

from wallnav_ros.policy.motion import constant_velocity, Forecast
from wallnav_ros.policy.rewards import (
    Gains, reward_terms, someone_passing, StepFacts, total, warning_radius)
from wallnav_ros.world.geometry import drive_unicycle, least_distance, lengths
from wallnav_ros.world.state import Agents

GOAL_TOLERANCE = 0.2      # m, distance at which the goal counts as reached
CAUTION_COST = 1.0        # per step, of brushing past a walking agent
SHARP_TURN = 0.6          # rad/s, above which a turn may be held for longer
NO_MATTER = 3.0           # standard deviations beyond which an agent is not expected


@dataclass(frozen=True)
class Rule:
    """
    How far an action is followed before the value network is asked.

    horizons: steps; the scores of several horizons are averaged. (1,) is the paper's rule.
    caution: s; passing a walking agent closer than this times its speed costs up to
    CAUTION_COST a step, since it may turn before then. 0 is the paper's rule.
    aversion: what a foreseen contact costs, times its chance, besides what is lost by it.
    turns: steps for which the turn of an action is held before the heading is; the best of them
    counts. (1,) is the paper's rule.
    time_step: s; discount: gamma of the paper; reward: R1 to R4.
    """

    horizons: tuple = (1,)
    time_step: float = 0.25
    discount: float = 0.9
    reward: str = 'R4'
    caution: float = 0.0
    aversion: float = 0.0
    turns: tuple = (1,)


@dataclass(frozen=True)
class Rollout:
    """
    Every way of P followed for H steps from B states.

    action: (P,) the action each way begins with; the ways of rule.turns[0] come first, in the
    order of the actions.
    poses: (B, P, H, 3); rewards: (B, P, H); over: (B, P, H) bool, the goal reached or a
    collision at or before that step; collided: (B, P) bool, a collision in the first step.
    survival: (B, P, H), the chance that no agent has been touched up to the end of that step.
    crowd: Agents (B, H, N) after each step, each on its likeliest way.
    """

    action: np.ndarray
    poses: np.ndarray
    rewards: np.ndarray
    over: np.ndarray
    collided: np.ndarray
    survival: np.ndarray
    crowd: Agents

    def along(self, way):
        """Return the Rollout of the ways `way` (B, A) alone, one for every action."""
        chosen = np.arange(len(way))[:, None], way
        return Rollout(np.arange(way.shape[1]), *(part[chosen] for part in (
            self.poses, self.rewards, self.over, self.collided, self.survival)), self.crowd)


def roll_out(rule, actions, motion, robot, agents, walls):
    """
    Return the Rollout of every way that begins with an action of an ActionSet.

    A way turns for one of `rule.turns` steps, then keeps the heading.
    `robot` has leading axis (B,), `agents` (B, N), `walls` is their common DistanceField;
    motion: the MotionModel that foresees the agents, None to let them keep their velocity.
    """
    steps = max(rule.horizons)
    action, turns = _ways(rule, actions)
    commands = actions.commands(robot.preferred_speed)[:, action]
    speed, turn_rate = commands[..., 0], commands[..., 1]
    poses = _drive(robot.pose, speed, turn_rate, turns, steps, rule.time_step)
    position = poses[..., :2]
    before = np.concatenate(
        (np.broadcast_to(robot.position[:, None, None], position[:, :, :1].shape),
         position[:, :, :-1]), axis=2)
    forecast = _foresee(rule, motion, agents, walls, steps)
    near, ways = _near(rule, robot, agents, forecast)
    gaps, survival = _contacts(robot, near, ways, before, position)
    collided, facts = _facts(robot, agents, walls, before, position, speed, gaps)
    if rule.reward == 'R3':
        facts = replace(facts, warning_depth=_warning_depth(agents, position, rule.time_step))
    rewards = total(reward_terms(rule.reward, facts))
    rewards -= _brushes(rule.caution, near.velocity, gaps)
    over = np.logical_or.accumulate(facts.reached | collided, axis=-1)
    rewards[..., 1:][over[..., :-1]] = 0.0
    crowd = _later(agents, forecast, rule.time_step)
    return Rollout(action, poses, rewards, over, collided[..., 0], survival, crowd)


def _ways(rule, actions):
    """Return the action (P,) and the steps of turning (P,) of every way."""
    every = np.arange(len(actions.speed))
    # To turn slightly for longer is no other way than to turn once, and costs as much to look at.
    sharp = np.flatnonzero(np.abs(actions.turn_rate) > SHARP_TURN)
    rows = [every] + [sharp] * (len(rule.turns) - 1)
    return np.concatenate(rows), np.repeat(rule.turns, [len(part) for part in rows])


def _drive(pose, speed, turn_rate, turns, steps, time_step):
    """Return poses (B, P, H, 3) of ways that turn at `turn_rate` (B, P) for `turns` (P,) steps."""
    pose, poses = pose[:, None], np.empty((*speed.shape, steps, 3))
    longest = min(turns.max(), steps)
    for number in range(longest):
        pose = drive_unicycle(pose, speed, np.where(turns > number, turn_rate, 0.0), time_step)
        poses[:, :, number] = pose
    # From then on every way is straight.
    further = (speed * time_step)[..., None] * np.arange(1, steps - longest + 1)
    poses[:, :, longest:, 0] = pose[..., 0, None] + further * np.cos(pose[..., 2, None])
    poses[:, :, longest:, 1] = pose[..., 1, None] + further * np.sin(pose[..., 2, None])
    poses[:, :, longest:, 2] = pose[..., 2, None]
    return poses


def _foresee(rule, motion, agents, walls, steps):
    """Return the Forecast of all agents."""
    if motion is None or not agents.radius.shape[1]:
        return constant_velocity(agents, steps, rule.time_step)
    return motion.forecast(agents, walls, steps, rule.time_step)


def _near(rule, robot, agents, forecast):
    """
    Return the Agents (B, M) that matter, M the most in any state, and their Forecast.

    Whoever no robot can come near to while they are foreseen, at its preferred speed, does not;
    they would cost time, and padding stands for them.
    """
    offset = forecast.position - robot.position[:, None, None, None]
    room = lengths(offset) - NO_MATTER * forecast.spread
    room -= (robot.preferred_speed[:, None] * rule.time_step)[..., None, None] * np.arange(
        1, forecast.position.shape[-2] + 1)
    speed = lengths(agents.velocity)
    wanted = (robot.radius[:, None] + agents.radius + Gains().comfort_distance
              + (rule.caution + rule.time_step) * speed)
    matters = agents.present & (room.min(axis=(-1, -2)) < wanted)
    most = matters.sum(axis=1).max(initial=0)
    rows = np.arange(len(matters))[:, None], np.argsort(~matters, axis=1, kind='stable')[:, :most]
    return (Agents(agents.position[rows], agents.velocity[rows], agents.radius[rows],
                   matters[rows]),
            Forecast(*(part[rows] for part in vars(forecast).values())))


def _warning_depth(agents, position, time_step):
    """Return d - r_wz - r_a (B, A, H) in metres, the least over walking agents (eq. 5)."""
    speed = np.linalg.norm(agents.velocity, axis=-1)
    ahead = time_step * np.arange(1, position.shape[2] + 1)[:, None, None]
    there = agents.position[:, None] + ahead * agents.velocity[:, None]
    distance = np.linalg.norm(position[..., None, :] - there[:, None], axis=-1)
    depth = distance - (warning_radius(speed) + agents.radius)[:, None, None]
    walks = (agents.present & (speed > 0.0))[:, None, None]
    return np.where(walks, depth, np.inf).min(axis=-1, initial=np.inf)


def _brushes(caution, velocity, gaps):
    """Return the cost (B, A, H) of `gaps` too close to agents of `velocity` (B, N, 2)."""
    if not caution:
        return 0.0
    speed = np.linalg.norm(velocity, axis=-1)
    margin = (caution * speed)[:, None, None]
    lack = np.clip((margin - gaps) / np.maximum(margin, 1e-9), 0.0, 1.0)
    return CAUTION_COST * np.where(margin > 0.0, lack, 0.0).max(axis=-1, initial=0.0)


def _facts(robot, agents, walls, before, after, speed, gaps):
    """Return collisions (B, A, H) and the StepFacts of moving from `before` to `after`."""
    distance = lengths(robot.goal[:, None, None] - after)
    start = np.broadcast_to(lengths(robot.goal - robot.position)[:, None, None],
                            distance[..., :1].shape)
    came_from = np.concatenate((start, distance[..., :-1]), axis=-1)
    agent_gap = gaps.min(axis=-1, initial=np.inf)
    # The wall is felt half way too: a step is longer than a thin wall is thick.
    wall_gap = (walls.at(np.stack((after, 0.5 * (before + after)))).min(axis=0)
                - robot.radius[:, None, None])
    passing = someone_passing(robot, agents)[:, None] & (speed == 0.0)
    final = (robot.beyond == 0.0)[:, None, None]
    collided = (agent_gap <= 0.0) | (wall_gap <= 0.0)
    return collided, StepFacts(
        reached=(distance < GOAL_TOLERANCE) & final & ~collided, agent_gap=agent_gap,
        progress=came_from - distance, moved=lengths(after - before),
        yielding=passing[..., None], wall_gap=wall_gap)


def _later(agents, forecast, time_step):
    """Return the Agents (B, H, N) that `agents` (B, N) become on their likeliest ways."""
    likeliest = forecast.chance.argmax(axis=-1)[..., None, None, None]
    way = np.take_along_axis(forecast.position, likeliest, axis=2)[:, :, 0]       # (B, N, H, 2)
    before = np.concatenate((agents.position[:, :, None], way[:, :, :-1]), axis=2)
    shape = (way.shape[0], way.shape[2], way.shape[1])
    return Agents(way.swapaxes(1, 2), ((way - before) / time_step).swapaxes(1, 2),
                  np.broadcast_to(agents.radius[:, None], shape),
                  np.broadcast_to(agents.present[:, None], shape))


def _contacts(robot, agents, forecast, before, after):
    """
    Return gaps (B, A, H, N) to each agent's likeliest way, and the survival (B, A, H).

    before, after: (B, A, H, 2), where each step of the robot begins and ends. A gap is the
    least on a step, in metres, inf for padding.
    """
    moves = []
    for axis in (0, 1):
        # Seen from the robot, single precision is exact to a micrometre, and twice as quick.
        origin = robot.position[:, axis]
        # Axes (B, H, N, K, A), actions last: NumPy is quick along a long last axis.
        start, end = (np.ascontiguousarray(
            part[..., axis].swapaxes(1, 2) - origin[:, None, None], np.float32)[:, :, None, None]
            for part in (before, after))
        there = (forecast.position[..., axis].transpose(0, 3, 1, 2)
                 - origin[:, None, None, None]).astype(np.float32)
        now = (agents.position[:, None, :, None, axis]
               - origin[:, None, None, None]).astype(np.float32)
        was = np.concatenate((np.broadcast_to(now, there[:, :1].shape), there[:, :-1]), axis=1)
        moves.append((start - was[..., None], (end - start) - (there - was)[..., None]))
    gap = least_distance(*moves[0], *moves[1])
    gap -= (robot.radius[:, None] + agents.radius)[:, None, :, None, None].astype(np.float32)
    np.copyto(gap, np.inf, where=~agents.present[:, None, :, None, None])
    missed = (1.0 - forecast.hit(gap)).prod(axis=2)
    likely = gap[np.arange(len(gap))[:, None], :, np.arange(gap.shape[2]),
                 forecast.chance.argmax(axis=-1)]
    # One contact that is foreseen over several steps is still one contact.
    return likely.transpose(0, 3, 2, 1), np.minimum.accumulate(missed, axis=1).swapaxes(1, 2)
