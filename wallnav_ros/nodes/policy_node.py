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
The node that drives: scan, odometry, map and goal in, velocity commands out.

The topics, parameters and stops are those of docs/nodes.md; the thinking is in `navigation`.
"""

import sys
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.navigation.localisation import MAP
from wallnav_ros.navigation.plans import Status
from wallnav_ros.navigation.watchdogs import Stop
from wallnav_ros.nodes import conversions as convert
from wallnav_ros.nodes.health import Latencies, navigation_status, tell_reversal
from wallnav_ros.nodes.policy_display import Display
from wallnav_ros.nodes.policy_parameters import (
    declare_options, follow_changes, make_navigator)
from wallnav_ros.nodes.runner import run
from wallnav_ros.nodes.topics import (
    advertise, LATCHED, NEWEST_SCAN, NEWEST_TRACKS, RELIABLE, SENSOR, subscribe, unheard_kind)
from wallnav_ros.nodes.transforms import find_frames
from wallnav_ros.world.files import errors_of

FAREWELL = Duration(seconds=0.5)      # longest wait for the last command to be acknowledged


class PolicyNode(Node):
    """Feeds a Navigator from topics and publishes what it says."""

    def __init__(self):
        """Load and check everything, then subscribe; raises ValueError or OSError before that."""
        super().__init__('policy_node')
        self.options = declare_options(self)
        self.navigator = make_navigator(self, self.options.control_rate)
        self._status = Status(np.zeros(2), 'stopped', Stop('no_goal', 'no goal'))
        self._latencies = {'scan_to_command': Latencies(), 'processing': Latencies()}
        self._faults, self._unheard = {}, None
        self._advertise()
        if self.options.map:
            occupancy_map = load_map(self.options.map)
            with errors_of(self.options.map):
                self._use_map(occupancy_map)
        self._frames = find_frames(self)
        self._subscribe()
        follow_changes(self, self.navigator)
        # A steady clock: a ROS clock that stands still would silence the watchdogs too.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0 / self.options.control_rate, self._step, clock=steady)
        self.create_timer(self.options.diagnostics_period, self._check_up, clock=steady)
        self._display.start()

    def close(self):
        """Leave the robot standing: a zero command is delivered before the node goes."""
        self._stand(Stop('shutdown', 'shutting down'))
        self._report()
        self._command_publisher.wait_for_all_acked(FAREWELL)

    def _advertise(self):
        kind = TwistStamped if self.options.stamped else Twist
        self._command_publisher = self._open(advertise, kind, 'cmd_vel', RELIABLE)
        self._decision_publisher = self._open(advertise, TwistStamped, 'decision', RELIABLE)
        self._diagnostics_publisher = self._open(
            advertise, DiagnosticArray, 'diagnostics', RELIABLE)
        self._display = Display(self, self.navigator, self._faults)

    def _subscribe(self):
        # In this order they are served: odometry first, which tells where a scan was taken.
        self._open(subscribe, Odometry, 'odom', self._take_odometry, SENSOR)
        self._open(subscribe, LaserScan, 'scan', self._take_scan, NEWEST_SCAN)
        self._open(subscribe, PoseWithCovarianceStamped, 'amcl_pose', self._take_fix, LATCHED)
        self._open(subscribe, PoseStamped, 'goal_pose', self._take_goal, RELIABLE)
        self._open(subscribe, Path, 'plan', self._take_path, RELIABLE)
        if self.navigator.settings.tracks_given:
            self._open(subscribe, PointCloud2, 'tracks', self._take_tracks, NEWEST_TRACKS)
        if not self.options.map:
            self._open(subscribe, OccupancyGrid, 'map', self._take_map, LATCHED)

    def _open(self, function, *arguments):
        return function(self, *arguments, faults=self._faults)

    def _now(self):
        return self.get_clock().now().nanoseconds * 1e-9

    def _take_odometry(self, message):
        try:
            stamp, pose, velocity = convert.odometry_from_message(message)
        except convert.MessageError as error:
            self.navigator.reject('odometry', str(error))
            return
        place = self.navigator.localisation
        place.odom_frame = convert.frame_name(message.header.frame_id) or place.odom_frame
        place.base_frame = convert.frame_name(message.child_frame_id) or place.base_frame
        self.navigator.take_odometry(stamp, pose, velocity, self._now())
        if self._frames is not None:
            self._look_up_correction()

    def _take_scan(self, message):
        received = monotonic()
        try:
            scan = convert.scan_from_message(message)
        except ValueError as error:
            self.navigator.reject('scan', str(error))
            return
        if self._frames is not None:
            self._look_up_mount(convert.frame_name(message.header.frame_id))
        before, tracker = self.navigator.plan, self.navigator.tracker
        reversed_before = tracker.reversed_sensors
        used = self.navigator.take_scan(scan, self._now())
        self._act_on_new_plan(before, received)
        tell_reversal(self, 'scan', tracker, reversed_before)
        if used:
            self._display.show_tracks()

    def _take_tracks(self, message):
        received = monotonic()
        try:
            tracks = convert.tracks_from_message(message)
        except convert.MessageError as error:
            self.navigator.reject('tracks', str(error))
            return
        before = self.navigator.plan
        self.navigator.take_tracks(
            tracks, convert.frame_name(message.header.frame_id), self._now())
        self._act_on_new_plan(before, received)

    def _take_fix(self, message):
        frame = convert.frame_name(message.header.frame_id)
        if frame != MAP:
            self.navigator.reject('localisation', f'frame {frame!r} is not {MAP!r}')
            return
        try:
            fix = convert.fix_from_message(message)
        except convert.MessageError as error:
            self.navigator.reject('localisation', str(error))
            return
        self.navigator.localisation.add_fix(*fix)

    def _take_path(self, message):
        self.navigator.take_path(convert.path_from_message(message),
                                 convert.frame_name(message.header.frame_id))

    def _take_goal(self, message):
        self._stand(Stop('planning', 'planning a route'))
        position = message.pose.position
        refusal = self.navigator.set_goal(
            np.array([position.x, position.y]), convert.frame_name(message.header.frame_id))
        if refusal is not None:
            self.get_logger().error(f'goal refused: {refusal}')
        self._step()

    def _take_map(self, message):
        self._stand(Stop('map_replaced', 'reading a new map'))
        self._report()
        try:
            self._use_map(convert.map_from_message(message))
        except ValueError as error:
            self.navigator.reject('map', str(error))
            self.get_logger().error(f'map refused: {error}')

    def _stand(self, stop):
        """Stand because of a Stop while something lasts longer than a command may."""
        self._status = Status(np.zeros(2), 'stopped', stop)
        self._command()

    def _use_map(self, occupancy_map):
        """Take an OccupancyMap's walls; raises ValueError where they cannot be used."""
        walls = extract_walls(occupancy_map, min_size=self.options.wall_min_size).walls
        self.navigator.set_walls(distance_field(walls) if len(walls) else None)
        self.navigator.map_fault = None if len(walls) else Stop(
            'walls_empty', 'map: there is no wall in it; give another one')
        for warning in occupancy_map.warnings:
            self.get_logger().warning(warning)
        self.get_logger().info(f'map with {len(walls)} wall segments')
        self._display.show_walls(walls)

    def _look_up_mount(self, laser_frame):
        found = self._frames.pose(self.navigator.localisation.base_frame, laser_frame)
        if found is not None:
            self.navigator.laser_pose = found[1]

    def _look_up_correction(self):
        place = self.navigator.localisation
        found = None if place.fixed else self._frames.pose(MAP, place.odom_frame)
        if found is not None and found[0] != place.fix_stamp:
            place.set_correction(*found)

    def _act_on_new_plan(self, before, received):
        """Publish at once what was decided since `before`, not at the next control step."""
        plan = self.navigator.plan
        if plan is None or plan is before:
            return
        status = self._command_next()
        decision = TwistStamped(header=Header(
            stamp=convert.time_message(plan.stamp),
            frame_id=self.navigator.localisation.base_frame))
        # The decision itself: the ramp towards it is for the base alone.
        decision.twist = convert.twist_message(np.zeros(2) if plan.stop else plan.command)
        self._decision_publisher.publish(decision)
        self._latencies['processing'].add(monotonic() - received)
        self._latencies['scan_to_command'].add(self._now() - plan.stamp)
        self._tell_changes(status)

    def _step(self):
        self._tell_changes(self._command_next())

    def _command_next(self):
        """Command what the navigator says now; returns the Status before."""
        before = self._status
        self._status = self._display.status = self.navigator.update(self._now(), monotonic())
        self._command()
        return before

    def _tell_changes(self, before):
        """Log and report at once when the reason for standing is not that of Status `before`."""
        old, new = (status.stop.cause if status.stop else '' for status in (before, self._status))
        if old != new and new != 'planning':
            if new:
                self.get_logger().info(f'stopped: {self._status.stop.detail}')
            else:
                self.get_logger().info('driving')
            self._report()

    def _command(self):
        message = convert.twist_message(self._status.command)
        if self.options.stamped:
            header = Header(stamp=self.get_clock().now().to_msg(),
                            frame_id=self.navigator.localisation.base_frame)
            message = TwistStamped(header=header, twist=message)
        self._command_publisher.publish(message)

    def _check_up(self):
        """Look for what keeps the base from hearing the commands, and report."""
        other = Twist if self.options.stamped else TwistStamped
        unheard = unheard_kind(self, self._command_publisher, {
            other: f'set enable_stamped_cmd_vel to {str(not self.options.stamped).lower()}'})
        if unheard is not None and 'cmd_vel' not in self._faults:
            self.get_logger().warning(unheard)
        if unheard is not None:
            self._faults['cmd_vel'] = unheard
        elif self._unheard is not None:
            self._faults.pop('cmd_vel', None)
        self._unheard = unheard
        self._report()

    def _report(self):
        message = DiagnosticArray(header=Header(stamp=self.get_clock().now().to_msg()))
        message.status = [navigation_status(
            self.get_fully_qualified_name(), self.navigator, self._status, self._now(),
            self._latencies, {f'fault {topic}': text for topic, text in self._faults.items()})]
        self._diagnostics_publisher.publish(message)


def main(args=None):
    """Run the node; returns its exit status."""
    return run(PolicyNode, args)


if __name__ == '__main__':
    sys.exit(main())
