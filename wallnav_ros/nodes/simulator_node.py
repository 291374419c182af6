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
The node that stands in for robot and people: one episode of a scenario, seen by a scanner.

Paper section 1 (world); the topics are those of a robot with AMCL (docs/nodes.md).
"""

from array import array
from dataclasses import dataclass
import json
import sys
from time import monotonic, time_ns

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header, String

from wallnav_ros.nodes import conversions as convert
from wallnav_ros.nodes.health import Latencies
from wallnav_ros.nodes.parameters import declare, declare_pose
from wallnav_ros.nodes.runner import run
from wallnav_ros.nodes.topics import advertise, LATCHED, RELIABLE, SENSOR, subscribe
from wallnav_ros.nodes.transforms import find_broadcaster, transform_message
from wallnav_ros.simulation.batch import RUNNING
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.lidar import Lidar
from wallnav_ros.simulation.live_world import Base, LiveWorld, Schedule, TICK
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.geometry import compose, invert
from wallnav_ros.world.tracks import HUMAN, OBSTACLE, Tracks

SHORTEST_PERIOD = 0.005    # s of wall time between timer calls
LONGEST_LAG = 0.2          # s of wall time that are caught up with; beyond, time is lost
START = 1.0                # s that /clock begins at: zero means "no clock yet" to ROS
CLOCK_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


@dataclass(frozen=True)
class Options:
    """The parameters that are the node's own: see docs/nodes.md."""

    speed: float
    publish_clock: bool
    wait_for_goal: bool
    scan_rate: float
    odom_rate: float
    command_timeout: float
    stamped: bool


