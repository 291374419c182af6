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
The node that tracks: one or more scans and odometry in, tracks and markers out.

Topics, parameters and frames are those of docs/perception.md; the thinking is in `perception`.
"""

from collections import Counter
import sys
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray
from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.navigation.localisation import Localisation, MAP
from wallnav_ros.navigation.surfaces import scan_points
from wallnav_ros.nodes import conversions as convert
from wallnav_ros.nodes.health import declare_diagnostics_period, Latencies, tell_reversal
from wallnav_ros.nodes.markers import track_markers
from wallnav_ros.nodes.parameters import declare, declare_pose, declare_settings
from wallnav_ros.nodes.runner import run
from wallnav_ros.nodes.topics import advertise, LATCHED, NEWEST_SCAN, RELIABLE, SENSOR, subscribe
from wallnav_ros.nodes.transforms import find_frames
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.world.files import errors_of
from wallnav_ros.world.geometry import compose
from wallnav_ros.world.tracks import HUMAN


class ScanTrackerNode(Node):
    """Feeds a Tracker from topics and publishes what it says."""

    def __init__(self):
        """Check the parameters, then subscribe; raises ValueError or OSError before that."""
        super().__init__('scan_tracker_node')
        self.tracker = Tracker(declare_settings(self, 'tracker', TrackerSettings()))
        self.place = Localisation()
        self.rejected = Counter()
        self._mounts = _declare_scanners(self)
        self._wait = declare(self, 'odom_wait', 2.0,
                             's to wait for odometry before tracking in the laser frame',
                             (0.0, 60.0))
        period = declare_diagnostics_period(self)
        self._walls = None
        self._first_scan = self._has_odometry = None
        self._tracks, self._frame = None, ''
        self._scans, self._odometry, self._latency = 0, 0, Latencies()
        self._min_size = declare(self, 'wall_min_size', 0.1,
                                 'm; smaller specks of the map are no walls', (0.0, 10.0))
        map_file = declare(self, 'map', '', 'YAML file of the map; empty: take it from topic map')
        if map_file:
            occupancy_map = load_map(map_file)
            with errors_of(map_file):
                self._use_map(occupancy_map)
        self._frames = find_frames(self)
        self._tracks_publisher = advertise(self, PointCloud2, 'tracks', RELIABLE)
        self._marker_publisher = advertise(self, MarkerArray, 'markers', RELIABLE)
        self._diagnostics_publisher = advertise(self, DiagnosticArray, 'diagnostics', RELIABLE)
        self._subscribe(bool(map_file))
        self.create_timer(period, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _subscribe(self, has_map):
        # In this order they are served: odometry first, which tells where a scan was taken.
        subscribe(self, Odometry, 'odom', self._take_odometry, SENSOR)
        for topic in self._mounts:
            subscribe(self, LaserScan, topic,
                      lambda message, topic=topic: self._take_scan(topic, message), NEWEST_SCAN)
        subscribe(self, PoseWithCovarianceStamped, 'amcl_pose', self._take_fix, LATCHED)
        if not has_map:
            subscribe(self, OccupancyGrid, 'map', self._take_map, LATCHED)

    def _take_odometry(self, message):
        try:
            stamp, pose, velocity = convert.odometry_from_message(message)
        except convert.MessageError as error:
            self.rejected[f'odom: {error}'] += 1
            return
        self.place.odom_frame = convert.frame_name(message.header.frame_id) or 'odom'
        self.place.base_frame = convert.frame_name(message.child_frame_id) or 'base_link'
        if self.place.add_odometry(stamp, pose, velocity):
            self._odometry += 1
        else:
            self.rejected['odom: out of order'] += 1

    def _take_fix(self, message):
        if convert.frame_name(message.header.frame_id) != MAP:
            self.rejected['amcl_pose: not in the map frame'] += 1
            return
        try:
            fix = convert.fix_from_message(message)
        except convert.MessageError as error:
            self.rejected[f'amcl_pose: {error}'] += 1
            return
        self.place.add_fix(*fix)

    def _take_map(self, message):
        try:
            self._use_map(convert.map_from_message(message))
        except ValueError as error:
            self.rejected[f'map: {error}'] += 1
            self.get_logger().error(f'map refused: {error}')

    def _use_map(self, occupancy_map):
        for warning in occupancy_map.warnings:
            self.get_logger().warning(warning)
        self._walls = distance_field(
            extract_walls(occupancy_map, min_size=self._min_size).walls)

    def _take_scan(self, topic, message):
        received = monotonic()
        try:
            scan = convert.scan_from_message(message)
        except ValueError as error:
            self.rejected[f'{topic}: {error}'] += 1
            return
        laser_frame = convert.frame_name(message.header.frame_id)
        mount = self._mount(topic, laser_frame)
        place = self._place(scan, mount)
        if place is None:
            self.rejected[f'{topic}: no odometry at its stamp'] += 1
            return
        self._scans += 1
        before = self.tracker.reversed_sensors
        self._tracks = self.tracker.update(scan, sensor=topic, **place)
        tell_reversal(self, topic, self.tracker, before)
        if self._has_odometry:
            self._frame = self.place.odom_frame
        else:
            alone = len(self._mounts) == 1 and not mount.any()
            self._frame = laser_frame if alone else self.place.base_frame
        self._latency.add(monotonic() - received)
        self._tracks_publisher.publish(convert.tracks_message(self._tracks, self._frame))
        if self._marker_publisher.get_subscription_count():
            self._marker_publisher.publish(track_markers(self._tracks, self._frame))

    def _mount(self, topic, laser_frame):
        """Return the laser's pose (3,) on the base: from TF where it has one."""
        found = None
        if self._frames is not None:
            found = self._frames.pose(self.place.base_frame, laser_frame)
        return self._mounts[topic] if found is None else found[1]

    def _place(self, scan, mount):
        """Return the Tracker's arguments about where `scan` was taken, None if not known."""
        base = self.place.odom_pose(scan.stamp)
        if self._first_scan is None:
            self._first_scan = monotonic()
        if base is not None:
            self._has_odometry = True
        elif self._has_odometry or monotonic() - self._first_scan < self._wait:
            return None
        else:
            if self._has_odometry is None:
                self.get_logger().warning(
                    f'no odometry on {self.resolve_topic_name("odom")}: the scans alone tell how '
                    'the robot moves, and tracks are in its own frame')
            self._has_odometry = False
            return {'pose': mount, 'odometry': False}
        end = self.place.odom_pose(scan.stamp + scan.sweep_time)
        laser = compose(base, mount)
        self.place.refine(scan.stamp, laser, scan_points(scan), self._walls)
        return {'pose': laser, 'walls': self.place.walls_in_odom(self._walls),
                'covariance': self.place.covariance_at(laser[:2]),
                'end_pose': None if end is None else compose(end, mount)}

    def _report(self):
        people = 0 if self._tracks is None else int((self._tracks.label == HUMAN).sum())
        total = 0 if self._tracks is None else len(self._tracks)
        walls = self.place.walls_in_odom(self._walls)
        values = {'scans': self._scans, 'odometry_count': self._odometry, 'tracks': total,
                  'humans': people, 'frame': self._frame,
                  'walls': 'none' if walls is None else 'subtracted',
                  'beams_reversed': ', '.join(self.tracker.reversed_sensors) or 'none',
                  'resets': self.tracker.resets, 'rejected': sum(self.rejected.values()),
                  **self._latency.values('scan_to_tracks'),
                  **{f'rejected {reason}': count for reason, count in self.rejected.items()}}
        level, text = DiagnosticStatus.OK, f'{people} humans, {total - people} obstacles'
        if not self._scans:
            level, text = DiagnosticStatus.WARN, 'no scan used yet'
        message = DiagnosticArray(header=Header(stamp=self.get_clock().now().to_msg()))
        message.status = [convert.diagnostic_status(
            self.get_fully_qualified_name(), 'wallnav_ros', level, text, values)]
        self._diagnostics_publisher.publish(message)


def _declare_scanners(node):
    """Return {scan topic: its laser's pose (3,) on the base}; raises ValueError."""
    first = declare_pose(node, 'laser_pose', 'of the laser on the base, where TF has none')
    more = declare(node, 'more_scan_topics', [''], 'further scanners, fused with topic scan')
    mounts = {'scan': first}
    for topic in filter(None, more):
        mounts[topic] = declare_pose(
            node, f'laser_pose_{topic.strip("/").replace("/", "_")}',
            f'of the laser that publishes {topic}, where TF has none')
    return mounts


def main(args=None):
    """Run the node; returns its exit status."""
    return run(ScanTrackerNode, args)


if __name__ == '__main__':
    sys.exit(main())
