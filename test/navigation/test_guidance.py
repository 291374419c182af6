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
"""The guide: goals and the ways to them, sub-goals, and another way where one is blocked."""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.navigation.guidance import Guide, PATIENCE
from wallnav_ros.navigation.localisation import Localisation
from wallnav_ros.world.walls import Walls

RADIUS = 0.25


def box(left, bottom, right, top):
    corners = np.array([(left, bottom), (right, bottom), (right, top), (left, top)], dtype=float)
    return np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)


# A room of 10 m x 10 m; a wall at x = 5 leaves a door 1 m wide at each end of it.
TWO_DOORS = distance_field(Walls(np.concatenate(
    (box(0, 0, 10, 10), [[[5.0, 1.0], [5.0, 9.0]]]))))


@pytest.fixture
def place():
    """Return a Localisation at (2, 2) in the map, odometry having begun there."""
    place = Localisation(np.array([2.0, 2.0, 0.0]))
    place.add_odometry(100.0, np.zeros(3), np.zeros(2))
    return place


def guide_to(place, goal, frame='map', walls=TWO_DOORS):
    guide = Guide()
    assert guide.take_goal(np.array(goal), frame, place) is None
    if guide.needs_route(place, walls):
        assert guide.plan(place, walls, RADIUS) is None
    return guide


def test_a_goal_in_sight_is_its_own_sub_goal(place):
    guide = guide_to(place, (2.0, 8.0))
    target, beyond = guide.sub_goal(place, RADIUS, np.array([2.0, 2.0]))
    np.testing.assert_allclose(target, [2.0, 8.0])
    assert beyond == 0.0


def test_the_way_to_a_goal_behind_a_wall_leads_through_the_nearest_door(place):
    guide = guide_to(place, (8.0, 2.0))
    target, beyond = guide.sub_goal(place, RADIUS, np.array([2.0, 2.0]))
    assert target[1] < 1.0 and beyond > 1.0
    assert 6.0 < guide.route.to_go(np.array([2.0, 2.0])) < 8.0


def test_without_a_map_the_goal_is_headed_for_straight(place):
    guide = guide_to(place, (8.0, 2.0), walls=None)
    np.testing.assert_allclose(guide.sub_goal(place, RADIUS, np.array([2.0, 2.0]))[0], [8.0, 2.0])


def test_a_robot_nearer_to_a_wall_than_its_route_would_lead_it_is_not_lost(place):
    guide = guide_to(place, (8.0, 2.0))
    target, beyond = guide.sub_goal(place, RADIUS, np.array([4.85, 5.0]))
    assert target[0] < 6.0 and beyond > 1.0


def test_a_sub_goal_is_never_where_the_robot_is(place, rng):
    guide = guide_to(place, (8.0, 2.0))
    for position in rng.uniform((0.3, 0.3), (4.7, 9.7), (100, 2)):
        target, beyond = guide.sub_goal(place, RADIUS, position)
        assert not beyond or np.hypot(*(target - position)) > 0.1


@pytest.mark.parametrize('goal, told', [
    ((0.1, 5.0), 'too close to a wall'), ((5.0, 5.0), 'too close to a wall'),
    ((12.0, 5.0), 'no way'), ((500.0, 5.0), 'outside the walls')])
def test_a_goal_that_no_way_leads_to_is_refused_with_the_reason(place, goal, told):
    guide = Guide()
    guide.take_goal(np.array(goal), 'map', place)
    assert told in guide.plan(place, TWO_DOORS, RADIUS)


def test_another_way_is_sought_only_after_long_without_progress(place):
    guide = guide_to(place, (8.0, 2.0))
    start = np.array([2.0, 2.0])
    assert not guide.is_stuck(place, RADIUS, start, 100.0)
    assert not guide.is_stuck(place, RADIUS, start, 100.0 + 0.9 * PATIENCE)
    nearer = np.array([2.8, 1.5])
    assert not guide.is_stuck(place, RADIUS, nearer, 100.0 + PATIENCE)
    assert not guide.is_stuck(place, RADIUS, nearer, 100.0 + 1.9 * PATIENCE)
    assert guide.is_stuck(place, RADIUS, nearer, 100.0 + 2.1 * PATIENCE)


def test_time_spent_standing_for_another_reason_does_not_count(place):
    guide = guide_to(place, (8.0, 2.0))
    start = np.array([2.0, 2.0])
    guide.is_stuck(place, RADIUS, start, 100.0)
    guide.rest()
    assert not guide.is_stuck(place, RADIUS, start, 100.0 + 2.0 * PATIENCE)


def test_what_blocks_one_door_sends_the_robot_through_the_other(place):
    guide = guide_to(place, (8.0, 2.0))
    door = np.column_stack((np.full(20, 5.0), np.linspace(0.0, 1.0, 20)))
    assert guide.replan(place, TWO_DOORS, RADIUS, door) is None
    assert guide.route.to_go(np.array([2.0, 2.0])) > 15.0
    assert guide.detours == 1
    # With both blocked there is no other way: the one there was stays.
    other = np.column_stack((np.full(20, 5.0), np.linspace(9.0, 10.0, 20)))
    assert 'no way' in guide.replan(place, TWO_DOORS, RADIUS, other)
    assert guide.route.to_go(np.array([2.0, 2.0])) > 15.0


def test_a_new_map_or_a_goal_that_drifted_calls_for_a_new_route(place):
    guide = guide_to(place, (6.0, 0.0), 'odom')
    assert not guide.needs_route(place, TWO_DOORS)
    assert guide.needs_route(place, distance_field(Walls(box(0, 0, 20, 20))))
    place.map_from_odom = np.array([2.0, 2.5, 0.0])
    assert guide.needs_route(place, TWO_DOORS)


def test_a_path_handed_in_is_followed_if_it_leads_to_the_goal(place):
    guide = guide_to(place, (8.0, 2.0))
    long_way = np.array([[2.0, 2.0], [2.0, 5.0], [2.0, 9.5], [5.0, 9.5], [8.0, 9.5], [8.0, 2.2]])
    assert guide.take_path(long_way, 'map', place) is None
    target, _ = guide.sub_goal(place, RADIUS, np.array([2.0, 2.0]))
    np.testing.assert_allclose(target, [2.0, 5.0])
    assert 'does not lead' in guide.take_path(long_way[:3], 'map', place)
    assert guide.way(place, RADIUS) is guide.route


def test_a_path_may_come_before_its_goal_and_in_the_frame_of_odometry(place):
    guide = Guide()
    path = np.array([[0.0, 0.0], [0.0, 3.0], [0.0, 6.0]])
    assert guide.take_path(path, 'odom', place) is None
    assert guide.take_goal(np.array([2.0, 8.0]), 'map', place) is None
    np.testing.assert_allclose(guide.way(place, RADIUS).points, path + (2.0, 2.0))


@pytest.mark.parametrize('points, frame, told', [
    (np.empty((0, 2)), 'map', 'empty'), (np.array([[np.nan, 0.0]]), 'map', 'not finite'),
    (np.zeros((3, 2)), 'mars', 'mars')])
def test_a_path_of_no_use_is_refused_with_the_reason(place, points, frame, told):
    assert told in Guide().take_path(points, frame, place)
