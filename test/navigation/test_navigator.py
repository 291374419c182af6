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
"""The navigator as a whole, fed by hand: when it drives, where to, and when it must not."""

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.navigation.base import BaseLimits
from wallnav_ros.navigation.localisation import Localisation
from wallnav_ros.navigation.navigator import MOST_REASONS, Navigator
from wallnav_ros.navigation.plans import NavigatorSettings
from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.outcomes import Rule
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.tracks import HUMAN, Tracks
from wallnav_ros.world.walls import Walls

BEAMS = 360
OPEN = np.full(BEAMS, np.inf)


def nearer_is_better(features):
    """Value states by their distance to the goal, the first feature of the robot, alone."""
    return -10.0 * features.robot[..., 0]


class Robot:
    """A robot that stands at `pose` by odometry and is read ten times a second."""

    def __init__(self, localisation=None, **settings):
        self.navigator = Navigator(
            Lookahead(nearer_is_better, make_actions(), Rule()), Tracker(),
            NavigatorSettings(**settings), localisation)
        self.time = 100.0
        self.pose, self.velocity = np.zeros(3), np.zeros(2)
        self.ranges = OPEN

    def sense(self, scan=True, odometry=True):
        self.time += 0.1
        if odometry:
            self.navigator.take_odometry(self.time, self.pose, self.velocity, self.time)
        if scan:
            self.navigator.take_scan(self.scan(), self.time)
        return self.navigator.update(self.time, self.time)

    def scan(self):
        return Scan(self.time, self.ranges, -np.pi, 2.0 * np.pi / BEAMS, 0.05, 12.0)

    def drive_to(self, x, y, frame='odom'):
        self.sense()
        assert self.navigator.set_goal(np.array([x, y]), frame) is None
        return self.sense()


def test_drives_straight_at_a_goal_ahead():
    robot = Robot()
    status = robot.drive_to(5.0, 0.0)
    assert status.state == 'driving' and status.stop is None
    # Straight ahead at the preferred speed is the action that gains most.
    np.testing.assert_allclose(robot.navigator.plan.command, [0.8, 0.0], atol=1e-9)


def test_commands_change_no_faster_than_the_base_can_follow():
    robot = Robot(base=BaseLimits(acceleration=1.0))
    robot.drive_to(50.0, 0.0)
    speeds = [robot.sense().command[0] for _ in range(12)]
    # 1 m/s^2 and a command every 0.1 s; the first one came with the goal.
    np.testing.assert_allclose(speeds[:6], [0.2, 0.3, 0.4, 0.5, 0.6, 0.7], atol=1e-6)
    np.testing.assert_allclose(speeds[7:], 0.8, atol=1e-6)


def test_settings_changed_while_it_drives_hold_from_the_next_decision_on():
    robot = Robot()
    robot.drive_to(50.0, 0.0)
    settings = robot.navigator.settings
    robot.navigator.set_settings(replace(settings, base=BaseLimits(max_speed=0.3)))
    speeds = [robot.sense().command[0] for _ in range(12)]
    assert speeds[-1] == pytest.approx(0.3)


