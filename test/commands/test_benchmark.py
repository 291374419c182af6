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
The benchmark command: what it is given is refused before minutes of measuring.

The stages themselves are tested in test_stages.py, training's rate in test_rate.py.
"""

import pytest
from refusals import refusal_by

rclpy = pytest.importorskip('rclpy')

from wallnav_ros.commands.benchmark import main  # noqa: E402

pytestmark = pytest.mark.extras


def test_weights_that_cannot_be_used_end_with_status_2_and_one_line(tmp_path, capsys):
    (tmp_path / 'weights.npz').write_bytes(b'noise')

    assert 'nobody: no such file' in refusal_by('benchmark', main, capsys, '--model', 'nobody')
    assert 'not a readable .npz' in refusal_by(
        'benchmark', main, capsys, '--model', str(tmp_path / 'weights.npz'))


@pytest.mark.parametrize('arguments', [['--json', '/dev/null/x'], ['--json', ''], ['--quick']])
def test_bad_usage_ends_with_status_2(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)

    assert caught.value.code == 2
    assert 'usage: benchmark' in capsys.readouterr().err
