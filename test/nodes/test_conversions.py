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
"""Messages to data and back: nothing lost, and nothing taken that cannot be used."""

import math

from geometry_msgs.msg import Pose, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan, PointField
from wallnav_ros.mapping.occupancy_map import MapError
from wallnav_ros.nodes import conversions as convert
from wallnav_ros.perception.scan import ScanError
from wallnav_ros.world.tracks import HUMAN, OBSTACLE, Tracks
from wallnav_ros.world.walls import Walls


def two_tracks():
    return Tracks(12.25, np.array([3, 4000000000], np.uint32),
                  np.array([[1.0, 2.0], [-3.5, 0.25]]),
                  np.array([[0.5, 0.0], [0.0, -1.0]]), np.array([0.25, 0.5]),
                  np.array([HUMAN, OBSTACLE], np.uint8))


@pytest.mark.parametrize('stamp', [0.0, 1.5, 1700000000.125, -2.25])
def test_stamps_survive_the_way_there_and_back(stamp):
    message = convert.time_message(stamp)
    assert 0 <= message.nanosec < 1_000_000_000
    assert convert.seconds(message) == pytest.approx(stamp, abs=1e-6)


@pytest.mark.parametrize('yaw', [0.0, 1.0, -3.0, math.pi / 2.0])
def test_a_pose_survives_the_way_there_and_back(yaw):
    np.testing.assert_allclose(
        convert.pose_from_message(convert.pose_message(np.array([1.5, -2.0, yaw]))),
        [1.5, -2.0, yaw], atol=1e-12)


def test_the_yaw_of_a_tilted_robot_is_where_its_nose_points():
    # Yaw 90 degrees, then rolled by 180: q = q_yaw * q_roll.
    half = math.sqrt(0.5)
    pose = Pose()
    pose.orientation.x, pose.orientation.y = half, half
    pose.orientation.z = pose.orientation.w = 0.0
    assert convert.pose_from_message(pose)[2] == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize('orientation', [(0, 0, 0, 0), (0, 0, 0, 2.0), (0, 0, math.nan, 1.0)])
def test_a_quaternion_that_is_no_rotation_is_refused(orientation):
    pose = Pose()
    (pose.orientation.x, pose.orientation.y, pose.orientation.z,
     pose.orientation.w) = map(float, orientation)
    with pytest.raises(convert.MessageError):
        convert.pose_from_message(pose)


@pytest.mark.parametrize('field', ['linear', 'angular', 'position'])
def test_odometry_that_is_not_finite_is_refused(field):
    message = Odometry()
    message.pose.pose.orientation.w = 1.0
    stamp, pose, velocity = convert.odometry_from_message(message)
    assert (stamp, pose.tolist(), velocity.tolist()) == (0.0, [0.0] * 3, [0.0] * 2)
    target = {'linear': message.twist.twist.linear, 'angular': message.twist.twist.angular,
              'position': message.pose.pose.position}[field]
    setattr(target, 'z' if field == 'angular' else 'x', math.inf)
    with pytest.raises(convert.MessageError, match='not finite'):
        convert.odometry_from_message(message)


def fix_with(**entries):
    """Return a message with entries of its covariance set, by name: xx, xy, yaw."""
    message = PoseWithCovarianceStamped()
    message.pose.pose = convert.pose_message(np.array([1.0, 2.0, 0.5]))
    places = {'xx': (0,), 'xy': (1, 6), 'yy': (7,), 'zz': (14,), 'x_yaw': (5, 30), 'yaw': (35,)}
    for name, value in entries.items():
        for place in places[name]:
            message.pose.covariance[place] = value
    return message


def test_a_fix_brings_what_is_in_doubt_of_a_planar_pose():
    message = fix_with(xx=0.04, xy=0.01, yy=0.09, zz=7.0, x_yaw=0.002, yaw=0.0025)
    stamp, pose, covariance = convert.fix_from_message(message)
    assert stamp == 0.0
    np.testing.assert_allclose(pose, [1.0, 2.0, 0.5])
    np.testing.assert_allclose(
        covariance, [[0.04, 0.01, 0.002], [0.01, 0.09, 0.0], [0.002, 0.0, 0.0025]])


def test_a_fix_without_any_covariance_tells_nothing_of_doubt():
    assert convert.fix_from_message(fix_with())[2] is None


