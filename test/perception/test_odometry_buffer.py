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
"""Poses between odometry messages, beyond them, and across a jump of the clock."""

import numpy as np
import pytest

from wallnav_ros.perception.odometry_buffer import PoseBuffer


def test_a_pose_lies_between_its_neighbours():
    buffer = PoseBuffer()
    buffer.add(1.0, (0.0, 0.0, 0.0))
    buffer.add(2.0, (1.0, 2.0, 0.4))
    np.testing.assert_allclose(buffer.at(1.25), [0.25, 0.5, 0.1])


def test_a_turn_takes_the_short_way_round():
    buffer = PoseBuffer()
    buffer.add(0.0, (0.0, 0.0, 3.0))
    buffer.add(1.0, (0.0, 0.0, -3.0))
    assert abs(buffer.at(0.5)[2]) == pytest.approx(np.pi)


def test_the_last_motion_bridges_a_short_wait_only():
    buffer = PoseBuffer(extrapolation=0.3)
    buffer.add(0.0, (0.0, 0.0, 0.0))
    buffer.add(0.1, (0.1, 0.0, 0.0))
    np.testing.assert_allclose(buffer.at(0.3), [0.3, 0.0, 0.0])
    assert buffer.at(0.5) is None


def test_nothing_is_known_before_the_first_pose_or_inside_a_long_gap():
    buffer = PoseBuffer(extrapolation=0.3, max_gap=1.0)
    assert buffer.at(0.0) is None
    buffer.add(10.0, (0.0, 0.0, 0.0))
    buffer.add(14.0, (4.0, 0.0, 0.0))
    assert buffer.at(9.0) is None
    assert buffer.at(12.0) is None
    np.testing.assert_allclose(buffer.at(13.9), [4.0, 0.0, 0.0])


def test_a_clock_set_back_starts_the_history_anew():
    buffer = PoseBuffer()
    buffer.add(100.0, (9.0, 9.0, 0.0))
    buffer.add(5.0, (1.0, 0.0, 0.0))
    assert len(buffer) == 1 and buffer.at(100.0) is None
    np.testing.assert_allclose(buffer.at(5.0), [1.0, 0.0, 0.0])


@pytest.mark.parametrize('pose', [(np.nan, 0.0, 0.0), (0.0, np.inf, 0.0), (0.0, 0.0)])
def test_a_pose_that_is_none_is_dropped(pose):
    buffer = PoseBuffer()
    assert not buffer.add(0.0, pose)
    assert len(buffer) == 0
