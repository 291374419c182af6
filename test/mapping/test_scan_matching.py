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
"""Finding a pose in a map: right where the place is unmistakable, refused where it is not."""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.scan_matching import match_scans
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.world.geometry import compose, invert, to_parent, wrap_angle
from wallnav_ros.world.walls import Walls

# An L-shaped hall of 12 m x 8 m with a niche and a pillar: no two corners look alike.
HALL = Walls.from_polylines(
    [[(0, 0), (12, 0), (12, 3), (9, 3), (9, 4), (12, 4), (12, 8), (7, 8), (7, 5), (0, 5)],
     [(3, 2), (3.5, 2), (3.5, 2.5), (3, 2.5)]], closed=True)
CORRIDOR = Walls.from_polylines([[(0, 0), (60, 0)], [(0, 2), (60, 2)]])


def look_round(walls, pose, rng, noise=0.02, reach=8.0):
    """Return 360 noisy beam ends (P, 2), seen from `pose`, and their origins, in its frame."""
    angles = np.radians(np.arange(360.0))
    ranges = walls.raycast(pose[:2], angles + pose[2], reach)
    met = np.isfinite(ranges)
    ranges = ranges[met] + rng.normal(0.0, noise, met.sum())
    ends = ranges[:, None] * np.stack((np.cos(angles[met]), np.sin(angles[met])), axis=1)
    return ends, np.zeros_like(ends)


@pytest.mark.parametrize('pose', [(2.0, 3.5, 0.4), (9.5, 6.0, -2.0), (8.0, 1.5, 3.0)])
def test_a_single_scan_finds_its_place_in_an_unmistakable_hall(pose, rng):
    match = match_scans(*look_round(HALL, np.array(pose), rng), distance_field(HALL))

    assert match.is_certain
    np.testing.assert_allclose(match.pose[:2], pose[:2], atol=0.05)
    assert abs(wrap_angle(match.pose[2] - pose[2])) < np.radians(1.0)


def test_the_frame_of_the_points_may_lie_anywhere(rng):
    pose, frame = np.array([2.0, 3.5, 0.4]), np.array([-300.0, 80.0, 2.5])
    points, origins = look_round(HALL, pose, rng)
    points, origins = to_parent(frame, points), to_parent(frame, origins)

    match = match_scans(points, origins, distance_field(HALL))

    expected = compose(pose, invert(frame))
    assert match.is_certain
    np.testing.assert_allclose(to_parent(match.pose, points), to_parent(expected, points),
                               atol=0.1)


def test_the_map_may_lie_anywhere_too(rng):
    pose, shift = np.array([2.0, 3.5, 0.4]), np.array([40.0, -70.0, 1.0])
    moved = Walls(to_parent(shift, HALL.segments))

    match = match_scans(*look_round(HALL, pose, rng), distance_field(moved))

    assert match.is_certain
    np.testing.assert_allclose(match.pose, compose(shift, pose), atol=0.05)


def test_a_third_of_the_beams_may_end_on_people(rng):
    pose = np.array([8.0, 1.5, 3.0])
    points, origins = look_round(HALL, pose, rng)
    points[::3] *= rng.uniform(0.2, 0.9, (len(points[::3]), 1))

    match = match_scans(points, origins, distance_field(HALL))

    assert match.is_certain
    np.testing.assert_allclose(match.pose, pose, atol=0.05)


def test_along_a_plain_corridor_the_place_is_not_certain(rng):
    match = match_scans(*look_round(CORRIDOR, np.array([20.0, 1.0, 0.1]), rng, reach=5.0),
                        distance_field(CORRIDOR))

    assert match.score > 0.8
    assert match.lead < 0.2
    assert not match.is_certain


def test_a_scan_of_another_place_is_not_certain(rng):
    round_hall = Walls.from_polylines(
        [[(4 * np.cos(turn), 4 * np.sin(turn)) for turn in np.linspace(0, 6.2, 60)]], closed=True)

    match = match_scans(*look_round(round_hall, np.array([1.0, 0.5, 0.0]), rng),
                        distance_field(HALL))

    assert not match.is_certain


def test_too_few_points_are_refused():
    with pytest.raises(ValueError, match='needs at least 20'):
        match_scans(np.zeros((100, 2)), np.zeros((100, 2)), distance_field(HALL))


def test_the_same_input_gives_the_same_pose(rng):
    points, origins = look_round(HALL, np.array([2.0, 3.5, 0.4]), rng)
    field = distance_field(HALL)

    first, second = (match_scans(points, origins, field) for _ in range(2))

    np.testing.assert_array_equal(first.pose, second.pose)
    assert first.score == second.score


@pytest.fixture(scope='module')
def turtlebot_survey(shared_data):
    """Return what a TurtleBot saw thrice or more in a hallway: points, origins and its way."""
    pytest.importorskip('rosbags')
    from wallnav_ros.evaluation.recordings import Recording
    from wallnav_ros.evaluation.survey import survey_recording
    survey = survey_recording(Recording(shared_data / 'scans/olin_mac_1st_floor_take_2'))
    steady = survey.hits >= 3
    return survey.points[steady], survey.origins[steady], survey.path[:, :2]


def field_of(path):
    """Return the DistanceField of a map's walls."""
    return distance_field(extract_walls(load_map(path)).walls)


@pytest.mark.extras
def test_both_halves_of_a_real_drive_agree_on_the_place(shared_data, turtlebot_survey):
    points, origins, path = turtlebot_survey
    map_file, = (shared_data / 'maps/olin_mac_1st_floor').glob('*.yaml')
    field = field_of(map_file)
    early = np.hypot(*(origins - path[0]).T) < 2.5

    whole = match_scans(points, origins, field)
    halves = [match_scans(points[part], origins[part], field) for part in (early, ~early)]

    assert whole.is_certain
    for half in halves:
        gap = to_parent(half.pose, path) - to_parent(whole.pose, path)
        # Wheel odometry drifts by a few per cent over the 8 m that were driven.
        assert np.hypot(*gap.T).max() < 0.5


@pytest.mark.extras
@pytest.mark.parametrize('name', ['fetch_4_26_15', 'utexas_gdc_3ne'])
def test_a_real_drive_is_not_certain_in_another_building(shared_data, turtlebot_survey, name):
    points, origins, _ = turtlebot_survey
    map_file, = (shared_data / 'maps' / name).glob('*.yaml')

    assert match_scans(points, origins, field_of(map_file)).lead < 0.1
