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
Exported weights say which commit of the source made them, and carry the motion model along.

That they give the values of the trained network is tested with the networks.
"""

from dataclasses import replace
import os
import subprocess

import pytest

from wallnav_ros.learning.settings import TrainSettings
from wallnav_ros.policy.value_function import load_value_function

torch = pytest.importorskip('torch')

from wallnav_ros.learning import export  # noqa: E402, I100
from wallnav_ros.learning.trainer import Trainer  # noqa: E402

pytestmark = pytest.mark.extras
TINY = TrainSettings(
    name='tiny', scenarios={'cross_path': 1}, memory=8,
    network={'mlp1': [8, 6], 'mlp2': [6, 4], 'attention': [5, 1], 'mlp3': [8, 1]})


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """Return a folder that stands for the source tree."""
    monkeypatch.setattr(export, 'share_directory', lambda: tmp_path)
    (tmp_path / 'code.py').write_text('one = 1\n')
    return tmp_path


def git(tree, *arguments):
    # A newcomer's git has no name yet; settings of whoever runs the suite must not matter.
    clean = {'GIT_CONFIG_GLOBAL': os.devnull, 'GIT_CONFIG_NOSYSTEM': '1'}
    return subprocess.run(
        ['git', '-c', 'user.name=one', '-c', 'user.email=one@example.com', *arguments],
        cwd=tree, env=os.environ | clean, check=True, capture_output=True, text=True).stdout


def test_the_commit_is_told_and_whether_the_tree_differs_from_it(tree):
    git(tree, 'init', '-q')
    git(tree, 'add', '.')
    git(tree, 'commit', '-q', '-m', 'One')
    head = git(tree, 'rev-parse', '--short=12', 'HEAD').strip()

    assert export.commit() == head
    (tree / 'code.py').write_text('one = 2\n')
    assert export.commit() == f'{head}+'


def test_an_installed_package_has_no_commit_to_tell(tree):
    assert export.commit() == 'unknown'


def test_a_machine_without_git_does_no_harm(tree, monkeypatch):
    monkeypatch.setenv('PATH', str(tree))

    assert export.commit() == 'unknown'


@pytest.mark.parametrize('motion', ['', 'motion'])
def test_the_motion_model_that_was_trained_with_goes_along(tmp_path, motion):
    trainer = Trainer(replace(TINY, motion=motion), tmp_path)
    trainer.counts.update(episodes=12, seconds=3.25)

    metadata = export.export_weights(trainer, tmp_path / 'weights.npz')

    loaded = load_value_function(tmp_path / 'weights.npz')
    assert (loaded.motion is not None) == bool(motion)
    assert loaded.metadata['training']['episodes'] == metadata['training']['episodes'] == 12
    assert loaded.metadata['decision'] == {'horizons': [2, 4, 6], 'turns': [1], 'caution': 0.15,
                                           'aversion': 0.0}
