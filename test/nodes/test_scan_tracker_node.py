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
"""The tracker node over real DDS: what it takes, what it publishes, how it ends."""

import os
import signal
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from map_files import write_map_files
from nav_msgs.msg import Odometry
from nodes_over_dds import TIMEOUT
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan, PointCloud2
from visualization_msgs.msg import MarkerArray
from wallnav_ros.nodes.conversions import time_message, tracks_from_message
from wallnav_ros.nodes.topics import LATCHED

BEAMS = 720
PERIOD = 0.1


class World:
    """A peer of the node: publishes a person walking past, collects what comes back."""

    def __init__(self, namespace=''):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node('world', namespace=namespace, context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.scans = self.node.create_publisher(LaserScan, 'scan', qos_profile_sensor_data)
        self.odometry = self.node.create_publisher(Odometry, 'odom', qos_profile_sensor_data)
        self.fixes = self.node.create_publisher(PoseWithCovarianceStamped, 'amcl_pose', LATCHED)
        self.tracks, self.markers, self.diagnostics = [], [], []
        self.node.create_subscription(PointCloud2, 'tracks', self.tracks.append, 10)
        self.node.create_subscription(MarkerArray, 'markers', self.markers.append, 10)
        self.node.create_subscription(
            DiagnosticArray, 'diagnostics', self.diagnostics.append, 10)
        self.time = 100.0

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)

    def wait(self, ready):
        """Spin until `ready()`; fails the test when that never comes."""
        end = time.monotonic() + TIMEOUT
        while not ready():
            assert time.monotonic() < end, 'the node did not answer in time'
            self.executor.spin_once(timeout_sec=0.05)

    def send_scan(self, ranges):
        """Publish one scan at the next tenth of a second, with odometry at its stamp."""
        self.time += PERIOD
        odometry = Odometry()
        odometry.header.stamp = time_message(self.time)
        odometry.header.frame_id, odometry.child_frame_id = 'odom', 'base_link'
        odometry.pose.pose.position.x = 5.0
        odometry.pose.pose.orientation.w = 1.0
        self.odometry.publish(odometry)
        scan = LaserScan(angle_min=-np.pi, angle_max=np.pi, angle_increment=2 * np.pi / BEAMS,
                         range_min=0.1, range_max=10.0)
        scan.header.stamp, scan.header.frame_id = time_message(self.time), 'laser'
        scan.ranges = np.asarray(ranges, dtype=np.float32).tolist()
        self.scans.publish(scan)

    def localise(self, spread):
        """Tell that the odometry's frame is the map's, with `spread` m of doubt in x and y."""
        fix = PoseWithCovarianceStamped()
        fix.header.stamp, fix.header.frame_id = time_message(self.time), 'map'
        fix.pose.pose.position.x = 5.0
        fix.pose.pose.orientation.w = 1.0
        fix.pose.covariance[0] = fix.pose.covariance[7] = spread ** 2
        self.fixes.publish(fix)

    def track(self, ranges):
        """Send a scan and return the Tracks that answer it."""
        self.send_scan(ranges)
        stamp = time_message(self.time)
        self.wait(lambda: self.tracks and self.tracks[-1].header.stamp == stamp)
        return tracks_from_message(self.tracks[-1])

    def connect(self):
        """Wait until the node has a scan and the odometry to it: topics connect one by one."""
        self.wait(lambda: self.node.count_publishers('tracks'))
        end = time.monotonic() + TIMEOUT
        while not self.tracks:
            assert time.monotonic() < end, 'the node did not answer in time'
            self.send_scan(np.full(BEAMS, np.inf))
            self.executor.spin_once(timeout_sec=0.05)


def disc_ranges(centre, radius):
    """Return the ranges at which BEAMS beams from the origin hit a disc, inf elsewhere."""
    angles = -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS)
    along = np.cos(angles) * centre[0] + np.sin(angles) * centre[1]
    gap = np.square(centre).sum() - along ** 2
    hit = (along > 0.0) & (gap < radius ** 2)
    return np.where(hit, along - np.sqrt(np.maximum(radius ** 2 - gap, 0.0)), np.inf)


