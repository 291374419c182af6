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
"""The laboratory tests as a command: real runs, a page and pictures about them."""

import json

import pytest

rclpy = pytest.importorskip('rclpy')
pyrvo = pytest.importorskip('pyrvo')

from wallnav_ros.commands.lab_tests import main  # noqa: E402

pytestmark = pytest.mark.extras


def test_drives_a_test_and_writes_the_page_about_it(tmp_path):
    page = tmp_path / 'docs' / 'lab.md'
    assert main(['--labs', 'lab_1', '--poses', 'noisy', '--runs', '1', '--seed', '3',
                 '--out', str(tmp_path / 'out'), '--page', str(page)]) == 0
    summary = json.loads((tmp_path / 'out' / 'lab_1_noisy' / 'summary.json').read_text())
    assert [run['outcome'] for run in summary['runs']] == ['goal']
    assert '| lab_1 | 5 cm and 2 degrees | 1 of 1 | 0 / 0 | 0 |' in page.read_text()
    assert (tmp_path / 'docs' / 'figures' / 'lab_1_noisy.png').stat().st_size > 10_000


@pytest.mark.parametrize('arguments', [
    ['--labs', 'lab_9'], ['--runs', '0'], ['--poses', 'wrong']])
def test_what_cannot_be_used_is_bad_usage(tmp_path, arguments):
    with pytest.raises(SystemExit) as ended:
        main(['--out', str(tmp_path / 'out'), *arguments])
    assert ended.value.code == 2


def test_weights_that_are_not_there_end_it_before_any_run(tmp_path, capsys):
    assert main(['--model', 'nowhere.npz', '--out', str(tmp_path / 'out')]) == 2
    assert 'nowhere' in capsys.readouterr().err
