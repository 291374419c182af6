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
"""The simulator node over real DDS: what its scanner sees, what it obeys, how it reports."""

import json
import signal
from time import monotonic

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from nodes_over_dds import TIMEOUT
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import String
from wallnav_ros.nodes import conversions as convert
from wallnav_ros.nodes.topics import LATCHED, RELIABLE, SENSOR

pyrvo = pytest.importorskip('pyrvo')

from wallnav_ros.nodes.simulator_node import LONGEST_LAG  # noqa: E402, I100
from wallnav_ros.simulation.episodes import draw_episode  # noqa: E402
from wallnav_ros.simulation.lidar import Lidar  # noqa: E402
from wallnav_ros.simulation.scenarios import load_scenario  # noqa: E402

pytestmark = pytest.mark.extras


class Listener:
    """Keeps every message of the simulator by topic, and can command the robot."""

    TOPICS = (('scan', LaserScan, SENSOR), ('odom', Odometry, SENSOR),
              ('amcl_pose', PoseWithCovarianceStamped, LATCHED),
              ('ground_truth/tracks', PointCloud2, RELIABLE), ('episode', String, LATCHED),
              ('/clock', Clock, SENSOR))

    def __init__(self):
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node('listener', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.heard = {topic: [] for topic, _, _ in self.TOPICS}
        for topic, kind, qos in self.TOPICS:
            self.node.create_subscription(kind, topic, self.heard[topic].append, qos)
        self.commands = self.node.create_publisher(Twist, 'cmd_vel', RELIABLE)
        self._goals = self.node.create_publisher(PoseStamped, 'goal_pose', RELIABLE)

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def wait(self, condition):
        end = monotonic() + TIMEOUT
        while not condition():
            assert monotonic() < end, 'did not happen in time'
            self._executor.spin_once(timeout_sec=0.05)

    def wait_for_silence(self, duration=1.0):
        """Spin until no odometry has come for `duration` s."""
        heard, since = 0, monotonic()
        while monotonic() - since < duration:
            if len(self.heard['odom']) != heard:
                heard, since = len(self.heard['odom']), monotonic()
            self._executor.spin_once(timeout_sec=0.05)

    def episode(self):
        return json.loads(self.heard['episode'][-1].data) if self.heard['episode'] else {}

    def send_goal(self, x, y):
        self.wait(lambda: self._goals.get_subscription_count())
        goal = PoseStamped()
        goal.header.frame_id = 'map'
        goal.pose.position.x, goal.pose.position.y = x, y
        self._goals.publish(goal)


@pytest.fixture
def listener(ros_domain_id):
    found = Listener()
    yield found
    found.close()


def test_sensors_agree_with_the_episode_drawn_from_the_same_seed(start, listener):
    start('simulator_node', {'scenario': 'cross_path', 'case': 'mixed', 'seed': 5,
                             'wait_for_goal': 'true', 'range_noise': 0.0})
    heard = listener.heard
    listener.wait(lambda: all(heard[topic] for topic in heard if topic != '/clock'))
    episode = draw_episode(load_scenario('cross_path'), 'mixed', 5)
    truth = convert.tracks_from_message(heard['ground_truth/tracks'][0])
    np.testing.assert_allclose(truth.position, episode.start, atol=1e-5)
    np.testing.assert_allclose(truth.radius, episode.radius, atol=1e-6)
    assert truth.label.tolist() == (episode.speed > 0.0).astype(int).tolist()
    pose = convert.pose_from_message(heard['amcl_pose'][0].pose.pose)
    np.testing.assert_allclose(pose, episode.robot.pose, atol=1e-9)
    expected = Lidar(noise=0.0).scan(episode.robot.pose, episode.scenario.walls, truth.agents(),
                                     np.random.default_rng(0))
    np.testing.assert_allclose(heard['scan'][0].ranges, expected, atol=1e-4)
    assert [heard[topic][0].header.frame_id for topic in ('scan', 'odom', 'amcl_pose')] == [
        'laser', 'odom', 'map']
    assert not heard['/clock']


def test_people_wait_for_the_goal_and_the_robot_for_commands(start, listener):
    start('simulator_node', {'case': 'mixed', 'wait_for_goal': 'true'})
    truths = listener.heard['ground_truth/tracks']
    listener.wait(lambda: len(truths) > 3)
    assert bytes(truths[0].data) == bytes(truths[-1].data)
    listener.send_goal(float('nan'), 4.0)
    count = len(truths)
    listener.wait(lambda: len(truths) > count + 3)
    assert listener.episode()['state'] == 'waiting'
    listener.send_goal(0.0, 4.0)
    listener.wait(lambda: bytes(truths[0].data) != bytes(truths[-1].data))
    assert listener.episode()['state'] == 'running'
    assert convert.pose_from_message(listener.heard['odom'][-1].pose.pose).tolist() == [0.0] * 3


def test_the_robot_stops_by_itself_when_commands_cease(start, listener):
    start('simulator_node', {'case': 'none', 'command_timeout': 0.2})
    odometry = listener.heard['odom']
    listener.wait(lambda: odometry and listener.commands.get_subscription_count())
    command = Twist()
    command.linear.x = 0.5
    listener.commands.publish(command)
    listener.wait(lambda: any(each.twist.twist.linear.x > 0.1 for each in odometry))
    listener.wait(lambda: odometry[-1].twist.twist.linear.x == 0.0)
    assert odometry[-1].pose.pose.position.x < 0.5 * (0.2 + 0.5)


def test_the_end_is_reported_with_everybodys_way(start, listener):
    start('simulator_node', {'case': 'mixed', 'wait_for_goal': 'true'})
    listener.wait(lambda: listener.heard['scan'])
    # A goal where the robot stands is reached at once.
    listener.send_goal(0.0, -4.0)
    listener.wait(lambda: listener.episode().get('state') == 'ended')
    report = listener.episode()
    assert report['outcome'] == 'goal' and report['time'] < 0.1
    assert np.shape(report['trajectories']['agents'])[1:] == (15, 2)
    assert report['trajectories']['goal'] == [0.0, -4.0]


def test_simulated_time_runs_as_fast_as_asked(start, listener):
    start('simulator_node', {'case': 'none', 'speed': 4.0})
    odometry = listener.heard['odom']
    listener.wait(lambda: odometry and listener.commands.get_subscription_count())
    command, began = Twist(), monotonic()
    command.linear.x = 0.5
    listener.commands.publish(command)

    def moving():
        """Return the stamps of what was simulated after the command was given."""
        return [convert.seconds(each.header.stamp) for each in odometry
                if each.twist.twist.linear.x > 0.0]
    listener.wait(moving)
    first = moving()[0]
    for topic, stamp in (('/clock', lambda message: message.clock),
                         ('scan', lambda message: message.header.stamp)):
        heard = listener.heard[topic]
        listener.wait(lambda heard=heard, stamp=stamp:
                      heard and convert.seconds(stamp(heard[-1])) > first + 8.0)
    last = convert.seconds(listener.heard['/clock'][-1].clock)
    # A busy machine may lose time, but none may be gained beyond the lag that is caught up with.
    assert monotonic() - began + LONGEST_LAG > (last - first) / 4.0


@pytest.mark.parametrize('fault, told', [
    ({'case': 'crowded'}, 'no case'), ({'scenario': 'atlantis'}, 'atlantis'),
    ({'seed': -1}, 'seed'), ({'beams': 1}, 'beams')])
def test_refuses_what_it_cannot_simulate(start, fault, told):
    node = start('simulator_node', fault)
    assert node.status() == 2
    assert len(node.lines) == 1 and told in node.lines[0]


def test_stamps_do_not_fall_behind_the_clock_of_a_machine_that_was_held_up(start, listener):
    process = start('simulator_node', {'scenario': 'cross_path', 'case': 'none'}).process
    odometry = listener.heard['odom']
    listener.wait(lambda: odometry)
    process.send_signal(signal.SIGSTOP)
    listener.wait_for_silence()
    process.send_signal(signal.SIGCONT)
    count = len(odometry)
    # Once it has caught up with what it catches up with, it is on time again.
    listener.wait(lambda: len(odometry) > count + 40)
    behind = listener.node.get_clock().now().nanoseconds * 1e-9 - convert.seconds(
        odometry[-1].header.stamp)
    assert behind < 0.5
