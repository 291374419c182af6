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
Recorded scans and odometry from rosbag2 folders, with no ROS graph.

Read by PyPI `rosbags` (sqlite3, mcap; metadata versions 1 to 9); frames follow REP-105.
"""

from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_typestore, Stores

from wallnav_ros.perception.scan import Scan, ScanError
from wallnav_ros.world.geometry import yaw_of

SCAN_TYPE = 'sensor_msgs/msg/LaserScan'
ODOMETRY_TYPE = 'nav_msgs/msg/Odometry'
TRANSFORM_TYPE = 'tf2_msgs/msg/TFMessage'
# Beams of a recording that are kept for a second look, 18 bytes each with what follows from
# them: 15 minutes of 1081 beams at 20 Hz. A longer one is read again.
_MOST_KEPT = 20_000_000


class RecordingError(ValueError):
    """A recording cannot be used; the message is one line: file, field and fix."""


class _OdometryError(ValueError):
    """An odometry message that must not be used; the text says why."""


@dataclass(frozen=True)
class ScanRecord:
    """
    A scan as it was received.

    bag_time: seconds, when the recorder received it (`scan.stamp` is the sensor's own time).
    frame: the laser's frame, without a leading slash.
    """

    bag_time: float
    frame: str
    scan: Scan


@dataclass(frozen=True)
class OdometryRecord:
    """
    A wheel-odometry message as it was received.

    bag_time, stamp: seconds, of receipt and of the message itself.
    frame, child_frame: without leading slashes (usually `odom` and `base_link`).
    pose: (3,) x, y, yaw of the child in the frame.
    twist: (3,) forward and leftward m/s and rad/s, in the child frame.
    """

    bag_time: float
    stamp: float
    frame: str
    child_frame: str
    pose: np.ndarray
    twist: np.ndarray


@dataclass(frozen=True)
class Mount:
    """
    Where the laser sits on the robot.

    pose: (3,) x, y, yaw in the robot's base frame.
    upside_down: the scan runs clockwise seen from above.
    """

    pose: np.ndarray
    upside_down: bool = False


class Recording:
    """
    One scan topic and, where there is one, one odometry topic of a rosbag2 folder.

    path: the folder. topics: {name: (type, message count)}.
    scan_topic, odom_topic: as found in the bag; odom_topic is None without odometry.
    rejected: how many messages were unusable, by reason; filled by `records`.
    """

    def __init__(self, path, scan_topic=None, odom_topic=None):
        """
        Look into the folder `path` and choose the topics.

        A topic left at None is found by its type. Raises RecordingError when the folder cannot
        be read, a named topic is missing or of another type, there is no scan, or when several
        topics would do.
        """
        self.path = Path(path)
        self.rejected = Counter()
        self._kept = None
        self._typestore = get_typestore(Stores.ROS2_JAZZY)
        with self._open() as reader:
            self.topics = {topic: (info.msgtype, info.msgcount)
                           for topic, info in reader.topics.items()}
        self.scan_topic = self._choose('--scan-topic', scan_topic, SCAN_TYPE)
        self.odom_topic = self._choose('--odom-topic', odom_topic, ODOMETRY_TYPE)
        if self.scan_topic is None:
            held = ', '.join(sorted(self.topics)) or 'none'
            raise RecordingError(
                f'{self.path}: topics: no {SCAN_TYPE} among them ({held}): record a scan')

    @property
    def scan_count(self):
        """Return how many scans the bag says it holds."""
        return self.topics[self.scan_topic][1]

    def records(self):
        """
        Yield every ScanRecord and OdometryRecord in the order they were received.

        A message that cannot be used at all is counted in `rejected` and left out.
        Raises RecordingError when a file is damaged or no scan comes out of it.
        """
        if self._kept is not None:
            yield from self._kept
            return
        scans, self.rejected = 0, Counter()
        kept, beams = [], 0
        wanted = {self.scan_topic, self.odom_topic} - {None}
        for topic, bag_time, message in self._messages(wanted):
            scans += topic == self.scan_topic
            make = _scan_record if topic == self.scan_topic else _odometry_record
            try:
                record = make(bag_time, message)
            except (ScanError, _OdometryError) as error:
                self.rejected[str(error)] += 1
                continue
            if topic == self.scan_topic:
                beams += len(record.scan.ranges)
            if beams <= _MOST_KEPT:
                kept.append(record)
            else:
                kept.clear()
            yield record
        if not scans:
            raise RecordingError(f'{self.path}: {self.scan_topic}: holds no message: '
                                 'record longer, or choose another --scan-topic')
        if beams <= _MOST_KEPT:
            self._kept = kept

    def mount(self, base, laser):
        """
        Return the Mount of frame `laser` on frame `base` by the recorded tf, or None.

        The first transform of each pair of frames counts: a laser does not move on its robot.
        """
        edges = {}
        static = {topic for topic in self.topics if topic.endswith('tf_static')}
        moving = {topic for topic, (kind, _) in self.topics.items() if kind == TRANSFORM_TYPE}
        for topics in (static, moving - static):
            for _, _, message in self._messages(topics):
                for transform in message.transforms:
                    parent = _frame(transform.header.frame_id)
                    child = _frame(transform.child_frame_id)
                    if (parent, child) in edges:
                        continue
                    edges[parent, child] = _matrix(transform.transform)
                    edges[child, parent] = np.linalg.inv(edges[parent, child])
                    if (found := _chain(edges, base, laser)) is not None:
                        return _mount(found)
        return None

    def _choose(self, option, name, kind):
        """Return the bag's topic of type `kind`, the one `name` means if it is not None."""
        if name is not None:
            found = [topic for topic in self.topics if topic.lstrip('/') == name.lstrip('/')]
            if not found:
                raise RecordingError(f'{self.path}: {option} {name}: not in the bag, '
                                     f'which holds {", ".join(sorted(self.topics))}')
            if self.topics[found[0]][0] != kind:
                raise RecordingError(f'{self.path}: {option} {name}: is a '
                                     f'{self.topics[found[0]][0]}, needs a {kind}')
            return found[0]
        found = sorted(topic for topic, (held, _) in self.topics.items() if held == kind)
        found = [topic for topic in found if self.topics[topic][1]] or found
        if len(found) > 1:
            raise RecordingError(f'{self.path}: {option}: several topics would do: '
                                 f'name one of {", ".join(found)}')
        return found[0] if found else None

    def _messages(self, topics):
        """Yield (topic, bag time in seconds, message) of `topics` in the order of receipt."""
        if not topics:
            return
        with self._open() as reader:
            wanted = [held for held in reader.connections if held.topic in topics]
            for connection, bag_time, raw in reader.messages(wanted):
                message = self._typestore.deserialize_cdr(raw, connection.msgtype)
                yield connection.topic, bag_time * 1e-9, message

    @contextmanager
    def _open(self):
        if not self.path.is_dir():
            raise RecordingError(f'{self.path}: no such folder: give the rosbag2 folder, '
                                 'the one that holds metadata.yaml')
        if not (self.path / 'metadata.yaml').is_file():
            raise RecordingError(f'{self.path}: metadata.yaml: missing: give a rosbag2 folder, '
                                 'or write it anew with `ros2 bag reindex`')
        try:
            with Reader(self.path) as reader:
                yield reader
        except (RecordingError, GeneratorExit):
            raise
        # A damaged file raises whatever its storage or its decoder happens to trip over.
        except Exception as error:
            reason = ' '.join(str(error).split()) or type(error).__name__
            raise RecordingError(f'{self.path}: cannot be read ({reason}): is the copy complete? '
                                 'a recording cut short needs `ros2 bag reindex`') from error


def _frame(name):
    """Return a frame id as ROS 2 spells it: without the leading slash of ROS 1."""
    return name.lstrip('/')


def _seconds(stamp):
    return stamp.sec + stamp.nanosec * 1e-9


def _scan_record(bag_time, message):
    scan = Scan(
        stamp=_seconds(message.header.stamp), ranges=message.ranges,
        angle_min=message.angle_min, angle_increment=message.angle_increment,
        range_min=message.range_min, range_max=message.range_max,
        time_increment=message.time_increment)
    return ScanRecord(bag_time, _frame(message.header.frame_id), scan)


def _odometry_record(bag_time, message):
    position, turn = message.pose.pose.position, message.pose.pose.orientation
    twist = message.twist.twist
    values = (position.x, position.y, turn.x, turn.y, turn.z, turn.w,
              twist.linear.x, twist.linear.y, twist.angular.z)
    if not all(map(math.isfinite, values)):
        raise _OdometryError('odometry: not finite')
    try:
        yaw = yaw_of(turn.x, turn.y, turn.z, turn.w)
    except ValueError as error:
        raise _OdometryError(f'odometry: {error}') from None
    return OdometryRecord(
        bag_time, _seconds(message.header.stamp),
        _frame(message.header.frame_id), _frame(message.child_frame_id),
        np.array([position.x, position.y, yaw]),
        np.array([twist.linear.x, twist.linear.y, twist.angular.z]))


def _matrix(transform):
    """Return the (4, 4) homogeneous matrix of a geometry_msgs Transform."""
    turn, shift = transform.rotation, transform.translation
    x, y, z, w = np.array([turn.x, turn.y, turn.z, turn.w]) / max(
        math.hypot(turn.x, turn.y, turn.z, turn.w), 1e-12)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), shift.x],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), shift.y],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), shift.z],
        [0.0, 0.0, 0.0, 1.0]])


def _chain(edges, base, laser):
    """Return the (4, 4) matrix of `laser` in `base` over the fewest of `edges`, or None."""
    reached, front = {base: np.eye(4)}, [base]
    while front and laser not in reached:
        step = {child: reached[parent] @ matrix for (parent, child), matrix in edges.items()
                if parent in front and child not in reached}
        reached.update(step)
        front = list(step)
    return reached.get(laser)


def _mount(matrix):
    """Return the Mount that a (4, 4) matrix is, seen from above."""
    yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    return Mount(np.array([matrix[0, 3], matrix[1, 3], yaw]), bool(matrix[2, 2] < 0.0))
