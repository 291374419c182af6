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
"""A path handed in: sub-goals as far along it as the robot can see, and what is left of it."""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.navigation.given_path import GivenPath, OPEN_SIGHT
from wallnav_ros.world.walls import Walls

# Ten metres east, then ten north, a point every half metre.
BEND = np.vstack((np.column_stack((np.arange(0.0, 10.0, 0.5), np.zeros(20))),
                  np.column_stack((np.full(21, 10.0), np.arange(0.0, 10.5, 0.5)))))


def walls_inside_the_bend():
    corner = [[[-1.0, 1.0], [9.0, 1.0]], [[9.0, 1.0], [9.0, 11.0]]]
    return distance_field(Walls(np.array(corner)))


def test_what_is_left_counts_the_way_to_the_path_and_on_along_it():
    path = GivenPath(BEND, None, 0.2)
    assert path.to_go(np.array([0.0, 0.0])) == pytest.approx(20.0)
    assert path.to_go(np.array([10.3, 4.0])) == pytest.approx(6.3)


def test_a_sub_goal_lies_on_the_path_as_far_as_can_be_looked():
    target, beyond = GivenPath(BEND, None, 0.2).guide(np.array([1.0, 0.2]))
    np.testing.assert_allclose(target, [1.0 + OPEN_SIGHT, 0.0])
    assert beyond == pytest.approx(20.0 - 1.0 - OPEN_SIGHT)


def test_a_sub_goal_is_not_sought_through_a_wall():
    path = GivenPath(BEND, walls_inside_the_bend(), 0.3)
    target, beyond = path.guide(np.array([7.0, 0.0]))
    # The corner at (9, 1) hides what lies far up the second leg from 3 m before the bend.
    assert target[0] == 10.0 and target[1] < 2.0
    assert beyond == pytest.approx(10.0 - target[1])
    target, _ = path.guide(np.array([10.0, 0.0]))
    np.testing.assert_allclose(target, [10.0, 6.0])


def test_at_the_end_the_last_point_is_the_goal_and_nothing_is_beyond():
    target, beyond = GivenPath(BEND, None, 0.2).guide(np.array([10.1, 9.2]))
    np.testing.assert_allclose(target, [10.0, 10.0])
    assert beyond == 0.0


def test_a_path_of_one_point_is_its_goal():
    path = GivenPath(np.array([[3.0, 4.0]]), None, 0.2)
    assert path.to_go(np.zeros(2)) == pytest.approx(5.0)
    target, beyond = path.guide(np.zeros(2))
    np.testing.assert_allclose(target, [3.0, 4.0])
    assert beyond == 0.0


def test_where_a_path_crosses_itself_the_robot_takes_the_shorter_rest():
    eight = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [1.0, 2.0], [1.0, 0.0], [1.0, -1.0]])
    assert GivenPath(eight, None, 0.2).to_go(np.array([1.0, 0.0])) == pytest.approx(1.0)
