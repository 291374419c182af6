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
"""Ways round whoever stands in the way: when they are sought, taken and left again."""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.route import plan_route
from wallnav_ros.navigation.detours import (
    Detours, FORGOTTEN, LOOKS, PAUSE, STANDING, Standing, STILL)
from wallnav_ros.world.tracks import HUMAN, Tracks
from wallnav_ros.world.walls import Walls

ROOM = 0.27            # m that a robot of 0.24 m radius needs
NOBODY = np.empty((0, 2)), np.empty(0)
START, GOAL = np.array([1.0, 2.0]), np.array([11.0, 2.0])


def hall(width=4.0):
    return distance_field(Walls.from_polylines(
        [[(0, 0), (12, 0), (12, width), (0, width), (0, 0)]]))


def someone(x, y=2.0, radius=0.3):
    return np.array([[x, y]]), np.array([radius])


def nearest(path, disc):
    """Return the least distance of the way `path` (K, 2) to the edge of a disc, in metres."""
    places = np.concatenate([np.linspace(start, end, 50)
                             for start, end in zip(path[:-1], path[1:])])
    return float((np.hypot(*(places - disc[0][0]).T) - disc[1][0]).min())


@pytest.fixture(scope='module')
def route():
    """Return the Route along a hall 4 m wide."""
    return plan_route(hall(), GOAL, ROOM)


def seek(detours, route, discs, position=START, looks=1):
    for _ in range(looks):
        detours.seek(route, position, discs, ROOM)
    return detours.now


def tracks(stamp, *places):
    count = len(places)
    return Tracks(stamp, np.arange(count, dtype=np.uint32), np.array(places, dtype=float),
                  np.zeros((count, 2)), np.full(count, 0.3), np.full(count, HUMAN, np.uint8))


def test_a_way_that_is_free_is_kept(route):
    assert seek(Detours(), route, NOBODY) is None
    # Somebody beside the way, who leaves it the room it needs.
    assert seek(Detours(), route, someone(4.0, 3.5)) is None


def test_who_stands_in_the_way_is_gone_round_and_the_way_is_joined_again(route):
    disc = someone(4.0)
    detour = seek(Detours(), route, disc)
    path = detour.path(START)
    assert nearest(path, disc) > ROOM - 0.05
    np.testing.assert_allclose(path[-1], GOAL)
    assert detour.to_go(START) == pytest.approx(route.to_go(START), abs=0.5)
    assert detour.route.goal[0] == pytest.approx(4.0 + 0.57 + 1.0, abs=0.3)


def test_a_detour_lasts_until_the_way_has_been_free_for_a_while(route):
    detours, disc = Detours(), someone(4.0)
    first = seek(detours, route, disc)
    # The same people, a little elsewhere as tracks are: the same way.
    assert seek(detours, route, someone(4.05, 1.97), looks=5) is first
    assert seek(detours, route, NOBODY, looks=LOOKS - 1) is first
    assert seek(detours, route, disc) is first
    assert seek(detours, route, NOBODY, looks=LOOKS) is None
    assert detours.count == 1


def test_a_detour_is_over_at_its_end(route):
    detours, disc = Detours(), someone(4.0)
    end = seek(detours, route, disc).route.goal
    assert seek(detours, route, disc, end + (0.1, 0.0)) is None


def test_somebody_else_who_stands_on_the_detour_is_gone_round_too(route):
    detours = Detours()
    first = seek(detours, route, someone(4.0))
    side = np.interp(4.0, *first.path(START).T)
    both = np.array([[4.0, 2.0], [4.0, side]]), np.array([0.3, 0.3])
    second = seek(detours, route, both)
    assert second is not first
    assert nearest(second.path(START), (both[0][1:], both[1][1:])) > ROOM - 0.05


def test_where_there_is_no_way_round_the_way_is_kept_and_none_is_sought_for_a_while():
    narrow, detours = plan_route(hall(1.0), np.array([11.0, 0.5]), ROOM), Detours()
    start, disc = np.array([1.0, 0.5]), someone(4.0, 0.5)
    assert seek(detours, narrow, disc, start) is None
    # Half of the hall is free again, but it has just been looked for a way.
    aside = someone(4.0, 0.9, 0.15)
    assert seek(detours, narrow, aside, start, PAUSE - 2) is None


def test_who_stands_on_the_goal_itself_cannot_be_gone_round(route):
    assert seek(Detours(), route, someone(11.0), np.array([8.0, 2.0])) is None


def test_only_a_piece_of_a_large_map_is_looked_at(route):
    detour = seek(Detours(), route, someone(4.0))
    assert detour.route.length.size < 0.5 * 130 * 130


def test_standing_takes_a_second_in_one_place():
    standing = Standing()
    for stamp in np.arange(0.0, STANDING + 0.01, 0.1):
        assert not len(standing.discs()[1])
        # One walks at half a metre a second, one wavers by less than STILL.
        standing.take(tracks(stamp, (0.5 * stamp, 0.0), (3.0, 0.4 * STILL * np.sin(9.0 * stamp))))
    position, radius = standing.discs()
    np.testing.assert_allclose(position, [[3.0, 0.0]], atol=STILL)
    np.testing.assert_allclose(radius, [0.3])


def test_who_is_hidden_for_a_moment_still_stands_there():
    standing = Standing()
    for stamp in (0.0, 0.6, 1.2):
        standing.take(tracks(stamp, (3.0, 0.0)))
    standing.take(Tracks.none(1.2 + 0.9 * FORGOTTEN))
    assert len(standing.discs()[1]) == 1
    standing.take(Tracks.none(1.3 + FORGOTTEN))
    assert len(standing.discs()[1]) == 0


def test_who_walks_on_no_longer_stands():
    standing = Standing()
    for stamp in (0.0, 0.6, 1.2):
        standing.take(tracks(stamp, (3.0, 0.0)))
    standing.take(tracks(1.5, (3.3, 0.0)))
    assert len(standing.discs()[1]) == 0
