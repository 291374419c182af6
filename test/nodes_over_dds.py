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
"""What tests of nodes share: processes that end with their test, and a robot to talk to them."""

from array import array
import os
import subprocess
import sys
import threading
from time import monotonic, time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import LaserScan, PointCloud2
from wallnav_ros.nodes.conversions import pose_message, time_message, tracks_message
from wallnav_ros.nodes.topics import LATCHED, RELIABLE, SENSOR
from wallnav_ros.world.geometry import drive_unicycle
from wallnav_ros.world.tracks import Tracks

TIMEOUT = 60.0             # s that anything may take on a busy machine
EAGER = {'diagnostics_period': 0.1}    # for nodes that are waited for
BEAMS = 360
COMMAND_TIMEOUT = 0.5      # s after which a base stops by itself


class NodeProcess:
    """A node of this package as a process; its stderr is collected as it comes."""

    def __init__(self, name, parameters=(), arguments=()):
        command = [sys.executable, '-m', f'wallnav_ros.nodes.{name}', '--ros-args', *arguments]
        for key, value in dict(parameters).items():
            command += ['-p', f'{key}:={value}']
        self.process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            env={**os.environ, 'OMP_NUM_THREADS': '1'})
        self.lines = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stderr:
            self.lines.append(line.rstrip())

    def status(self):
        """Wait for the end of the process and return its exit status."""
        status = self.process.wait(TIMEOUT)
        self._reader.join(TIMEOUT)
        return status

    def kill(self):
        self.process.kill()
        self.process.wait()
        self._reader.join(TIMEOUT)
        self.process.stderr.close()


