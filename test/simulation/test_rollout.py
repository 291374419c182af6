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
Episodes run to their ends: outcome, figures and reward terms of each.

Paper section 7.
"""

import numpy as np
import pytest

from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.outcomes import Rule
from wallnav_ros.simulation.batch import EpisodeBatch
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.rollout import GreedyPolicy, run_episodes
from wallnav_ros.simulation.scenarios import load_scenario

pytestmark = pytest.mark.extras

TERMS = ['R_g', 'R_c', 'R_d', 'R_hg', 'R_s', 'R_pf', 'R_wc', 'R_wmin', 'R_wmax']


class Straight:
    """Drives straight ahead at full speed, whatever happens."""

    actions = make_actions()
    action = int(np.flatnonzero((actions.speed == 1.0) & (actions.turn_rate == 0.0))[0])

    def __call__(self, batch, rows, field):
        return np.full(len(rows), self.action)


def nearness(features):
    return -10.0 * features.robot[:, 0].astype(float)


def episodes_of(name, case, count):
    return [draw_episode(load_scenario(name), case, seed) for seed in range(count)]


def test_straight_across_the_empty_cross_is_worked_by_hand():
    (result,) = run_episodes(episodes_of('cross_path', 'none', 1), Straight())

    # From -4 to 3.8 m and beyond: 7.8 m at 0.2 m a step needs 40 steps to come within 0.2 m
    # (39 end at 0.2 m exactly, which is not nearer than that).
    assert (result.outcome, result.time) == ('goal', pytest.approx(9.75, abs=0.26))
    steps = round(result.time / 0.25)
    assert result.path_length == pytest.approx(0.2 * steps)
    assert result.path.shape == (steps + 1, 3)
    assert result.path[-1, :2] == pytest.approx([0.0, -4.0 + 0.2 * steps], abs=1e-4)
    assert result.min_gap_wall == pytest.approx(1.8, abs=1e-4)
    assert result.min_gap_agent == np.inf
    assert result.terms == pytest.approx({
        'R_g': 10.0, 'R_c': 0.0, 'R_d': 0.0, 'R_hg': 0.002 * steps, 'R_s': 0.0,
        'R_pf': 0.01 * steps, 'R_wc': 0.0, 'R_wmin': 0.01 * steps, 'R_wmax': 0.1}, abs=1e-6)


def test_straight_on_through_the_curve_passes_its_inner_wall_with_room():
    (result,) = run_episodes(episodes_of('curve_path', 'none', 1), Straight())

    # Start and goal are 12 sqrt(2) m from the centre; the chord between them comes nearest to
    # it in the middle, at (0, 0): 8 sqrt(2) = 11.3 m, 1.3 m from the wall.
    assert result.outcome == 'goal'
    assert result.min_gap_wall == pytest.approx(8.0 * np.sqrt(2.0) - 10.0 - 0.2, abs=0.01)


@pytest.mark.parametrize('reward, names', [('R4', TERMS), ('R2', TERMS[:5]), ('R1', TERMS[:4])])
def test_the_terms_summed_are_those_of_the_reward(reward, names):
    (result,) = run_episodes(episodes_of('cross_path', 'none', 1), Straight(), reward=reward)

    assert list(result.terms) == names


def test_terms_stop_adding_up_when_an_episode_ends():
    """Of episodes side by side, those that end early are paid as if they were alone."""
    episodes = episodes_of('cross_path', 'mixed', 5)
    together = run_episodes(episodes, Straight())

    for episode, result in zip(episodes, together):
        (alone,) = run_episodes([episode], Straight())
        assert alone.terms == pytest.approx(result.terms)
        assert alone.time == result.time
        assert (alone.path == result.path).all()
    assert len({result.time for result in together}) > 1


def test_straight_through_a_crowd_collides_and_is_told_so():
    results = run_episodes(episodes_of('cross_path', 'static', 6), Straight())

    collided = [result for result in results if result.outcome == 'collision']
    assert collided
    for result in collided:
        assert result.min_gap_agent <= 0.0
        assert result.terms['R_c'] == -0.5
        assert result.terms['R_g'] == 0.0


def test_results_name_their_episodes():
    results = run_episodes(episodes_of('curve_path', 'static', 3), Straight())

    assert [(result.scenario, result.case, result.seed) for result in results] == [
        ('curve_path', 'static', seed) for seed in range(3)]


def test_the_greedy_policy_takes_the_best_action_of_its_lookahead():
    policy = GreedyPolicy(Lookahead(nearness, make_actions(), Rule()))
    batch = EpisodeBatch(episodes_of('cross_path', 'mixed', 4))
    (rows, field), = batch.groups()

    action = policy(batch, rows, field)

    scores, rollout = policy.lookahead.evaluate(batch.robot(rows), batch.agents(rows), field)
    for row in rows:
        assert not rollout.collided[row, action[row]]
        allowed = scores[row][~rollout.collided[row]]
        assert scores[row, action[row]] == allowed.max()


def test_a_greedy_policy_with_every_way_blocked_stops():
    class Blocked(Lookahead):

        def evaluate(self, robot, agents, walls):
            scores, rollout = super().evaluate(robot, agents, walls)
            rollout.collided[:] = True
            return scores, rollout
    batch = EpisodeBatch(episodes_of('cross_path', 'none', 2))
    (rows, field), = batch.groups()

    action = GreedyPolicy(Blocked(nearness, make_actions()))(batch, rows, field)

    assert action.tolist() == [0, 0]


def test_greed_for_nearness_crosses_an_empty_junction_in_a_straight_line():
    policy = GreedyPolicy(Lookahead(nearness, make_actions()))

    (result,) = run_episodes(episodes_of('cross_path', 'none', 1), policy)

    assert result.outcome == 'goal'
    assert np.abs(result.path[:, 0]).max() < 1e-3


def test_gaps_are_those_of_each_step_and_their_least_is_the_least_gap():
    for result in run_episodes(episodes_of('cross_path', 'mixed', 4), Straight()):
        assert len(result.gaps) == len(result.path) - 1
        assert result.gaps.min() == result.min_gap_agent


def test_only_the_watched_say_where_the_crowd_was():
    episodes = episodes_of('cross_path', 'dynamic', 3)

    results = run_episodes(episodes, Straight(), watched=2)

    assert results[2].crowd is None
    for episode, result in zip(episodes, results[:2]):
        assert result.crowd.shape == (len(result.path), len(episode.radius), 2)
        assert (result.crowd[0] == episode.start).all()
        assert (result.crowd[-1] != episode.start).any()
