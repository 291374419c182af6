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
"""What the base can do: actions it can carry out, ramps it can follow, commands on their way."""

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.navigation.base import achievable, BaseLimits, Ramp
from wallnav_ros.policy.actions import make_actions, STOP

LIMITS = BaseLimits(acceleration=1.0, turn_acceleration=4.0, latency=0.1)
AHEAD = np.array([0.8, 0.0])


def test_turn_rates_are_cut_to_what_the_base_can_do():
    actions = achievable(make_actions(1.8), BaseLimits(max_turn_rate=1.0))
    assert np.abs(actions.turn_rate).max() == 1.0
    np.testing.assert_array_equal(actions.speed, make_actions(1.8).speed)


def test_turns_too_slow_for_the_base_become_none_or_the_slowest_it_can():
    actions = achievable(make_actions(1.8), BaseLimits(min_turn_rate=0.5))
    rates = np.unique(actions.turn_rate)
    assert not ((np.abs(rates) > 0.0) & (np.abs(rates) < 0.5)).any()
    # 0.225 rad/s is nearer to none, 0.45 rad/s to the slowest.
    assert {-0.5, 0.0, 0.5, 0.675} <= set(np.round(rates, 9))
    assert actions.turn_rate[STOP] == 0.0


def test_a_ramp_rises_by_what_the_base_can_follow_and_ends_at_the_command():
    ramp, given = Ramp(LIMITS), []
    for step in range(20):
        now = 0.05 * step
        given.append(ramp.give(ramp.towards(AHEAD, now, 0.05), now)[0])
    np.testing.assert_allclose(np.diff([0.0, *given])[:16], 0.05, atol=1e-9)
    np.testing.assert_allclose(given[16:], 0.8, atol=1e-9)


def test_a_command_between_two_steps_does_not_make_the_ramp_steeper():
    ramp = Ramp(LIMITS)
    ramp.give(ramp.towards(AHEAD, 0.0, 0.05), 0.0)
    # 0.01 s later the base has reached 0.01 m/s and can add 0.05 within a period.
    assert ramp.towards(AHEAD, 0.01, 0.05)[0] == pytest.approx(0.06)


def test_a_ramp_starts_from_where_braking_has_left_the_base():
    ramp = Ramp(LIMITS)
    ramp.give(AHEAD, 0.0)
    ramp.give(np.zeros(2), 1.0)
    assert ramp.towards(AHEAD, 1.5, 0.05)[0] == pytest.approx(0.35)


def test_commands_take_effect_one_latency_after_they_were_given():
    ramp = Ramp(LIMITS)
    for now, speed in ((0.0, 0.1), (0.05, 0.2), (0.1, 0.3)):
        ramp.give(np.array([speed, 0.0]), now)
    # At 0.1 s the first one takes effect, 0.05 s later the second, and so on.
    np.testing.assert_allclose(ramp.in_effect(0.1, [0.0, 0.05, 0.1])[:, 0], [0.1, 0.2, 0.3])


def test_before_any_command_the_base_stands():
    assert not Ramp(LIMITS).in_effect(5.0, [0.0, 0.05]).any()


def test_limits_that_are_lowered_hold_at_once():
    ramp = Ramp(LIMITS)
    ramp.give(AHEAD, 0.0)
    ramp.limits = replace(LIMITS, max_speed=0.3)
    assert ramp.towards(AHEAD, 1.0, 0.05)[0] == 0.3
