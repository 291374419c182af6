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
"""Scanners whose drivers flip the beams are found out by their scans, others are left alone."""

import numpy as np
import pytest

from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.world.geometry import compose
from wallnav_ros.world.tracks import HUMAN
from wallnav_ros.world.walls import Walls

BEAMS, PERIOD = 360, 0.1
STEP = 2.0 * np.pi / BEAMS
ANGLES = -np.pi + STEP * np.arange(BEAMS)
# A room with a niche and a partition, so that no heading in it looks like another.
ROOM = Walls.from_polylines([
    [[-4, -3], [5, -3], [5, 1], [6, 1], [6, 3], [-4, 3], [-4, -3]], [[1, -3], [1, -1.5]]])
MOUNT = np.array([0.1, 0.0, 0.5])


def robot_at(time, swing):
    """Return the laser's pose at `time` of a robot at 0.2 m/s that looks `swing` rad about."""
    base = np.array([0.2 * time - 2.0, 0.0, swing * np.sin(2.0 * time)])
    return compose(base, MOUNT)


def sweep(time, swing, order, rng):
    """
    Return the Scan begun at `time`, each beam from where the laser was when it was taken.

    order: 1 where the first beam is taken first, -1 where it is taken last.
    """
    ranges = []
    # Six beams at a time: in a sixtieth of a scan the laser turns by less than 2 mrad.
    for first in range(0, BEAMS, 6):
        share = (first + 2.5) / BEAMS
        pose = robot_at(time + PERIOD * (share if order > 0 else 1.0 - share), swing)
        ranges.append(ROOM.raycast(pose[:2], ANGLES[first:first + 6] + pose[2], 12.0))
    return Scan(time, np.concatenate(ranges) + rng.normal(0.0, 0.01, BEAMS), -np.pi, STEP,
                0.1, 11.0, PERIOD / BEAMS)


def drive(tracker, order, count=48, swing=0.5, odometry=True):
    """Feed `count` scans of a robot that looks about to `tracker`; returns the Tracks of each."""
    rng, found = np.random.default_rng(9), []
    for number in range(count):
        time = PERIOD * number
        scan = sweep(time, swing, order, rng)
        if odometry:
            found.append(tracker.update(scan, robot_at(time, swing),
                                        end_pose=robot_at(time + scan.sweep_time, swing)))
        else:
            found.append(tracker.update(scan))
    return found


@pytest.mark.parametrize('odometry', [True, False])
def test_flipped_beams_are_found_out_within_five_seconds_of_turning(odometry):
    tracker = Tracker()
    drive(tracker, order=-1, odometry=odometry)
    assert tracker.reversed_sensors == ['scan']
    # In the last scan, at 4.7 s, the laser turned by 0.1 s * 1 rad/s * cos(9.4 rad) = -0.1 rad.
    assert tracker.sweep[2] == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize('odometry', [True, False])
def test_beams_in_the_order_of_the_message_are_believed(odometry):
    tracker = Tracker()
    drive(tracker, order=1, odometry=odometry)
    assert tracker.reversed_sensors == []
    assert tracker.sweep[2] == pytest.approx(-0.1, abs=0.02)


def test_a_scanner_that_does_not_turn_is_not_judged():
    tracker = Tracker()
    drive(tracker, order=-1, swing=0.0)
    assert tracker.reversed_sensors == []


def test_what_bent_walls_were_taken_for_is_forgotten():
    tracker = Tracker()
    found = drive(tracker, order=-1, count=80)
    assert not any((tracks.label == HUMAN).any() for tracks in found[48:])


def test_a_clock_set_back_does_not_make_a_flipped_scanner_right():
    tracker = Tracker()
    drive(tracker, order=-1)
    drive(tracker, order=-1, count=3)
    assert tracker.resets == 1
    assert tracker.reversed_sensors == ['scan']
