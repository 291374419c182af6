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
"""Routes: worked by hand in small worlds, and real maps planned across."""

from time import thread_time

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.route import plan_round, plan_route, RouteError
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.world.geometry import to_parent
from wallnav_ros.world.walls import Walls

RADIUS = 0.2
ROOM = [(0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)]
# Two rooms side by side, a door of 1 m between them at the top.
PARTED = distance_field(Walls.from_polylines(
    [ROOM, [(4.0, 0.0), (4.2, 0.0), (4.2, 5.0), (4.0, 5.0)]], closed=True))
START, GOAL = np.array([2.0, 1.0]), np.array([6.0, 1.0])


@pytest.fixture(scope='module')
def around():
    return plan_route(PARTED, GOAL, RADIUS, START)


def test_a_goal_in_sight_is_its_own_sub_goal(around):
    goal, beyond = around.guide(np.array([[6.0, 4.0]]))

    assert goal.tolist() == [GOAL.tolist()]
    assert beyond.tolist() == [0.0]


def test_a_goal_behind_a_wall_is_reached_through_the_door(around):
    goal, beyond = around.guide(START[None])

    assert 5.2 < goal[0, 1] < 5.8                      # the door: y from 5 to 6, and the radius
    assert around.walls.at(goal)[0] > RADIUS
    # Up beside the wall, across and down again is 4 + 4 + 0.6 at the shortest.
    length = np.linalg.norm(goal[0] - START) + beyond[0]
    shortest = np.linalg.norm([1.8, 4.2]) * 2 + 0.6
    assert shortest < length < 1.1 * shortest


def test_every_sub_goal_is_nearer_to_the_goal_than_where_it_is_given(rng):
    # Among short walls in disorder; where cells in sight ended at one's own, a path had no end.
    for _ in range(8):
        start, turn = rng.uniform(0.0, 6.0, (25, 2)), rng.uniform(0.0, 2.0 * np.pi, 25)
        ends = start + 0.5 * np.stack((np.cos(turn), np.sin(turn)), axis=1)
        field = distance_field(Walls(np.stack((start, ends), axis=1)))
        away = field.at(places := rng.uniform(0.0, 6.0, (200, 2))) > RADIUS + 0.1
        route = plan_route(field, places[away][0], RADIUS)
        to_go = route.to_go(places)
        _, beyond = route.guide(places)
        known = np.isfinite(to_go)
        assert known.sum() > 50
        assert (beyond[known] < np.maximum(to_go[known], 1e-6)).all()


def test_the_path_keeps_the_robot_clear_of_walls_and_ends_at_the_goal(around):
    path = around.path(START)

    assert path[0].tolist() == START.tolist()
    assert path[-1].tolist() == GOAL.tolist()
    dense = np.concatenate([np.linspace(a, b, 100) for a, b in zip(path[:-1], path[1:])])
    assert around.walls.at(dense).min() > RADIUS - 0.01


def test_what_is_left_shrinks_along_the_way(around):
    way = around.path(START)
    left = around.to_go(np.concatenate([np.linspace(a, b, 20) for a, b in zip(way[:-1], way[1:])]))

    assert (np.diff(left) <= 0.15).all()
    assert left[-1] == pytest.approx(0.0, abs=0.1)


def test_many_robots_are_guided_as_each_alone(around):
    robots = np.array([[1.0, 1.0], [3.0, 5.5], [5.0, 3.0], [2.0, 3.0]])
    goals, beyond = around.guide(robots)

    for row, robot in enumerate(robots):
        goal, left = around.guide(robot[None])
        assert np.allclose(goal[0], goals[row], atol=0.2)
        assert left[0] == pytest.approx(beyond[row], abs=0.2)


def test_there_is_room_to_spare_where_the_place_is_wide():
    # Past the end of a wall the shortest way touches its corner; the chosen one keeps off.
    path = plan_route(PARTED, GOAL, RADIUS, START).path(START)

    assert PARTED.at(path[1:-1]).min() > RADIUS + 0.1