def test_something_that_turns_up_within_the_braking_distance_stops_the_robot_at_once():
    robot = Robot(scan_timeout=1.0)
    robot.drive_to(50.0, 0.0)
    for _ in range(12):
        robot.sense()
    robot.velocity = np.array([0.8, 0.0])
    assert robot.sense().command[0] == pytest.approx(0.8)
    while robot.navigator.plan.stamp < robot.time:
        robot.sense()
    # Nothing is due to be decided yet; a box stands 0.35 m before the robot's front.
    ahead = np.abs(np.arange(BEAMS) - BEAMS // 2) < 10
    robot.ranges = np.where(ahead, 0.55, np.inf)
    status = robot.sense()
    assert status.stop.cause == 'braking' and not status.command.any()


@pytest.mark.parametrize('allowed, cause, speed', [
    (False, 'in_contact', 0.0), (True, None, -0.2)])
def test_backs_off_from_contact_only_where_it_may(allowed, cause, speed):
    robot = Robot(base=BaseLimits(reverse=allowed))
    ahead = np.abs(np.arange(BEAMS) - BEAMS // 2) < 30
    robot.ranges = np.where(ahead, 0.18, np.inf)
    status = robot.drive_to(5.0, 0.0)
    assert (status.stop and status.stop.cause) == cause
    assert status.command[0] == pytest.approx(speed)


def test_a_control_loop_that_was_held_up_is_a_reason_to_stand():
    robot = Robot(scan_timeout=5.0, odom_timeout=5.0)
    robot.drive_to(50.0, 0.0)
    robot.time += 1.0
    status = robot.navigator.update(robot.time, robot.time)
    assert status.stop.cause == 'overrun' and not status.command.any()
    assert robot.navigator.loop.overruns == 1
    assert robot.sense().state == 'driving'


def test_stands_without_a_goal_and_says_so():
    status = Robot().sense()
    assert status.stop.cause == 'no_goal' and not status.command.any()


def test_stops_at_the_goal_and_stays_there():
    robot = Robot()
    robot.drive_to(5.0, 0.0)
    robot.pose = np.array([4.9, 0.0, 0.0])
    assert robot.sense().stop.cause == 'goal_reached'
    robot.pose = np.array([4.0, 0.0, 0.0])
    assert robot.sense().stop.cause == 'goal_reached'


@pytest.mark.parametrize('silent, cause', [
    ({'scan': False}, 'scan_stale'), ({'odometry': False}, 'odometry_stale')])
def test_an_input_that_falls_silent_stops_the_robot_within_its_timeout(silent, cause):
    robot = Robot()
    robot.drive_to(5.0, 0.0)
    causes = [status.stop and status.stop.cause for status in
              (robot.sense(**silent) for _ in range(6))]
    assert causes[:4] == [None] * 4 and causes[4:] == [cause] * 2
    assert robot.sense().state == 'driving'


def test_no_plan_outlives_a_stop():
    robot = Robot()
    robot.drive_to(5.0, 0.0)
    for _ in range(6):
        robot.sense(scan=False)
    # The next scan is usable, but says nothing until it is decided on.
    robot.navigator.feeds['scan'].arrived(robot.time, robot.time)
    status = robot.navigator.update(robot.time, robot.time)
    assert status.stop.cause == 'planning' and not status.command.any()


def test_decisions_are_taken_once_a_time_step_whatever_the_scan_rate():
    robot = Robot()
    robot.drive_to(50.0, 0.0)
    plans = set()
    for _ in range(40):
        robot.sense()
        plans.add(robot.navigator.plan.stamp)
    # Four seconds at one decision every 0.25 s, each taken with the scan that follows.
    assert len(plans) in (16, 17)


@pytest.mark.parametrize('pose, goal, frame, expected', [
    ((0.0, 0.0, 0.0), (5.0, 1.0), 'odom', (5.0, 1.0)),
    ((2.0, 0.0, np.pi / 2.0), (5.0, 0.0), 'base_link', (2.0, 5.0)),
    ((0.0, 0.0, 0.0), (5.0, 1.0), 'map', (3.0, 2.0))])
def test_a_goal_may_be_given_in_any_frame_that_is_known(pose, goal, frame, expected):
    # The odometry's frame lies at (2, -1) in the map; expected is the goal by odometry.
    robot = Robot(Localisation(np.array([2.0, -1.0, 0.0])))
    robot.pose = np.array(pose)
    robot.drive_to(*goal, frame)
    plan = robot.navigator.plan
    assert plan.frame == 'map'
    np.testing.assert_allclose(plan.goal, np.add(expected, (2.0, -1.0)), atol=1e-9)


@pytest.mark.parametrize('goal, frame, told', [
    ((1.0, 0.0), 'map', 'not localised'), ((1.0, 0.0), 'mars', 'mars'),
    ((np.inf, 0.0), 'odom', 'not finite')])
def test_a_goal_that_cannot_be_used_is_refused_and_ends_the_one_before(goal, frame, told):
    robot = Robot()
    robot.drive_to(5.0, 0.0)
    assert told in robot.navigator.set_goal(np.array(goal), frame)
    assert robot.sense().stop.cause == 'goal_refused'


def test_a_goal_in_the_map_stays_put_when_the_localisation_corrects_itself():
    robot = Robot()
    robot.sense()
    robot.navigator.localisation.add_fix(robot.time, np.array([1.0, 0.0, 0.0]))
    robot.drive_to(5.0, 0.0, 'map')
    robot.navigator.localisation.add_fix(robot.time, np.array([1.4, 0.0, 0.0]))
    for _ in range(3):
        robot.sense()
    plan = robot.navigator.plan
    np.testing.assert_allclose(plan.goal, [5.0, 0.0])
    np.testing.assert_allclose(plan.path[0, :2], [1.4, 0.0], atol=1e-9)


def test_a_pose_in_the_map_a_metre_away_ends_the_goal():
    robot = Robot()
    robot.sense()
    robot.navigator.localisation.add_fix(robot.time, np.zeros(3))
    # The first pose in the map is no jump, however far from where odometry began.
    robot.drive_to(5.0, 0.0, 'map')
    robot.navigator.localisation.add_fix(robot.time, np.array([1.0, 0.0, 0.0]))
    assert robot.sense().stop.cause == 'localisation_jumped'
    assert robot.sense().stop.cause == 'localisation_jumped'
    assert robot.drive_to(5.0, 0.0, 'map').state == 'driving'


def test_a_fix_grows_old_only_while_the_robot_drives():
    robot = Robot()
    robot.sense()
    robot.navigator.localisation.add_fix(robot.time, np.zeros(3))
    robot.drive_to(50.0, 0.0, 'map')
    for _ in range(30):
        status = robot.sense()
    assert status.stop is None
    robot.pose = np.array([1.0, 0.0, 0.0])
    assert robot.sense().stop.cause == 'localisation_stale'
    robot.navigator.localisation.add_fix(robot.time, robot.pose)
    robot.sense()
    assert robot.sense().state == 'driving'


def test_a_clock_set_back_forgets_the_goal():
    robot = Robot()
    robot.drive_to(5.0, 0.0)
    robot.time -= 50.0
    assert robot.sense().stop is not None
    robot.sense()
    assert robot.sense().stop.cause == 'clock_jumped'
    assert robot.drive_to(5.0, 0.0).state == 'driving'


def test_stands_in_a_ring_closer_than_its_own_radius():
    robot = Robot()
    robot.ranges = np.full(BEAMS, 0.15)
    assert robot.drive_to(5.0, 0.0).stop.cause == 'in_contact'


def test_walls_that_only_the_scanner_knows_are_not_driven_into():
    robot = Robot()
    # A wall straight ahead, 0.45 m away and as wide as the scanner sees.
    angles = -np.pi + 2.0 * np.pi / BEAMS * np.arange(BEAMS)
    with np.errstate(divide='ignore'):
        robot.ranges = np.where(np.cos(angles) > 0.05, 0.45 / np.cos(angles), np.inf)
    status = robot.drive_to(5.0, 0.0)
    # One step of 0.25 s straight at 0.8 m/s would end 0.05 m inside it, radius included.
    assert status.stop is None and robot.navigator.plan.command[0] < 0.8


def test_mapped_walls_count_only_once_the_robot_is_localised():
    nodes = np.abs(-5.0 + 0.05 * np.arange(201) - 0.35)
    wall_ahead = DistanceField(np.broadcast_to(nodes, (201, 201)).astype(np.float32),
                               np.array([-5.0, -5.0, 0.0]), 0.05)
    robot = Robot()
    robot.navigator.set_walls(wall_ahead)
    robot.drive_to(5.0, 0.0)
    assert robot.navigator.plan.command[0] == pytest.approx(0.8)
    robot = Robot(Localisation(np.zeros(3)))
    robot.navigator.set_walls(wall_ahead)
    robot.sense()
    assert 'no way' in robot.navigator.set_goal(np.array([5.0, 0.0]), 'odom')
    status = robot.sense()
    assert status.stop.cause == 'goal_refused' and 'no way' in status.stop.detail


def test_tracks_of_another_process_are_brought_into_the_state_frame_and_to_the_moment():
    robot = Robot(Localisation(np.array([0.0, 0.0, np.pi / 2.0])), tracks_given=True)
    robot.sense()
    robot.navigator.set_goal(np.array([0.0, 5.0]), 'map')
    walker = Tracks(robot.time - 0.2, np.array([7], np.uint32), np.array([[3.0, 0.0]]),
                    np.array([[1.0, 0.0]]), np.array([0.3]), np.array([HUMAN], np.uint8))
    robot.navigator.take_tracks(walker, 'odom', robot.time)
    agents = robot.navigator.observe(robot.time).agents
    # x of the odometry is y of the map, and 0.2 s have passed at 1 m/s.
    np.testing.assert_allclose(agents.position, [[0.0, 3.2]], atol=1e-9)
    np.testing.assert_allclose(agents.velocity, [[0.0, 1.0]], atol=1e-9)


def test_tracks_in_an_unknown_frame_do_not_count_as_tracks():
    robot = Robot(tracks_given=True)
    robot.sense()
    robot.navigator.take_tracks(Tracks.none(robot.time), 'mars', robot.time)
    assert robot.sense().stop.cause == 'tracks_missing'
    assert robot.navigator.rejected["tracks: frame 'mars' is not known"] == 1


def test_a_scan_without_a_valid_beam_counts_as_no_scan():
    robot = Robot()
    robot.drive_to(5.0, 0.0)
    robot.ranges = np.full(BEAMS, np.nan)
    for _ in range(6):
        status = robot.sense()
    assert status.stop.cause == 'scan_stale' and 'no beam is valid' in status.stop.detail


def test_reasons_for_rejection_do_not_fill_the_memory():
    navigator = Robot().navigator
    for number in range(1000):
        navigator.reject('scan', f'range_max: {number}')
    assert len(navigator.rejected) <= MOST_REASONS + 1
    assert sum(navigator.rejected.values()) == 1000


def test_somebody_who_stands_in_the_way_is_gone_round_without_standing_before_them():
    robot = Robot(Localisation(np.zeros(3)))
    robot.navigator.set_walls(distance_field(Walls.from_polylines(
        [[(-2, -2), (12, -2), (12, 2), (-2, 2), (-2, -2)]])))
    # A disc of 0.3 m radius, 3 m ahead, in a hall 4 m wide.
    offset = np.radians(np.arange(BEAMS) - BEAMS // 2)
    inside = np.abs(3.0 * np.sin(offset)) < 0.3
    robot.ranges = np.where(
        inside & (np.abs(offset) < 1.0),
        3.0 * np.cos(offset) - np.sqrt(np.maximum(0.09 - (3.0 * np.sin(offset)) ** 2, 0.0)),
        np.inf)
    robot.drive_to(10.0, 0.0, 'map')
    assert robot.navigator.way is robot.navigator.guide.route
    states = [robot.sense().state for _ in range(25)]
    assert set(states) == {'driving'}
    assert robot.navigator.guide.detours == 1
    assert abs(robot.navigator.plan.goal[1]) > 0.1
