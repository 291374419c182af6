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
The evaluate command: its files, the same to the byte on any number of workers, and refusals.

The fields of summary.json are a contract.
"""

import csv
import json
import os
from pathlib import Path
import signal
import subprocess
import sys

from interruptions import interrupted
import numpy as np
import pytest
from refusals import refusal_by
from wallnav_ros.commands.evaluate import main
from wallnav_ros.policy import features as feature_set
from wallnav_ros.policy.value_function import FORMAT, layer_shapes, ValueFunction

pytestmark = pytest.mark.extras

HALL = """
walls: [[[-2, -4], [4, -4], [4, -4.2]], [[1, 3], [2, 3], [2, 4]]]
robot: {start: [0, 0, 0], goal: [2, 0]}
time_limit: 4.0
cases: {none: {}, busy: {static: 2, dynamic: 2}}
agents: {radius: [0.1, 0.3], goal: anywhere}
"""


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / 'hall.yaml'
    path.write_text(HALL)
    return str(path)


@pytest.fixture(scope='module')
def untrained(tmp_path_factory):
    """Return an untrained weight file."""
    sizes = {'mlp1': [8, 6], 'mlp2': [6, 4], 'attention': [5, 1], 'mlp3': [8, 1]}
    rng = np.random.default_rng(3)
    path = tmp_path_factory.mktemp('weights') / 'untrained.npz'
    ValueFunction({
        'format': FORMAT, 'network': {'kind': 'three_mlp', 'sizes': sizes},
        'features': feature_set.describe(), 'actions': {'max_turn_rate': 1.8}, 'reward': 'R4',
        'decision': {'horizons': [1], 'caution': 0.0}, 'time_step': 0.25, 'discount': 0.9,
        'training': {}}, {name: rng.normal(0.0, 0.3, shape).astype(np.float32)
                          for name, shape in layer_shapes(sizes).items()}).save(path)
    return str(path)


def run(scenario, out, *more):
    # A picture takes longer than the episodes in it.
    return main(['--model', 'orca', '--scenario', scenario, '--out', str(out),
                 '--episodes', '4', '--seed', '7', '--figures', '0', *more])


def test_files_and_fields_are_those_of_the_contract(scenario, tmp_path):
    assert run(scenario, tmp_path / 'out') == 0

    assert {path.name for path in (tmp_path / 'out').iterdir()} >= {
        'summary.json', 'episodes.csv', 'tables.md'}
    summary = json.loads((tmp_path / 'out' / 'summary.json').read_text())
    assert (summary['model'], summary['seed']) == ('orca', 7)
    assert [(cell['scenario'], cell['case']) for cell in summary['cells']] == [
        ('hall', 'none'), ('hall', 'busy')]
    for cell in summary['cells']:
        assert cell['episodes'] == 4
        assert sum(cell[f'{rate}_rate'] for rate in (
            'success', 'collision', 'wall_collision', 'timeout')) == pytest.approx(1.0)
        assert set(cell['intervals_95']) == {
            'success_rate', 'collision_rate', 'wall_collision_rate', 'timeout_rate'}
        assert {'mean_time', 'mean_path_length', 'reward_terms'} <= set(cell)


def test_every_episode_has_a_row(scenario, tmp_path):
    run(scenario, tmp_path / 'out')

    with open(tmp_path / 'out' / 'episodes.csv', newline='') as stream:
        rows = list(csv.DictReader(stream))
    assert [(row['case'], row['seed']) for row in rows] == [
        (case, str(seed)) for case in ('none', 'busy') for seed in range(7, 11)]
    assert {'outcome', 'time', 'path_length', 'min_gap_agent', 'min_gap_wall', 'R_g',
            'R_wmin'} <= set(rows[0])
    assert {row['outcome'] for row in rows} <= {'goal', 'collision', 'wall_collision', 'timeout'}


def test_any_number_of_workers_gives_the_same_files_to_the_byte(scenario, tmp_path):
    run(scenario, tmp_path / 'one')
    run(scenario, tmp_path / 'two', '--workers', '2')

    for name in ('episodes.csv', 'summary.json', 'tables.md'):
        assert (tmp_path / 'two' / name).read_bytes() == (tmp_path / 'one' / name).read_bytes()


def test_another_seed_gives_other_episodes(scenario, tmp_path):
    run(scenario, tmp_path / 'one', '--case', 'busy')
    run(scenario, tmp_path / 'other', '--case', 'busy', '--seed', '8')

    with open(tmp_path / 'one' / 'episodes.csv') as one, \
            open(tmp_path / 'other' / 'episodes.csv') as other:
        one, other = list(csv.DictReader(one)), list(csv.DictReader(other))
    # Seeds 7 to 10 and 8 to 11: what they share is the same.
    assert one[1:] == other[:3]
    assert {**one[0], 'seed': ''} != {**other[3], 'seed': ''}


def test_one_case_may_be_asked_for_and_the_summary_written_elsewhere_too(scenario, tmp_path):
    run(scenario, tmp_path / 'out', '--case', 'busy', '--json', str(tmp_path / 'copy.json'))

    summary = json.loads((tmp_path / 'copy.json').read_text())
    assert [cell['case'] for cell in summary['cells']] == ['busy']
    assert summary == json.loads((tmp_path / 'out' / 'summary.json').read_text())


def test_a_picture_of_every_cell_is_drawn_unless_declined(scenario, tmp_path):
    main(['--model', 'orca', '--scenario', scenario, '--out', str(tmp_path / 'out'),
          '--episodes', '1'])
    run(scenario, tmp_path / 'plain')

    assert {path.name for path in (tmp_path / 'out').glob('*.png')} == {
        'hall_none.png', 'hall_busy.png'}
    assert not list((tmp_path / 'plain').glob('*.png'))


def test_pictures_change_no_figure(scenario, tmp_path):
    run(scenario, tmp_path / 'out', '--figures', '3')
    run(scenario, tmp_path / 'plain', '--workers', '2')

    for name in ('episodes.csv', 'summary.json', 'tables.md'):
        assert (tmp_path / 'out' / name).read_bytes() == (tmp_path / 'plain' / name).read_bytes()


def test_several_models_are_measured_on_the_same_episodes_and_compared(
        scenario, tmp_path, untrained):
    run(scenario, tmp_path / 'alone')
    run(scenario, tmp_path / 'out', '--model', untrained)

    assert (tmp_path / 'out' / 'orca' / 'episodes.csv').read_bytes() == (
        tmp_path / 'alone' / 'episodes.csv').read_bytes()
    summary = json.loads((tmp_path / 'out' / 'summary.json').read_text())
    alone = json.loads((tmp_path / 'alone' / 'summary.json').read_text())
    # What one model's summary holds is there too, for the first.
    assert {key: summary[key] for key in alone} == alone
    assert [entry['model'] for entry in summary['models']] == ['orca', untrained]
    comparison, = summary['comparisons']
    assert (comparison['model'], comparison['against']) == ('orca', untrained)
    assert 0.0 < comparison['wilcoxon_success'] <= 1.0
    own, other = (entry['cells'] for entry in summary['models'])
    assert [cell['difference'] for cell in comparison['cells']] == pytest.approx(
        [one['success_rate'] - two['success_rate'] for one, two in zip(own, other)])
    table = (tmp_path / 'out' / 'comparison.md').read_text()
    assert '| scenario | case | orca | untrained |' in table


def test_two_files_of_one_name_get_folders_of_their_own(scenario, tmp_path, untrained):
    run(scenario, tmp_path / 'out', '--model', untrained, untrained, '--case', 'none')

    assert {path.name for path in (tmp_path / 'out').iterdir() if path.is_dir()} == {
        'orca', 'untrained_2', 'untrained_3'}


def test_people_may_be_told_to_see_the_robot(tmp_path):
    """Two that go by ORCA give way to each other: a crowd that sees the robot meets it less."""
    rates = []
    for number, more in enumerate(([], ['--robot-visible'])):
        main(['--model', 'orca', '--scenario', 'cross_path', '--case', 'dynamic', '--episodes',
              '25', '--out', str(tmp_path / str(number)), '--figures', '0', *more])
        summary = json.loads((tmp_path / str(number) / 'summary.json').read_text())
        rates.append(summary['cells'][0]['collision_rate'])

    assert rates[1] < 0.5 * rates[0]


def test_the_tables_are_printed(scenario, tmp_path, capsys):
    run(scenario, tmp_path / 'out')

    assert (tmp_path / 'out' / 'tables.md').read_text() in capsys.readouterr().out


def refusal(capsys, *arguments):
    """Return the one line with which the command ends at exit status 2."""
    return refusal_by('evaluate', main, capsys, *arguments)


def test_input_that_cannot_be_used_ends_with_status_2_and_one_line(scenario, tmp_path, capsys):
    out = ['--out', str(tmp_path / 'out')]
    broken = tmp_path / 'broken.yaml'
    broken.write_text('walls: [\n')
    (tmp_path / 'weights.npz').write_bytes(b'noise')
    orca = ['--model', 'orca']

    assert 'nobody: no such file' in refusal(capsys, '--model', 'nobody', *out)
    assert 'not a readable .npz' in refusal(
        capsys, '--model', str(tmp_path / 'weights.npz'), *out)
    assert 'nowhere: no such file' in refusal(capsys, *orca, '--scenario', 'nowhere', *out)
    assert 'not valid YAML' in refusal(capsys, *orca, '--scenario', str(broken), *out)
    assert "no case 'full'" in refusal(
        capsys, *orca, '--scenario', scenario, '--case', 'full', *out)


def test_a_folder_that_cannot_be_written_is_refused_before_any_work(scenario, tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        main(['--model', 'orca', '--scenario', scenario, '--out', scenario, '--episodes',
              '1000000'])

    assert caught.value.code == 2
    assert f'--out: no folder can be written at {scenario!r}' in capsys.readouterr().err


def test_ctrl_c_ends_with_one_line(scenario, tmp_path):
    # The bar says that it has begun.
    status, errors = interrupted('evaluate', b'evaluating', '--model', 'orca', '--scenario',
                                 scenario, '--episodes', '100000', '--out', tmp_path / 'out')

    assert status == 130
    assert b'evaluate: interrupted; nothing was written' in errors
    assert b'Traceback' not in errors


def test_a_worker_that_is_killed_ends_it_with_one_line(scenario, tmp_path):
    process = subprocess.Popen(
        [sys.executable, '-m', 'wallnav_ros.commands.evaluate', '--model', 'orca', '--scenario',
         scenario, '--episodes', '100000', '--workers', '2', '--out', tmp_path / 'out'],
        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
    text = b''
    while b'25/' not in text:           # a worker has handed in its first episodes
        text += process.stderr.read(1)
    children = Path(f'/proc/{process.pid}/task/{process.pid}/children').read_text().split()
    workers = [int(child) for child in children
               if b'spawn_main' in Path(f'/proc/{child}/cmdline').read_bytes()]
    os.kill(workers[0], signal.SIGKILL)
    _, errors = process.communicate(timeout=60)

    assert process.returncode == 1
    assert b'a worker was killed (SIGKILL)' in errors and b'--workers' in errors
    assert b'Traceback' not in errors
    assert not any(Path(f'/proc/{worker}').exists() for worker in workers)


@pytest.mark.parametrize('arguments', [
    ['--episodes', '0'], ['--episodes', 'many'], ['--seed', '-1'], ['--seed', '1.5'],
    ['--workers', '0'], ['--horizons', '0'], ['--horizons', '101'], ['--caution', '-1'],
    ['--figures', '-1'], ['--json', '/dev/null/x'], ['--colour']])
def test_bad_usage_ends_with_status_2(arguments, tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        main(['--out', str(tmp_path), *arguments])

    assert caught.value.code == 2
    assert 'usage: evaluate' in capsys.readouterr().err


def test_out_is_needed(capsys):
    with pytest.raises(SystemExit) as caught:
        main([])

    assert caught.value.code == 2
    assert '--out' in capsys.readouterr().err
