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
"""The tracks' states, against the Kalman filter of the textbook; their birth, life and trails."""

import numpy as np
import pytest
from track_tables import make_table

from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.track_table import TrackTable, TRAIL

SETTINGS = TrackerSettings(acceleration_noise=0.4, rest_time=0.3, fastest=3.0)


def matrices(table, row):
    """Return state (2,) and covariance (2, 2) of the x coordinate of a track."""
    place, cross, speed = table.covariance[row]
    return (np.array([table.position[row, 0], table.velocity[row, 0]]),
            np.array([[place, cross], [cross, speed]]))


def test_a_prediction_is_that_of_the_textbook():
    table = make_table([[1.0, 2.0], [3.0, 4.0]], velocity=[[0.5, -0.2], [0.0, 1.0]],
                       covariance=[[0.04, 0.01, 0.09], [0.01, 0.0, 0.25]])
    before = [matrices(table, row) for row in range(2)]
    table.predict(0.2, SETTINGS)
    step = np.array([[1.0, 0.2], [0.0, 1.0]])
    noise = 0.4 ** 2 * np.array([[0.2 ** 3 / 3.0, 0.2 ** 2 / 2.0], [0.2 ** 2 / 2.0, 0.2]])
    for row, (state, spread) in enumerate(before):
        after, spread_after = matrices(table, row)
        np.testing.assert_allclose(after, step @ state)
        np.testing.assert_allclose(spread_after, step @ spread @ step.T + noise)
    np.testing.assert_allclose(table.position[:, 1], [1.96, 4.2])


def test_two_short_predictions_are_one_long_one():
    tables = [make_table([[0.0, 0.0]], velocity=[1.0, 0.5], covariance=[0.04, 0.01, 0.09])
              for _ in range(2)]
    tables[0].predict(0.3, SETTINGS)
    tables[1].predict(0.1, SETTINGS)
    tables[1].predict(0.2, SETTINGS)
    np.testing.assert_allclose(tables[0].position, tables[1].position)
    np.testing.assert_allclose(tables[0].covariance, tables[1].covariance)


def test_a_correction_is_that_of_the_textbook_and_leaves_other_rows_alone():
    table = make_table([[1.0, 2.0], [3.0, 4.0]], velocity=[[0.5, -0.2], [0.0, 1.0]],
                       covariance=[0.04, 0.01, 0.09], seen=5.0)
    state, spread = matrices(table, 0)
    table.correct(np.array([0]), np.array([[1.2, 2.0]]), np.array([0.1]), 6.0)
    gain = spread[:, 0] / (spread[0, 0] + 0.1 ** 2)
    after, spread_after = matrices(table, 0)
    np.testing.assert_allclose(after, state + gain * 0.2)
    np.testing.assert_allclose(spread_after, spread - np.outer(gain, spread[0]))
    np.testing.assert_allclose(table.position[1], [3.0, 4.0])
    assert table.seen.tolist() == [6.0, 5.0]


def test_a_steady_walker_is_known_to_a_few_centimetres_within_a_second(rng):
    table = make_table([[0.0, 0.0]], covariance=[0.1 ** 2, 0.0, 1.0])
    for step in range(1, 31):
        table.predict(0.1, SETTINGS)
        seen = np.array([[0.1 * step, 0.0]]) + rng.normal(0.0, 0.03, (1, 2))
        table.correct(np.array([0]), seen, np.array([0.03]), 0.1 * step)
        if step >= 10:
            assert np.hypot(*(table.position[0] - [0.1 * step, 0.0])) < 0.08
    np.testing.assert_allclose(table.velocity[0], [1.0, 0.0], atol=0.25)


def walk(settings, rng, steps=60):
    """Return how fast (S, 2) both filters have somebody walk along x who turns back half way."""
    table = TrackTable()
    table.add(np.zeros((1, 2)), np.full(1, 0.2), np.zeros(1), 0.0, settings)
    told, x = [], 0.0
    for step in range(1, steps + 1):
        x += 0.1 if step <= steps // 2 else -0.1
        table.predict(0.1, settings)
        table.correct(np.array([0]), np.array([[x, 0.0]]) + rng.normal(0.0, 0.03, (1, 2)),
                      np.array([0.03]), 0.1 * step)
        told.append((table.velocity[0, 0], table.steady_velocity[0, 0]))
    return np.array(told)


