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
"""A recorded bag played as real messages into the running nodes, against its offline replay."""

from time import monotonic

import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')
rosbags = pytest.importorskip('rosbags')

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402, I100
from geometry_msgs.msg import PoseStamped, TwistStamped  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import QoSProfile, ReliabilityPolicy  # noqa: E402
from recorded_bags import Bag, MOUNT, simulate_drive  # noqa: E402
from rosbags.rosbag2 import Reader, StoragePlugin, Writer  # noqa: E402
from rosbags.typesys import get_typestore, Stores  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import LaserScan, PointCloud2  # noqa: E402

from wallnav_ros.evaluation.recordings import Recording  # noqa: E402
from wallnav_ros.evaluation.replay import replay_recording  # noqa: E402
from wallnav_ros.evaluation.replay_stage import set_stage  # noqa: E402
from wallnav_ros.evaluation.survey import survey_recording  # noqa: E402
from wallnav_ros.nodes.conversions import seconds, time_message, tracks_from_message  # noqa: E402
from wallnav_ros.nodes.topics import RELIABLE, SENSOR  # noqa: E402
from wallnav_ros.perception.tracking import Tracker  # noqa: E402
from wallnav_ros.policy.lookahead import Lookahead  # noqa: E402
from wallnav_ros.policy.value_function import load_value_function  # noqa: E402
from wallnav_ros.world.files import find_asset  # noqa: E402

pytestmark = pytest.mark.extras

TIMEOUT = 60.0
# Seconds of odometry before the first scan.
AHEAD = 1.0
# Nanoseconds, about one a scan: each is waited for.
ODOMETRY_PERIOD = 120_000_000
NO_ODOMETRY = Odometry()
NO_ODOMETRY.pose.pose.position.x = float('nan')
# Both nodes tell in diagnostics what they have taken in; the test waits for each message.
EAGER = {'diagnostics_period': 0.02}
WHEELCHAIR = (0.85, 0.235, 0.7344)


