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
"""Bags written for tests: rosbag2 folders with scans, odometry and transforms, or a drive."""

from dataclasses import dataclass, field
import math

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from wallnav_ros.simulation.lidar import Lidar
from wallnav_ros.world.geometry import compose, drive_unicycle, to_parent
from wallnav_ros.world.state import Agents
from wallnav_ros.world.walls import Walls

STORE = get_typestore(Stores.ROS2_JAZZY)


def _type(name):
    return STORE.types[name]


def _header(stamp, frame):
    nanoseconds = round(stamp * 1e9)
    time = _type('builtin_interfaces/msg/Time')(
        sec=nanoseconds // 10 ** 9, nanosec=nanoseconds % 10 ** 9)
    return _type('std_msgs/msg/Header')(stamp=time, frame_id=frame)


def _quaternion(yaw, roll=0.0):
    """Return a rotation by `roll` about x, then by `yaw` about z."""
    return _type('geometry_msgs/msg/Quaternion')(
        x=math.cos(yaw / 2) * math.sin(roll / 2), y=math.sin(yaw / 2) * math.sin(roll / 2),
        z=math.sin(yaw / 2) * math.cos(roll / 2), w=math.cos(yaw / 2) * math.cos(roll / 2))


def laser_scan(stamp, ranges, frame='laser', angle_min=-math.pi, angle_increment=None):
    """Return a LaserScan of `ranges`, by default over the whole circle."""
    step = 2.0 * math.pi / max(len(ranges), 1) if angle_increment is None else angle_increment
    return _type('sensor_msgs/msg/LaserScan')(
        header=_header(stamp, frame), angle_min=angle_min,
        angle_max=angle_min + step * (len(ranges) - 1), angle_increment=step, time_increment=0.0,
        scan_time=0.1, range_min=0.05, range_max=12.0,
        ranges=np.asarray(ranges, dtype=np.float32), intensities=np.empty(0, np.float32))


def odometry(stamp, pose, twist=(0.0, 0.0, 0.0), frame='odom', child='base_link', scale=1.0):
    """Return an Odometry; `scale` other than 1 spoils its quaternion."""
    vector, point = _type('geometry_msgs/msg/Vector3'), _type('geometry_msgs/msg/Point')
    turn = _quaternion(pose[2])
    turn = type(turn)(x=scale * turn.x, y=scale * turn.y, z=scale * turn.z, w=scale * turn.w)
    return _type('nav_msgs/msg/Odometry')(
        header=_header(stamp, frame), child_frame_id=child,
        pose=_type('geometry_msgs/msg/PoseWithCovariance')(
            pose=_type('geometry_msgs/msg/Pose')(
                position=point(x=float(pose[0]), y=float(pose[1]), z=0.0), orientation=turn),
            covariance=np.zeros(36)),
        twist=_type('geometry_msgs/msg/TwistWithCovariance')(
            twist=_type('geometry_msgs/msg/Twist')(
                linear=vector(x=float(twist[0]), y=float(twist[1]), z=0.0),
                angular=vector(x=0.0, y=0.0, z=float(twist[2]))),
            covariance=np.zeros(36)))


def transform(parent, child, x, y, yaw, roll=0.0, stamp=0.0):
    """Return a TFMessage with one transform."""
    return _type('tf2_msgs/msg/TFMessage')(transforms=[
        _type('geometry_msgs/msg/TransformStamped')(
            header=_header(stamp, parent), child_frame_id=child,
            transform=_type('geometry_msgs/msg/Transform')(
                translation=_type('geometry_msgs/msg/Vector3')(x=x, y=y, z=0.2),
                rotation=_quaternion(yaw, roll)))])


@dataclass
class Bag:
    """Messages to be written: (bag time in seconds, topic, message)."""

    messages: list = field(default_factory=list)

    def add(self, bag_time, topic, message):
        """Add a message, as received at `bag_time`."""
        self.messages.append((bag_time, topic, message))

    def write(self, path, mcap=False, zstd=False, topics=None):
        """
        Write the rosbag2 folder `path` and return it.

        topics: {name: type} to announce even where no message is on them.
        """
        writer = Writer(path, version=9, storage_plugin=(
            StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3))
        if zstd:
            writer.set_compression(
                CompressionMode.STORAGE if mcap else CompressionMode.MESSAGE,
                CompressionFormat.ZSTD)
        kinds = dict(topics or {})
        kinds.update({topic: message.__msgtype__ for _, topic, message in self.messages})
        with writer:
            connections = {topic: writer.add_connection(topic, kind, typestore=STORE)
                           for topic, kind in kinds.items()}
            for bag_time, topic, message in self.messages:
                writer.write(connections[topic], round(bag_time * 1e9),
                             STORE.serialize_cdr(message, message.__msgtype__))
        return path


# An L-shaped hall of 12 m x 8 m with a niche and a pillar: no two corners look alike.
HALL = Walls.from_polylines(
    [[(0, 0), (12, 0), (12, 3), (9, 3), (9, 4), (12, 4), (12, 8), (7, 8), (7, 5), (0, 5)],
     [(3, 2), (3.5, 2), (3.5, 2.5), (3, 2.5)]], closed=True)
# The robot's base in the hall at the start; its odometry starts there at zero.
START = np.array([1.0, 3.6, 0.0])
MOUNT = np.array([0.15, 0.05, 0.3])
FIRST_STAMP = 1000.0


@dataclass(frozen=True)
class Drive:
    """
    A simulated drive through the hall past one person who walks.

    bag: `scan` at 10 Hz and `odom` at 20 Hz, received 20 ms after their stamps. stamps: (S,) of
    the scans; walker: (S, 2) and base: (S, 3), both in the odometry's frame.
    """

    bag: Bag
    stamps: np.ndarray
    walker: np.ndarray
    base: np.ndarray


def simulate_drive(seconds=8.0, with_odometry=True, delay=0.02, mirrored=False):
    """
    Return a Drive of 0.5 m/s along a gentle bend, the walker coming the other way at 1 m/s.

    Without odometry the robot stands. delay: s by which the recorder's clock is ahead of the
    stamps. mirrored: the laser hangs upside down, and the bag's tf says so.
    """
    rng, lidar, bag = np.random.default_rng(7), Lidar(noise=0.01), Bag()
    if mirrored:
        bag.add(FIRST_STAMP + delay, '/tf_static', transform(
            'base_link', 'laser', MOUNT[0], MOUNT[1], MOUNT[2], roll=math.pi))
    speed, turn = (0.5, 0.05) if with_odometry else (0.0, 0.0)
    stamps, walkers, bases = FIRST_STAMP + np.arange(0.1, seconds, 0.1), [], []
    for number in range(int(20 * seconds)):
        if with_odometry:
            time = number / 20.0
            bag.add(FIRST_STAMP + time + delay, '/odom', odometry(
                FIRST_STAMP + time, drive_unicycle(np.zeros(3), speed, turn, time),
                (speed, 0.0, turn)))
    for stamp in stamps:
        base = drive_unicycle(np.zeros(3), speed, turn, stamp - FIRST_STAMP)
        walker = np.array([8.0 - 1.0 * (stamp - FIRST_STAMP), 0.7])
        person = Agents.of([to_parent(START, walker)], np.zeros((1, 2)), [0.25])
        ranges = lidar.scan(compose(START, compose(base, MOUNT)), HALL, person, rng)
        # Hung upside down, the same beams are swept the other way round.
        step = -lidar.angle_increment if mirrored else lidar.angle_increment
        first = -lidar.angle_min if mirrored else lidar.angle_min
        bag.add(stamp + delay, '/scan', laser_scan(
            stamp, ranges, angle_min=first, angle_increment=step))
        walkers.append(walker)
        bases.append(base)
    bag.messages.sort(key=lambda message: message[0])
    return Drive(bag, stamps, np.array(walkers), np.array(bases))
