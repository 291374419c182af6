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
"""What earlier scans say of a place: seen empty, occupied, or out of sight."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.visibility import look_up, make_view, ViewMemory

STEP = np.radians(1.0)
CLEAR = 7.0
ORIGIN = np.zeros(3)


def scan_of(ranges, angle_min=0.0, step=STEP, stamp=0.0):
    return Scan(stamp, ranges, angle_min, step, 0.1, 10.0)


def wall_ahead(distance, beams=91, step=STEP):
    """Return a scan of 91 beams about the x axis that all end at `distance` m."""
    return scan_of(np.full(beams, distance), -45.0 * step, step)


def ask(scan, points, pose=ORIGIN, lateral=0.05, depth=0.1, slack=0.0):
    """Return (free, occupied), lists of bool, of what one view of `scan` says of `points`."""
    points = np.array(points, dtype=float).reshape(-1, 2)
    view = make_view(scan, np.asarray(pose, dtype=float), CLEAR)
    free, occupied = look_up([view], scan, points, lateral, depth, slack)
    return free[0].tolist(), occupied[0].tolist()


def test_before_a_surface_is_free_at_it_occupied_and_behind_it_unknown():
    free, occupied = ask(wall_ahead(4.0), [[2.0, 0.0], [4.05, 0.0], [6.0, 0.0]])
    assert free == [True, False, False]
    assert occupied == [False, True, False]


def test_depth_is_the_margin_on_either_side_of_a_surface():
    # Free must end 0.1 m before the surface; the same surface is 0.1 m thick either way.
    free, occupied = ask(wall_ahead(4.0), [[3.89, 0.0], [3.91, 0.0], [4.09, 0.0], [4.11, 0.0]])
    assert free == [True, False, False, False]
    assert occupied == [False, True, True, False]


def test_a_turning_laser_sees_each_place_by_the_beam_that_swept_it():
    # 91 beams from -45 to 45 degrees while the laser turns by 45 more: beam 60 points at 15
    # degrees when the laser has turned by 30, and so towards 45.
    ranges = np.full(91, 4.0)
    ranges[60] = 2.0
    view = make_view(scan_of(ranges, -45.0 * STEP), ORIGIN, CLEAR,
                     np.array([0.0, 0.0, np.radians(45.0)]))
    places = 2.0 * np.array([[np.cos(bearing), np.sin(bearing)]
                             for bearing in np.radians([45.0, 15.0])])
    free, occupied = look_up([view], scan_of(ranges, -45.0 * STEP), places, 0.01, 0.1, 0.0)
    assert occupied[0].tolist() == [True, False]
    assert free[0].tolist() == [False, True]


def test_a_moving_laser_sees_from_the_middle_of_its_way():
    # Ahead of x = 0.5, where it was halfway, the wall is 4 m away.
    scan = wall_ahead(4.0)
    view = make_view(scan, ORIGIN, CLEAR, np.array([1.0, 0.0, 0.0]))
    places = np.array([[4.5, 0.0], [4.0, 0.0]])
    free, occupied = look_up([view], scan, places, 0.01, 0.1, 0.0)
    assert occupied[0].tolist() == [True, False]
    assert free[0].tolist() == [False, True]


def test_slack_widens_the_margin_with_distance():
    # 0.1 m and 0.05 rad times 3.75 m are 0.2875 m; 4 - 3.75 is less.
    assert ask(wall_ahead(4.0), [[3.75, 0.0]])[0] == [True]
    assert ask(wall_ahead(4.0), [[3.75, 0.0]], slack=0.05) == ([False], [True])


def test_out_of_the_field_of_view_nothing_is_known():
    assert ask(wall_ahead(4.0), [[-2.0, 0.0], [0.0, 3.0]]) == ([False] * 2, [False] * 2)


def test_a_near_thing_within_the_lateral_margin_spoils_a_free_place():
    ranges = np.full(91, 4.0)
    ranges[47] = 1.0          # 2 degrees to the left: 7 cm beside a place 2 m ahead
    scan = scan_of(ranges, -45.0 * STEP)
    assert ask(scan, [[2.0, 0.0]], lateral=0.03)[0] == [True]
    assert ask(scan, [[2.0, 0.0]], lateral=0.07)[0] == [False]


@pytest.mark.parametrize('value, reach', [
    (np.inf, CLEAR), (15.0, CLEAR), (np.nan, 0.0), (0.0, 0.0), (-np.inf, 0.0)])
def test_no_return_is_free_up_to_the_clear_range_and_an_error_is_not(value, reach):
    free, occupied = ask(scan_of(np.full(91, value), -45.0 * STEP),
                         [[1.0, 0.0], [6.8, 0.0], [7.2, 0.0]])
    assert free == [reach > 1.0, reach > 6.8, False]
    assert not any(occupied)


def test_the_view_is_asked_from_where_it_was_taken():
    # The laser stood at (1, 2) and looked along y: its wall is at y = 6.
    pose = [1.0, 2.0, np.pi / 2.0]
    free, occupied = ask(wall_ahead(4.0), [[1.0, 4.0], [1.0, 6.0], [3.0, 2.0]], pose)
    assert free == [True, False, False]
    assert occupied == [False, True, False]


def test_a_clockwise_scanner_sees_the_same():
    ranges = np.linspace(2.0, 6.0, 91)
    points = np.random.default_rng(1).uniform(-1.0, 6.0, (200, 2))
    forth = ask(scan_of(ranges, -45.0 * STEP), points)
    back = ask(scan_of(ranges[::-1], 45.0 * STEP, -STEP), points)
    assert forth == back


@pytest.mark.parametrize('angle_min', [-np.pi, 0.0, 1.0, -np.pi - 10.0 * STEP, 5.0])
def test_a_full_circle_has_no_seam(angle_min):
    scan = scan_of(np.full(360, 4.0), angle_min)
    bearings = np.radians(np.arange(0.0, 360.0, 0.25))
    around = np.stack((np.cos(bearings), np.sin(bearings)), axis=1)
    assert all(ask(scan, 2.0 * around)[0])
    assert all(ask(scan, 4.0 * around)[1])


def test_the_windows_of_a_full_circle_reach_over_its_seam():
    ranges = np.full(360, 4.0)
    ranges[-2] = 1.0
    # A place 3 m off on the first beam; the last but one passes 10 cm beside it.
    assert ask(scan_of(ranges), [[3.0, 0.0]], lateral=0.05)[0] == [True]
    assert ask(scan_of(ranges), [[3.0, 0.0]], lateral=0.11)[0] == [False]


ONE_RANGE = st.one_of(st.floats(0.25, 9.5, width=32), st.just(np.inf), st.just(np.nan))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.dictionaries(st.integers(0, 39), ONE_RANGE, max_size=4),
       st.sampled_from([1, 2, 4, 8, 16]))
def test_a_place_is_free_exactly_if_every_beam_in_its_window_passes_it(things, half):
    ranges = [things.get(beam, 5.0) for beam in range(40)]
    scan = scan_of(ranges)
    beam, distance = 20, 3.0
    angle = beam * STEP
    # This lateral margin spans `half` beams and a little less at that distance.
    lateral = 0.98 * half * distance * STEP
    free, _ = ask(scan, [[distance * np.cos(angle), distance * np.sin(angle)]], lateral=lateral)
    window = np.array(ranges[beam - half:beam + half + 1])
    through = np.where(np.isinf(window), CLEAR, np.nan_to_num(window))
    assert free == [bool((through > distance + 0.1).all())]


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(ONE_RANGE, min_size=40, max_size=40),
       st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-20, 20)))
def test_no_place_is_both_free_and_occupied(ranges, pose):
    points = np.random.default_rng(2).uniform(-10.0, 10.0, (50, 2))
    free, occupied = ask(scan_of(ranges), points, pose, lateral=0.1)
    assert not any(np.logical_and(free, occupied))


def test_each_view_has_its_own_say():
    empty, full = (make_view(wall_ahead(far), ORIGIN, CLEAR) for far in (5.0, 3.0))
    free, occupied = look_up([empty, full], wall_ahead(4.0), np.array([[3.0, 0.0]]), .05, .1, 0.0)
    assert free.tolist() == [[True], [False]]
    assert occupied.tolist() == [[False], [True]]


def view_at(stamp, beams=91):
    return make_view(scan_of(np.full(beams, 4.0), stamp=stamp), ORIGIN, CLEAR)


def test_memory_keeps_views_at_least_its_spacing_apart():
    memory = ViewMemory(spacing=0.25, count=8)
    for number in range(11):
        memory.add(view_at(0.1 * number))
    stamps = [view.stamp for view in memory.older_than(10.0, view_at(10.0))]
    np.testing.assert_allclose(stamps, [0.0, 0.3, 0.6, 0.9])


def test_memory_gives_views_of_an_age_and_of_the_same_scanner_only():
    memory = ViewMemory(spacing=0.25, count=8)
    for stamp in (0.0, 1.0, 2.0):
        memory.add(view_at(stamp))
    assert [view.stamp for view in memory.older_than(1.0, view_at(3.0))] == [0.0, 1.0]
    assert memory.older_than(1.0, view_at(3.0, beams=45)) == []
    memory.add(view_at(3.0, beams=45))
    assert [view.stamp for view in memory.older_than(9.0, view_at(9.0, beams=45))] == [3.0]
    assert memory.older_than(9.0, view_at(9.0)) == []


def test_memory_is_bounded_reaches_far_back_and_is_denser_where_it_is_fresh():
    memory = ViewMemory(spacing=0.25, count=8)
    for number in range(400):
        memory.add(view_at(0.25 * number))
    stamps = np.array([view.stamp for view in memory.older_than(1e3, view_at(1e3))])
    ages = 0.25 * 399 - stamps
    assert len(ages) == 8
    assert ages[-1] == 0.0 and ages[0] > 20.0
    # The gaps grow with age, and no age is more than four times the one after it.
    assert (np.diff(np.diff(stamps)) <= 1e-9).all()
    assert (ages[:-2] <= 4.0 * ages[1:-1]).all()
