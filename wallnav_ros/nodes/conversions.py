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
ROS messages to the package's own data and back.

REP-103 and REP-105 (axes, units, frames); sensor_msgs/PointCloud2 for tracks.
"""

from array import array
import math

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, Quaternion, Twist
import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from visualization_msgs.msg import Marker
from wallnav_ros.mapping.occupancy_map import from_occupancy_grid
from wallnav_ros.perception.scan import Scan
from wallnav_ros.world.geometry import yaw_of
from wallnav_ros.world.tracks import Tracks


# The PointCloud2 that carries tracks: name, NumPy type, PointField type.
TRACK_FIELDS = (
    ('x', '<f4', PointField.FLOAT32), ('y', '<f4', PointField.FLOAT32),
    ('z', '<f4', PointField.FLOAT32), ('vx', '<f4', PointField.FLOAT32),
    ('vy', '<f4', PointField.FLOAT32), ('radius', '<f4', PointField.FLOAT32),
    ('id', '<u4', PointField.UINT32), ('label', 'u1', PointField.UINT8))
TRACK_TYPE = np.dtype([(name, kind) for name, kind, _ in TRACK_FIELDS])
MOST_TRACKS = 10_000       # more in one message is no crowd but a fault
PLANAR = (0, 1, 5)         # x, y and yaw among the six coordinates of a pose's covariance
FARTHEST = 1e6             # m; what lies farther off is no place of a robot
FASTEST = 100.0            # m/s and rad/s; what is faster is no robot


class MessageError(ValueError):
    """A message that must not be used; the text says why, the same for the same fault."""


def seconds(stamp):
    """Return a builtin_interfaces Time in seconds."""
    return stamp.sec + stamp.nanosec * 1e-9


def time_message(stamp):
    """Return `stamp` seconds as a builtin_interfaces Time."""
    nanoseconds = round(stamp * 1e9)
    return Time(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def frame_name(name):
    """Return a frame id as ROS 2 spells it: without the leading slash of ROS 1."""
    return name.lstrip('/')


def pose_from_message(pose):
    """
    Return a geometry_msgs Pose as x, y, yaw (3,); height, roll and pitch are left out.

    Raises MessageError where it is not finite, absurdly far off, or its quaternion is not of
    unit length.
    """
    turn = pose.orientation
    values = (pose.position.x, pose.position.y, turn.x, turn.y, turn.z, turn.w)
    if not all(map(math.isfinite, values)):
        raise MessageError('pose: not finite')
    if max(abs(pose.position.x), abs(pose.position.y)) > FARTHEST:
        raise MessageError(f'pose: farther off than {FARTHEST:g} m')
    try:
        return np.array([pose.position.x, pose.position.y,
                         yaw_of(turn.x, turn.y, turn.z, turn.w)])
    except ValueError as error:
        raise MessageError(f'orientation: {error}') from None


def pose_message(pose):
    """Return x, y, yaw (3,) as a geometry_msgs Pose."""
    message = Pose()
    message.position.x, message.position.y = float(pose[0]), float(pose[1])
    message.orientation = Quaternion(z=math.sin(pose[2] / 2.0), w=math.cos(pose[2] / 2.0))
    return message


def odometry_from_message(message):
    """
    Return stamp (s), pose (3,) and velocity (2,), m/s forward and rad/s, of an Odometry.

    Raises MessageError where something in it is not finite, absurd or no pose.
    """
    twist = message.twist.twist
    velocity = np.array([twist.linear.x, twist.angular.z])
    if not np.isfinite(velocity).all():
        raise MessageError('twist: not finite')
    if np.abs(velocity).max() > FASTEST:
        raise MessageError(f'twist: faster than {FASTEST:g} m/s or rad/s')
    return seconds(message.header.stamp), pose_from_message(message.pose.pose), velocity


def fix_from_message(message):
    """
    Return stamp (s), pose (3,) and its covariance (3, 3) of a PoseWithCovarianceStamped.

    The covariance is None where all of it is zero: that is how senders say that they do not
    know. Raises MessageError where something is not finite, absurd or no covariance.
    """
    pose = pose_from_message(message.pose.pose)
    covariance = np.reshape(message.pose.covariance, (6, 6))[np.ix_(PLANAR, PLANAR)]
    if not np.isfinite(covariance).all():
        raise MessageError('covariance: not finite')
    largest = np.abs(covariance).max()
    if largest > FARTHEST or (
            np.linalg.eigvalsh(0.5 * (covariance + covariance.T))[0] < -1e-6 * largest):
        raise MessageError('covariance: a variance is negative or absurd')
    return seconds(message.header.stamp), pose, covariance if largest else None


def scan_from_message(message):
    """Return a LaserScan as a Scan; raises ScanError where it cannot be used."""
    return Scan(
        stamp=seconds(message.header.stamp), ranges=np.asarray(message.ranges),
        angle_min=message.angle_min, angle_increment=message.angle_increment,
        range_min=message.range_min, range_max=message.range_max,
        time_increment=message.time_increment)


def map_from_message(message):
    """Return an OccupancyGrid as an OccupancyMap; raises MapError or MessageError."""
    info = message.info
    return from_occupancy_grid(np.asarray(message.data, dtype=np.int8), info.width, info.height,
                               info.resolution, pose_from_message(info.origin))


def path_from_message(message):
    """Return the positions (K, 2) of a nav_msgs Path, in metres, in its header's frame."""
    places = [(pose.pose.position.x, pose.pose.position.y) for pose in message.poses]
    return np.array(places, dtype=float).reshape(-1, 2)


