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
The train command: from a configuration to weights, and refusals in one line.

Paper algorithm 1, in small.
"""

import csv
import json
import resource

from interruptions import interrupted
import numpy as np
import pytest
from refusals import refusal_by
from wallnav_ros.commands.train import main
from wallnav_ros.evaluation.baselines import BASELINES
from wallnav_ros.evaluation.episodes import load_policy
from wallnav_ros.policy.value_function import load_value_function
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.rollout import run_episodes
from wallnav_ros.simulation.scenarios import load_scenario
import yaml

pytest.importorskip('torch')
load_settings = pytest.importorskip('wallnav_ros.learning.settings').load_settings

pytestmark = pytest.mark.extras


@pytest.fixture
def config(tmp_path):
    """Return a configuration that trains in seconds on a hall with nobody in it."""
    scenario = tmp_path / 'hall.yaml'
    scenario.write_text('walls: [[[-2, -4], [4, -4], [4, -4.2]]]\ntime_limit: 4.0\n'
                        'robot: {start: [0, -2, 0], goal: [2, -2]}\ncases: {none: {}}\n')
    path = tmp_path / 'tiny.yaml'
    path.write_text(yaml.safe_dump({
        'name': 'tiny', 'scenarios': {str(scenario): 1}, 'cases': {'none': 1}, 'horizons': [1],
        'decision_horizons': [1], 'imitation_episodes': 2, 'imitation_updates': 2,
        'episodes': 4, 'parallel': 2, 'updates': 2, 'batch_size': 8, 'memory': 200,
        'evaluate_every': 4, 'evaluation_episodes': 1}))
    return path


def test_a_configuration_becomes_weights(config, tmp_path, capsys):
    assert main(['--config', str(config), '--out', str(tmp_path / 'out')]) == 0

    weights = load_value_function(tmp_path / 'out' / 'tiny.npz')
    assert weights.metadata['training']['episodes'] == 4
    assert capsys.readouterr().out.splitlines()[-1] == (
        f'best weights: {tmp_path / "out" / "tiny.npz"}')


def test_the_result_may_be_had_for_a_machine(config, tmp_path):
    out, told = tmp_path / 'out', tmp_path / 'told' / 'result.json'

    assert main(['--config', str(config), '--out', str(out), '--json', str(told)]) == 0

    document = json.loads(told.read_text())
    assert document['weights'] == str(out / 'tiny.npz')
    assert document['episodes'] == 4
    last = document['evaluations'][-1]
    assert (last['episodes'], last['case']) == (4, 'none')
    assert 0.0 <= last['goal'] <= 1.0


def test_a_finished_run_may_be_resumed(config, tmp_path):
    command = ['--config', str(config), '--out', str(tmp_path / 'out')]
    main(command)
    before = (tmp_path / 'out' / 'tiny.npz').read_bytes()

    assert main([*command, '--resume']) == 0

    assert (tmp_path / 'out' / 'tiny.npz').read_bytes() == before


def test_settings_may_be_changed_for_one_run(config, tmp_path):
    assert main(['--config', str(config), '--out', str(tmp_path / 'out'), '--set', 'name=other',
                 'reward=R1', '--set', 'without=[attention]']) == 0

    weights = load_value_function(tmp_path / 'out' / 'other.npz')
    assert weights.metadata['reward'] == 'R1'
    assert weights.metadata['training']['settings']['without'] == ['attention']
    assert (weights.tensors['attention.1.weight'] == 0.0).all()


@pytest.mark.parametrize('name', BASELINES)
def test_a_baseline_becomes_weights_that_evaluate_runs(config, tmp_path, name):
    assert main(['--config', str(config), '--out', str(tmp_path / 'out'), '--set',
                 f'kind={name}', 'evaluation_episodes=2']) == 0

    policy = load_policy(str(tmp_path / 'out' / 'tiny.npz'))
    scenario = load_scenario(str(tmp_path / 'hall.yaml'))
    episodes = [draw_episode(scenario, 'none', 1000000 + number) for number in range(2)]
    results = run_episodes(episodes, policy)
    with open(tmp_path / 'out' / 'evaluation.csv', newline='') as stream:
        row = list(csv.DictReader(stream))[-1]
    # NumPy now, torch then: the same drive.
    assert np.mean([result.path_length for result in results]) == pytest.approx(
        float(row['path_length']), rel=1e-3)


@pytest.mark.parametrize('name', BASELINES)
def test_the_shipped_configuration_of_a_baseline_is_of_its_kind(repository, name):
    settings = load_settings(repository / 'params' / 'training' / f'{name}.yaml')

    assert (settings.name, settings.kind) == (name, name)
    assert (settings.horizons, settings.decision_horizons, settings.caution) == ((1,), (1,), 0.0)


def refusal(capsys, *arguments):
    """Return the one line with which the command ends at exit status 2."""
    return refusal_by('train', main, capsys, *arguments)


def test_input_that_cannot_be_used_ends_with_status_2_and_one_line(config, tmp_path, capsys):
    out = ['--out', str(tmp_path / 'out')]

    def with_setting(**changes):
        path = tmp_path / 'changed.yaml'
        path.write_text(yaml.safe_dump({**yaml.safe_load(config.read_text()), **changes}))
        return ['--config', str(path), *out]

    assert 'nothing: no such file' in refusal(capsys, '--config', 'nothing', *out)
    assert 'epochs: unknown' in refusal(capsys, *with_setting(epochs=3))
    assert 'memory: expected a whole number above 0' in refusal(capsys, *with_setting(memory=0))
    assert 'nowhere: no such file' in refusal(capsys, *with_setting(scenarios={'nowhere': 1}))
    assert "no case 'full'" in refusal(capsys, *with_setting(cases={'full': 1}))
    assert 'no checkpoint to resume from' in refusal(
        capsys, '--config', str(config), *out, '--resume')
    assert '--device abacus: ' in refusal(
        capsys, '--config', str(config), *out, '--device', 'abacus')
    with pytest.raises(SystemExit, match='2'):
        main(['--config', str(config), '--out', str(config)])
    assert f'--out: no folder can be written at {str(config)!r}' in capsys.readouterr().err


@pytest.mark.filterwarnings('ignore::RuntimeWarning')
def test_a_diverging_run_ends_with_status_1_and_advice(config, tmp_path, capsys):
    diverging = yaml.safe_load(config.read_text())
    diverging.update(learning_rate=1e30, final_learning_rate=1e30, imitation_updates=50)
    config.write_text(yaml.safe_dump(diverging))

    assert main(['--config', str(config), '--out', str(tmp_path / 'out')]) == 1

    assert 'train: the loss became ' in capsys.readouterr().err.splitlines()[-1]


@pytest.fixture
def little_memory():
    """Let this process have 40 GB of address space, as on a machine that has no more."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (40 * 10 ** 9, hard))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def test_more_memory_than_there_is_ends_with_status_1_and_advice(
        config, tmp_path, capsys, little_memory):
    # 10 ** 9 states of more than 90 bytes.
    assert main(['--config', str(config), '--out', str(tmp_path), '--set',
                 f'memory={10 ** 9}']) == 1

    assert 'lower memory' in capsys.readouterr().err.splitlines()[-1]


def test_ctrl_c_ends_with_one_line_that_says_how_to_go_on(config, tmp_path):
    # The bar says that it has begun.
    status, errors = interrupted('train', b'imitation', '--config', config, '--out',
                                 tmp_path / 'out', '--set', 'imitation_episodes=100000')

    assert status == 130
    assert b'train: interrupted; --resume goes on from the last checkpoint' in errors
    assert b'Traceback' not in errors


@pytest.mark.parametrize('arguments', [
    [], ['--config', 'default'], ['--out', 'x'], ['--nonsense']])
def test_bad_usage_ends_with_status_2(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)

    assert caught.value.code == 2
    assert 'usage: train' in capsys.readouterr().err
