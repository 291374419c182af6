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
The simulated scanner: ranges of shapes worked by hand, noise and limits as configured.

Conventions of sensor_msgs/LaserScan: beam i looks angle_min + i angle_increment to the left.
"""

import numpy as np
import pytest

from wallnav_ros.simulation.lidar import Lidar
from wallnav_ros.world.state import Agents
from wallnav_ros.world.walls import Walls

# A room from (-2, -1) to (4, 3).
BOX = Walls.from_polylines([[[-2, -1], [4, -1], [4, 3], [-2, 3]]], closed=True)
NOTHING = Walls.from_polylines([])
QUARTERS = Lidar(beams=4, angle_min=-np.pi / 2, angle_increment=np.pi / 2, noise=0.0)


def scan(lidar, pose=(0.0, 0.0, 0.0), walls=NOTHING, agents=None, seed=1):
    return lidar.scan(np.asarray(pose, dtype=float), walls, agents or Agents.none(),
                      np.random.default_rng(seed))


def test_a_box_is_seen_at_its_walls():
    # Right, ahead, left and behind.
    assert scan(QUARTERS, walls=BOX) == pytest.approx([1.0, 4.0, 3.0, 2.0])


def test_a_slanted_beam_is_longer_by_the_cosine():
    lidar = Lidar(beams=2, angle_min=0.0, angle_increment=0.5, noise=0.0)

    # At 0.5 rad the wall ahead, 4 m off, is hit at 4 tan 0.5 = 2.19 m: short of its end.
    assert scan(lidar, walls=BOX) == pytest.approx([4.0, 4.0 / np.cos(0.5)])


def test_turning_the_scanner_left_shifts_what_the_beams_see():
    assert scan(QUARTERS, (0.0, 0.0, np.pi / 2), BOX) == pytest.approx([4.0, 3.0, 2.0, 1.0])


def test_moving_the_scanner_changes_the_ranges_by_as_much():
    assert scan(QUARTERS, (1.0, 0.5, 0.0), BOX) == pytest.approx([1.5, 3.0, 2.5, 3.0])


def test_a_negative_increment_scans_clockwise():
    clockwise = Lidar(beams=4, angle_min=np.pi, angle_increment=-np.pi / 2, noise=0.0)

    assert scan(clockwise, walls=BOX) == pytest.approx([2.0, 3.0, 4.0, 1.0])
    assert clockwise.angles() == pytest.approx([np.pi, np.pi / 2, 0.0, -np.pi / 2])


def test_a_disc_is_seen_at_its_near_side():
    agents = Agents.of([[2.0, 0.0]], [[0.0, 0.0]], [0.5])
    lidar = Lidar(beams=3, angle_min=-0.2, angle_increment=0.2, noise=0.0)

    # Off centre by 0.2 rad: 2 cos 0.2 - sqrt(0.25 - (2 sin 0.2)^2).
    oblique = 2.0 * np.cos(0.2) - np.sqrt(0.25 - (2.0 * np.sin(0.2)) ** 2)
    assert scan(lidar, agents=agents) == pytest.approx([oblique, 1.5, oblique])


def test_a_disc_behind_the_scanner_does_not_cast_its_shadow_ahead():
    agents = Agents.of([[-2.0, 0.0]], [[0.0, 0.0]], [0.5])

    assert scan(QUARTERS, agents=agents).tolist() == [np.inf, np.inf, np.inf, 1.5]


def test_what_is_nearer_hides_what_is_farther():
    agents = Agents.of([[2.0, 0.0], [6.0, 0.0]], [[0.0, 0.0]] * 2, [0.5, 0.5])

    assert scan(QUARTERS, walls=BOX, agents=agents)[1] == pytest.approx(1.5)


def test_out_of_range_is_no_return():
    near, far = (Lidar(**{**vars(QUARTERS), **limits})
                 for limits in ({'range_max': 2.5}, {'range_min': 1.5}))

    assert scan(near, walls=BOX).tolist() == [1.0, np.inf, np.inf, 2.0]
    assert scan(far, walls=BOX).tolist() == [np.inf, 4.0, 3.0, 2.0]


def test_an_empty_world_returns_nothing():
    assert np.isinf(scan(Lidar())).all()


@pytest.mark.parametrize('beams', [1, 180, 1081])
def test_there_are_as_many_float32_ranges_as_beams(beams):
    ranges = scan(Lidar(beams=beams, angle_increment=2 * np.pi / beams), walls=BOX)

    assert ranges.shape == (beams,)
    assert ranges.dtype == np.float32


def test_noise_has_the_spread_asked_for_and_no_bias():
    lidar = Lidar(noise=0.03)
    exact = scan(Lidar(noise=0.0), walls=BOX)

    error = np.stack([scan(lidar, walls=BOX, seed=seed) - exact for seed in range(40)])

    # 14,400 samples: the mean is good to 0.03 / 120, the spread to 0.03 / 170.
    assert abs(error.mean()) < 4 * 0.03 / 120
    assert error.std() == pytest.approx(0.03, abs=4 * 0.03 / 170)
    assert abs(np.corrcoef(error[:, :-1].ravel(), error[:, 1:].ravel())[0, 1]) < 0.04


def test_the_same_generator_gives_the_same_scan():
    assert (scan(Lidar(), walls=BOX, seed=3) == scan(Lidar(), walls=BOX, seed=3)).all()
    assert (scan(Lidar(), walls=BOX, seed=3) != scan(Lidar(), walls=BOX, seed=4)).any()


def test_inside_an_agent_the_scanner_sees_through_it():
    """A person's disc over the scanner: no return at zero range is made up."""
    agents = Agents.of([[0.1, 0.0]], [[0.0, 0.0]], [0.5])

    assert scan(QUARTERS, walls=BOX, agents=agents) == pytest.approx([1.0, 4.0, 3.0, 2.0])
