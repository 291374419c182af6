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
Run a batch of episodes to their ends under one policy, and report what happened.

Paper section 7: outcome, time, path length, gaps and every reward term.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.policy.rewards import reward_terms
from wallnav_ros.simulation.batch import EpisodeBatch, OUTCOMES, RUNNING


@dataclass(frozen=True)
class EpisodeResult:
    """
    One finished episode.

    outcome: a name of OUTCOMES. time: s. path_length, min_gap_agent, min_gap_wall: m.
    terms: {reward term: sum over the episode}. path: (T + 1, 3) robot poses.
    gaps: (T,) m, least gap to any agent in each step. crowd: (T + 1, N, 2) m, where the agents
    were, or None where that was not asked for.
    """

    scenario: str
    case: str
    seed: int
    outcome: str
    time: float
    path_length: float
    min_gap_agent: float
    min_gap_wall: float
    terms: dict
    path: np.ndarray
    gaps: np.ndarray
    crowd: np.ndarray = None


class GreedyPolicy:
    """Takes a Lookahead's best action that is not predicted to collide at once, else stops."""

    def __init__(self, lookahead):
        self.lookahead = lookahead
        self.actions = lookahead.actions

    def __call__(self, batch, rows, field):
        """Return the index (len(rows),) of the action for each of `rows` of `batch`."""
        scores, rollout = self.lookahead.evaluate(batch.guided(rows), batch.agents(rows), field)
        scores = np.where(rollout.collided, -np.inf, scores)
        # argmax of a row that is -inf throughout is 0, the stop action.
        return scores.argmax(axis=1)


def run_episodes(episodes, policy, time_step=0.25, reward='R4', watched=0):
    """
    Run `episodes` side by side to their ends and return an EpisodeResult for each.

    `policy(batch, rows, field)` returns action indices and has an `actions` ActionSet. The
    results of the first `watched` episodes also say where the agents were.
    """
    batch = EpisodeBatch(episodes, time_step)
    every = np.arange(len(episodes))
    commands_of = policy.actions.commands(batch.robot(every).preferred_speed)
    paths, gaps, sums = [batch.robot(every).pose], [], {}
    seen = every[:watched]
    crowds = [batch.agents(seen).position]
    while (batch.outcome == RUNNING).any():
        running = batch.outcome == RUNNING
        action = np.zeros(len(episodes), dtype=int)
        for rows, field in batch.groups():
            action[rows] = policy(batch, rows, field)
        facts = batch.step(commands_of[every, action])
        for name, value in reward_terms(reward, facts).items():
            sums[name] = sums.get(name, 0.0) + np.where(running, value, 0.0)
        paths.append(batch.robot(every).pose)
        gaps.append(facts.agent_gap)
        crowds.append(batch.agents(seen).position)
    paths, gaps, crowds = (np.stack(part, axis=1) for part in (paths, gaps, crowds))
    steps = np.round(batch.time / time_step).astype(int)
    return [EpisodeResult(
        episode.scenario.name, episode.case, episode.seed, OUTCOMES[batch.outcome[row]],
        float(batch.time[row]), float(batch.path_length[row]), float(batch.min_gap_agent[row]),
        float(batch.min_gap_wall[row]),
        {name: float(value[row]) for name, value in sums.items()},
        paths[row, :steps[row] + 1], gaps[row, :steps[row]],
        crowds[row, :steps[row] + 1, :len(episode.radius)] if row < watched else None)
        for row, episode in enumerate(episodes)]
