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
"""The state the policy sees: shapes hold for none, one or a batch."""

import dataclasses

import numpy as np
import pytest

from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.state import Agents, Observation, Robot


def test_agents_given_are_all_present():
    agents = Agents.of([[1, 2], [3, 4]], [[0, 0], [1, 0]], [0.3, 0.4])

    assert agents.position.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert agents.velocity.tolist() == [[0.0, 0.0], [1.0, 0.0]]
    assert agents.present.tolist() == [True, True]


def test_a_batch_of_agents_keeps_its_leading_axes():
    agents = Agents.of(np.zeros((5, 3, 2)), np.zeros((5, 3, 2)), np.full((5, 3), 0.3))

    assert agents.position.shape == (5, 3, 2)
    assert agents.present.shape == (5, 3)


def test_nobody_is_a_set_of_agents_too():
    agents = Agents.none()

    assert agents.position.shape == agents.velocity.shape == (0, 2)
    assert agents.radius.shape == agents.present.shape == (0,)


def test_positions_that_do_not_fit_the_radii_are_refused():
    with pytest.raises(ValueError):
        Agents.of(np.zeros((3, 2)), np.zeros((3, 2)), [0.3, 0.4])


def test_the_position_of_a_robot_is_the_first_part_of_its_pose():
    robot = Robot(np.array([[1.0, 2.0, 0.5]]), np.zeros((1, 2)), np.zeros((1, 2)),
                  np.array([0.2]), np.array([0.8]))

    assert robot.position.tolist() == [[1.0, 2.0]]


def test_an_observation_cannot_be_changed():
    robot = Robot(np.zeros(3), np.zeros(2), np.zeros(2), np.array(0.2), np.array(0.8))
    observation = Observation(robot, Agents.none(), DistanceField.empty())

    with pytest.raises(dataclasses.FrozenInstanceError):
        observation.robot = None
