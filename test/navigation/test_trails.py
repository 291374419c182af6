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
"""Trails: where people were, told from tracks at any rate."""

import numpy as np
import pytest

from wallnav_ros.navigation.trails import Trails
from wallnav_ros.policy.motion import HISTORY, PAST
from wallnav_ros.world.tracks import HUMAN, OBSTACLE, Tracks


def tracks(stamp, *rows):
    """Return Tracks of (id, x, y, label) rows at `stamp`."""
    ids, x, y, label = zip(*rows) if rows else ((),) * 4
    position = np.stack((np.array(x, float), np.array(y, float)), axis=1).reshape(-1, 2)
    return Tracks(stamp, np.array(ids, np.uint32), position, np.zeros_like(position),
                  np.full(len(ids), 0.3), np.array(label, np.uint8))


def walk(trails, rate, seconds, label=HUMAN):
    """Let somebody walk along x at 1 m/s; returns the last tracks."""
    for number in range(int(rate * seconds) + 1):
        last = tracks(number / rate, (7, number / rate, 0.5, label), (9, 3.0, 3.0, OBSTACLE))
        trails.take(last)
    return last


@pytest.mark.parametrize('rate', [5.0, 7.5, 10.0, 40.0])
def test_a_walk_is_told_in_time_steps_at_any_scan_rate(rate):
    trails = Trails(0.25)
    last = walk(trails, rate, 6.0)
    trail = trails.of(last)

    assert trail.shape == (2, HISTORY, 2)
    expected = last.position[0, 0] - 0.25 * np.arange(1, PAST + 1)
    assert trail[0, :PAST, 0] == pytest.approx(expected, abs=1e-9)
    assert (trail[0, :PAST, 1] == 0.5).all()


@pytest.mark.parametrize('rate', [5.0, 7.5, 10.0, 40.0])
def test_what_is_long_ago_is_told_to_the_nearest_step(rate):
    trails = Trails(0.25)
    last = walk(trails, rate, 30.0)
    older = trails.of(last)[0, PAST:]
    known = np.isfinite(older[:, 0])

    # It came at 0 s, 30 s ago: 120 steps. Within a step and a scan of where it was.
    assert known.sum() == pytest.approx(120 - PAST, abs=1)
    expected = last.position[0, 0] - 0.25 * np.arange(PAST + 1, HISTORY + 1)
    assert older[known, 0] == pytest.approx(expected[known], abs=0.25 + 1.0 / rate)


def test_what_is_no_person_is_taken_to_have_stood_where_it_is():
    trails = Trails(0.25)
    trail = trails.of(walk(trails, 10.0, 6.0))[1]

    assert (trail[:PAST] == [3.0, 3.0]).all()
    assert np.isnan(trail[PAST:]).all()


def test_a_newcomer_is_known_since_it_came():
    trails = Trails(0.25)
    trails.take(tracks(0.0))
    trails.take(tracks(0.1))
    for number in range(2, 12):
        last = tracks(0.1 * number, (3, 0.1 * number, 0.0, HUMAN))
        trails.take(last)
    known = np.isfinite(trails.of(last)[0]).all(axis=1)

    # Seen for 0.9 s: 0.25, 0.5 and 0.75 s ago.
    assert known.tolist() == [True] * 3 + [False] * (HISTORY - 3)


def test_nothing_is_told_across_a_gap():
    trails = Trails(0.25)
    trails.take(tracks(0.0, (3, 0.0, 0.0, HUMAN)))
    last = tracks(1.0, (3, 1.0, 0.0, HUMAN))
    trails.take(last)

    assert np.isnan(trails.of(last)).all()


def test_somebody_who_comes_back_after_a_gap_is_remembered_where_it_was():
    trails = Trails(0.25)
    trails.take(tracks(0.0, (3, 0.0, 0.0, HUMAN)))
    trails.take(tracks(10.0))
    last = tracks(10.1, (3, 4.0, 0.0, HUMAN))
    trails.take(last)
    trail = trails.of(last)[0]

    # Ten seconds are forty steps.
    assert np.flatnonzero(np.isfinite(trail[:, 0])).tolist() == [39]
    assert trail[39].tolist() == [0.0, 0.0]


def test_memory_is_bounded_and_can_be_lost():
    trails = Trails(0.25)
    last = walk(trails, 40.0, 60.0)
    for number in range(300):
        trails.take(tracks(60.1 + 0.25 * number, (100 + number, 0.0, 0.0, HUMAN)))

    assert len(trails._memories) < 70
    assert len(trails._ids) <= HISTORY + 1
    trails.forget()
    assert np.isnan(trails.of(last)[0]).all()
