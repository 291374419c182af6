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
Lambda-returns worked by hand on episodes of three steps.

Paper algorithm 1; Sutton and Barto, section 12.1, for the returns.
"""

import numpy as np
import pytest

from wallnav_ros.learning.experience import _returns, Demonstrator, Explorer, gather, Step
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.features import AGENT, Features, ROBOT, WALL_RAYS
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.outcomes import Rule
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.orca import OrcaPolicy
from wallnav_ros.simulation.scenarios import load_scenario

pytestmark = pytest.mark.extras

# Rewards and the values expected of the states in which they were earned; gamma is 0.5.
REWARD = (1.0, 2.0, 4.0)
EXPECTED = (10.0, 20.0, 40.0)


def steps_of(reward=REWARD, expected=EXPECTED, explored=(False, False, False), row=0):
    def at(number):
        state = Features(np.full((1, len(ROBOT)), number, np.float32),
                         np.zeros((1, WALL_RAYS), np.float32),
                         np.zeros((1, 0, len(AGENT)), np.float32), np.zeros((1, 0), bool))
        return Step(np.array([row]), state, np.array([reward[number]]),
                    np.array([expected[number]]), np.array([explored[number]]))
    return [at(number) for number in range(3)]


def returns_of(steps, trace, rows=1):
    """Return {number of the step: return} of the states that were kept."""
    states, returns = _returns(steps, np.full(rows, 0.5), trace)
    return dict(zip(states.robot[:, 0].astype(int).tolist(), returns.tolist()))


@pytest.mark.parametrize('trace, expected', [
    # What really followed: 4; 2 + 0.5 x 4; 1 + 0.5 x 4.
    (1.0, {2: 4.0, 1: 4.0, 0: 3.0}),
    # What the next state is expected to give: 4; 2 + 0.5 x 40; 1 + 0.5 x 20.
    (0.0, {2: 4.0, 1: 22.0, 0: 11.0}),
    # Half of each: 4; 2 + 0.5 (20 + 2); 1 + 0.5 (10 + 6.5).
    (0.5, {2: 4.0, 1: 13.0, 0: 9.25}),
])
def test_lambda_returns_by_hand(trace, expected):
    assert returns_of(steps_of(), trace) == pytest.approx(expected)


@pytest.mark.parametrize('trace', [0.0, 0.5, 1.0])
def test_an_exploratory_action_is_left_out_and_cuts_the_return_before_it(trace):
    explored = (False, True, False)

    returns = returns_of(steps_of(explored=explored), trace)

    # Before it: 1 + 0.5 x the 20 expected there, whatever the trace; after it nothing changes.
    assert returns == pytest.approx({2: 4.0, 0: 11.0})


def test_an_exploratory_last_action_leaves_the_end_to_expectation():
    returns = returns_of(steps_of(explored=(False, False, True)), 1.0)

    # 2 + 0.5 x 40; 1 + 0.5 x 22.
    assert returns == pytest.approx({1: 22.0, 0: 12.0})


def test_episodes_side_by_side_do_not_mix():
    """Two episodes interleaved, the second one with nothing to earn."""
    steps = [step for pair in zip(steps_of(), steps_of((0.0,) * 3, (0.0,) * 3, row=1))
             for step in pair]

    states, returns = _returns(steps, np.array([0.5, 0.5]), 0.5)

    assert sorted(returns.tolist()) == [0.0, 0.0, 0.0, 4.0, 9.25, 13.0]


def test_each_robots_preferred_speed_sets_its_discount():
    steps = steps_of() + steps_of(row=1)

    _, returns = _returns(sorted(steps, key=lambda step: step.features.robot[0, 0]),
                          np.array([0.5, 1.0]), 1.0)

    assert sorted(returns.tolist()) == pytest.approx(sorted([4.0, 4.0, 3.0, 4.0, 6.0, 7.0]))


class Straight:
    """Drives straight ahead at full speed and expects nothing."""

    actions = make_actions()

    def act(self, batch, rows, field):
        ahead = np.flatnonzero((self.actions.speed == 1.0) & (self.actions.turn_rate == 0.0))
        return (np.full(len(rows), ahead[0]), np.zeros(len(rows)),
                np.zeros(len(rows), dtype=bool))


def test_a_straight_drive_is_worth_its_discounted_rewards():
    episode = draw_episode(load_scenario('cross_path'), 'none', 0)

    states, returns, (drive,) = gather([episode], Straight(), Rule(reward='R1'), trace=1.0)

    # 0.002 a step and 10 instead on the last; gamma^(0.25 x 0.8) a step.
    steps, discount = len(returns), 0.9 ** 0.2
    order = np.argsort(-states.robot[:, 0])          # by distance to the goal: from the start
    assert 39 <= steps <= 40
    left = np.arange(steps - 1, -1, -1)
    expected = 0.002 * (1 - discount ** left) / (1 - discount) + 10.0 * discount ** left
    assert returns[order] == pytest.approx(expected, abs=1e-6)
    assert (drive.outcome, drive.time) == ('goal', 0.25 * steps)
    assert drive.path_length == pytest.approx(0.2 * steps)
    assert sum(drive.terms.values()) == pytest.approx(10.0 + 0.002 * (steps - 1))


def test_what_a_drive_earned_ends_with_it_though_others_go_on():
    near, far = (draw_episode(load_scenario('cross_path'), 'none', 0, preferred_speed=speed)
                 for speed in (1.0, 0.4))
    _, _, drives = gather([near, far], Straight(), Rule(), trace=1.0)
    _, _, (alone,) = gather([near], Straight(), Rule(), trace=1.0)

    assert drives[0] == alone
    assert drives[1].time > 2.0 * drives[0].time


def test_demonstrations_are_gathered_from_orca():
    episodes = [draw_episode(load_scenario('cross_path'), case, 1) for case in ('none', 'static')]

    states, returns, drives = gather(
        episodes, Demonstrator(OrcaPolicy(make_actions())), Rule(), trace=1.0)

    assert drives[0].outcome == 'goal'
    assert len(states.robot) == len(returns) > 40
    assert np.isfinite(returns).all()
    assert states.present.shape == (len(returns), 15)
    # The states come from where the robot was, not from where it got to: within 0.2 m of it.
    assert states.robot[:, ROBOT.index('goal_distance')].min() > 0.0199


def nearness(features):
    return -10.0 * features.robot[:, 0].astype(float)


@pytest.mark.parametrize('epsilon, share', [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0)])
def test_an_explorer_acts_at_random_as_often_as_asked(epsilon, share, rng):
    from wallnav_ros.simulation.batch import EpisodeBatch
    batch = EpisodeBatch([draw_episode(load_scenario('cross_path'), 'none', seed)
                          for seed in range(20)])
    (rows, field), = batch.groups()
    lookahead = Lookahead(nearness, make_actions())
    explorer = Explorer(lookahead, epsilon, rng)
    scores, _ = lookahead.evaluate(batch.robot(rows), batch.agents(rows), field)

    drawn = [explorer.act(batch, rows, field) for _ in range(10)]

    explored = np.stack([explored for _, _, explored in drawn])
    assert explored.mean() == pytest.approx(share, abs=0.12)
    for action, expected, random in drawn:
        assert (action[~random] == scores.argmax(axis=1)[~random]).all()
        assert (expected == scores.max(axis=1)).all()
    if epsilon:
        chosen = np.concatenate([action[random] for action, _, random in drawn])
        assert len(np.unique(chosen)) > 30


def test_the_same_generator_gathers_the_same_experience():
    episodes = [draw_episode(load_scenario('cross_path'), 'static', seed) for seed in range(2)]

    def run():
        explorer = Explorer(Lookahead(nearness, make_actions()), 0.3, np.random.default_rng(5))
        return gather(episodes, explorer, Rule(), 0.9)
    first, second = run(), run()

    assert (first[1] == second[1]).all()
    assert (first[0].robot == second[0].robot).all()
    assert first[2] == second[2]
