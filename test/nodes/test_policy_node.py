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
"""The policy node over real DDS: goal in, motion out, and every stop of docs/nodes.md."""

import signal
from time import monotonic

from geometry_msgs.msg import PoseStamped
from map_files import write_map_files
from nav_msgs.msg import OccupancyGrid, Path
from nodes_over_dds import EAGER
import numpy as np
import pytest
from visualization_msgs.msg import Marker, MarkerArray
from wallnav_ros.nodes.topics import LATCHED, RELIABLE, SENSOR


@pytest.fixture
def start_policy(start, straight_weights):
    """Return a function that starts the policy node with weights that head for the goal."""
    def start_node(parameters=(), arguments=()):
        return start('policy_node', {'model': straight_weights, **EAGER, **dict(parameters)},
                     arguments)
    return start_node


def assert_stands(robot, steps=15):
    """Check that the next `steps` control steps all command a standstill."""
    assert not robot.collect(steps)[:, 1:].any()


def test_drives_to_a_goal_and_stops_there_under_a_namespace_and_remaps(start_policy, make_robot):
    robot = make_robot(namespace='/robot_1', scan='/lidar/scan', command='/base/cmd_vel')
    start_policy(arguments=['-r', '__ns:=/robot_1', '-r', 'scan:=/lidar/scan',
                            '-r', 'cmd_vel:=/base/cmd_vel'])
    robot.wait_for('no_goal')
    robot.send_goal(1.0, 0.5)
    robot.wait(robot.moves, 'motion')
    robot.wait_for('goal_reached')
    assert_stands(robot)
    assert np.hypot(*(robot.pose[:2] - (1.0, 0.5))) < 0.2


@pytest.mark.parametrize('missing, cause', [
    ('goal', 'no_goal'), ('scans', 'scan_missing'), ('odometry', 'odometry_missing')])
def test_never_moves_without(start_policy, robot, missing, cause):
    if missing != 'goal':
        setattr(robot, missing, False)
    start_policy()
    robot.wait(lambda: robot.causes, 'diagnostics')
    if missing != 'goal':
        robot.send_goal(5.0, 0.0)
    robot.wait_for(cause)
    assert_stands(robot, 25)
    assert not any(command[1] or command[2] for command in robot.commands)


@pytest.mark.parametrize('feed, last, cause', [
    ('scans', 'last_scan', 'scan_stale'), ('odometry', 'last_odometry', 'odometry_stale')])
def test_stops_within_half_a_second_when_a_sensor_falls_silent_and_goes_on_when_it_returns(
        start_policy, robot, feed, last, cause):
    start_policy()
    robot.wait_for('no_goal')
    robot.start_driving()
    setattr(robot, feed, False)
    robot.wait(robot.stands, 'standstill')
    assert robot.commands[-1][0] - getattr(robot, last) <= 0.5
    robot.wait_for(cause)
    assert_stands(robot)
    setattr(robot, feed, True)
    robot.wait(robot.moves, 'motion after the sensor returned')


@pytest.mark.parametrize('sent', [signal.SIGINT, signal.SIGTERM])
def test_ends_on_a_signal_with_a_delivered_standstill_and_status_zero(start_policy, robot, sent):
    node = start_policy()
    robot.wait_for('no_goal')
    robot.start_driving()
    node.process.send_signal(sent)
    assert node.status() == 0
    # No command comes any more, so the last one that arrived must have been a standstill.
    robot.wait(lambda: robot.causes[-1] == 'shutdown' and robot.stands(), 'a last standstill')


def test_takes_tracks_from_their_topic_and_stops_without_them(start_policy, robot):
    start_policy({'tracks_source': 'topic'})
    robot.wait_for('tracks_missing')
    robot.send_goal(30.0, 0.0)
    assert_stands(robot)
    robot.tracks = True
    robot.wait(robot.moves, 'motion')
    robot.tracks = False
    robot.wait_for('tracks_stale')
    assert_stands(robot)


