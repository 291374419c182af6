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
The robot under ORCA: the demonstrator of imitation learning, and a baseline.

Paper algorithm 1.
"""

import gc

import numpy as np
import pytest

from wallnav_ros.policy.actions import make_actions
from wallnav_ros.simulation.batch import EpisodeBatch
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.orca import OrcaPolicy
from wallnav_ros.simulation.rollout import run_episodes
from wallnav_ros.simulation.scenarios import load_scenario

pytestmark = pytest.mark.extras


def episodes_of(name, case, count, **robot):
    return [draw_episode(load_scenario(name), case, seed, **robot) for seed in range(count)]


@pytest.mark.parametrize('name, straight', [
    # The way less the 0.2 m at which the goal counts, at 0.8 m/s.
    ('cross_path', 7.8 / 0.8), ('curve_path', (8.0 * np.sqrt(2.0) - 0.2) / 0.8)])
def test_it_reaches_the_goal_of_the_empty_paths_without_dawdling(name, straight):
    (result,) = run_episodes(episodes_of(name, 'none', 1), OrcaPolicy(make_actions()))

    assert result.outcome == 'goal'
    assert straight <= result.time < 1.25 * straight


@pytest.mark.parametrize('radius, speed', [(0.15, 1.0), (0.35, 0.3)])
def test_it_drives_other_robots_too(radius, speed):
    episodes = episodes_of('cross_path', 'none', 1, radius=radius, preferred_speed=speed)

    (result,) = run_episodes(episodes, OrcaPolicy(make_actions()))

    assert result.outcome == 'goal'
    assert result.path_length / result.time <= speed + 1e-6


def test_its_demonstrations_are_worth_imitating():
    """It knows nothing of agents that ignore it, but gets through many a crowd all the same."""
    results = run_episodes(episodes_of('cross_path', 'mixed', 12), OrcaPolicy(make_actions()))

    assert sum(result.outcome == 'goal' for result in results) >= 4
    assert all(result.outcome != 'wall_collision' for result in results)


def test_the_same_episode_is_driven_the_same_way_again():
    first, second = (run_episodes(episodes_of('curve_path', 'mixed', 2),
                                  OrcaPolicy(make_actions())) for _ in range(2))

    assert all((one.path == other.path).all() for one, other in zip(first, second))


def test_one_policy_may_drive_one_batch_after_another():
    policy = OrcaPolicy(make_actions())
    expected = run_episodes(episodes_of('cross_path', 'static', 2), OrcaPolicy(make_actions()))

    run_episodes(episodes_of('curve_path', 'static', 2), policy)
    again = run_episodes(episodes_of('cross_path', 'static', 2), policy)

    assert all((one.path == other.path).all() for one, other in zip(expected, again))


def test_simulators_go_with_their_episodes():
    """Thousands of demonstrations must not fill the memory with finished simulators."""
    policy = OrcaPolicy(make_actions())
    batch = EpisodeBatch(episodes_of('cross_path', 'none', 3))
    (rows, field), = batch.groups()
    policy(batch, rows, field)
    assert len(policy._simulators) == 3

    del batch
    gc.collect()

    assert len(policy._simulators) == 0
