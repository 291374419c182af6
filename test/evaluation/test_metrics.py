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
Comfort of a drive: jerk and time in personal space, worked by hand.

Hall's distances: 0.45 m and 1.2 m.
"""

import numpy as np
import pytest
from wallnav_ros.evaluation.metrics import comfort, mean_jerk
from wallnav_ros.simulation.rollout import EpisodeResult

pytestmark = pytest.mark.extras


def test_a_steady_drive_and_a_steady_acceleration_have_no_jerk():
    time = 0.25 * np.arange(9)[:, None]

    assert mean_jerk(time * [0.8, 0.3], 0.25) == pytest.approx(0.0, abs=1e-9)
    assert mean_jerk(time ** 2 * [0.4, -0.1], 0.25) == pytest.approx(0.0, abs=1e-9)


def test_a_cubic_path_has_the_jerk_of_its_third_derivative():
    """With x = t^3 / 2 and y = t^3 / 3: third derivatives 3 and 2 m/s^3."""
    time = 0.25 * np.arange(9)[:, None]

    assert mean_jerk(time ** 3 * [0.5, 1.0 / 3.0], 0.25) == pytest.approx(np.hypot(3.0, 2.0))


def test_a_sudden_stop_has_the_jerk_of_its_step():
    """From 0.2 m a step to 0: second differences 0, -0.2, 0, third -0.2 and 0.2 m."""
    x = np.array([0.0, 0.2, 0.4, 0.4, 0.4])

    assert mean_jerk(np.stack((x, 0 * x), axis=1), 0.25) == pytest.approx(0.2 / 0.25 ** 3)


@pytest.mark.parametrize('poses', [0, 1, 3])
def test_a_path_too_short_to_have_one_has_none(poses):
    assert mean_jerk(np.zeros((poses, 3)), 0.25) == 0.0


def test_time_near_people_is_counted_by_steps():
    gaps = np.array([2.0, 1.3, 1.1, 0.46, 0.44, -0.1, np.inf, 1.2])
    result = EpisodeResult('cross_path', 'mixed', 0, 'collision', 2.0, 1.0, -0.1, 1.0, {},
                           np.zeros((9, 3)), gaps)

    figures = comfort(result)

    assert figures['intimate_time'] == pytest.approx(2 * 0.25)
    assert figures['personal_time'] == pytest.approx(4 * 0.25)