def test_the_steady_filter_tells_who_goes_on_better_and_lags_behind_who_turns(rng):
    quick, steady = walk(TrackerSettings(acceleration_noise=0.4, steady_noise=0.25), rng).T
    assert np.std(steady[10:30] - 1.0) < 0.9 * np.std(quick[10:30] - 1.0)
    assert np.mean(steady[30:35]) > np.mean(quick[30:35])


def test_with_the_same_noise_both_filters_are_one(rng):
    quick, steady = walk(TrackerSettings(acceleration_noise=0.3, steady_noise=0.3), rng).T
    np.testing.assert_array_equal(quick, steady)


def test_nobody_runs_faster_than_people_do():
    table = make_table([[0.0, 0.0]], velocity=[6.0, 8.0])
    table.predict(0.1, SETTINGS)
    np.testing.assert_allclose(table.velocity, [[1.8, 2.4]])


def test_the_velocity_of_what_seems_to_stand_dies_away():
    table = make_table(np.zeros((2, 2)), velocity=[1.0, 0.0], motion=[-2.0, 0.0])
    table.predict(0.3, SETTINGS)
    np.testing.assert_allclose(table.velocity[:, 0], [np.exp(-1.0), 1.0])


def test_only_the_rows_that_are_kept_stay_in_every_column():
    table = make_table(np.arange(6.0).reshape(3, 2), radius=[0.1, 0.2, 0.3])
    table.keep(np.array([True, False, True]))
    assert table.id.tolist() == [1, 3] and table.radius.tolist() == [0.1, 0.3]
    assert {len(getattr(table, name)) for name in TrackTable.COLUMNS} == {2}


def test_the_trail_holds_the_last_places_newest_first():
    table = make_table([[0.0, 0.0]])
    for step in range(1, TRAIL + 3):
        table.position = table.place = np.array([[float(step), 0.0]])
        table.lay_trail(0.2 * step, 0.2)
    assert table.trail[0, :, 0].tolist() == [float(step) for step in range(TRAIL + 2, 2, -1)]


def test_the_trail_has_its_own_pace_whatever_that_of_the_scans():
    table = make_table([[0.0, 0.0]])
    for step in range(1, 21):
        table.position = table.place = np.array([[float(step), 0.0]])
        table.lay_trail(0.05 * step, 0.2)
    np.testing.assert_allclose(np.diff(table.trail[0, :5, 0]), -4.0)


def test_reach_is_the_furthest_from_where_it_was_born():
    table = make_table([[0.0, 0.0]])
    for x in (1.0, 3.0, 2.0):
        table.position = np.array([[x, 0.0]])
        table.lay_trail(x, 0.2)
    assert table.reach.tolist() == [3.0]


def start(table, places, stamp=1.0):
    """Start tracks at `places`."""
    places = np.asarray(places, dtype=float).reshape(-1, 2)
    table.add(places, np.full(len(places), 0.2), np.zeros(len(places)), stamp, SETTINGS)


def test_tracks_are_born_at_rest_where_they_are_seen():
    table = TrackTable()
    start(table, [[1.0, 2.0], [3.0, 4.0]], stamp=7.0)
    assert table.position.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert not table.velocity.any() and not table.human.any() and not table.score.any()
    assert table.seen.tolist() == [7.0, 7.0]
    assert (table.trail == table.position[:, None]).all()


@pytest.mark.parametrize('end', [TrackTable.clear,
                                 lambda table: table.keep(np.zeros(len(table), bool))])
def test_identities_are_never_used_again(end):
    table = TrackTable()
    start(table, [[0.0, 0.0], [1.0, 0.0]])
    end(table)
    assert len(table) == 0
    start(table, [[0.0, 0.0]])
    start(table, [])
    start(table, [[5.0, 0.0]])
    assert table.id.tolist() == [3, 4] and table.id.dtype == np.uint32
