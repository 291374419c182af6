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
"""Where the robot is: frames, fixes that come early, late or never, and clocks set back."""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.navigation.localisation import Localisation, REFINED_EVERY
from wallnav_ros.world.walls import Walls

QUARTER = np.pi / 2.0


def drive_along_x(place, until, step=0.1):
    """Drive at 1 m/s along the odometry's x axis, from time 0 to `until`."""
    for stamp in np.arange(0.0, until + 1e-9, step):
        assert place.add_odometry(stamp, np.array([stamp, 0.0, 0.0]), np.array([1.0, 0.0]))


def test_without_a_fix_the_state_frame_is_that_of_the_odometry():
    place = Localisation()
    drive_along_x(place, 1.0)
    assert place.state_frame == 'odom'
    np.testing.assert_allclose(place.pose(0.55), [0.55, 0.0, 0.0])
    assert place.frame_in_state('map') is None


def test_a_fix_places_the_odometry_in_the_map():
    place = Localisation()
    drive_along_x(place, 1.0)
    # At 0.5 s the robot was at x = 0.5; there, the map says it is at (10, 20), facing north.
    place.add_fix(0.5, np.array([10.0, 20.0, QUARTER]))
    assert place.state_frame == 'map'
    np.testing.assert_allclose(place.map_from_odom, [10.0, 19.5, QUARTER], atol=1e-12)
    np.testing.assert_allclose(place.newest(), [10.0, 20.5, QUARTER], atol=1e-12)


def test_a_correction_is_kept_while_the_robot_drives_on():
    place = Localisation()
    drive_along_x(place, 1.0)
    place.add_fix(1.0, np.array([5.0, 0.0, 0.0]))
    place.add_odometry(1.1, np.array([1.2, 0.3, 0.0]), np.zeros(2))
    np.testing.assert_allclose(place.newest(), [5.2, 0.3, 0.0], atol=1e-12)
    assert place.travelled == pytest.approx(np.hypot(0.2, 0.3))


def test_a_fix_from_before_the_first_odometry_waits_for_it():
    place = Localisation()
    place.add_fix(-600.0, np.array([3.0, 4.0, 0.0]))
    assert place.state_frame == 'odom'
    drive_along_x(place, 0.5)
    np.testing.assert_allclose(place.newest(), [3.5, 4.0, 0.0], atol=1e-12)


def test_a_fix_ahead_of_the_odometry_waits_for_it():
    place = Localisation()
    drive_along_x(place, 1.0)
    place.add_fix(2.0, np.array([7.0, 0.0, 0.0]))
    assert place.state_frame == 'odom'
    drive_on = np.array([1.8, 0.0, 0.0])
    place.add_odometry(1.8, drive_on, np.array([1.0, 0.0]))
    np.testing.assert_allclose(place.map_from_odom, [5.0, 0.0, 0.0], atol=1e-9)


def test_a_jump_is_measured_where_the_robot_is():
    place = Localisation()
    drive_along_x(place, 1.0)
    place.add_fix(1.0, np.array([1.0, 0.0, 0.0]))
    place.add_fix(1.0, np.array([1.0, 0.7, 0.0]))
    assert place.last_jump == pytest.approx(0.7)


def test_a_fixed_odometry_frame_survives_a_clock_set_back():
    place = Localisation(np.array([2.0, 0.0, 0.0]))
    drive_along_x(place, 1.0)
    place.forget()
    assert place.state_frame == 'map' and place.newest() is None
    loose = Localisation()
    drive_along_x(loose, 1.0)
    loose.add_fix(1.0, np.zeros(3))
    loose.forget()
    assert loose.state_frame == 'odom'


@pytest.mark.parametrize('frame, expected', [
    ('map', [0.0, 0.0, 0.0]), ('odom', [1.0, 2.0, 0.0]), ('base_link', [2.0, 2.0, 0.0]),
    ('mars', None)])
def test_frames_are_related_to_the_state_frame(frame, expected):
    place = Localisation(np.array([1.0, 2.0, 0.0]))
    drive_along_x(place, 1.0)
    found = place.frame_in_state(frame)
    assert found is None if expected is None else np.allclose(found, expected)


def test_odometry_out_of_order_is_refused_and_changes_nothing():
    place = Localisation()
    drive_along_x(place, 1.0)
    assert not place.add_odometry(0.5, np.array([9.0, 9.0, 0.0]), np.zeros(2))
    np.testing.assert_allclose(place.newest(), [1.0, 0.0, 0.0])


def test_what_is_in_the_state_frame_can_be_brought_into_the_odometrys():
    place = Localisation(np.array([1.0, 2.0, QUARTER]))
    np.testing.assert_allclose(place.in_odom(np.array([1.0, 3.0, QUARTER])), [1.0, 0.0, 0.0],
                               atol=1e-12)


def test_a_late_message_from_before_the_clock_was_set_back_does_not_hold_up_localisation():
    place = Localisation()
    place.add_odometry(200.0, np.zeros(3), np.zeros(2))
    place.add_odometry(100.0, np.zeros(3), np.zeros(2))
    place.add_fix(100.0, np.array([1.0, 2.0, 0.0]))
    np.testing.assert_allclose(place.newest(), [1.0, 2.0, 0.0])


