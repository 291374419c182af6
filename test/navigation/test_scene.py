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
"""What is around the robot: the map, what the scanner sees of it, and where they differ."""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.navigation.localisation import Localisation
from wallnav_ros.navigation.scene import Scene
from wallnav_ros.perception.scan import Scan
from wallnav_ros.world.state import Robot
from wallnav_ros.world.tracks import Tracks
from wallnav_ros.world.walls import Walls

WALL_AHEAD = distance_field(Walls.from_polylines([[(1.0, -3.0), (1.0, 3.0)]]))
CLEARANCE = 0.03


def scene_with_wall_seen_at(distance):
    """Return a Scene at the origin of a map with a wall 1 m ahead, seen at `distance` m."""
    place = Localisation(np.zeros(3))
    place.add_odometry(1.0, np.zeros(3), np.zeros(2))
    scene = Scene(place, 0.25)
    scene.map_walls = WALL_AHEAD
    scene.take_scan(Scan(1.0, [distance], 0.0, 0.1, 0.05, 10.0), np.zeros(3))
    scene.tracks = Tracks.none(1.0)
    return scene


def robot():
    return Robot(np.zeros(3), np.zeros(2), np.array([5.0, 0.0]), np.float64(0.2),
                 np.float64(0.8), np.float64(0.0))


@pytest.mark.parametrize('seen, nearest', [
    # What is seen before the wall counts: the map or the pose in it may be wrong.
    (0.90, 0.90), (0.95, 0.95), (0.5, 0.5),
    # Within the clearance the map is believed, and beyond it the map's wall counts as well.
    (0.98, 1.0), (1.10, 1.0), (1.5, 1.0)])
def test_commands_are_checked_against_the_nearer_of_the_mapped_wall_and_the_one_seen(
        seen, nearest):
    near = scene_with_wall_seen_at(seen).observe_near(robot(), 1.0, 2.0, CLEARANCE)
    assert near.walls.at(np.zeros(2)) == pytest.approx(nearest, abs=2e-3)


def test_decisions_take_what_is_seen_next_to_a_mapped_wall_for_that_wall():
    observation = scene_with_wall_seen_at(0.90).observe(robot(), 1.0)
    assert observation.walls.at(np.zeros(2)) == pytest.approx(1.0, abs=2e-3)


def test_a_scene_gives_beam_ends_in_the_lasers_own_frame():
    scene = scene_with_wall_seen_at(0.9)
    ends = scene.take_scan(Scan(1.0, [2.0], 0.0, 0.1, 0.05, 10.0), np.array([1.0, 1.0, 1.0]))
    np.testing.assert_allclose(ends, [[2.0, 0.0]])