def test_commands_twist_stamped_when_asked_to(start_policy, make_robot):
    robot = make_robot(stamped=True)
    start_policy({'enable_stamped_cmd_vel': 'true'})
    robot.wait_for('no_goal')
    robot.start_driving()
    header = robot.headers[-1]
    assert header.frame_id == 'base_link'
    assert abs(header.stamp.sec - robot.now()) < 2.0


def test_a_clock_set_back_stops_the_robot_until_a_new_goal(start_policy, robot):
    robot.clock = True
    start_policy({'use_sim_time': 'true'})
    robot.wait_for('no_goal')
    robot.start_driving()
    robot.clock_offset = -100.0
    robot.wait(robot.stands, 'standstill')
    robot.wait_for('clock_jumped')
    assert_stands(robot)
    robot.start_driving()


def test_a_clock_that_stands_still_stops_the_robot(start_policy, robot):
    robot.clock = True
    start_policy({'use_sim_time': 'true'})
    robot.wait_for('no_goal')
    robot.start_driving()
    robot.clock = False
    silent = monotonic()
    robot.wait(robot.stands, 'standstill')
    assert robot.commands[-1][0] - silent < 1.0
    assert_stands(robot)


def test_refuses_a_goal_it_cannot_relate_and_says_why(start_policy, robot):
    node = start_policy()
    robot.wait_for('no_goal')
    robot.send_goal(3.0, 0.0, frame='map')
    robot.wait_for('goal_refused')
    assert_stands(robot)
    robot.send_goal(float('nan'), 0.0)
    robot.wait(lambda: robot.values.get('rejected goal: a coordinate is not finite') == '1',
               'a counted rejection')
    assert_stands(robot)
    assert any("frame 'map'" in line and 'not localised' in line for line in node.lines)


def test_odometry_that_is_no_pose_is_counted_and_stops_the_robot(start_policy, robot):
    start_policy()
    robot.wait_for('no_goal')
    robot.start_driving()
    robot.odometry_pose = np.array([np.nan, 0.0, 0.0])
    robot.wait_for('odometry_stale')
    assert_stands(robot)
    robot.wait(lambda: int(robot.values.get('rejected odometry: pose: not finite', 0)) > 5,
               'counted rejections')


def test_stands_where_something_is_inside_its_radius(start_policy, robot):
    robot.ranges = np.full(360, 0.15)
    start_policy()
    robot.wait_for('no_goal')
    robot.send_goal(5.0, 0.0)
    robot.wait_for('in_contact')
    assert_stands(robot)


def test_drives_in_the_map_frame_once_localised_on_a_map_from_its_topic(start_policy, robot):
    robot.fixes = True
    walls = []
    robot.node.create_subscription(Marker, 'walls', walls.append, LATCHED)
    grid = OccupancyGrid()
    grid.info.width = grid.info.height = 200
    grid.info.resolution = 0.05
    grid.info.origin.position.x = grid.info.origin.position.y = -1.0
    grid.info.origin.orientation.w = 1.0
    cells = np.zeros((200, 200), np.int8)
    cells[:, 0] = 100
    grid.data = cells.ravel().tolist()
    publisher = robot.node.create_publisher(OccupancyGrid, 'map', LATCHED)
    publisher.publish(grid)
    start_policy()
    robot.wait_for('no_goal')
    robot.wait(lambda: walls, 'walls')
    assert walls[-1].header.frame_id == 'map'
    np.testing.assert_allclose(sorted({point.x for point in walls[-1].points}), [-1.0, -0.95])
    # Odometry began at (1, 2) in the map: this goal is 1 m ahead of the robot.
    robot.start_driving(2.0, 2.0, frame='map')
    robot.wait_for('goal_reached')
    np.testing.assert_allclose(robot.pose[:2], [1.0, 0.0], atol=0.2)
    assert robot.values['state_frame'] == 'map'


