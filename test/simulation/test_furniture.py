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
"""Chairs: four thin legs, where the chair stands and turned as it is."""

import numpy as np
import pytest

from wallnav_ros.simulation.furniture import chair_legs, LEG, SEAT


@pytest.mark.parametrize('pose', [(0.0, 0.0, 0.0), (3.0, -1.0, 0.0), (3.0, -1.0, 0.7)])
def test_a_chair_is_four_square_legs_at_the_corners_of_its_seat(pose):
    legs = np.array(chair_legs(np.array(pose)))
    centres = legs.mean(axis=1)

    assert legs.shape == (4, 4, 2)
    assert np.allclose(centres.mean(axis=0), pose[:2])
    # Round the seat, and round each leg, one side after the other is as long as it should be.
    for corners, side in [(centres, SEAT), *((leg, LEG) for leg in legs)]:
        assert np.allclose(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1), side)
        assert np.allclose(np.linalg.norm(corners - corners.mean(axis=0), axis=1), side / 2 ** 0.5)


def test_a_chair_turns_with_its_pose():
    straight, turned = (np.array(chair_legs(np.array([0.0, 0.0, yaw]))) for yaw in (0.0, 0.3))

    cos, sin = np.cos(0.3), np.sin(0.3)
    assert np.allclose(turned, straight @ np.array([[cos, sin], [-sin, cos]]))
