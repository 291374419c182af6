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
The fault matrix of docs/safety.md over DDS: every fault ends in a stop and is named.

One navigating graph lives through all of them, as a robot would through a bad day.
"""

import gc
import signal
import threading
from time import monotonic

from nodes_over_dds import EAGER, NodeProcess, Robot
import numpy as np
import pytest

STOPPED_WITHIN = 0.5       # s
CONTROL_PERIOD = 0.05      # s
MOST_HELD_UP = 0.3         # s, that a busy machine may keep the processor from the node
pytestmark = pytest.mark.slow
TIMEOUTS = {'scan_timeout': 0.3, 'odom_timeout': 0.3, 'tracks_timeout': 0.3,
            'localisation_timeout': 0.3}
FULL_SPEED = 0.7           # m/s, of 0.8
CORRIDOR = np.zeros((80, 2000), np.int8)
CORRIDOR[[0, -1]] = CORRIDOR[:, [0, -1]] = 100


class Graph:
    """A robot in a long corridor, localised, and the node that drives it east."""

    def __init__(self, weights, namespace='', **parameters):
        self.robot = Robot(namespace=namespace)
        self.robot.fixes = self.robot.clock = True
        self.robot.send_map(CORRIDOR, 0.1, (-4.0, -2.0))
        self.policy = NodeProcess('policy_node', {
            'model': weights, 'use_sim_time': 'true', **EAGER, **TIMEOUTS, **parameters},
            ['-r', f'__ns:={namespace or "/"}'])

    def close(self):
        self.policy.kill()
        self.robot.close()

    def drive_at_full_speed(self):
        robot = self.robot
        if not robot.moves():
            robot.wait(lambda: robot.values.get('state_frame') == 'map', 'a pose in the map')
            robot.send_goal(150.0, 2.0, 'map')
        robot.wait(lambda: robot.commands and robot.commands[-1][1] > FULL_SPEED, 'full speed')

    def assert_stops(self, cause, since=None, told=''):
        """
        Check that the robot is told to stand within half a second, and why.

        The half second is that of a node which is given the processor for every control step: a
        hold-up is allowed for, but not as long a one as would hide a node that hangs.
        """
        robot, seen = self.robot, len(self.robot.causes)
        began = monotonic() if since is None else since
        robot.wait(robot.stands, f'a standstill because of {cause}')
        sent = [began, *(command[0] for command in robot.commands if command[0] > began)]
        held_up = max((np.diff(sent) - CONTROL_PERIOD).max(initial=0.0), 0.0)
        assert sent[-1] - began <= STOPPED_WITHIN + min(held_up, MOST_HELD_UP)
        robot.wait(lambda: cause in robot.causes[seen:], f'diagnostics that tell {cause}')
        assert any(told in message for message in robot.messages[seen:])

    def assert_goes_on_by_itself(self):
        self.robot.wait(self.robot.moves, 'motion after the fault cleared')

    def assert_waits_for_a_new_goal(self):
        assert not self.robot.collect(15)[:, 1:].any()
        self.drive_at_full_speed()


@pytest.fixture(scope='module')
def graph(ros_domain_id, straight_weights):
    """Return the Graph that all faults of this file happen to."""
    # What earlier tests left would be searched for garbage while a stop is being timed.
    gc.collect()
    gc.freeze()
    graph = Graph(straight_weights)
    yield graph
    graph.close()
    gc.unfreeze()


@pytest.fixture
def driving(graph):
    """Return the Graph with its robot at full speed; what a test broke is mended after it."""
    graph.drive_at_full_speed()
    yield graph
    graph.robot.mend()


@pytest.mark.parametrize('feed, last, cause', [
    ('scans', 'last_scan', 'scan_stale'), ('odometry', 'last_odometry', 'odometry_stale')])
def test_a_sensor_that_falls_silent(driving, feed, last, cause):
    setattr(driving.robot, feed, False)
    driving.assert_stops(cause, getattr(driving.robot, last), f'{cause.split("_")[0]}: ')
    setattr(driving.robot, feed, True)
    driving.assert_goes_on_by_itself()


def test_a_localisation_that_falls_silent(driving):
    robot = driving.robot
    robot.fixes = False
    # Its age counts once half a metre was driven without it.
    since = robot.last_fix + max(TIMEOUTS['localisation_timeout'], 0.5 / 0.8)
    driving.assert_stops('localisation_stale', since, 'no pose for')
    robot.fixes = True
    driving.assert_goes_on_by_itself()


def test_a_localisation_that_jumps_by_a_metre(driving):
    driving.robot.fix_shift = np.array([0.0, 1.0, 0.0])
    driving.assert_stops('localisation_jumped', told='jumped by 1.0')
    driving.assert_waits_for_a_new_goal()
    driving.robot.fix_shift = np.zeros(3)
    driving.assert_stops('localisation_jumped')


def test_odometry_that_is_not_finite(driving):
    driving.robot.odometry_pose = np.array([np.nan, 0.0, 0.0])
    driving.assert_stops('odometry_stale', told='not finite')
    driving.robot.odometry_pose = None
    driving.assert_goes_on_by_itself()


def test_a_scan_without_a_valid_beam(driving):
    driving.robot.ranges = np.full(360, np.nan)
    driving.assert_stops('scan_stale', told='no beam is valid')
    driving.robot.ranges = np.full(360, np.inf)
    driving.assert_goes_on_by_itself()


def test_something_within_the_robot_itself(driving):
    driving.robot.ranges = np.where(np.abs(np.arange(360) - 180) < 30, 0.17, np.inf)
    driving.assert_stops('in_contact', told='inside the robot')
    driving.robot.ranges = np.full(360, np.inf)
    driving.assert_goes_on_by_itself()


def test_a_map_that_is_replaced(driving):
    driving.robot.send_map(CORRIDOR, 0.1, (-4.0, -2.0))
    driving.assert_stops('map_replaced')
    driving.assert_goes_on_by_itself()


def test_a_map_without_a_wall(driving):
    driving.robot.send_map(np.zeros_like(CORRIDOR), 0.1, (-4.0, -2.0))
    driving.assert_stops('walls_empty', told='no wall')
    assert not driving.robot.collect(10)[:, 1:].any()
    driving.robot.send_map(CORRIDOR, 0.1, (-4.0, -2.0))
    driving.assert_goes_on_by_itself()


def test_a_goal_inside_a_wall(driving):
    driving.robot.send_goal(100.0, -1.95, 'map')
    driving.assert_stops('goal_refused', told='too close to a wall')
    driving.assert_waits_for_a_new_goal()


def test_a_goal_that_no_way_leads_to(driving):
    driving.robot.send_goal(100.0, 20.0, 'map')
    driving.assert_stops('goal_refused', told='no way')
    driving.assert_waits_for_a_new_goal()


def test_a_clock_that_is_set_back(driving):
    driving.robot.clock_offset = -100.0
    driving.assert_stops('clock_jumped', told='send the goal again')
    driving.assert_waits_for_a_new_goal()
    driving.robot.clock_offset = 0.0
    driving.drive_at_full_speed()


def test_a_processor_that_is_taken_away_for_a_second(driving):
    robot, process = driving.robot, driving.policy.process
    process.send_signal(signal.SIGSTOP)
    starved = monotonic()
    threading.Timer(1.0, process.send_signal, [signal.SIGCONT]).start()
    # Nobody can command now: this is where the base stops by itself.
    robot.wait(lambda: not robot.velocity.any(), 'the base to stop')
    assert monotonic() - starved < 0.5 + STOPPED_WITHIN
    before = len(robot.commands)
    robot.wait(lambda: len(robot.commands) > before, 'a command after waking up')
    driving.assert_stops('overrun', robot.commands[before][0], 'does the machine keep up')
    driving.assert_goes_on_by_itself()


def test_the_end_by_sigterm_at_full_speed(driving):
    robot = driving.robot
    driving.policy.process.send_signal(signal.SIGTERM)
    driving.assert_stops('shutdown')
    assert driving.policy.status() == 0
    assert robot.stands()


def test_a_tracker_that_is_killed(ros_domain_id, straight_weights):
    graph = Graph(straight_weights, '/other', tracks_source='topic')

    def tracker():
        return NodeProcess('scan_tracker_node', {'use_sim_time': 'true'}, ['-r', '__ns:=/other'])

    trackers = [tracker()]
    try:
        graph.drive_at_full_speed()
        trackers[0].process.kill()
        graph.assert_stops('tracks_stale', told='tracks: ')
        trackers.append(tracker())
        graph.assert_goes_on_by_itself()
    finally:
        graph.close()
        for process in trackers:
            process.kill()


def test_weights_that_are_garbage_at_the_start(robot, start, tmp_path):
    weights = tmp_path / 'garbage.npz'
    weights.write_bytes(np.random.default_rng(0).bytes(100_000))
    node = start('policy_node', {'model': weights})
    robot.wait(lambda: node.process.poll() is not None, 'the end of the node')
    assert node.status() == 2
    assert not robot.commands
    assert len(node.lines) == 1 and 'garbage.npz' in node.lines[0]
