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
The action set: stop, and speeds times turn rates that any robot can scale.

Paper section 1: 81 actions, the turn per step bounded.
"""

import numpy as np
import pytest

from wallnav_ros.policy.actions import make_actions, STOP


def test_there_are_81_actions_and_the_first_one_stops():
    commands = make_actions().commands(0.8)

    assert commands.shape == (81, 2)
    assert STOP == 0
    assert commands[STOP].tolist() == [0.0, 0.0]


def test_no_two_actions_are_alike_and_only_one_stands_still():
    commands = make_actions().commands(0.8)

    assert len(np.unique(commands, axis=0)) == 81
    assert (commands[1:, 0] > 0.0).all()


def test_every_speed_can_go_straight_ahead():
    commands = make_actions().commands(1.0)

    straight = commands[commands[:, 1] == 0.0, 0]

    assert len(straight) == 6     # the five speeds, and standing still
    assert straight.max() == 1.0


def test_speeds_are_spaced_exponentially_up_to_the_preferred_speed():
    # (e^(k/5) - 1) / (e - 1) for k = 1 ... 5.
    expected = [0.128851, 0.286231, 0.478454, 0.713236, 1.0]

    assert np.unique(make_actions().speed)[1:] == pytest.approx(expected, abs=1e-6)


def test_commands_scale_with_the_preferred_speed_and_turns_do_not():
    actions = make_actions()

    slow, fast = actions.commands(np.array([0.4, 0.8]))

    assert fast[:, 0] == pytest.approx(2.0 * slow[:, 0])
    assert (fast[:, 1] == slow[:, 1]).all()


@pytest.mark.parametrize('bound', [0.5, 1.8])
def test_no_turn_is_faster_than_the_bound(bound):
    turn_rate = make_actions(max_turn_rate=bound).turn_rate

    assert np.abs(turn_rate).max() == bound
    assert len(np.unique(turn_rate)) == 16


def test_both_ways_to_turn_are_offered_alike_but_for_the_fastest():
    turn_rate = np.unique(make_actions(max_turn_rate=1.6).turn_rate)

    # Sixteen headings 0.2 rad/s apart: one way has one more of them, as zero is among them.
    assert turn_rate == pytest.approx(np.arange(-8, 8) * 0.2)


def test_other_numbers_of_speeds_and_turns_may_be_asked_for():
    assert make_actions(speeds=2, turns=3).commands(1.0).shape == (7, 2)
