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
"""When an input is too old to move on, and when the clock cannot be trusted."""

import pytest

from wallnav_ros.navigation.watchdogs import ClockWatch, Feed


def feed_at(stamp, received, timeout=0.4):
    feed = Feed('scan', timeout)
    feed.arrived(stamp, received)
    return feed


def test_an_input_that_never_came_is_missing():
    assert Feed('scan', 0.4).fault(5.0).cause == 'scan_missing'


@pytest.mark.parametrize('stamp, received, now, cause', [
    (10.0, 10.0, 10.39, None),
    (10.0, 10.0, 10.41, 'scan_stale'),       # nothing came since
    (9.5, 10.0, 10.0, 'scan_stale'),         # came, but old already
    (10.49, 10.0, 10.0, None),               # stamps run a little ahead under sim time
    (10.6, 10.0, 10.0, 'scan_ahead')])
def test_age_counts_by_stamp_and_by_receipt(stamp, received, now, cause):
    fault = feed_at(stamp, received).fault(now)
    assert (fault and fault.cause) == cause


def test_the_last_refusal_is_named_while_nothing_usable_comes():
    feed = feed_at(10.0, 10.0)
    feed.refused('no beam is valid')
    assert 'no beam is valid' in feed.fault(11.0).detail
    feed.arrived(11.0, 11.0)
    assert 'no beam is valid' not in feed.fault(12.0).detail


def test_the_rate_is_that_of_arrivals():
    feed = Feed('scan', 0.4)
    for number in range(100):
        feed.arrived(0.1 * number, 0.1 * number)
    assert feed.rate == pytest.approx(10.0, rel=0.01)
    assert feed.count == 100


def test_a_clock_set_back_is_told_once():
    clock = ClockWatch()
    assert not clock.set_back(100.0, 0.0)
    assert not clock.set_back(99.95, 0.05)       # /clock out of order
    assert clock.set_back(50.0, 0.1)
    assert not clock.set_back(50.1, 0.2)
    assert clock.jumps == 1


def test_a_clock_that_stands_still_is_a_fault_until_it_moves():
    clock = ClockWatch()
    clock.set_back(100.0, 0.0)
    clock.set_back(100.0, 0.6)
    assert clock.fault(0.6).cause == 'clock_stopped'
    clock.set_back(100.1, 0.7)
    assert clock.fault(0.7) is None


def test_time_zero_means_that_there_is_no_clock_yet():
    clock = ClockWatch()
    clock.set_back(0.0, 0.0)
    assert clock.fault(0.1).cause == 'clock_missing'