def twist_message(command):
    """Return a command (2,), m/s and rad/s, as a Twist."""
    message = Twist()
    message.linear.x, message.angular.z = float(command[0]), float(command[1])
    return message


def tracks_message(tracks, frame):
    """Return Tracks in `frame` as a PointCloud2 with the fields of TRACK_FIELDS."""
    rows = np.zeros(len(tracks), dtype=TRACK_TYPE)
    rows['x'], rows['y'] = tracks.position[:, 0], tracks.position[:, 1]
    rows['vx'], rows['vy'] = tracks.velocity[:, 0], tracks.velocity[:, 1]
    rows['radius'], rows['id'], rows['label'] = tracks.radius, tracks.id, tracks.label
    fields = [PointField(name=name, offset=TRACK_TYPE.fields[name][1], datatype=kind, count=1)
              for name, _, kind in TRACK_FIELDS]
    return PointCloud2(
        header=Header(stamp=time_message(tracks.stamp), frame_id=frame), height=1,
        width=len(rows), fields=fields, is_bigendian=False, point_step=TRACK_TYPE.itemsize,
        row_step=rows.nbytes, data=array('B', rows.tobytes()), is_dense=True)


def tracks_from_message(message):
    """
    Return the Tracks of a PointCloud2, in the frame its header names.

    Extra fields are ignored. Raises MessageError where a field is missing or of another type,
    the data does not fill the points announced, or a value is not finite.
    """
    offsets = {field.name: field.offset for field in message.fields
               if (field.name, field.datatype) in {(name, kind) for name, _, kind in TRACK_FIELDS}}
    for name, kind, _ in TRACK_FIELDS:
        if name not in offsets:
            raise MessageError(f'tracks: field {name} is missing or of another type')
        if offsets[name] + np.dtype(kind).itemsize > message.point_step:
            raise MessageError(f'tracks: field {name} lies outside its point')
    count = message.width * message.height
    if message.is_bigendian or count > MOST_TRACKS:
        raise MessageError(f'tracks: big-endian, or more than {MOST_TRACKS}')
    if len(message.data) != count * message.point_step:
        raise MessageError('tracks: data does not fill the points announced')
    layout = np.dtype({'names': [name for name, _, _ in TRACK_FIELDS],
                       'formats': [kind for _, kind, _ in TRACK_FIELDS],
                       'offsets': [offsets[name] for name, _, _ in TRACK_FIELDS],
                       'itemsize': message.point_step})
    rows = np.frombuffer(bytes(message.data), dtype=layout)
    position = np.stack((rows['x'], rows['y']), axis=1).astype(float)
    velocity = np.stack((rows['vx'], rows['vy']), axis=1).astype(float)
    radius = rows['radius'].astype(float)
    if not ((np.abs(position) <= FARTHEST).all() and (np.abs(velocity) <= FASTEST).all()
            and (radius >= 0.0).all() and (radius <= FARTHEST).all()):
        raise MessageError('tracks: a value is not finite or absurd, or a radius is negative')
    return Tracks(seconds(message.header.stamp), rows['id'].copy(), position, velocity, radius,
                  rows['label'].copy())


def walls_marker(walls, frame, stamp):
    """Return Walls as one LINE_LIST Marker in `frame`, at `stamp` seconds."""
    marker = Marker(ns='walls', type=Marker.LINE_LIST, action=Marker.ADD)
    marker.header = Header(stamp=time_message(stamp), frame_id=frame)
    marker.pose.orientation.w = 1.0
    marker.scale.x = 0.04
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = 0.1, 0.1, 0.6, 1.0
    marker.points = [Point(x=x, y=y) for x, y in walls.segments.reshape(-1, 2).tolist()]
    return marker


def diagnostic_status(name, hardware_id, level, message, values):
    """Return a DiagnosticStatus; `level` is one of its constants, `values` a mapping."""
    return DiagnosticStatus(
        name=name, hardware_id=hardware_id, level=level, message=message,
        values=[KeyValue(key=str(key), value=str(value)) for key, value in values.items()])
