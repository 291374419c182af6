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
Training settings: defaults of the shipped files, and every fault in one line.

Paper section 6.
"""

from dataclasses import fields

import pytest
from refusals import refusal_of
from wallnav_ros.learning.kinds import KINDS
from wallnav_ros.learning.settings import load_settings, SettingsError, TrainSettings
import yaml

pytestmark = pytest.mark.extras


def refusal(path):
    return refusal_of(SettingsError, load_settings, path)


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / 'settings.yaml'
        path.write_text(text if isinstance(text, str) else yaml.safe_dump(text))
        return path
    return write


def test_every_shipped_file_is_sound(repository):
    paths = sorted((repository / 'params' / 'training').glob('*.yaml'))

    assert paths
    for path in paths:
        assert isinstance(load_settings(path), TrainSettings)


def test_an_empty_file_gives_the_defaults(write):
    assert load_settings(write('')) == TrainSettings()


def test_what_a_file_says_replaces_the_defaults(write):
    settings = load_settings(write({
        'name': 'other', 'horizons': [1, 2], 'discount': 1, 'cases': {'none': 0.5}}))

    assert (settings.name, settings.horizons, settings.discount) == ('other', (1, 2), 1.0)
    assert type(settings.discount) is float
    assert settings.cases == {'none': 0.5}
    assert settings.seed == TrainSettings().seed


def test_a_missing_file_is_refused(tmp_path):
    assert refusal(tmp_path / 'none.yaml') == (
        'No such file or directory: give an existing YAML file')


@pytest.mark.parametrize('text', ['a: [', 'a: 2026-13-01', '[' * 500], ids=range(3))
def test_text_that_is_not_yaml_is_refused(write, text):
    assert refusal(write(text)).startswith('not valid YAML')


@pytest.mark.parametrize('text', ['- 1', 'text', '3'])
def test_a_document_that_is_no_mapping_is_refused(write, text):
    assert refusal(write(text)) == 'expected a mapping of settings'


@pytest.mark.parametrize('key, value, line', [
    ('epochs', 3, 'epochs: unknown; known are name, seed'),
    ('seed', 1.5, 'seed: expected a whole number, got 1.5'),
    ('seed', True, 'seed: expected a whole number, got True'),
    ('seed', -1, 'seed: expected a whole number, 0 or more, got -1'),
    ('name', 3, 'name: expected text, got 3'),
    ('name', '', 'name: expected a file name without folders'),
    ('name', '../up', 'name: expected a file name without folders'),
    ('scenarios', 'curve_path', 'scenarios: expected a mapping'),
    ('scenarios', {}, 'scenarios: expected {name: weight}'),
    ('scenarios', {'curve_path': -1}, 'scenarios: expected {name: weight}'),
    ('cases', ['none'], 'cases: expected a mapping'),
    ('cases', {}, 'cases: expected {name: weight}'),
    ('cases', {'none': 0}, 'cases: expected {name: weight}'),
    ('cases', {'none': -1, 'mixed': 2}, 'cases: expected {name: weight}'),
    ('cases', {'none': float('nan')}, 'cases: expected {name: weight}'),
    ('cases', {'none': 10 ** 400}, 'cases: expected {name: weight}'),
    ('memory', 10 ** 12, 'memory: expected at most 1000000000, got 1000000000000'),
    ('discount', 10 ** 400, 'discount: expected a number from 0 to 1, got inf'),
    ('time_step', 10 ** 400, 'time_step: expected a number above 0, got inf'),
    ('radius', [0.3], 'radius: expected [low, high] with 0 < low <= high'),
    ('radius', [0.3, 0.2], 'radius: expected [low, high] with 0 < low <= high'),
    ('preferred_speed', [0.0, 1.0], 'preferred_speed: expected [low, high]'),
    ('reward', 'R5', "reward: expected one of R1, R2, R3, R4, got 'R5'"),
    ('horizons', [], 'horizons: expected a list of steps, each 1 or more'),
    ('horizons', [101], 'horizons: expected a list of steps, each 1 or more, at most 100'),
    ('decision_horizons', [0, 2], 'decision_horizons: expected a list of steps, each 1 or more'),
    ('network', {'mlp1': [8]}, 'network: expected layer widths'),
    ('network', {'mlp1': [8], 'mlp2': [8], 'attention': [1], 'mlp3': [1]},
     'network: expected layer widths'),
    ('kind', 'perceptron', 'kind: expected one of three_mlp, cadrl'),
    ('without', ['legs'], 'without: expected some of walls, attention'),
    ('without', [['walls']], 'without: expected some of walls, attention'),
    ('learning_rate', 0, 'learning_rate: expected a number above 0, got 0'),
    ('time_step', float('inf'), 'time_step: expected a number above 0'),
    ('discount', 1.1, 'discount: expected a number from 0 to 1, got 1.1'),
    ('trace', float('nan'), 'trace: expected a number from 0 to 1, got nan'),
    ('epsilon_end', -0.1, 'epsilon_end: expected a number from 0 to 1'),
    *((key, 0, f'{key}: expected a whole number above 0, got 0')
      for key in ('parallel', 'updates', 'batch_size', 'memory', 'evaluate_every',
                  'evaluation_episodes', 'imitation_updates', 'episodes')),
])
def test_a_fault_is_named_by_file_field_and_fix(write, key, value, line):
    assert refusal(write({key: value})).startswith(line)


@pytest.mark.parametrize('key', [entry.name for entry in fields(TrainSettings)])
def test_no_setting_takes_just_anything(write, key):
    """A value of a wrong type is refused by name, for settings added later too."""
    assert refusal(write({key: None})).startswith(f'{key}: expected ')


@pytest.mark.parametrize('kind', KINDS)
def test_a_kind_brings_its_own_layer_sizes_and_checks_others(write, kind):
    assert load_settings(write({'kind': kind})).network == KINDS[kind].sizes
    assert refusal(write({'kind': kind, 'network': {'layers': [8]}})).startswith(
        'network: expected layer widths for ')


def test_only_ours_has_walls_to_take_out(write):
    assert load_settings(write({'without': ['walls', 'attention']})).without == (
        'walls', 'attention')
    assert refusal(write({'kind': 'sarl', 'without': ['walls']})).startswith('without: ')


def test_changes_replace_what_the_file_says(write):
    path = write({'reward': 'R4', 'seed': 3})

    settings = load_settings(path, ['reward=R1', 'without=[walls]', 'horizons=[1]',
                                    'cases={none: 1}'])

    assert (settings.reward, settings.seed, settings.without, settings.horizons,
            settings.cases) == ('R1', 3, ('walls',), (1,), {'none': 1})


@pytest.mark.parametrize('change, line', [
    ('reward', '--set reward: expected KEY=VALUE'),
    ('cases={', '--set cases={: the value is not valid YAML'),
    ('colour=red', 'colour: unknown'),
    ('reward=R9', 'reward: expected one of R1')])
def test_a_change_that_cannot_be_used_is_refused(write, change, line):
    with pytest.raises(SettingsError) as caught:
        load_settings(write(''), [change])

    assert line in str(caught.value)
    assert str(caught.value).count(chr(10)) == 0
