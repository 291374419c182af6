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
"""From one scan to things: where beams end, what earlier views say, and what is compact."""

import discs as discs_seen
import numpy as np
import pytest
from track_tables import make_detections

from wallnav_ros.perception.detection import detect, judge_points, place_beams
from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.visibility import make_view
from wallnav_ros.world.geometry import to_parent

SETTINGS = TrackerSettings()
BEAMS = 720
STEP = 2.0 * np.pi / BEAMS
ANGLES = -np.pi + STEP * np.arange(BEAMS)
ORIGIN = np.zeros(3)
NOBODY = np.empty((0, 2))


def look(discs=(), wall=None, pose=ORIGIN, stamp=0.0):
    """Return a full-circle scan from `pose`: discs (x, y, radius), and a wall at x = `wall`."""
    ranges = np.full(BEAMS, np.inf)
    if wall is not None:
        facing = np.cos(ANGLES + pose[2])
        ranges = np.where(facing > 0.5, (wall - pose[0]) / np.maximum(facing, 0.5), np.inf)
    ranges = discs_seen.before(ranges, ANGLES, pose, discs)
    return Scan(stamp, ranges, -np.pi, STEP, 0.1, 12.0)


def find(scan, views=(), expected=NOBODY, pose=ORIGIN):
    """Return the Detections in `scan` from `pose`, of which earlier `views` tell."""
    pose = np.asarray(pose, dtype=float)
    hits, local = place_beams(scan, np.ones(len(scan.ranges), bool), np.zeros(3), SETTINGS)
    points = to_parent(pose, local)
    return detect(scan, hits, points, pose, judge_points(points, scan, list(views), SETTINGS),
                  np.asarray(expected, dtype=float), np.full(len(expected), 0.25), SETTINGS)


def view_of(scan, pose=ORIGIN):
    return make_view(scan, np.asarray(pose, dtype=float), SETTINGS.clear_range)


def test_beams_that_are_wanted_and_in_reach_end_where_they_point():
    scan = Scan(0.0, [1.0, 2.0, np.nan, 3.0, 30.0], 0.0, np.pi / 2.0 / 4, 0.1, 50.0)
    hits, points = place_beams(
        scan, np.array([True, True, True, False, True]), np.zeros(3), SETTINGS)
    assert hits.tolist() == [0, 1]       # of the others one is lost, one unwanted, one too far
    turned = np.pi / 8
    np.testing.assert_allclose(points, [[1.0, 0.0], [2 * np.cos(turned), 2 * np.sin(turned)]])


def test_a_sweep_is_straightened_into_the_frame_of_its_first_beam():
    # A laser that drives 0.2 m and turns 0.1 rad within its sweep, past a wall 2 m to the left.
    sweep, count = np.array([0.2, 0.0, 0.1]), 91
    share = np.arange(count) / (count - 1)
    angles = np.radians(45.0) + np.radians(1.0) * np.arange(count)
    ranges = 2.0 / np.sin(angles + share * sweep[2])
    scan = Scan(0.0, ranges, angles[0], np.radians(1.0), 0.1, 10.0, 1e-3)
    _, points = place_beams(scan, np.ones(count, bool), sweep, SETTINGS)
    np.testing.assert_allclose(points[:, 1], 2.0)
    # Taken for still, the wall would be bent.
    _, bent = place_beams(scan, np.ones(count, bool), np.zeros(3), SETTINGS)
    assert np.ptp(bent[:, 1]) > 0.1


def test_what_was_empty_is_fresh_and_what_was_there_is_still():
    views = [view_of(look([(2.0, 0.0, 0.2)], stamp=stamp)) for stamp in (0.0, 0.5, 2.0, 2.5)]
    now = look(stamp=3.0)
    points = np.array([[1.8, 0.0], [0.0, 3.0], [3.0, 0.0]])
    still, fresh, background = judge_points(points, now, views, SETTINGS)
    assert still.tolist() == [True, False, False]
    assert fresh.tolist() == [False, True, False]       # behind the disc nothing is known
    assert background.tolist() == [True, False, False]


def test_who_has_stood_for_a_second_and_a_half_is_still_but_no_background():
    views = [view_of(look(discs, stamp=stamp)) for stamp, discs in (
        (0.0, []), (0.5, []), (1.6, [(2.0, 0.0, 0.2)]), (1.8, [(2.0, 0.0, 0.2)]))]
    now = look(stamp=3.0)
    still, _, background = judge_points(np.array([[1.8, 0.0]]), now, views, SETTINGS)
    assert not background[0]
    # The views older than a second are two against two.
    assert not still[0]
    still, _, _ = judge_points(np.array([[1.8, 0.0]]), now, views[1:], SETTINGS)
    assert still[0]