class SimulatorNode(Node):
    """Advances a LiveWorld with the wall clock and publishes what a robot in it would."""

    def __init__(self):
        """Draw the episode, then open the topics; raises ValueError or OSError before that."""
        super().__init__('simulator_node')
        self.options = _declare_options(self)
        self.lidar = _declare_lidar(self)
        self.laser_pose = declare_pose(self, 'laser_pose', 'of the laser on the base')
        self.world, self._rng = _draw_world(self)
        self._held = self.options.wait_for_goal
        self._simulated = 0.0
        self._command, self._commanded = np.zeros(2), -np.inf
        self._schedule, self._odom_in_map = Schedule(), self.world.pose
        self._sent, self._latency = {}, Latencies()
        self._advertise()
        self._subscribe()
        now = monotonic()
        self._wall = now
        self._epoch = (START if self.options.publish_clock
                       else self.get_clock().now().nanoseconds * 1e-9)
        self._report()
        period = max(TICK / self.options.speed, SHORTEST_PERIOD)
        self.create_timer(period, self._catch_up, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _advertise(self):
        self._scan_publisher = advertise(self, LaserScan, 'scan', SENSOR)
        self._odom_publisher = advertise(self, Odometry, 'odom', SENSOR)
        self._fix_publisher = advertise(self, PoseWithCovarianceStamped, 'amcl_pose', LATCHED)
        self._truth_publisher = advertise(self, PointCloud2, 'ground_truth/tracks', RELIABLE)
        self._episode_publisher = advertise(self, String, 'episode', LATCHED)
        self._clock_publisher = (advertise(self, ClockMessage, '/clock', CLOCK_QOS)
                                 if self.options.publish_clock else None)
        self._broadcast = find_broadcaster(self)

    def _subscribe(self):
        kind, take = ((TwistStamped, lambda message: self._take_command(message.twist))
                      if self.options.stamped else (Twist, self._take_command))
        subscribe(self, kind, 'cmd_vel', take, RELIABLE)
        subscribe(self, TwistStamped, 'decision', self._take_decision, RELIABLE)
        subscribe(self, PoseStamped, 'goal_pose', self._take_goal, RELIABLE)

    def _take_command(self, twist):
        command = np.array([twist.linear.x, twist.angular.z])
        if np.isfinite(command).all():
            self._command, self._commanded = command, self._simulated

    def _take_decision(self, message, info):
        sent = self._sent.pop(_nanoseconds(message.header.stamp), None)
        if sent is not None:
            # It arrived when DDS had it; that this node was simulating then is not the robot's.
            waited = max(0.0, 1e-9 * (time_ns() - info['received_timestamp']))
            self._latency.add(max(0.0, monotonic() - sent - waited))

    def _take_goal(self, message):
        if convert.frame_name(message.header.frame_id) != 'map':
            self.get_logger().warning('goal_pose: only goals in frame map are judged')
            return
        goal = np.array([message.pose.position.x, message.pose.position.y])
        if not np.isfinite(goal).all():
            self.get_logger().warning('goal_pose: a coordinate is not finite')
            return
        self.world.goal = goal
        if self._held:
            self._held = False
            self._report()

    def _catch_up(self):
        """Advance by the ticks that wall time says are due, at most LONGEST_LAG of it."""
        now = monotonic()
        lag = min(now - self._wall, LONGEST_LAG)
        if self._clock_publisher is None:
            # Stamps by the machine's clock must not fall behind it for good.
            self._epoch += now - self._wall - lag
        ticks = int(lag * self.options.speed / TICK)
        self._wall = now - (lag - ticks * TICK / self.options.speed)
        for _ in range(ticks):
            self._tick()

    def _tick(self):
        self._simulated += TICK
        stamp = convert.time_message(self._epoch + self._simulated)
        if not self._held:
            fresh = self._simulated - self._commanded <= self.options.command_timeout
            running = self.world.outcome == RUNNING
            self.world.advance(self._command if fresh else np.zeros(2), TICK)
            if running and self.world.outcome != RUNNING:
                self._report()
        if self._clock_publisher is not None:
            self._clock_publisher.publish(ClockMessage(clock=stamp))
        if self._schedule.is_due('odom', self.options.odom_rate, self._simulated):
            self._odom_publisher.publish(self._odometry(stamp))
            if self._broadcast is not None:
                self._broadcast([
                    transform_message(stamp, 'map', 'odom', self._odom_in_map),
                    transform_message(stamp, 'odom', 'base_link', self.world.odometry),
                    transform_message(stamp, 'base_link', 'laser', self.laser_pose)])
        if self._schedule.is_due('scan', self.options.scan_rate, self._simulated):
            self._publish_scan(stamp)

    def _publish_scan(self, stamp):
        agents = self.world.agents()
        scan = LaserScan(header=Header(stamp=stamp, frame_id='laser'))
        scan.angle_min, scan.angle_increment = self.lidar.angle_min, self.lidar.angle_increment
        scan.angle_max = scan.angle_min + (self.lidar.beams - 1) * scan.angle_increment
        scan.range_min, scan.range_max = self.lidar.range_min, self.lidar.range_max
        scan.scan_time = 1.0 / self.options.scan_rate
        scan.ranges = array('f', self.lidar.scan(
            compose(self.world.pose, self.laser_pose), self.world.episode.scenario.walls, agents,
            self._rng).tobytes())
        self._publish_fix(stamp)
        if len(self._sent) > 100:
            self._sent.pop(next(iter(self._sent)))
        self._sent[_nanoseconds(stamp)] = monotonic()
        self._scan_publisher.publish(scan)
        if self._truth_publisher.get_subscription_count():
            self._truth_publisher.publish(self._truth(agents, stamp))

    def _publish_fix(self, stamp):
        """Publish the pose in the map when the robot has moved as far as AMCL waits for."""
        fix = self.world.next_fix()
        if fix is None:
            return
        message = PoseWithCovarianceStamped(header=Header(stamp=stamp, frame_id='map'))
        self._odom_in_map = compose(fix, invert(self.world.odometry))
        message.pose.pose = convert.pose_message(fix)
        base = self.world.base
        message.pose.covariance[0] = message.pose.covariance[7] = base.fix_noise ** 2
        message.pose.covariance[35] = base.fix_turn_noise ** 2
        self._fix_publisher.publish(message)

    def _odometry(self, stamp):
        message = Odometry(header=Header(stamp=stamp, frame_id='odom'), child_frame_id='base_link')
        message.pose.pose = convert.pose_message(self.world.odometry)
        message.twist.twist = convert.twist_message(self.world.measured)
        return message

    def _truth(self, agents, stamp):
        walks = self.world.episode.speed > 0.0
        tracks = Tracks(convert.seconds(stamp), np.arange(len(walks), dtype=np.uint32),
                        agents.position, agents.velocity, agents.radius,
                        np.where(walks, HUMAN, OBSTACLE).astype(np.uint8))
        return convert.tracks_message(tracks, 'map')

    def _report(self):
        """Publish how far the episode is; at its end also where everybody went."""
        over = self.world.outcome != RUNNING
        state = 'waiting' if self._held else 'ended' if over else 'running'
        report = {'state': state, **self.world.summary(),
                  **self._latency.values('scan_to_command')}
        if over:
            report['trajectories'] = self.world.trajectories()
            self.get_logger().info(f'{report["outcome"]} after {report["time"]:.2f} s')
        self._episode_publisher.publish(String(data=json.dumps(report)))


def _nanoseconds(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def _declare_options(node):
    speed = declare(node, 'speed', 1.0, 'simulated seconds per second', (0.05, 50.0))
    return Options(
        speed=speed,
        publish_clock=declare(node, 'publish_clock', False,
                              'publish /clock; always so unless speed is 1') or speed != 1.0,
        wait_for_goal=declare(node, 'wait_for_goal', False,
                              'hold the people until the first goal_pose'),
        scan_rate=declare(node, 'scan_rate', 10.0, 'Hz', (1.0, 80.0)),
        odom_rate=declare(node, 'odom_rate', 40.0, 'Hz', (1.0, 80.0)),
        command_timeout=declare(node, 'command_timeout', 0.5,
                                's after which the robot stops by itself', (0.05, 10.0)),
        stamped=declare(node, 'enable_stamped_cmd_vel', False, 'take TwistStamped on cmd_vel'))


def _declare_lidar(node):
    defaults = Lidar()
    beams = declare(node, 'beams', defaults.beams, 'per scan', (2, 5000))
    view = declare(node, 'field_of_view', 2.0 * np.pi, 'rad, ahead of the laser',
                   (0.1, 2.0 * np.pi))
    full = view > 2.0 * np.pi - 1e-6
    return Lidar(
        beams=beams, angle_min=-view / 2.0, angle_increment=view / (beams if full else beams - 1),
        range_max=declare(node, 'range_max', defaults.range_max, 'm', (0.5, 100.0)),
        noise=declare(node, 'range_noise', defaults.noise, 'm, standard deviation', (0.0, 1.0)))


def _draw_world(node):
    """Return the LiveWorld the parameters ask for, and the generator of its noise."""
    scenario = load_scenario(declare(node, 'scenario', 'cross_path', 'file, or a shipped name'))
    case = declare(node, 'case', 'mixed', 'of the scenario')
    seed = declare(node, 'seed', 1, 'of people and noise', (0, 2 ** 31 - 1))
    limits = Base()
    base = Base(
        max_speed=declare(node, 'max_speed', limits.max_speed, 'm/s', (0.01, 5.0)),
        max_turn_rate=declare(node, 'max_turn_rate', limits.max_turn_rate, 'rad/s', (0.01, 10.0)),
        acceleration=declare(node, 'acceleration', limits.acceleration, 'm/s^2', (0.01, 100.0)),
        turn_acceleration=declare(node, 'turn_acceleration', limits.turn_acceleration,
                                  'rad/s^2', (0.01, 100.0)),
        drift=declare(node, 'odom_drift', 0.0, 'of the odometry, per m and rad', (0.0, 0.5)),
        fix_noise=declare(node, 'localisation_noise', 0.0, 'm', (0.0, 5.0)),
        fix_turn_noise=declare(node, 'localisation_turn_noise', 0.0, 'rad', (0.0, 1.0)))
    rng = np.random.default_rng((seed, 1))
    return LiveWorld(draw_episode(scenario, case, seed), base, rng), rng


def main(args=None):
    """Run the node; returns its exit status."""
    return run(SimulatorNode, args)


if __name__ == '__main__':
    sys.exit(main())
