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
"""Frame, map, goal and clock of a replay, from surveys written by hand."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

rosbags = pytest.importorskip('rosbags')

from recorded_bags import HALL, START  # noqa: E402
from wallnav_ros.evaluation.recordings import Mount, RecordingError  # noqa: E402
from wallnav_ros.evaluation.replay_stage import set_stage  # noqa: E402
from wallnav_ros.evaluation.survey import Survey  # noqa: E402
from wallnav_ros.navigation.navigator import NavigatorSettings  # noqa: E402
from wallnav_ros.world.geometry import to_child  # noqa: E402
from wallnav_ros.world.walls import Walls  # noqa: E402

pytestmark = pytest.mark.extras

WALL = Walls(np.array([[[0.0, 0.0], [10.0, 0.0]]]))


def survey(path=((0, 0, 0), (4, 0, 0)), points=(), **changed):
    """Return a Survey of a robot with odometry and a known mount, unless `changed`."""
    path, points = np.array(path, float), np.reshape(points, (-1, 2)).astype(float)
    whole = Survey(
        odom_frame='odom', base_frame='base_link', laser_frame='laser',
        stamps=np.arange(len(path), dtype=float), path=path, twists=np.zeros((len(path), 3)),
        scan_times=np.arange(9.0), latencies=np.full(9, 0.02),
        mount=Mount(np.array([0.1, 0.0, 0.0])), mount_source='given', points=points,
        origins=np.zeros((len(points), 2)), hits=np.full(len(points), 9))
    return replace(whole, **changed)


def seen_from_the_start(walls=HALL):
    """Return where (K, 2) beams from the hall's START end at `walls`, as the robot sees it."""
    angles = np.radians(np.arange(0.0, 360.0, 0.5))
    ranges = walls.raycast(START[:2], angles, 20.0)
    ends = START[:2] + ranges[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    return to_child(START, ends)


@pytest.mark.parametrize('mount, frame', [((0, 0, 0), 'laser'), ((0.1, 0, 0), 'base_link')])
def test_without_odometry_places_are_the_lasers_only_where_it_is_the_robots_middle(mount, frame):
    alone = survey(odom_frame=None, base_frame=None, mount=Mount(np.array(mount, float)))
    assert set_stage(alone).stage.frame == frame


@pytest.mark.parametrize('latencies, offset', [
    ([0.0], 0.0),
    ([0.02, 0.3, 0.3], 0.0),      # a slow link may be as late as this
    ([0.31], 0.31),
    ([-0.01], -0.01),             # nothing is received before it was measured
    ([-22.0, -22.5, -21.5], -22.0),
    ([0.01, 0.02, 50.0], 0.0),    # one late scan makes no other clock
    ([130.2, 130.0, 0.0], 130.0),
])
def test_the_recorder_has_another_clock_where_the_median_scan_is_too_late_or_early(
        latencies, offset):
    assert set_stage(survey(latencies=np.array(latencies))).stage.clock_offset == offset


@pytest.mark.parametrize('end, goal, source', [
    ((2.0, 2.0, 0.0), (2.0, 2.0), 'where the robot ended'),
    ((1.0, 3.0, 0.0), (1.0, 3.0), 'where the robot ended'),
    # 0.98 m: nowhere in particular. The robot started facing left of x, up y.
    ((1.98, 2.0, 3.0), (1.0, 7.0), '5 m ahead of where the robot started'),
    ((1.0, 2.0, 9.0), (1.0, 7.0), '5 m ahead of where the robot started'),
])
def test_a_robot_that_went_a_metre_or_more_wanted_to_get_there(end, goal, source):
    staging = set_stage(survey([(1.0, 2.0, pi / 2), (5.0, 5.0, 0.0), end]))

    np.testing.assert_allclose(staging.stage.goal, goal, atol=1e-9)
    assert staging.summary['goal'] == {'position': list(goal), 'from': source}


def test_the_initial_pose_is_where_the_first_odometry_lies_in_the_map():
    # At (1, 2) in odom, facing x; there the map has it at (10, 20), facing y. The origin of odom
    # is 1 m behind it and 2 m to its right: in the map at (10 + 2, 20 - 1).
    drive = survey([(1.0, 2.0, 0.0), (4.0, 2.0, 0.0)])

    staging = set_stage(drive, walls=WALL, initial_pose=(10.0, 20.0, pi / 2))

    np.testing.assert_allclose(staging.stage.map_from_odom, (12.0, 19.0, pi / 2))
    assert staging.summary['map'] == {
        'used': True, 'pose_of_odom': [12.0, 19.0, 1.5708], 'from': 'initial pose'}
    # It drove 3 m ahead, which is up in the map.
    np.testing.assert_allclose(staging.stage.goal, (10.0, 23.0))


def test_without_a_way_the_goal_is_ahead_in_the_map_too():
    staging = set_stage(survey([(1.0, 2.0, 0.0)]), walls=WALL, initial_pose=(10.0, 20.0, pi / 2))

    np.testing.assert_allclose(staging.stage.goal, (10.0, 25.0))


def test_a_given_goal_is_in_the_map_already():
    staging = set_stage(survey(), walls=WALL, initial_pose=(10.0, 20.0, pi / 2), goal=(3, -4))

    assert staging.stage.goal.tolist() == [3.0, -4.0]
    assert staging.summary['goal'] == {'position': [3.0, -4.0], 'from': 'given'}


def test_the_walls_of_a_used_map_are_handed_on_with_their_distances():
    staging = set_stage(survey(), walls=WALL, initial_pose=(5.0, 0.5, 0.0))

    assert staging.walls is WALL
    np.testing.assert_allclose(
        staging.stage.walls.at(np.array([[5.0, 0.0], [5.0, 0.5], [-0.3, 0.4]])), [0.0, 0.5, 0.5],
        atol=0.04)
    assert (staging.stage.frame, staging.summary['frame']) == ('map', 'map')


def test_without_a_map_there_are_no_walls_and_the_state_is_in_odometry():
    staging = set_stage(survey(odom_frame='wheels'))

    assert (staging.walls, staging.stage.walls, staging.stage.map_from_odom) == (None,) * 3
    assert (staging.stage.frame, staging.summary['frame']) == ('wheels', 'wheels')
    assert 'map' not in staging.summary


def test_mount_and_settings_are_handed_on_and_the_summary_tells_the_mount():
    mount = Mount(np.array([0.123456, -1.0, 2.0]), upside_down=True)
    settings = NavigatorSettings(radius=0.4)

    staging = set_stage(survey(mount=mount, mount_source='tf base_link -> laser'), settings)

    assert staging.stage.mount is mount
    assert staging.stage.settings is settings
    assert {name: value for name, value in staging.summary.items() if 'laser' in name} == {
        'laser_pose': [0.1235, -1.0, 2.0], 'laser_pose_from': 'tf base_link -> laser',
        'laser_upside_down': True}


@pytest.mark.parametrize('changed, told', [
    ({}, []),
    ({'mount_source': 'tf base_link -> laser'}, []),
    ({'mount_source': 'unknown'}, ['no tf to laser in the bag']),
    ({'odom_frame': None}, ['no odometry in the bag']),
    ({'odom_frame': None, 'mount_source': 'unknown'}, ['no odometry in', 'no tf to laser in']),
])
def test_only_what_was_assumed_is_warned_of(changed, told):
    warnings = set_stage(survey(**changed)).warnings

    assert len(warnings) == len(told)
    for warning, start in zip(warnings, told):
        assert warning.startswith(start)


def test_a_robot_that_sees_the_hall_is_found_in_it():
    # Odometry starts 2 m to the right of the robot, facing as it does.
    points = seen_from_the_start() + (0.0, 2.0)
    origins = np.tile((0.0, 2.0), (len(points), 1))

    staging = set_stage(survey([(0.0, 2.0, 0.0)], points, origins=origins), walls=HALL)

    np.testing.assert_allclose(staging.stage.map_from_odom, START - (0.0, 2.0, 0.0), atol=0.02)
    found = staging.summary['map']
    assert found['used'] and found['score'] > 0.9 > found['score_elsewhere']
    assert found['from'] == 'matching scans to the walls'
    assert not staging.warnings


def test_in_a_bare_rectangle_the_robot_may_as_well_be_at_the_other_end():
    room = Walls.from_polylines([[(0, 0), (8, 0), (8, 5), (0, 5)]], closed=True)

    staging = set_stage(survey(points=seen_from_the_start(room)), walls=room)

    found = staging.summary['map']
    assert found['score'] > 0.9
    assert found['score_elsewhere'] == pytest.approx(found['score'], abs=0.05)
    assert (found['used'], staging.stage.map_from_odom, staging.stage.frame) == (
        False, None, 'odom')
    assert f'(score {found["score"]}, elsewhere {found["score_elsewhere"]})' in staging.warnings[0]


@pytest.fixture(scope='module')
def undisturbed():
    """Return what matching finds in the hall by steady points near the start alone."""
    return set_stage(survey(points=seen_from_the_start()), walls=HALL).summary['map']


@pytest.mark.parametrize('origin, hits', [
    ((0.0, 0.0), 2),       # somebody passing
    ((9.0, 12.0), 9),      # 15 m from the start, where odometry may have drifted
])
def test_beams_of_passers_by_and_of_far_away_are_not_matched(undisturbed, rng, origin, hits):
    points = seen_from_the_start()
    clutter = rng.uniform(-1.0, 8.0, (400, 2))

    staging = set_stage(survey(
        points=np.concatenate((points, clutter)),
        origins=np.repeat([(0.0, 0.0), origin], (len(points), len(clutter)), axis=0),
        hits=np.repeat((3, hits), (len(points), len(clutter)))), walls=HALL)

    assert staging.summary['map'] == undisturbed


def test_in_a_recording_of_two_scans_twice_is_steady(undisturbed):
    points = seen_from_the_start()

    staging = set_stage(survey(points=points, scan_times=np.arange(2.0), latencies=np.zeros(2),
                               hits=np.full(len(points), 2)), walls=HALL)

    assert staging.summary['map'] == undisturbed


@pytest.mark.parametrize('goal, position', [(None, [4.0, 0.0]), ((1.0, 1.0), [1.0, 1.0])])
def test_a_map_that_too_few_points_can_be_matched_with_is_not_used(goal, position):
    points = [(0.5 * number, 1.0) for number in range(19)]

    staging = set_stage(survey(points=points), walls=HALL, goal=goal)

    assert (staging.stage.frame, staging.stage.map_from_odom) == ('odom', None)
    assert (staging.walls, staging.stage.walls) == (None, None)
    assert staging.summary['goal']['position'] == position
    assert not staging.summary['map']['used']
    assert staging.summary['map']['from'].startswith('19 distinct scan points')
    warning, = staging.warnings
    assert warning.startswith('the robot could not be located in the map with certainty (score 0.0'
                              ', elsewhere 0.0)')


def test_walls_that_give_no_distances_are_refused_as_the_maps():
    walls = Walls(np.array([[[0.0, 0.0], [np.inf, 0.0]]]))

    with pytest.raises(RecordingError, match='^--map: walls: a coordinate is not finite$'):
        set_stage(survey(), walls=walls)