def test_without_views_nothing_is_judged():
    for found in judge_points(np.ones((3, 2)), look(), [], SETTINGS):
        assert found.tolist() == [False] * 3


@pytest.mark.parametrize('x, y, radius', [
    (2.0, 0.0, 0.2), (0.0, -3.0, 0.25), (-1.5, 1.5, 0.15), (3.0, 2.0, 0.3)])
def test_a_disc_is_found_with_its_centre_and_size(x, y, radius):
    found = find(look([(x, y, radius)]))
    assert len(found) == 1
    np.testing.assert_allclose(found.position[0], [x, y], atol=0.05)
    assert found.radius[0] == pytest.approx(radius, abs=0.03)
    assert not found.leg[0] and found.apart[0]
    assert not np.any(found.hidden[0])


def test_what_is_seen_is_told_in_the_frame_of_the_laser_pose():
    pose = np.array([1.0, -2.0, 2.0])
    found = find(look([(3.0, 0.5, 0.2)], pose=pose), pose=pose)
    np.testing.assert_allclose(found.position, [[3.0, 0.5]], atol=0.03)


def test_a_leg_is_thin():
    found = find(look([(2.0, 0.0, 0.07), (0.0, 2.0, 0.25)]))
    legs = dict(zip(np.round(found.position[:, 0]).tolist(), found.leg.tolist()))
    assert legs == {2.0: True, 0.0: False}


def test_a_wall_is_no_thing_and_what_leans_on_it_is_not_apart():
    found = find(look([(2.85, 0.0, 0.1), (1.5, 2.0, 0.2)], wall=3.0))
    apart = {round(y): flag for (_, y), flag in zip(found.position.tolist(), found.apart)}
    assert not apart.get(0, False) and apart[2]
    assert len(find(look(wall=3.0))) == 0


def test_one_who_comes_out_before_a_wall_is_cut_from_it():
    # Both are one cluster: the wall has always been there, the person has not.
    empty = [view_of(look(wall=3.0, stamp=stamp)) for stamp in (0.0, 0.5, 1.0)]
    found = find(look([(2.8, 0.0, 0.25)], wall=3.0, stamp=4.0), empty)
    gap = np.hypot(*(found.position - [2.8, 0.0]).T)
    assert gap.min() < 0.15
    assert found.fresh[gap.argmin()] > 0.9 and found.still[gap.argmin()] < 0.1


def test_two_who_walk_shoulder_to_shoulder_are_parted_where_they_are_expected():
    pair = [(2.0, 0.24, 0.25), (2.0, -0.24, 0.25)]
    assert len(find(look(pair))) == 1
    found = find(look(pair), expected=[[2.0, 0.24], [2.0, -0.24]])
    assert len(found) == 2
    np.testing.assert_allclose(np.sort(found.position[:, 1]), [-0.24, 0.24], atol=0.08)


def test_who_is_half_behind_a_pillar_is_told_to_be():
    # The pillar covers bearings up to 0.1 rad; the person reaches from -0.12 to 0.12.
    found = find(look([(1.0, 0.12, 0.1), (2.5, 0.0, 0.3)]))
    far = found.position[:, 0].argmax()
    assert np.any(found.hidden[far]) and not np.any(found.hidden[1 - far])


def test_far_things_are_known_less_well():
    near, far = (find(look([(x, 0.0, 0.3)])).noise[0] for x in (1.0, 10.0))
    assert SETTINGS.body_noise <= near < far


def test_nothing_is_found_in_an_empty_scan():
    assert len(find(look())) == 0


@pytest.mark.parametrize('cover, side', [((0.5, 0.0), -1.0), ((0.0, 0.5), 1.0)])
def test_the_centre_of_a_body_half_hidden_lies_one_radius_from_the_limb_in_sight(cover, side):
    # Seen along x: 0.2 m of a disc 0.5 m wide, whose other part is hidden on one side.
    found = make_detections([[2.0, 0.0]], radius=0.1, hidden=cover, sight=(1.0, 0.0))
    settings = TrackerSettings(hidden_width=0.3)
    centre = found.centre_of(np.array([0]), np.array([0.25]), settings)[0]
    # The limb in sight is 0.1 m to the other side; the centre is 0.25 m from it.
    assert centre[1] == pytest.approx(side * 0.15)
    depth = np.sqrt(0.25 ** 2 - 0.15 ** 2 - 0.1 ** 2 / 3.0) - 0.1 * np.pi / 4.0
    assert centre[0] == pytest.approx(2.0 + depth)


def test_the_centre_stays_where_nothing_is_missing():
    found = make_detections([[2.0, 0.0]], radius=0.2, hidden=(0.5, 0.0), sight=(1.0, 0.0))
    centre = found.centre_of(np.array([0]), np.array([0.2]), TrackerSettings())[0]
    np.testing.assert_allclose(centre, [2.0, 0.0], atol=0.01)
