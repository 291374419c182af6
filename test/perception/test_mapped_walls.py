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
"""What counts as a mapped wall follows from how well the robot knows where it is."""

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.perception.mapped_walls import lie_on_walls
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.world.distance_field import DistanceField

# A wall along the x axis; nodes 5 cm apart, each as far from it as its row says.
ROWS = 0.05 * np.arange(-40, 41)
WALL = DistanceField(np.repeat(np.abs(ROWS)[:, None], 281, axis=1).astype(np.float32),
                     np.array([-2.0, -2.0, 0.0]), 0.05)
# Ranges and map without error: what is left is the pose's.
EXACT = replace(TrackerSettings(), match_noise=0.0, map_noise=0.0, wall_reach=1.0)
SURE = np.zeros((3, 3))


def heading(degrees):
    """Return the covariance of a pose of which only the heading is in doubt."""
    return np.diag([0.0, 0.0, np.radians(degrees) ** 2])


def position(along, across):
    """Return the covariance of a pose with standard deviations along x and y, in metres."""
    return np.diag([along ** 2, across ** 2, 0.0])


def reach(covariance, settings=EXACT, laser=None, x=5.0):
    """
    Return how far off the wall, to 1 mm, a beam end over `x` still counts as the wall.

    Without a laser given, beams run along the wall, from x = 0.
    """
    heights = np.arange(0.0, 1.2, 0.001)
    found = [lie_on_walls(np.array([[x, height]]), np.array([0.0, height]) if laser is None
                          else laser, WALL, covariance, settings)[0] for height in heights]
    assert found == sorted(found, reverse=True)
    return heights[np.count_nonzero(found) - 1]


def test_a_degree_of_doubt_moves_the_end_of_a_beam_along_a_wall_by_17_mm_a_metre():
    # Two standard deviations are 2 degrees: 5 m * 0.0349 = 0.175 m, twice that at 10 m.
    assert reach(heading(1.0)) == pytest.approx(0.175, abs=0.002)
    assert reach(heading(1.0), x=10.0) == pytest.approx(0.349, abs=0.002)


def test_a_turn_keeps_the_end_of_a_beam_on_a_wall_that_it_meets_head_on():
    assert reach(heading(2.0), laser=np.array([5.0, -5.0])) < 0.01


def test_a_turn_counts_by_the_slant_of_the_beam():
    # From 5 m across and 5 m along: the end moves 7.07 m * 0.0349 at 45 degrees to the wall.
    found = reach(heading(1.0), laser=np.array([0.0, -5.0]))
    assert found == pytest.approx(5.0 * 0.0349, abs=0.002)


def test_only_what_moves_across_the_wall_counts():
    assert reach(position(along=0.3, across=0.0)) < 0.01
    assert reach(position(along=0.0, across=0.1)) == pytest.approx(0.2, abs=0.002)


def test_errors_of_position_and_heading_that_belong_together_may_cancel():
    # 0.1 m to the left for each 0.02 rad to the right: at 5 m ahead the two make up for it.
    covariance = np.zeros((3, 3))
    covariance[1, 1], covariance[2, 2] = 0.1 ** 2, 0.02 ** 2
    covariance[1, 2] = covariance[2, 1] = -0.1 * 0.02
    assert reach(covariance) < 0.01
    assert reach(np.abs(covariance)) == pytest.approx(2.0 * (0.1 + 5.0 * 0.02), abs=0.002)


def test_independent_errors_add_in_squares():
    settings = replace(EXACT, match_noise=0.03, map_noise=0.04)
    assert reach(SURE, settings) == pytest.approx(2.0 * 0.05, abs=0.002)
    # 2 * sqrt(0.05^2 + 0.12^2) = 0.26
    assert reach(position(0.0, 0.12), settings) == pytest.approx(0.26, abs=0.002)


def test_a_person_beside_the_wall_stays_however_great_the_doubt():
    lost = np.diag([0.5 ** 2, 0.5 ** 2, np.radians(15.0) ** 2])
    assert reach(lost, TrackerSettings()) == pytest.approx(0.3, abs=0.002)


def test_where_nobody_tells_a_documented_doubt_is_assumed():
    settings = TrackerSettings()
    told = np.diag([settings.pose_noise ** 2, settings.pose_noise ** 2,
                    settings.heading_noise ** 2])
    assert reach(None, settings) == reach(told, settings)
    # At 2 m: 2 * sqrt(0.03^2 + 0.04^2 + 0.05^2 + (2 * 0.02)^2) = 0.162.
    assert reach(None, settings, x=2.0) == pytest.approx(0.162, abs=0.002)


def test_the_frame_in_which_it_is_told_does_not_matter():
    turned = replace(WALL, pose=np.array([2.0, -2.0, np.pi / 2.0]))     # now along the y axis
    doubt = np.diag([0.1 ** 2, 0.0, 0.0])
    ends = np.array([[-0.19, 5.0], [-0.21, 5.0]])
    found = lie_on_walls(ends, np.array([-0.2, 0.0]), turned, doubt, EXACT)
    assert found.tolist() == [True, False]


def test_a_scan_that_meets_nothing_has_no_wall():
    assert lie_on_walls(np.empty((0, 2)), np.zeros(2), WALL, None, EXACT).shape == (0,)