def test_doubt_of_a_heading_grows_with_the_way_from_the_fix():
    place = Localisation()
    drive_along_x(place, 1.0)
    # A tenth of a radian of doubt, 3 m from where it was told: 0.3 m across, and 0.06 m of drift.
    place.add_fix(1.0, np.array([5.0, 0.0, 0.0]), np.diag([0.01, 0.04, 0.01]))
    found = place.covariance_at(np.array([4.0, 0.0]))
    expected = np.diag([0.01, 0.04 + 0.09, 0.01]) + 0.06 ** 2 * np.eye(3)
    expected[1, 2] = expected[2, 1] = 3.0 * 0.01
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_doubt_is_told_along_the_axes_of_the_odometry():
    place = Localisation()
    drive_along_x(place, 1.0)
    # The map's y axis is the odometry's x axis.
    place.add_fix(1.0, np.array([0.0, 0.0, QUARTER]), np.diag([0.01, 0.04, 0.0]))
    found = place.covariance_at(np.array([1.0, 0.0]))
    np.testing.assert_allclose(found, np.diag([0.04, 0.01, 0.0]), atol=1e-12)


def test_doubt_is_unknown_where_no_fix_tells_it():
    place = Localisation()
    drive_along_x(place, 1.0)
    assert place.covariance_at(np.zeros(2)) is None
    place.add_fix(1.0, np.zeros(3))
    assert place.covariance_at(np.zeros(2)) is None


def test_a_transform_keeps_the_doubt_of_the_last_fix():
    place = Localisation()
    drive_along_x(place, 1.0)
    place.add_fix(1.0, np.zeros(3), np.diag([0.01, 0.01, 0.0]))
    place.set_correction(1.1, np.zeros(3))
    np.testing.assert_allclose(place.covariance_at(np.array([1.0, 0.0])),
                               np.diag([0.01, 0.01, 0.0]), atol=1e-12)
    place.forget()
    assert place.covariance_at(np.zeros(2)) is None


ROOM = Walls.from_polylines([[(0, 0), (6, 0), (6, 4), (3, 4), (3, 3), (0, 3), (0, 0)]])
FIELD = distance_field(ROOM)
NOISE = np.diag((0.05, 0.05, 0.035)) ** 2


def look(pose):
    """Return the beam ends (K, 2) of a scanner at `pose` (3,) in the room, in its own frame."""
    bearings = np.radians(np.arange(0.0, 360.0, 2.0))
    ranges = ROOM.raycast(pose[:2], bearings + pose[2], 12.0)
    return ranges[:, None] * np.stack((np.cos(bearings), np.sin(bearings)), axis=1)


def placed(fix, covariance=NOISE, **named):
    """Return a Localisation at the origin of its odometry, with a fix (3,) at 1 s."""
    place = Localisation(**named)
    place.add_odometry(1.0, np.zeros(3), np.zeros(2))
    place.add_fix(1.0, np.array(fix), covariance)
    return place


@pytest.mark.parametrize('covariance', [NOISE, None])
def test_a_fix_is_corrected_by_what_is_seen(covariance):
    pose = np.array([1.0, 1.5, 0.0])
    place = placed(pose + (0.06, -0.05, 0.04), covariance)
    doubt = place.covariance_at(np.zeros(2))
    place.refine(1.0, np.zeros(3), look(pose), FIELD)
    np.testing.assert_allclose(place.newest(), pose, atol=0.01)
    assert covariance is None or (
        place.covariance_at(np.zeros(2)).diagonal() < 0.2 * doubt.diagonal()).all()
    # The correction is no jump of the localisation.
    assert place.take_jump() == 0.0


def test_a_fix_that_cannot_be_reconciled_with_what_is_seen_holds():
    place = placed((1.0, 1.5, 0.0))
    place.refine(1.0, np.zeros(3), look(np.array([1.25, 1.5, 0.0])), FIELD)
    np.testing.assert_allclose(place.newest(), [1.0, 1.5, 0.0])


def test_one_bad_fix_does_not_outweigh_what_was_seen_before():
    pose = np.array([1.0, 1.5, 0.0])
    place = placed(pose)
    place.refine(1.0, np.zeros(3), look(pose), FIELD)
    for stamp in (2.0, 3.0):
        place.add_odometry(stamp, np.zeros(3), np.zeros(2))
        place.add_fix(stamp, pose + (0.12, 0.0, 0.0), NOISE)
        place.refine(stamp, np.zeros(3), look(pose), FIELD)
        np.testing.assert_allclose(place.newest(), pose, atol=0.01)


def test_scans_in_quick_succession_are_not_all_matched():
    pose = np.array([1.0, 1.5, 0.0])
    place = placed(pose)
    place.refine(1.0, np.zeros(3), look(pose), FIELD)
    before = place.newest()
    place.refine(1.0 + 0.5 * REFINED_EVERY, np.zeros(3), look(pose + (0.03, 0.0, 0.0)), FIELD)
    np.testing.assert_array_equal(place.newest(), before)
    place.refine(1.0 + 1.5 * REFINED_EVERY, np.zeros(3), look(pose + (0.03, 0.0, 0.0)), FIELD)
    np.testing.assert_allclose(place.newest(), pose + (0.03, 0.0, 0.0), atol=0.01)


def test_an_odometry_that_is_fixed_in_the_map_stays_there():
    place = Localisation(np.array([1.0, 1.5, 0.0]))
    place.add_odometry(1.0, np.zeros(3), np.zeros(2))
    place.refine(1.0, np.zeros(3), look(np.array([1.05, 1.5, 0.0])), FIELD)
    np.testing.assert_array_equal(place.newest(), [1.0, 1.5, 0.0])
