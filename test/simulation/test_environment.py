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
The Gymnasium environment: passes its checker, repeats itself, and agrees with `evaluate`.

Paper sections 1, 2 and 5.
"""

import subprocess
import sys
import warnings

import numpy as np
import pytest
from wallnav_ros.policy.actions import make_actions, STOP
from wallnav_ros.simulation.batch import EpisodeBatch
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.orca import OrcaPolicy
from wallnav_ros.simulation.rollout import run_episodes
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.simulation.scenarios import load_scenario

gymnasium = pytest.importorskip('gymnasium')
environment = pytest.importorskip('wallnav_ros.simulation.environment')

pytestmark = pytest.mark.extras

AHEAD = 1 + 4 * 16 + 8     # full speed, no turn


def make(**options):
    return gymnasium.make(environment.ID, **options)


def play(env, actions, seed):
    """Return observations, rewards and infos of an episode under `actions`, to its end."""
    history = [env.reset(seed=seed)]
    for action in actions:
        *step, terminated, truncated, info = env.step(action)
        history.append((*step, info))
        if terminated or truncated:
            break
    return history


def same(one, other):
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.tobytes() == other.tobytes()
    return one == other


@pytest.mark.parametrize('options', [
    {}, {'scenario': 'curve_path', 'case': 'none'}, {'case': 'all', 'reward': 'R1'},
    {'scenario': 'family', 'case': 'all', 'render_mode': 'rgb_array'}])
def test_gymnasium_finds_nothing_to_complain_about(options):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        from gymnasium.utils.env_checker import check_env
        check_env(make(**options).unwrapped)


def test_the_same_seed_is_the_same_episode_to_the_byte():
    actions = np.random.default_rng(0).integers(81, size=60)

    first = play(make(), actions, seed=5)

    assert same(play(make(), actions, seed=5), first)
    env = make()
    env.reset(seed=1)
    assert same(play(env, actions, seed=5), first)
    assert not same(play(make(), actions, seed=6), first)


def test_episodes_without_a_seed_follow_from_the_last_one_given():
    one, other = make(), make()
    one.reset(seed=3), other.reset(seed=3)

    numbers = [one.reset()[1]['seed'] for _ in range(4)]

    assert [other.reset()[1]['seed'] for _ in range(4)] == numbers
    assert len(set(numbers)) == 4


def test_a_seed_is_the_number_of_the_episode_that_evaluate_runs():
    env, row = make(scenario='curve_path', case='dynamic', reward='R3'), np.array([0])
    scenario = load_scenario('curve_path')
    expected, = run_episodes([draw_episode(scenario, 'dynamic', 11)], OrcaPolicy(make_actions()),
                             reward='R3')
    policy = OrcaPolicy(env.unwrapped._world.actions)
    _, info = env.reset(seed=11)
    sums, ended = {}, False
    while not ended:
        action = policy(env.unwrapped._batch, row, scenario.field)[0]
        _, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
        for name, value in info['reward_terms'].items():
            sums[name] = sums.get(name, 0.0) + value

    assert {name: info[name] for name in ('seed', 'outcome', 'time', 'path_length')} == {
        'seed': 11, 'outcome': expected.outcome, 'time': expected.time,
        'path_length': expected.path_length}
    assert sums == pytest.approx(expected.terms)


def test_the_reward_is_the_sum_of_its_named_terms():
    env = make(scenario='curve_path', case='static')

    for _, reward, info in play(env, [AHEAD] * 20, seed=2)[1:]:
        assert reward == pytest.approx(sum(info['reward_terms'].values()))
        assert set(info['reward_terms']) == {'R_g', 'R_c', 'R_d', 'R_hg', 'R_s', 'R_pf', 'R_wc',
                                             'R_wmin', 'R_wmax'}


def test_reaching_the_goal_and_collisions_terminate():
    """Straight on crosses the empty junction; a quarter turn to the left meets a wall."""
    goal = play(make(case='none'), [AHEAD] * 200, seed=0)
    wall = play(make(case='none'), [1 + 4 * 16 + 15, *[AHEAD] * 200], seed=0)

    # 8 m to go, of which 0.2 m are tolerance, at 0.2 m a step.
    assert goal[-1][-1]['outcome'] == 'goal'
    assert len(goal) - 1 == 40
    assert goal[-1][-1]['reward_terms']['R_g'] == 10.0
    assert wall[-1][-1]['outcome'] == 'wall_collision'


def test_running_out_of_time_truncates():
    env = make(case='none')
    env.reset(seed=0)

    steps = [env.step(STOP) for _ in range(180)]

    assert [step[2:4] for step in steps] == [(False, False)] * 179 + [(False, True)]
    assert steps[-1][4]['outcome'] == 'timeout'


def test_after_its_end_an_episode_must_be_reset():
    env = make(case='none').unwrapped
    play(env, [AHEAD] * 200, seed=0)

    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(AHEAD)


def test_a_picture_shows_walls_people_robot_and_goal():
    env = make(render_mode='rgb_array')
    env.reset(seed=0)

    image = env.render()
    env.step(AHEAD)

    assert image.dtype == np.uint8 and image.shape == (512, 512, 3)
    colours = {tuple(colour) for colour in image.reshape(-1, 3)}
    picture = sys.modules['wallnav_ros.simulation.picture']
    # Nobody walks yet when an episode begins.
    assert {picture.WALL, picture.ROBOT, picture.GOAL, picture.STANDING} <= colours
    assert (env.render() != image).any()


def test_there_is_no_picture_without_a_render_mode():
    env = make().unwrapped
    env.reset(seed=0)

    assert env.render() is None


@pytest.mark.parametrize('options, error, line', [
    ({'scenario': 'nowhere'}, FileNotFoundError, 'nowhere: no such file'),
    ({'case': 'full'}, ScenarioError, "no case 'full'"),
    ({'scenario': 'family', 'case': 'full'}, ScenarioError, "no case 'full'"),
    ({'reward': 'R5'}, ValueError, "unknown reward 'R5', choose one of R1, R2, R3, R4")])
def test_what_does_not_exist_is_refused(options, error, line):
    for make_one in (environment.CorridorEnv, environment.CorridorVectorEnv):
        with pytest.raises(error, match=line):
            make_one(**options)


def test_before_the_first_reset_there_is_nothing_to_step():
    with pytest.raises(gymnasium.error.ResetNeeded):
        environment.CorridorVectorEnv(2).step(np.array([AHEAD, AHEAD]))


def test_the_vectorised_form_is_that_many_environments():
    options = {'case': 'all', 'reward': 'R2'}
    one = gymnasium.make_vec(environment.ID, 3, vectorization_mode='vector_entry_point', **options)
    many = gymnasium.vector.SyncVectorEnv([lambda: environment.CorridorEnv(**options)] * 3)
    rng = np.random.default_rng(1)
    assert one.single_observation_space == many.single_observation_space

    steps = [(one.reset(seed=4), many.reset(seed=4))]
    for _ in range(150):
        actions = np.where(rng.random(3) < 0.3, rng.integers(81, size=3), AHEAD)
        steps.append((one.step(actions), many.step(actions)))

    for (seen, *ours, info), (expected, *theirs, about) in steps:
        for name in seen:
            assert seen[name] == pytest.approx(expected[name], abs=1e-6)
        for value, other in zip(ours, theirs):
            assert value == pytest.approx(other)
        assert info['outcome'].tolist() == about['outcome'].tolist()
        assert info['seed'].tolist() == about['seed'].tolist()
        if 'reward_terms' in about:
            assert (info['_reward_terms'] == about['_reward_terms']).all()
            for name, value in about['reward_terms'].items():
                assert info['reward_terms'][name] == pytest.approx(value)
    # Each of the three ended at least once, so their next episodes were compared too.
    ended = np.sum([step[0][2] | step[0][3] for step in steps[1:]], axis=0)
    assert (ended >= 1).all()


def test_a_restarted_row_forgets_its_earlier_episode():
    scenario = load_scenario('cross_path')
    batch = EpisodeBatch([draw_episode(scenario, 'mixed', 0), draw_episode(scenario, 'none', 1)])
    for _ in range(4):
        batch.step(np.zeros((2, 2)))
    episode, row, other = draw_episode(scenario, 'static', 2), np.array([1]), np.array([0])
    before = batch.agents(other).position

    batch.restart(1, episode)

    assert (batch.robot(row).pose == episode.robot.pose).all()
    assert (batch.agents(row).position[0] == episode.start).all()
    assert (batch.past(row, 3).position[0] == episode.start).all()
    assert (batch.agents(other).position == before).all()
    assert (batch.past(other, 3).position != before).any()
    assert batch.time.tolist() == [1.0, 0.0]


def test_the_simulator_needs_no_gymnasium():
    code = ('import sys; sys.modules["gymnasium"] = None; '
            'import wallnav_ros.simulation.rollout, wallnav_ros.evaluation.episodes')

    assert subprocess.run([sys.executable, '-c', code]).returncode == 0
