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
"""Scores worked by hand, and the simulator's truth as a floor no tracker may fall through."""

import numpy as np
import pytest

motmetrics = pytest.importorskip('motmetrics')

from wallnav_ros.evaluation.tracking import (  # noqa: E402
    clear_mot, longest_stray, people_seen, TrackedScan)
from wallnav_ros.evaluation.tracking_simulation import score_simulation  # noqa: E402
from wallnav_ros.simulation.scenarios import load_scenario  # noqa: E402


def frame(truth, tracks):
    """Return a frame for `clear_mot` of {id: (x, y)} twice."""
    return (list(truth), np.array(list(truth.values())).reshape(-1, 2),
            list(tracks), np.array(list(tracks.values())).reshape(-1, 2))


def test_a_switch_a_miss_and_a_false_alarm_each_cost_a_quarter():
    # Four true positions: one is missed, one changes its track, and one track is of nobody.
    scores = clear_mot([frame({1: (0, 0), 2: (5, 0)}, {7: (0.1, 0), 8: (5, 0.3)}),
                        frame({1: (0, 0), 2: (5, 0)}, {9: (0.2, 0), 4: (9, 9)})])
    assert (scores.recall, scores.precision, scores.objects) == (0.75, 0.75, 4)
    assert scores.switches == 1
    assert scores.mota == pytest.approx(1.0 - 3.0 / 4.0)
    assert scores.motp == pytest.approx((0.1 + 0.3 + 0.2) / 3.0)


def test_a_track_beyond_the_gate_finds_nobody():
    assert clear_mot([frame({1: (0, 0)}, {1: (0.8, 0)})]).recall == 0.0


def tracked(stamp, position, label):
    return TrackedScan(stamp, stamp, np.zeros(3), np.array([[2.0, 0.0]]),
                       np.array([3]), np.array([label]), np.array([position]))


def test_humans_are_counted_by_identity():
    scans = [tracked(0.0, (2.0, 0.0), 1), tracked(0.1, (2.0, 0.0), 1),
             tracked(0.2, (2.0, 0.0), 0)]
    assert people_seen(scans) == (1, pytest.approx(2.0 / 3.0))


def test_a_stray_lasts_while_it_is_far_from_every_beam():
    scans = [tracked(stamp, (x, 0.0), 1)
             for stamp, x in ((0.0, 2.0), (0.5, 2.6), (1.0, 2.7), (1.5, 2.0))]
    assert longest_stray(scans) == pytest.approx(0.5)


def test_the_simulated_crowd_is_followed():
    found = score_simulation(load_scenario('cross_path'), 'mixed', range(1), duration=10.0)
    assert found.scores.mota > 0.8
    assert found.velocity_rmse < 0.25
    assert found.label_accuracy > 0.7
    # Who has walked half a metre has shown it.
    assert found.decided_accuracy > max(found.label_accuracy, 0.9)