@pytest.mark.parametrize('fault, told', [
    ({'model': '{tmp}/cut.npz'}, 'cut.npz'), ({'model': 'no_such_model'}, 'no_such_model'),
    ({'robot_radius': '-1.0'}, 'robot_radius'), ({'control_rate': 'fast'}, 'control_rate'),
    ({'tracks_source': 'tea_leaves'}, 'tracks_source'),
    ({'laser_pose': '[0.0, 1.0]'}, 'laser_pose'), ({'map': '{tmp}/none.yaml'}, 'none.yaml'),
    ({'map': '{tmp}/map.yaml'}, 'map.yaml: walls span')])
def test_refuses_to_start_before_it_subscribes_to_anything(
        start_policy, robot, straight_weights, tmp_path, fault, told):
    content = straight_weights.read_bytes()
    (tmp_path / 'cut.npz').write_bytes(content[:len(content) // 2])
    # A kilometre of walls, at 5 cm.
    write_map_files(tmp_path, [[0]] * 4 + [[254]] * 4 + [[0]] * 4, resolution='100.0')
    node = start_policy({key: value.format(tmp=tmp_path) for key, value in fault.items()})
    robot.wait(lambda: node.process.poll() is not None, 'the end of the node')
    assert node.status() == 2
    assert len(node.lines) == 1 and told in node.lines[0]
    assert robot.matched == 0


def test_says_what_to_do_when_the_base_takes_the_other_kind_of_command(start_policy, make_robot):
    robot = make_robot(stamped=True)
    node = start_policy()
    robot.wait(lambda: 'fault cmd_vel' in robot.values, 'a fault in diagnostics')
    assert 'set enable_stamped_cmd_vel to true' in robot.values['fault cmd_vel']
    robot.wait(lambda: any('enable_stamped_cmd_vel' in line for line in node.lines), 'a warning')
    make_robot()
    robot.wait(lambda: 'fault cmd_vel' not in robot.values, 'the end of the fault')


def test_names_a_peer_whose_quality_of_service_does_not_fit(start_policy, robot):
    start_policy()
    robot.wait_for('no_goal')
    robot.node.create_publisher(PoseStamped, 'goal_pose', SENSOR)
    robot.wait(lambda: 'fault goal_pose' in robot.values, 'a fault in diagnostics')
    assert 'quality of service' in robot.values['fault goal_pose']
    assert 'reliability' in robot.values['fault goal_pose']


def test_follows_a_path_that_leads_to_the_goal(start_policy, robot):
    start_policy()
    robot.wait_for('no_goal')
    path = Path()
    path.header.frame_id = 'odom'
    for x, y in ((0.0, 0.0), (0.0, 1.0), (0.0, 2.0), (1.0, 2.0), (2.0, 2.0)):
        pose = PoseStamped()
        pose.pose.position.x, pose.pose.position.y = x, y
        path.poses.append(pose)
    publisher = robot.node.create_publisher(Path, 'plan', RELIABLE)
    robot.wait(publisher.get_subscription_count, 'a subscriber to the plan')
    publisher.publish(path)
    robot.start_driving(2.0, 2.0)
    robot.wait(lambda: robot.values.get('way') == 'given', 'a path in use')
    robot.wait(lambda: robot.pose[1] > 1.2, 'the first leg')
    assert robot.pose[0] < 0.9
    robot.wait_for('goal_reached')


def test_shows_where_it_is_bound_and_why_it_stands(start_policy, robot):
    shown = {}

    def take(message):
        shown.update({marker.ns: marker for marker in message.markers
                      if marker.action == Marker.ADD})

    robot.node.create_subscription(MarkerArray, 'markers', take, RELIABLE)
    start_policy()
    robot.wait(lambda: 'status' in shown and shown['status'].text == 'no goal', 'the reason')
    robot.start_driving(3.0, 0.0)
    robot.wait(lambda: {'goal', 'route', 'sub_goal', 'path', 'action'} <= set(shown), 'the plan')
    assert shown['goal'].pose.position.x == pytest.approx(3.0, abs=0.01)
    robot.wait(lambda: shown['status'].text == 'driving', 'the state')
