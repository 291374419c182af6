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
Whatever comes in, nothing is raised and no command leaves the limits.

Messages go through the callbacks of a real policy_node. WALLNAV_FUZZ sets how many there are.
"""

from array import array
import os

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
import numpy as np
import pytest
import rclpy
from rclpy.parameter import Parameter
from rclpy.time import Time
from sensor_msgs.msg import LaserScan
from wallnav_ros.nodes.conversions import pose_message, time_message, tracks_message
from wallnav_ros.nodes.policy_node import PolicyNode
from wallnav_ros.nodes.policy_parameters import SETTINGS
from wallnav_ros.world.geometry import drive_unicycle
from wallnav_ros.world.tracks import Tracks

INPUTS = int(os.environ.get('WALLNAV_FUZZ', 10_000))
NASTY = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1e308, -1e308, 5e-324, 1e18, -1.0, 3.0)
FRAMES = ('odom', 'map', 'base_link', 'mars', '', '/odom', 'ä' * 300)
STEP = 0.005               # s that an input takes


class World:
    """Draws inputs for a policy_node: mostly what a robot would send, else nonsense."""

    def __init__(self, rng, node):
        self.rng, self.node = rng, node
        self.callbacks = {subscription.topic_name: subscription.callback
                          for subscription in node.subscriptions}
        self.live = [setting for setting in SETTINGS if setting.live]
        self.time, self.pose = 1000.0, np.zeros(3)
        self.nonsense = False
        self.given = np.zeros(2)
        self.update, node.navigator.update = node.navigator.update, self.note_update
        self.makers = {'/odom': self.odometry, '/scan': self.scan, '/goal_pose': self.goal,
                       '/amcl_pose': self.fix, '/plan': self.path, '/map': self.map,
                       '/tracks': self.tracks}

    def advance(self):
        """Let time pass, now and then to anywhere; the robot does as it is told."""
        self.time += STEP
        if self.rng.random() < 2e-4:
            self.time = max(1.0, self.time + self.rng.choice((-100.0, -0.2, 0.5, 1e6)))
        self.node.get_clock().set_ros_time_override(Time(nanoseconds=round(self.time * 1e9)))
        self.pose = drive_unicycle(self.pose, *self.given, STEP)

    def note_update(self, now, steady):
        """Let the navigator say what to do, and note the command (2,) that it gives."""
        status = self.update(now, steady)
        self.given = status.command
        return status

    def send(self):
        """Hand one input to the node; returns whether it changed the limits in force."""
        # Spells of sense and nonsense, so that there is motion to disturb.
        if self.rng.random() < 0.005:
            self.nonsense = self.rng.random() < 0.5
        draw = self.rng.random()
        if draw < 0.01:
            self.set_parameter()
            return True
        topics = ('/odom', '/odom', '/odom', '/scan', '/scan', '/amcl_pose', '/tracks')
        if draw < 0.05:
            topics = ('/goal_pose', '/plan', '/map') if draw < 0.02 else ('/goal_pose', '/plan')
        topic = topics[self.rng.integers(len(topics))]
        if topic in self.callbacks:
            self.callbacks[topic](self.makers[topic]())
        return False

    def set_parameter(self):
        setting = self.live[self.rng.integers(len(self.live))]
        if setting.limits is None:
            value = bool(self.rng.random() < 0.5)
        else:
            low, high = setting.limits
            value = float(self.rng.choice((*NASTY, low, high, self.rng.uniform(low, high))))
        self.node.set_parameters([Parameter(setting.name, value=value)])

    def number(self, value, chance=0.1):
        """Return `value`, or anything while the world makes no sense."""
        if self.nonsense and self.rng.random() < chance:
            return float(self.rng.choice(NASTY))
        return float(value)

    def header(self, message, frame):
        stamp = self.time - self.rng.uniform(0.0, 0.02)
        frame = FRAMES[self.rng.integers(len(FRAMES))] if self.odd() else frame
        message.header.frame_id = frame
        message.header.stamp = time_message(stamp)
        if self.odd():
            message.header.stamp.sec = int(self.rng.integers(-2 ** 31, 2 ** 31))
        return message

    def odd(self):
        return self.nonsense and self.rng.random() < 0.05

    def odometry(self):
        message = self.header(Odometry(child_frame_id='base_link'), 'odom')
        message.pose.pose = self.placed(self.pose)
        message.twist.twist.linear.x = self.number(self.given[0])
        message.twist.twist.angular.z = self.number(self.given[1])
        return message

    def placed(self, pose):
        message = pose_message(pose)
        message.position.x = self.number(message.position.x)
        message.orientation.z = self.number(message.orientation.z)
        return message

    def scan(self):
        beams = int(self.rng.integers(0, 60)) if self.odd() else 48
        ranges = self.rng.uniform(0.3, 8.0, beams).astype(np.float32)
        if self.nonsense:
            wild = self.rng.random(beams) < 0.2
            with np.errstate(over='ignore'):
                ranges[wild] = self.rng.choice(NASTY, int(wild.sum()))
        elif self.rng.random() < 0.8:
            ranges[:] = np.inf
        return self.header(LaserScan(
            angle_min=self.single(-np.pi), angle_increment=self.single(2.0 * np.pi / 48),
            range_min=self.single(0.05), range_max=self.single(12.0),
            time_increment=self.single(0.0), ranges=array('f', ranges.tobytes())), 'laser')

    def single(self, value):
        """Return a number that fits into 32 bits."""
        with np.errstate(over='ignore'):
            return float(np.float32(self.number(value, 0.03)))

    def goal(self):
        message = self.header(PoseStamped(), ('odom', 'map')[self.rng.integers(2)])
        message.pose.position.x = self.number(self.rng.uniform(-20.0, 20.0))
        message.pose.position.y = self.number(self.rng.uniform(-20.0, 20.0))
        return message

    def fix(self):
        message = self.header(PoseWithCovarianceStamped(), 'map')
        message.pose.pose = self.placed(self.pose + self.rng.normal(0.0, 0.05, 3))
        for place in (0, 1, 6, 7, 35):
            message.pose.covariance[place] = self.number(self.rng.uniform(0.0, 0.1), 0.03)
        return message

    def path(self):
        message = self.header(Path(), ('odom', 'map')[self.rng.integers(2)])
        message.poses = [self.goal() for _ in range(self.rng.integers(0, 5))]
        return message

    def map(self):  # noqa: A003
        height, width = self.rng.integers(0, 60, 2)
        cells = self.rng.choice(np.array([-1, 0, 0, 0, 0, 0, 0, 0, 100, 50], np.int8),
                                (height, width))
        message = self.header(OccupancyGrid(data=array('b', cells.tobytes())), 'map')
        message.info.width, message.info.height = int(width), int(height)
        message.info.resolution = self.single(0.2)
        message.info.origin = self.placed(np.zeros(3))
        if self.odd():
            message.info.width = int(self.rng.integers(0, 2 ** 32))
        return message

    def tracks(self):
        count = int(self.rng.integers(0, 6))
        tracks = Tracks(self.time, np.arange(count, dtype=np.uint32),
                        self.pose[:2] + self.rng.uniform(-8.0, 8.0, (count, 2)),
                        self.rng.uniform(-2.0, 2.0, (count, 2)), self.rng.uniform(0.1, 0.5, count),
                        self.rng.integers(0, 2, count).astype(np.uint8))
        if self.odd() and count:
            tracks.position[0] = self.number(0.0, 1.0)
        message = tracks_message(tracks, 'odom')
        if self.odd():
            message.data = array('B', self.rng.bytes(int(self.rng.integers(0, 200))))
        if self.odd():
            message.fields = message.fields[:int(self.rng.integers(0, 8))]
        return self.header(message, 'odom') if self.odd() else message


@pytest.fixture(params=['scan', 'topic'])
def node(request, ros_domain_id, straight_weights):
    """Return a policy_node in this process, with the clock in the hands of the test."""
    rclpy.init(args=['--ros-args', '-p', 'use_sim_time:=true', '-p', f'model:={straight_weights}',
                     '-p', f'tracks_source:={request.param}', '--log-level', 'fatal'])
    node = PolicyNode()
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def test_no_input_raises_or_drives_the_robot_beyond_its_limits(node, rng):
    world = World(rng, node)
    timers = [timer.callback for timer in node.timers]
    driven = 0
    for number in range(INPUTS // 2):
        world.advance()
        # A command from before the limits were changed says nothing about them.
        if world.send() or number % 10 == 0:
            timers[0]()
        if number % 200 == 0:
            for timer in timers[1:]:
                timer()
        base, (speed, turn_rate) = node.navigator.settings.base, world.given
        assert (0.0 if not base.reverse else -base.max_speed) <= speed <= base.max_speed
        assert abs(turn_rate) <= base.max_turn_rate
        driven += speed > 0.05
    # Nonsense alone would show nothing: the robot was on its way for a good part of it.
    assert driven > 0.02 * INPUTS
    assert node.navigator.rejected