class Robot:
    """
    A robot in an open place, over DDS: drives as it is told, sends odometry and scans.

    Switches: `scans`, `odometry`, `tracks`, `fixes`, `clock` say what it sends, `fix_shift`
    (3,) how far off its fixes are.
    Records: `commands` [(monotonic when sent, v, w)], `causes` and `messages` (of the node's
    diagnostics, in order), `values` (the newest of them).
    """

    def __init__(self, namespace='', scan='scan', command='cmd_vel', stamped=False):
        self.tracks = self.fixes = self.clock = False
        self.pose, self.velocity = np.zeros(3), np.zeros(2)
        self.clock_offset = 0.0
        self.mend()
        self.commands, self.causes, self.messages, self.headers = [], [], [], []
        self.values = {}
        self.last_scan = self.last_odometry = self.last_fix = None
        self.matched = 0
        self._steady = monotonic() - time()
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node('robot', namespace=namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._open(scan, command, stamped)
        self._moved = monotonic()
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.node.create_timer(0.025, self._send_odometry, clock=steady)
        self.node.create_timer(0.1, self._send_scan, clock=steady)

    def _open(self, scan, command, stamped):
        node = self.node
        matched = PublisherEventCallbacks(matched=self._note_match)
        self._scan = node.create_publisher(LaserScan, scan, SENSOR, event_callbacks=matched)
        self._odometry = node.create_publisher(Odometry, 'odom', SENSOR, event_callbacks=matched)
        self._tracks = node.create_publisher(PointCloud2, 'tracks', RELIABLE)
        self._fix = node.create_publisher(PoseWithCovarianceStamped, 'amcl_pose', LATCHED)
        self._goal = node.create_publisher(PoseStamped, 'goal_pose', RELIABLE)
        self._map = node.create_publisher(OccupancyGrid, 'map', LATCHED)
        self._clock = node.create_publisher(
            ClockMessage, '/clock', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
        node.create_subscription(TwistStamped if stamped else Twist, command,
                                 self._take_command, RELIABLE)
        node.create_subscription(DiagnosticArray, 'diagnostics', self._take_diagnostics, RELIABLE)

    def mend(self):
        """Let sensors work and see nothing, as to begin with."""
        self.scans = self.odometry = True
        self.ranges = np.full(BEAMS, np.inf)
        self.odometry_pose, self.fix_shift = None, np.zeros(3)

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def wait(self, condition, what, timeout=TIMEOUT):
        """Spin until `condition()` holds; the test fails, naming `what`, when it never does."""
        deadline = monotonic() + timeout
        while not condition():
            assert monotonic() < deadline, f'{what}: did not happen; causes: {self.causes[-5:]}'
            self._executor.spin_once(timeout_sec=0.02)

    def wait_for(self, cause):
        """Wait until the node's diagnostics give `cause` ('' while it drives)."""
        self.wait(lambda: self.causes and self.causes[-1] == cause, f'cause {cause!r}')

    def send_goal(self, x, y, frame='odom'):
        """Send a goal in metres to the node, once that has connected to its topic."""
        self.wait(self._goal.get_subscription_count, 'a node that takes goals')
        goal = PoseStamped()
        goal.header.frame_id = frame
        goal.pose.position.x, goal.pose.position.y = float(x), float(y)
        goal.pose.orientation.w = 1.0
        self._goal.publish(goal)

    def send_map(self, cells, resolution, origin):
        """Send a map of `cells` (H, W) int8 whose lower left corner lies at `origin` (2,)."""
        grid = OccupancyGrid(data=array('b', np.ascontiguousarray(cells, np.int8).tobytes()))
        grid.header.frame_id = 'map'
        grid.info.height, grid.info.width = cells.shape
        grid.info.resolution = resolution
        grid.info.origin.position.x, grid.info.origin.position.y = map(float, origin)
        grid.info.origin.orientation.w = 1.0
        self._map.publish(grid)

    def start_driving(self, x=30.0, y=0.0, frame='odom'):
        """Send a goal and wait until the robot moves."""
        self.send_goal(x, y, frame)
        self.wait(self.moves, 'motion')

    def moves(self):
        return bool(self.commands) and self.commands[-1][1] > 0.05

    def stands(self):
        return bool(self.commands) and self.commands[-1][1:] == (0.0, 0.0)

    def collect(self, count):
        """Return the next `count` commands as an array (count, 3): monotonic, v, w."""
        before = len(self.commands)
        self.wait(lambda: len(self.commands) >= before + count, f'{count} commands')
        return np.array(self.commands[before:])

    def now(self):
        if self.clock:
            return 1000.0 + monotonic() + self.clock_offset
        return self.node.get_clock().now().nanoseconds * 1e-9

    def _note_match(self, event):
        self.matched += event.current_count_change > 0

    def _take_command(self, message, info):
        # When the node sent it: what this process takes to notice is not the node's doing.
        sent = info['source_timestamp'] * 1e-9 + self._steady
        if isinstance(message, TwistStamped):
            self.headers.append(message.header)
            message = message.twist
        self.velocity = np.array([message.linear.x, message.angular.z])
        self.commands.append((sent, *self.velocity.tolist()))

    def _take_diagnostics(self, message):
        for status in message.status:
            values = {item.key: item.value for item in status.values}
            if 'cause' in values:      # scan_tracker_node has diagnostics of its own
                self.values = values
                self.causes.append(values['cause'])
                self.messages.append(status.message)

    def _send_odometry(self):
        now = monotonic()
        if self.commands and now - self.commands[-1][0] > COMMAND_TIMEOUT:
            self.velocity = np.zeros(2)
        self.pose = drive_unicycle(self.pose, *self.velocity, now - self._moved)
        self._moved = now
        if self.clock:
            self._clock.publish(ClockMessage(clock=time_message(self.now())))
        if not self.odometry:
            return
        message = Odometry(child_frame_id='base_link')
        message.header.stamp, message.header.frame_id = time_message(self.now()), 'odom'
        message.pose.pose = pose_message(
            self.pose if self.odometry_pose is None else self.odometry_pose)
        message.twist.twist.linear.x, message.twist.twist.angular.z = self.velocity.tolist()
        self._odometry.publish(message)
        self.last_odometry = monotonic()

    def _send_scan(self):
        stamp = time_message(self.now())
        if self.fixes:
            fix = PoseWithCovarianceStamped()
            fix.header.stamp, fix.header.frame_id = stamp, 'map'
            # The odometry began at (1, 2) in the map.
            fix.pose.pose = pose_message(self.pose + (1.0, 2.0, 0.0) + self.fix_shift)
            self._fix.publish(fix)
            self.last_fix = monotonic()
        if self.tracks:
            self._tracks.publish(tracks_message(Tracks.none(self.now()), 'odom'))
        if not self.scans:
            return
        scan = LaserScan(angle_min=-np.pi, angle_increment=2 * np.pi / BEAMS, range_min=0.05,
                         range_max=12.0, ranges=self.ranges.astype(np.float32).tolist())
        scan.header.stamp, scan.header.frame_id = stamp, 'laser'
        self._scan.publish(scan)
        self.last_scan = monotonic()