@pytest.mark.parametrize('entries', [
    {'yaw': math.nan}, {'xx': math.inf}, {'yy': -0.1}, {'xx': 0.01, 'yy': 0.01, 'xy': 0.5},
    {'yaw': 1e9}])
def test_a_fix_whose_covariance_is_none_is_refused(entries):
    with pytest.raises(convert.MessageError, match='covariance'):
        convert.fix_from_message(fix_with(**entries))


def test_a_scan_keeps_its_geometry_and_its_ranges():
    message = LaserScan(angle_min=-1.0, angle_increment=0.5, range_min=0.1, range_max=8.0,
                        time_increment=0.001, ranges=[1.0, math.inf, 2.5])
    message.header.stamp = convert.time_message(7.5)
    scan = convert.scan_from_message(message)
    assert (scan.stamp, scan.angle_min, scan.angle_increment) == (7.5, -1.0, 0.5)
    np.testing.assert_allclose(scan.ranges, [1.0, np.inf, 2.5])
    with pytest.raises(ScanError):
        convert.scan_from_message(LaserScan())


def test_tracks_survive_the_way_there_and_back():
    tracks = two_tracks()
    message = convert.tracks_message(tracks, 'odom')
    assert message.header.frame_id == 'odom'
    back = convert.tracks_from_message(message)
    assert back.stamp == tracks.stamp
    for name in ('id', 'position', 'velocity', 'radius', 'label'):
        np.testing.assert_array_equal(getattr(back, name), getattr(tracks, name))


def test_no_tracks_are_a_message_too():
    assert len(convert.tracks_from_message(convert.tracks_message(Tracks.none(1.0), 'odom'))) == 0


def test_tracks_may_carry_further_fields_and_padding():
    message = convert.tracks_message(two_tracks(), 'odom')
    rows = np.frombuffer(bytes(message.data), np.uint8).reshape(2, message.point_step)
    message.data = np.pad(rows, ((0, 0), (0, 7))).ravel().tolist()
    message.point_step += 7
    message.fields.append(PointField(name='mood', offset=30, datatype=PointField.UINT8, count=1))
    np.testing.assert_array_equal(convert.tracks_from_message(message).radius, [0.25, 0.5])


def spoil(message, fault):
    if fault == 'a field is missing':
        message.fields = message.fields[1:]
    elif fault == 'a field is of another type':
        message.fields[0].datatype = PointField.FLOAT64
    elif fault == 'a field lies outside':
        message.fields[0].offset = 1000
    elif fault == 'too little data':
        message.data = message.data[:-1]
    elif fault == 'big-endian':
        message.is_bigendian = True
    elif fault == 'not finite':
        tracks = two_tracks()
        tracks.velocity[0, 0] = np.nan
        return convert.tracks_message(tracks, 'odom')
    elif fault == 'too many':
        message.width = 4_000_000_000
    return message


@pytest.mark.parametrize('fault', [
    'a field is missing', 'a field is of another type', 'a field lies outside',
    'too little data', 'big-endian', 'not finite', 'too many'])
def test_tracks_that_cannot_be_read_are_refused(fault):
    with pytest.raises(convert.MessageError):
        convert.tracks_from_message(spoil(convert.tracks_message(two_tracks(), 'odom'), fault))


def test_a_grid_becomes_a_map_with_its_lowest_row_first():
    message = OccupancyGrid()
    message.info.width, message.info.height, message.info.resolution = 3, 2, 0.5
    message.info.origin.position.x = -1.0
    message.info.origin.orientation.w = 1.0
    message.data = [0, 0, 100, -1, 0, 0]
    found = convert.map_from_message(message)
    assert found.cells.tolist() == [[0, 0, 100], [-1, 0, 0]]
    np.testing.assert_allclose(found.origin, [-1.0, 0.0, 0.0])
    message.data = [0]
    with pytest.raises(MapError):
        convert.map_from_message(message)


def test_walls_become_pairs_of_points_in_metres():
    walls = Walls.from_polylines([[[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]])
    marker = convert.walls_marker(walls, 'map', 3.0)
    assert marker.type == marker.LINE_LIST and marker.header.frame_id == 'map'
    assert [(point.x, point.y) for point in marker.points] == [
        (0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (1.0, 2.0)]