def test_an_open_world_is_crossed_straight():
    route = plan_route(distance_field(Walls.from_polylines([])), np.array([5.0, 5.0]), RADIUS,
                       np.zeros(2))

    assert route.path(np.zeros(2)).tolist() == [[0.0, 0.0], [5.0, 5.0]]
    assert route.to_go(np.zeros(2)) == pytest.approx(np.hypot(5.0, 5.0), abs=0.1)


@pytest.mark.parametrize(('goal', 'start', 'radius', 'reason'), [
    ((3.9, 2.0), START, RADIUS, 'the goal is too close to a wall'),
    (GOAL, (0.1, 1.0), RADIUS, 'the robot is too close to a wall'),
    (GOAL, START, 0.6, 'no way that a robot of 0.6 m'),
])
def test_no_route_says_why(goal, start, radius, reason):
    with pytest.raises(RouteError, match=reason):
        plan_route(PARTED, np.array(goal), radius, np.array(start))


def test_who_stands_in_the_door_is_passed_on_the_side_that_leaves_room():
    disc, radius = np.array([[4.1, 5.2]]), np.array([0.2])

    path = plan_round(PARTED, START, GOAL, RADIUS, disc, radius).path(START)

    dense = np.concatenate([np.linspace(a, b, 100) for a, b in zip(path[:-1], path[1:])])
    assert np.hypot(*(dense - disc[0]).T).min() > radius[0] + RADIUS - 0.01


def test_who_fills_the_door_leaves_no_way_round():
    with pytest.raises(RouteError, match='no way round who stands there'):
        plan_round(PARTED, START, GOAL, RADIUS, np.array([[4.1, 5.4]]), np.array([0.3]))


def test_a_robot_from_where_no_way_leads_heads_for_the_goal():
    route = plan_route(PARTED, GOAL, 0.6)
    goal, beyond = route.guide(START[None])

    assert goal.tolist() == [GOAL.tolist()]
    assert beyond.tolist() == [0.0]
    with pytest.raises(RouteError, match='from here'):
        route.path(START)


@pytest.mark.parametrize('name', ['aces.yaml', 'intel.yaml', 'depot.yaml'])
def test_real_maps_are_crossed(shared_data, name):
    occupancy = load_map(next((shared_data / 'maps').rglob(name)))
    field = distance_field(extract_walls(occupancy).walls)
    free = np.argwhere(occupancy.cells == 0)[:, ::-1] + 0.5
    free = to_parent(occupancy.origin, free * occupancy.resolution)
    free = free[field.at(free) > 0.5]
    route = plan_route(field, free[len(free) // 2], 0.25)
    left = route.to_go(free)
    start = free[np.where(np.isfinite(left), left, 0.0).argmax()]
    path = route.path(start)

    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert 20.0 < length < 1.03 * route.to_go(start) + 0.2
    dense = np.concatenate([np.linspace(a, b, 100) for a, b in zip(path[:-1], path[1:])])
    assert field.at(dense).min() > 0.25 - 0.02


@pytest.mark.parametrize('name', ['asl_office_j/*.yaml', 'fetch_4_26_15/*.yaml',
                                  'nav2_warehouse/*.yaml'])
def test_a_route_of_thirty_metres_on_a_real_map_is_planned_within_half_a_second(
        shared_data, rng, name):
    path = sorted((shared_data / 'maps').glob(name))[0]
    field = distance_field(extract_walls(load_map(path)).walls)
    size = np.array(field.distance.shape[::-1]) * field.resolution
    points = field.pose[:2] + rng.uniform(0.0, 1.0, (4000, 2)) * size
    points = points[(field.at(points) > 0.5) & (field.at(points) < 2.0)]
    far, tries = 0, 0
    while far < 3 and tries < 40:
        tries += 1
        start, goal = points[rng.integers(len(points), size=2)]
        began = thread_time()
        route = plan_route(field, goal, 0.25)
        took = thread_time() - began
        if 30.0 <= route.to_go(start) < np.inf:
            far += 1
            assert took < 0.5
    assert far == 3
