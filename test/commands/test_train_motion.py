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
"""The train_motion command: weights and a card, or one line that says what is wrong."""

import pytest
from wallnav_ros.commands.train_motion import main
from wallnav_ros.policy.motion_weights import load_motion

pytestmark = pytest.mark.extras


def test_weights_and_a_card_are_written(tmp_path, capsys):
    out = tmp_path / 'motion.npz'

    assert main(['--scenario', 'cross_path', '--crowds', '3', '--epochs', '1',
                 '--out', str(out)]) == 0

    training = load_motion(out).training
    assert training['crowds'] == 3
    card = out.with_suffix('.md').read_text()
    assert f"likeliest way\n  {training['unseen']['likeliest']:.3f} m" in card
    assert 'constant_velocity' in capsys.readouterr().out


def test_weights_whose_card_would_take_their_name_are_refused(tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        main(['--out', str(tmp_path / 'motion.md')])

    assert caught.value.code == 2
    assert 'ending in .npz' in capsys.readouterr().err


def test_a_device_that_is_not_there_is_refused_by_one_line(tmp_path, capsys):
    assert main(['--device', 'nowhere', '--out', str(tmp_path / 'm.npz')]) == 2

    error = capsys.readouterr().err
    assert error.startswith('train_motion: --device nowhere: ') and error.count('\n') == 1


def test_an_unknown_scenario_is_refused_by_one_line(tmp_path, capsys):
    assert main(['--scenario', 'nowhere', '--out', str(tmp_path / 'm.npz')]) == 2

    error = capsys.readouterr().err
    assert error.startswith('train_motion: ') and error.count('\n') == 1
    assert not (tmp_path / 'm.npz').exists()