@pytest.fixture
def start_node(ros_domain_id):
    """Return a function that starts the node and ends it with the test."""
    started = []

    def start(*arguments):
        process = subprocess.Popen(
            [sys.executable, '-m', 'wallnav_ros.nodes.scan_tracker_node', '--ros-args',
             '-p', 'diagnostics_period:=0.1', *arguments],
            stderr=subprocess.PIPE, text=True, env=os.environ)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def world(ros_domain_id, request):
    """Return a peer in the namespace the test asks for."""
    peer = World(getattr(request, 'param', ''))
    yield peer
    peer.close()


def walk_past(world, steps=25):
    """Let a person of 0.25 m radius pass at 2 m at 1 m/s; returns the last Tracks."""
    for step in range(steps):
        tracks = world.track(disc_ranges(np.array([2.0, -1.2 + 0.1 * step]), 0.25))
    return tracks


def test_a_walker_becomes_a_human_track_in_the_odometry_frame(start_node, world):
    start_node()
    world.connect()
    tracks = walk_past(world)
    assert world.tracks[-1].header.frame_id == 'odom'
    assert tracks.stamp == pytest.approx(world.time, abs=1e-6)
    assert len(tracks) == 1 and tracks.label[0] == 1
    # The robot stands at x = 5 m: the person is 2 m further on, 1.2 m to the left by now.
    np.testing.assert_allclose(tracks.position[0], [7.0, 1.2], atol=0.1)
    np.testing.assert_allclose(tracks.velocity[0], [0.0, 1.0], atol=0.2)


def test_tracks_have_the_fields_of_the_interface(start_node, world):
    start_node()
    world.connect()
    world.track(disc_ranges(np.array([2.0, 0.0]), 0.25))
    names = [field.name for field in world.tracks[-1].fields]
    kinds = [field.datatype for field in world.tracks[-1].fields]
    assert names == ['x', 'y', 'z', 'vx', 'vy', 'radius', 'id', 'label']
    assert kinds == [7, 7, 7, 7, 7, 7, 6, 2]
    world.wait(lambda: world.markers)


@pytest.mark.parametrize('world', ['/robot_7'], indirect=True)
def test_names_follow_namespace_and_remaps(start_node, world):
    start_node('-r', '__ns:=/robot_7')
    world.connect()
    assert len(walk_past(world)) == 1


def test_scans_that_cannot_be_used_are_counted_and_do_no_harm(start_node, world):
    start_node()
    world.connect()
    world.send_scan([])

    def rejected():
        values = {item.key: item.value for message in world.diagnostics
                  for status in message.status for item in status.values}
        return values.get('rejected scan: ranges: no beams') == '1'
    # Only the newest scan is kept for a busy node: each is sent when the one before is dealt with.
    world.wait(rejected)
    world.send_scan(np.full(BEAMS, np.nan))
    world.track(disc_ranges(np.array([2.0, 0.0]), 0.25))


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_ends_cleanly_when_asked(start_node, world, number):
    process = start_node()
    world.connect()
    process.send_signal(number)
    assert process.wait(TIMEOUT) == 0


@pytest.mark.parametrize('spread, speck, found', [(0.02, 0.1, 1), (0.1, 0.1, 0), (0.1, 3.0, 1)])
def test_doubt_of_the_pose_and_its_size_decide_what_is_a_mapped_wall(
        start_node, world, tmp_path, spread, speck, found):
    # A wall from (7, -1) to (7.5, 1) in the map; a pole whose near side is 0.19 m before it.
    # Margins: 2 * sqrt(0.03^2 + 0.04^2 + 0.02^2) = 0.11 m and, with 0.1 m, 0.22 m.
    start_node('-p', 'map:=' + str(write_map_files(
        tmp_path, [[0]] * 4, resolution='0.5', origin='[7.0, -1.0, 0.0]')),
        '-p', f'wall_min_size:={speck}')
    world.connect()
    world.localise(spread)
    world.wait(lambda: any(item.key == 'walls' and item.value == 'subtracted'
                           for message in world.diagnostics
                           for status in message.status for item in status.values))
    for _ in range(8):
        tracks = world.track(disc_ranges(np.array([1.85, 0.0]), 0.04))
    assert len(tracks) == found


def test_refuses_a_map_that_does_not_exist(start_node):
    process = start_node('-p', 'map:=nowhere.yaml')
    assert process.wait(TIMEOUT) == 2
    assert 'nowhere.yaml' in process.stderr.read()