class Player:
    """Plays the bytes of a bag onto topics and collects what the nodes answer."""

    def __init__(self):
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node('player', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._out = {'/scan': self.node.create_publisher(LaserScan, 'scan', SENSOR),
                     '/odom': self.node.create_publisher(Odometry, 'odom', SENSOR)}
        self._clock = self.node.create_publisher(
            Clock, '/clock', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
        self._goal = self.node.create_publisher(PoseStamped, 'goal_pose', RELIABLE)
        self.tracks, self.decisions, self.rejected = {}, {}, set()
        self.odometry_count, self.node_time = 0, 0.0
        self.node.create_subscription(
            DiagnosticArray, 'diagnostics', self._take_diagnostics, RELIABLE)
        self.node.create_subscription(PointCloud2, 'tracks', self._take_tracks, RELIABLE)
        self.node.create_subscription(TwistStamped, 'decision', self._take_decision, RELIABLE)

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def _take_tracks(self, message):
        self.tracks[round(seconds(message.header.stamp), 3)] = tracks_from_message(message)

    def _take_decision(self, message):
        twist = message.twist
        self.decisions[round(seconds(message.header.stamp), 3)] = (
            twist.linear.x, twist.angular.z)

    def wait(self, condition, what):
        """Spin until `condition()` holds; the test fails, naming `what`, when it never does."""
        deadline = monotonic() + TIMEOUT
        while not condition():
            assert monotonic() < deadline, f'{what}: did not happen'
            self._executor.spin_once(timeout_sec=0.02)

    def connect(self):
        """
        Wait until a node takes scans and odometry, and its tracks are listened to.

        Topics connect one by one and each way by itself: what tells for certain is that the
        node counts a scan without beams and an odometry that is not finite as rejected.
        """
        def refused():
            self._out['/scan'].publish(LaserScan())
            self._out['/odom'].publish(NO_ODOMETRY)
            return (self.node.count_publishers('tracks')
                    and any('no beams' in reason for reason in self.rejected)
                    and any('not finite' in reason for reason in self.rejected))
        self.wait(refused, 'connection')

    def _take_diagnostics(self, message):
        values = {value.key: value.value for value in message.status[0].values}
        self.rejected.update(key for key in values if key.startswith('rejected '))
        self.odometry_count = int(values['odometry_count'])
        self.node_time = seconds(message.header.stamp)

    def send_goal(self, position):
        self.wait(self._goal.get_subscription_count, 'somebody who takes goals')
        goal = PoseStamped()
        goal.header.frame_id = 'odom'
        goal.pose.position.x, goal.pose.position.y = map(float, position)
        self._goal.publish(goal)

    def play(self, path, replay, sim_time=False):
        """
        Play the bag at `path`, each message when the node has taken the one before it.

        Nothing orders two topics: a scan could overtake odometry, and both the clock. With
        `sim_time` the node follows the clock that is played.
        """
        stamps = iter([round(tracks.stamp, 3) for tracks in replay.tracks])
        odometry = 0
        with Reader(path) as reader:
            for connection, bag_time, raw in reader.messages():
                now = time_message(bag_time * 1e-9)
                self._clock.publish(Clock(clock=now))
                if sim_time:
                    self.wait(lambda now=now: self.node_time == seconds(now), 'clock')
                self._out[connection.topic].publish(bytes(raw))
                if connection.topic == '/scan':
                    stamp = next(stamps)
                    self.wait(lambda stamp=stamp: stamp in self.tracks, f'answer to {stamp}')
                else:
                    odometry += 1
                    self.wait(lambda sent=odometry: self.odometry_count == sent, 'odometry')


@pytest.fixture
def player(ros_domain_id):
    """Return a Player in the test's own domain."""
    peer = Player()
    yield peer
    peer.close()


def drive_past_one_person(path, every):
    """Write a bag of a simulated drive with every n-th scan; returns its path."""
    bag = simulate_drive().bag
    begin = bag.messages[0][0] + AHEAD
    odometry = [each for each in bag.messages if each[1] == '/odom'][::2]
    scans = [each for each in bag.messages if each[1] == '/scan' and each[0] > begin][::every]
    return Bag(sorted(odometry + scans, key=lambda message: message[0])).write(path)


@pytest.fixture(scope='module')
def simulated(tmp_path_factory):
    """Return the path of a bag of a simulated drive past one person, scans at 10 Hz."""
    return drive_past_one_person(tmp_path_factory.mktemp('simulated') / 'bag', 1)


@pytest.fixture(scope='module')
def seldom(tmp_path_factory):
    """Return the same with so few scans that a decision is due with each."""
    return drive_past_one_person(tmp_path_factory.mktemp('seldom') / 'bag', 3)


@pytest.fixture(scope='module')
def wheelchair(shared_data, tmp_path_factory):
    """Return a bag: 10 s of the real wheelchair among people, with thinned odometry."""
    path = tmp_path_factory.mktemp('wheelchair') / 'bag'
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = []
    with Reader(shared_data / 'scans/leg_tracker_bench_moving_1/rosbag2') as reader:
        held = [each for each in reader.connections if each.topic in ('/scan', '/odom')]
        begin = reader.start_time + 18_000_000_000
        due = begin
        for connection, bag_time, raw in reader.messages(held, begin, begin + 11_000_000_000):
            if connection.topic == '/scan' and bag_time > begin + 1e9 * AHEAD:
                messages.append((bag_time, connection, raw))
            elif connection.topic == '/odom' and bag_time >= due:
                due = bag_time + ODOMETRY_PERIOD
                messages.append((bag_time, connection, raw))
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {each.topic: writer.add_connection(each.topic, each.msgtype, typestore=store)
                  for each in held}
        for bag_time, connection, raw in sorted(messages, key=lambda message: message[0]):
            writer.write(topics[connection.topic], bag_time, raw)
    return path


def replay_of(path, mount, goal=None):
    """Return the Stage and the offline Replay of a bag."""
    recording = Recording(path)
    stage = set_stage(survey_recording(recording, mount), goal=goal).stage
    weights = load_value_function(find_asset('models', 'wallnav', '.npz'))
    return stage, replay_recording(recording, stage, Tracker(), Lookahead.from_weights(weights))


def laser_parameter(mount):
    """Return the parameter that tells a node where the laser is."""
    return {'laser_pose': '[' + ', '.join(map(str, map(float, mount))) + ']'}


def agreement(answered, replay):
    """Return the share of scans answered with the replay's very tracks, and the worst gap (m)."""
    same, gaps = 0, [0.0]
    for expected in replay.tracks:
        tracks = answered[round(expected.stamp, 3)]
        if (tracks.id.tolist(), tracks.label.tolist()) == (
                expected.id.tolist(), expected.label.tolist()):
            same += 1
            gaps.extend(np.hypot(*(tracks.position - expected.position).T))
    return same / len(replay.tracks), max(gaps)


@pytest.mark.parametrize('bag, mount', [('simulated', MOUNT), ('wheelchair', WHEELCHAIR)])
def test_the_tracker_node_tracks_as_the_replay_does(bag, mount, request, start, player):
    path = request.getfixturevalue(bag)
    _, replay = replay_of(path, mount)
    start('scan_tracker_node', EAGER | laser_parameter(mount))
    player.connect()

    player.play(path, replay)

    share, gap = agreement(player.tracks, replay)
    assert len(player.tracks) == len(replay.tracks)
    assert sum(map(len, replay.tracks)) > len(replay.tracks)
    assert share > 0.95
    assert gap < 0.01


def test_the_policy_node_decides_as_the_replay_does(seldom, start, player):
    goal = (6.0, 0.5)
    _, replay = replay_of(seldom, MOUNT, goal)
    start('policy_node', EAGER | {'use_sim_time': 'true'} | laser_parameter(MOUNT))
    player.connect()
    player.send_goal(goal)

    player.play(seldom, replay, sim_time=True)

    assert agreement(player.tracks, replay)[0] > 0.95
    assert len(player.decisions) == len(replay.decision_ms)
    # The recorded robot is not led by us, and at last meets the person. Then decisions hang on
    # what was commanded when, in which a replay has only the scans for a clock.
    driving = [decision == 'driving' for decision in (*replay.decisions, '')].index(False)
    assert driving > 5
    for stamp, command in zip(replay.stamps[:driving], replay.commands[:driving]):
        np.testing.assert_allclose(player.decisions[round(stamp, 3)], command, atol=1e-6)
