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
Gather experience: run episodes side by side and turn them into states with returns.

Paper algorithm 1 (lines that fill E); returns are lambda-returns cut at exploratory actions.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.learning.sight import WallSight
from wallnav_ros.policy.features import Features
from wallnav_ros.policy.rewards import reward_terms, total
from wallnav_ros.simulation.batch import EpisodeBatch, OUTCOMES, RUNNING


@dataclass(frozen=True)
class Step:
    """One step of all running episodes: rows (S,), what was seen, done, paid and expected."""

    rows: np.ndarray
    features: Features
    reward: np.ndarray
    expected: np.ndarray
    explored: np.ndarray


@dataclass(frozen=True)
class Drive:
    """How one episode went: its outcome, s, m and {reward term: sum over the episode}."""

    outcome: str
    time: float
    path_length: float
    terms: dict


class Explorer:
    """Acts greedily on a Lookahead, at random with probability `epsilon`."""

    def __init__(self, lookahead, epsilon, rng):
        self.lookahead = lookahead
        self.actions = lookahead.actions
        self.epsilon = epsilon
        self.rng = rng

    def act(self, batch, rows, field):
        """Return actions (S,), the value (S,) expected of the state, and what was random."""
        scores, _ = self.lookahead.evaluate(batch.guided(rows), batch.agents(rows), field)
        action = scores.argmax(axis=1)
        explored = self.rng.random(len(rows)) < self.epsilon
        chance = self.rng.integers(scores.shape[1], size=len(rows))
        return np.where(explored, chance, action), scores.max(axis=1), explored


class Demonstrator:
    """Acts as the ORCA policy does; its states have no expected value."""

    def __init__(self, policy):
        self.policy = policy
        self.actions = policy.actions

    def act(self, batch, rows, field):
        """Return actions (S,), zeros and False throughout: nothing is bootstrapped."""
        action = self.policy(batch, rows, field)
        return action, np.zeros(len(rows)), np.zeros(len(rows), dtype=bool)


def gather(episodes, actor, rule, trace, sight=WallSight()):
    """
    Run `episodes` to their ends; return Features (S,), returns (S,) and a Drive for each.

    `sight` says what of a state is kept, and what the actor sees of the episodes.
    `trace` is lambda: 1 pays what really followed, 0 what the next state is expected to give.
    An exploratory action says nothing of the state it was taken in, so that state is left out
    and the return of those before it ends in the value expected there.
    """
    batch = EpisodeBatch(episodes, rule.time_step)
    view = sight.view(batch)
    every = np.arange(len(episodes))
    preferred_speed = batch.robot(every).preferred_speed
    commands_of = actor.actions.commands(preferred_speed)
    steps, sums = [], {}
    while (batch.outcome == RUNNING).any():
        running = batch.outcome == RUNNING
        action = np.zeros(len(episodes), dtype=int)
        seen = []
        for rows, field in batch.groups():
            state = sight.features(view.guided(rows), view.agents(rows), field)
            action[rows], expected, explored = actor.act(view, rows, field)
            seen.append((rows, state, expected, explored))
        facts = batch.step(commands_of[every, action])
        terms = reward_terms(rule.reward, facts)
        reward = total(terms)
        for name, value in terms.items():
            sums[name] = sums.get(name, 0.0) + np.where(running, value, 0.0)
        steps.extend(Step(rows, state, reward[rows], expected, explored)
                     for rows, state, expected, explored in seen)
    discount = rule.discount ** (rule.time_step * preferred_speed)
    states, returns = _returns(steps, discount, trace)
    drives = [Drive(OUTCOMES[batch.outcome[row]], float(batch.time[row]),
                    float(batch.path_length[row]),
                    {name: float(value[row]) for name, value in sums.items()}) for row in every]
    return states, returns, drives


def _returns(steps, discount, trace):
    """Return the Features (S,) of non-exploratory states and their returns (S,)."""
    # What follows a state: its own return and its expected value, per episode, from the end.
    following, expected_next = np.zeros(len(discount)), np.zeros(len(discount))
    kept, returns = [], []
    for step in reversed(steps):
        rows = step.rows
        after = (1.0 - trace) * expected_next[rows] + trace * following[rows]
        value = step.reward + discount[rows] * after
        following[rows] = np.where(step.explored, step.expected, value)
        expected_next[rows] = step.expected
        keep = ~step.explored
        kept.append(Features(*(part[keep] for part in vars(step.features).values())))
        returns.append(value[keep])
    return (Features(*(np.concatenate([getattr(part, name) for part in kept])
                       for name in Features.__dataclass_fields__)), np.concatenate(returns))
