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
Ways round whoever stands in the way, sought before the robot gets stuck before them.

What `simulation.detours` does in training; from tracks, and on a piece of the map, so that it
takes no longer than a control period or so.
"""

from dataclasses import dataclass, replace
import math

import numpy as np

from wallnav_ros.mapping.route import plan_round, Route, RouteError
from wallnav_ros.world.geometry import to_child

STILL = 0.2            # m that who stands has moved at most, as tracks go
STANDING = 1.0         # s after which who has not moved is taken to stand
FORGOTTEN = 3.0        # s after which who was not seen again is taken to have left
AHEAD = 6.0            # m of the way that are looked at
BEYOND = 1.0           # m past who stands, where the way is joined again
APART = 0.1            # m between the places looked at on it
MARGIN = 4.0           # m of the map around that piece of the way
EASE = 0.1             # m of room more than it needs, from which on the way counts as free again
THERE = 0.5            # m to the end of a detour, at which it is over
LOOKS = 2              # at a way that is free again, before it is taken
PAUSE = 4              # looks, after one that found no way round


class Standing:
    """Remembers for how long each track has stood where it stands."""

    def __init__(self):
        self._seen = {}

    def forget(self):
        """Forget everybody, as after a jump of the clock."""
        self._seen.clear()

    def take(self, tracks):
        """Note Tracks in the odometry's frame."""
        now, places = tracks.stamp, tracks.position.tolist()
        for number, place, radius in zip(tracks.id.tolist(), places, tracks.radius.tolist()):
            anchor, since, _, _ = self._seen.get(number, (None, now, now, 0.0))
            if anchor is None or math.dist(place, anchor) > STILL:
                anchor, since = place, now
            self._seen[number] = anchor, since, now, radius
        self._seen = {number: entry for number, entry in self._seen.items()
                      if 0.0 <= now - entry[2] < FORGOTTEN}

    def discs(self):
        """Return the position (K, 2), in the odometry's frame, and radius (K,) of who stands."""
        stand = [entry for entry in self._seen.values() if entry[2] - entry[1] >= STANDING]
        return (np.array([entry[0] for entry in stand]).reshape(-1, 2),
                np.array([entry[3] for entry in stand]))


@dataclass(frozen=True)
class Detour:
    """
    A way round somebody who stands.

    route: the Route to a place farther along the way. onward: the Route that is left and joined.
    """

    route: Route
    onward: Route

    @property
    def rest(self):
        """Return the metres to go from its end."""
        return float(self.onward.to_go(self.route.goal))

    def to_go(self, position):
        """Return the metres (...) to go from `position` (..., 2); inf: none."""
        return self.route.to_go(position) + self.rest

    def path(self, position):
        """Return the way (K, 2) from `position` (2,); raises RouteError where there is none."""
        return np.vstack((self.route.path(position), self.onward.path(self.route.goal)[1:]))


class Detours:
    """
    Leaves a Route where somebody stands on it, and takes it again.

    now: the Detour to follow, or None. count: how many there were.
    """

    def __init__(self):
        self.now, self.count = None, 0
        self.drop()

    def drop(self):
        """Follow the route itself again."""
        self.now, self._free, self._pause = None, 0, 0

    def seek(self, route, position, discs, room):
        """
        Look at `route` from `position` (2,), and leave it or take it again where that is better.

        discs: position (N, 2) and radius (N,) of who stands. room: m, that the robot needs from
        its middle. To be called every half a second or so; raises RouteError where no way leads
        on from `position`.
        """
        if self.now is not None and np.hypot(*(self.now.route.goal - position)) < THERE:
            self.drop()
        path = route.path(position)
        if self.now is not None and not blocked(self.now.route.path(position), *discs, room)[0]:
            clear = not blocked(path, *discs, room + EASE)[0]
            self._free = self._free + 1 if clear else 0
            if self._free >= LOOKS:
                self.drop()
            return
        stands, end = blocked(path, *discs, room)
        self._pause = max(self._pause - 1, 0)
        if not stands:
            self.drop()
        elif end is not None and not self._pause:
            try:
                found = plan_detour(route.walls, position, end, *discs, room)
            except RouteError:
                self._pause = PAUSE
                return
            self.now, self.count, self._free = Detour(found, route), self.count + 1, 0


def blocked(path, position, radius, room):
    """
    Return whether discs leave a robot less than `room` m on its way, and where it may join again.

    path: (K, 2) of the way; position (N, 2), radius (N,) of the discs. The place (2,) is None
    where the way is free, or ends among them.
    """
    places = _sampled(path)
    away = np.hypot(*np.moveaxis(places[:, None] - position, -1, 0)) - radius
    hit = np.flatnonzero((away < room).any(axis=1))
    if not len(hit):
        return False, None
    free = np.arange(len(places)) >= hit[-1] + 1 + int(BEYOND / APART)
    free[-1] |= hit[-1] + 1 < len(places) and len(path) > 1
    return True, places[free.argmax()] if free.any() else None


def plan_detour(walls, start, end, position, radius, room):
    """
    Return the Route from `start` (2,) to `end` (2,) round discs; raises RouteError.

    walls: DistanceField of the map that all is in; discs as in `blocked`. Only MARGIN metres
    around start and end are looked at.
    """
    low, high = np.minimum(start, end) - MARGIN, np.maximum(start, end) + MARGIN
    piece = _cut(walls, low, high)
    near = ((position > low) & (position < high)).all(axis=1)
    return plan_round(piece, start, end, room, position[near], radius[near])


def _sampled(path):
    """Return places (M, 2) on the first AHEAD metres of `path` (K, 2), and its end if nearer."""
    strides = np.hypot(*np.diff(path, axis=0).T)
    along = np.append(0.0, np.cumsum(strides))
    at = np.append(np.arange(0.0, min(along[-1], AHEAD), APART), min(along[-1], AHEAD))
    return np.stack([np.interp(at, along, part) for part in path.T], axis=1)


def _cut(walls, low, high):
    """Return the piece of a DistanceField with the box from `low` (2,) to `high` (2,) in it."""
    corners = np.array([(low[0], low[1]), (low[0], high[1]), (high[0], low[1]), tuple(high)])
    nodes = to_child(walls.pose, corners) / walls.resolution
    most = np.array(walls.distance.shape[::-1]) - 1
    first = np.clip(np.floor(nodes.min(axis=0)), 0, most - 1).astype(int)
    last = np.clip(np.ceil(nodes.max(axis=0)), 1, most).astype(int)
    cos, sin = np.cos(walls.pose[2]), np.sin(walls.pose[2])
    shift = walls.resolution * first
    corner = walls.pose[:2] + (cos * shift[0] - sin * shift[1], sin * shift[0] + cos * shift[1])
    return replace(walls, pose=np.array([*corner, walls.pose[2]]), distance=np.ascontiguousarray(
        walls.distance[first[1]:last[1] + 1, first[0]:last[0] + 1]))
