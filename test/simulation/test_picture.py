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
"""The image of a scene: everybody where they are, x to the right and y up."""

import numpy as np
import pytest

from wallnav_ros.simulation.picture import (
    BACKGROUND, draw_scene, GOAL, MARGIN, ROBOT, SIZE, STANDING, WALKING, WALL)
from wallnav_ros.world.state import Agents, Robot
from wallnav_ros.world.walls import Walls

# 8 m wide and 4 m high.
ROOM = Walls.from_polylines([[(-2, -1), (6, -1), (6, 3), (-2, 3)]], closed=True)
SCALE = SIZE / (8.0 + 2.0 * MARGIN)
HERE = Robot(np.array([0.0, 0.0, 0.0]), np.zeros(2), np.array([5.0, 2.0]), np.float64(0.3),
             np.float64(0.8))
PEOPLE = Agents(np.array([[2.0, 2.0], [3.0, 0.0], [4.0, 1.0]]),
                np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.0]]), np.array([0.3, 0.3, 0.3]),
                np.array([True, True, False]))


@pytest.fixture(scope='module')
def image():
    return draw_scene(ROOM, HERE, PEOPLE)


def colour_at(image, x, y):
    """Return the colour, three numbers, at (x, y) in metres."""
    row = image.shape[0] - (y + 1.0 + MARGIN) * SCALE
    return tuple(image[int(row), int((x + 2.0 + MARGIN) * SCALE)].tolist())


def test_the_longer_side_has_the_size_and_metres_are_as_long_both_ways(image):
    assert image.dtype == np.uint8
    assert image.shape == (np.ceil((4.0 + 2.0 * MARGIN) * SCALE), SIZE, 3)


@pytest.mark.parametrize('x, y, colour', [
    # Beside the line that shows where the robot heads.
    (-0.1, 0.1, ROBOT), (5.0, 2.0, GOAL), (2.0, 2.0, STANDING), (3.0, 0.0, WALKING),
    (6.0, 1.0, WALL), (-2.0, 1.0, WALL),
    # The third of the agents is not there, nor is anybody upside down.
    (4.0, 1.0, BACKGROUND), (2.0, 0.0, BACKGROUND), (3.0, 2.0, BACKGROUND)])
def test_everybody_is_where_they_are(image, x, y, colour):
    assert colour_at(image, x, y) == colour


def test_a_disc_is_as_large_as_its_radius(image):
    standing = (image == STANDING).all(axis=-1).sum() / SCALE ** 2

    assert standing == pytest.approx(np.pi * 0.3 ** 2, rel=0.1)


def test_the_heading_is_drawn_ahead_of_the_robot(image):
    assert colour_at(image, 0.2, 0.0) == BACKGROUND
    assert colour_at(image, -0.2, 0.0) == ROBOT
