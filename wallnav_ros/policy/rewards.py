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
The rewards R1, R2, R3 and R4, each as named terms whose sum is the reward.

Paper section 5 (equations 2 to 5 and algorithm 2).
"""

from dataclasses import dataclass, field

import numpy as np

REWARDS = ('R1', 'R2', 'R3', 'R4')
PUSH_DISTANCE = 0.03         # m per step, below which the robot counts as stopped
YIELD_RANGE = 2.0            # m, gap within which stopping for a walking agent is yielding
YIELD_SPEED = 0.1            # m/s, approach speed above which that agent is passing
WALL_MARGIN = 0.1            # m, wall gap below which R_wmin penalises
WALL_LIMIT = 13.0            # m, distance to the farthest wall beyond which the map is left


@dataclass(frozen=True)
class Gains:
    """The numbers of section 5; R3 replaces three of them."""

    goal: float = 10.0
    collision: float = -0.5
    discomfort: float = 0.5
    comfort_distance: float = 0.2
    progress: float = 0.01
    yielding: float = 0.02
    push: float = 0.01
    wall_collision: float = -0.5
    wall_near: float = -0.5
    wall_clear: float = 0.01
    wall_far: float = -0.05
    wall_end: float = 0.1


GAINS_R3 = Gains(collision=-0.1, discomfort=0.25)


@dataclass(frozen=True)
class StepFacts:
    """
    What happened during one step, as arrays that broadcast against each other.

    reached: bool, the goal was reached. agent_gap: m, least gap to any agent during the step
    (inf without agents; <= 0 is a collision). progress: m gained towards the goal.
    moved: m travelled. yielding: bool, stopped while an agent passes. wall_gap: m, least
    distance to a wall less the robot's radius (<= 0 is a collision). farthest_wall: m.
    ended: bool, the episode ended. warning_depth: m, d - r_wz - r_a of the warning zone the
    robot is deepest in (>= 0 outside all zones).
    """

    reached: np.ndarray
    agent_gap: np.ndarray
    progress: np.ndarray
    moved: np.ndarray
    yielding: np.ndarray
    wall_gap: np.ndarray
    farthest_wall: np.ndarray = 0.0
    ended: np.ndarray = False
    warning_depth: np.ndarray = field(default=np.inf)


def reward_terms(name, facts, gains=None):
    """
    Return the terms of reward `name` as a dictionary of arrays; their sum is the reward.

    `gains` defaults to the paper's for that reward. Raises ValueError on an unknown name.
    """
    if name not in REWARDS:
        raise ValueError(f'unknown reward {name!r}, choose one of {", ".join(REWARDS)}')
    gains = gains or (GAINS_R3 if name == 'R3' else Gains())
    collided = facts.agent_gap <= 0.0
    uneasy = (facts.agent_gap > 0.0) & (facts.agent_gap < gains.comfort_distance)
    terms = {
        'R_g': np.where(facts.reached, gains.goal, 0.0),
        'R_c': np.where(collided, gains.collision, 0.0),
        'R_d': np.where(uneasy, gains.discomfort * (facts.agent_gap - gains.comfort_distance),
                        0.0),
    }
    progress = gains.progress * facts.progress
    if name in ('R1', 'R3'):
        if name == 'R3':
            terms['R_wz'] = _warning(facts)
        terms['R_hg'] = progress
        return _first_that_applies(terms, [facts.reached, collided, uneasy]
                                   + ([facts.warning_depth < 0.0] if name == 'R3' else []))
    terms['R_hg'] = progress + np.zeros_like(terms['R_g'])
    terms['R_s'] = np.where(facts.yielding, gains.yielding, 0.0)
    if name == 'R4':
        terms['R_pf'] = np.where(facts.moved > PUSH_DISTANCE, gains.push, -gains.push)
        terms['R_wc'] = np.where(facts.wall_gap <= 0.0, gains.wall_collision, 0.0)
        terms['R_wmin'] = np.where(facts.wall_gap < WALL_MARGIN, gains.wall_near,
                                   gains.wall_clear)
        terms['R_wmax'] = np.where(facts.farthest_wall > WALL_LIMIT, gains.wall_far,
                                   np.where(facts.ended, gains.wall_end, 0.0))
    return terms


def total(terms):
    """Return the reward: the sum of its named terms."""
    return sum(terms.values())


def someone_passing(robot, agents):
    """
    Return (...) whether an agent walks past close by, so that stopping now would yield to it.

    `robot` has leading axes (...), `agents` (..., N): an agent passes when its gap is below
    YIELD_RANGE and it approaches faster than YIELD_SPEED.
    """
    offset = robot.position[..., None, :] - agents.position
    distance = np.hypot(offset[..., 0], offset[..., 1])
    gap = distance - agents.radius - np.asarray(robot.radius)[..., None]
    approach = np.sum(offset * agents.velocity, axis=-1) / np.maximum(distance, 1e-6)
    passing = agents.present & (gap < YIELD_RANGE) & (approach > YIELD_SPEED)
    return passing.any(axis=-1)


def warning_radius(speed):
    """Return the radius r_wz (...) in metres of the zone around an agent of `speed` (...) m/s."""
    return 0.3 + 0.5 * np.asarray(speed)


def _warning(facts):
    depth = np.minimum(facts.warning_depth, 0.0)
    return np.where(facts.warning_depth < 0.0, 0.2 * (np.exp(depth) - 0.3), 0.0)


def _first_that_applies(terms, applies):
    """Keep, per element, only the first term whose condition holds, else the last term."""
    kept, free = {}, True
    for (name, value), condition in zip(terms.items(), [*applies, True]):
        kept[name] = np.where(free & np.asarray(condition), value, 0.0)
        free = free & ~np.asarray(condition)
    return kept
