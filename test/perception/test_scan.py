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
"""Which beams of a scan count, and which scans cannot be used."""

import numpy as np
import pytest

from wallnav_ros.perception.scan import Scan, ScanError


def make_scan(ranges, angle_min=0.0, angle_increment=0.1, range_min=0.1, range_max=10.0, **more):
    return Scan(0.0, ranges, angle_min, angle_increment, range_min, range_max, **more)


def test_only_finite_ranges_within_the_limits_are_hits():
    scan = make_scan([np.nan, np.inf, -np.inf, 0.0, 0.05, 0.1, 5.0, 10.0, 10.1])
    assert scan.hits.tolist() == [False] * 5 + [True] * 3 + [False]


def test_beyond_the_range_is_free_and_an_error_is_not():
    scan = make_scan([np.inf, 10.1, np.nan, -np.inf, 0.0, 5.0])
    assert scan.clear.tolist() == [True, True, False, False, False, False]


@pytest.mark.parametrize('step', [0.1, -0.1])
def test_beams_follow_the_sign_of_the_increment(step):
    np.testing.assert_allclose(
        make_scan([1.0] * 3, angle_min=0.5, angle_increment=step).angles,
        [0.5, 0.5 + step, 0.5 + 2 * step])


@pytest.mark.parametrize('field, values', [
    ('ranges', {'ranges': []}),
    ('angle_min', {'angle_min': np.nan}),
    ('angle_increment', {'angle_increment': np.inf}),
    ('angle_increment', {'angle_increment': 0.0}),
    ('angle_increment', {'angle_increment': 7.0}),
    ('range_max', {'range_max': 0.05}),
    ('range_max', {'range_max': np.nan}),
])
def test_a_meaningless_scan_is_refused_naming_the_field(field, values):
    with pytest.raises(ScanError, match=f'^{field}: '):
        make_scan(**{'ranges': [1.0, 1.0], **values})


def test_one_beam_is_a_scan():
    assert make_scan([1.0], angle_increment=0.0).hits.tolist() == [True]


def test_a_turn_of_beams_is_a_full_circle_and_a_half_is_none():
    turn = make_scan(np.ones(360), angle_increment=2 * np.pi / 360)
    assert turn.full_circle
    assert not make_scan(np.ones(180), angle_increment=2 * np.pi / 360).full_circle


def test_the_sweep_lasts_from_the_first_beam_to_the_last():
    assert make_scan(np.ones(11), time_increment=0.01).sweep_time == pytest.approx(0.1)
    assert make_scan(np.ones(11), time_increment=-1.0).sweep_time == 0.0
