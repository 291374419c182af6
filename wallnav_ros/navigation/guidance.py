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
Where to go next: the goal, the way to it, and the sub-goal that the policy can see.

REP-105: a goal in `map` stays put there, one in `odom` drifts with it. Ways: `mapping.route`.
"""

from contextlib import suppress
from dataclasses import replace

import cv2
import numpy as np

from wallnav_ros.mapping.route import plan_route, RouteError
from wallnav_ros.navigation.detours import Detour, Detours
from wallnav_ros.navigation.given_path import GivenPath
from wallnav_ros.navigation.localisation import MAP
from wallnav_ros.navigation.watchdogs import Stop
from wallnav_ros.world.geometry import to_child, to_parent

FARTHEST = 1e6         # m; what lies farther off is no place of a robot
AT_HAND = 0.2          # m, within which a sub-goal gives no direction: the one after it does
PATIENCE = 8.0         # s without getting nearer, after which another way is sought
PROGRESS = 0.5         # m that count as getting nearer
GOAL_DRIFT = 0.2       # m that a goal may move in the map before its route is planned anew
PATH_END = 0.5         # m between the end of a path and the goal that it leads to
OUTSIDE = 50.0         # m beyond all walls that a route is still sought
SNAP = np.stack(np.meshgrid(*2 * [np.linspace(-0.4, 0.4, 9)]), axis=-1).reshape(-1, 2)
SNAP = SNAP[np.argsort(np.hypot(*SNAP.T), kind='stable')]


class Guide:
    """
    Holds the goal and the way to it, or why there is none.

    goal: the position (2,) and the name of its frame, or None. ended: the Stop that explains
    why there is none. route: the Route planned, None where no map says anything. replanned: how
    often another one was, the robot being stuck.
    """

    def __init__(self):
        self.ended = Stop('no_goal', 'no goal')
        self._given, self.replanned, self._detours = None, 0, Detours()
        self._drop()

    @property
    def detours(self):
        """Return how often another way was planned because the first one was blocked."""
        return self.replanned + self._detours.count

    def _drop(self):
        self.goal = self.route = self._walls = None
        self._blocking = np.empty((0, 2))
        self._nearest, self._since = np.inf, None
        self._detours.drop()

    def end(self, stop):
        """Drop the goal, `stop` (a Stop) being the reason; returns it."""
        self._drop()
        self.ended, self._given = stop, None
        return stop

    def take_goal(self, position, frame, place):
        """
        Drive to `position` (2,) metres in `frame`, `place` (Localisation) relating the frames.

        Returns None, or why the goal is refused; there is no goal then.
        """
        given = self._given
        refusal = _unusable(position, frame, place)
        if refusal is not None:
            self.refuse(refusal)
            return refusal
        if frame == place.base_frame:
            position, frame = to_parent(place.frame_in_state(frame), position), place.state_frame
        self._drop()
        self.goal, self._given = (np.asarray(position, dtype=float), frame), given
        return None

    def refuse(self, reason):
        """Drop the goal because of `reason`."""
        self.end(Stop('goal_refused', f'goal: {reason}'))

    def take_path(self, points, frame, place):
        """
        Follow `points` (K, 2) metres in `frame`, once they lead to the goal.

        Returns None, or why the path is of no use.
        """
        if not len(points) or not np.isfinite(points).all():
            return 'empty, or a coordinate is not finite'
        if np.abs(points).max() > FARTHEST:
            return f'farther off than {FARTHEST:g} m'
        if place.frame_in_state(frame) is None:
            return f'frame {frame!r} is not known'
        self._given = np.asarray(points, dtype=float), frame
        if self.goal is not None and self._given_path(place, None, 0.0) is None:
            return 'does not lead to the goal'
        return None

    def goal_in_state(self, place):
        """Return the goal (2,) in the state frame, None where its frame is not known now."""
        position, frame = self.goal
        relation = place.frame_in_state(frame)
        return None if relation is None else to_parent(relation, position)

    def needs_route(self, place, walls):
        """Return whether a route is to be planned on `walls`, the map's DistanceField or None."""
        if walls is None or place.state_frame != MAP:
            self.route = None
            return False
        moved = self.route is None or (
            np.hypot(*(self.route.goal - self.goal_in_state(place))) > GOAL_DRIFT)
        return moved or self._walls is not walls

    def plan(self, place, walls, radius):
        """Plan the route on `walls` for a robot of `radius` m; returns why there is none."""
        start = place.newest()
        if _outside(walls, self.goal_in_state(place)) > OUTSIDE:
            return f'more than {OUTSIDE:g} m outside the walls of the map'
        try:
            route = plan_route(_with_points(walls, self._blocking),
                               self.goal_in_state(place), radius)
        except RouteError as error:
            return str(error)
        if start is not None and not np.isfinite(route.to_go(_snap(route, start[:2]))):
            return (f'no way that a robot of {radius:g} m radius fits through leads to it from '
                    f'({start[0]:.2f}, {start[1]:.2f})')
        self.route, self._walls = route, walls
        self._detours.drop()
        return None

    def replan(self, place, walls, radius, blocking):
        """
        Plan a route around `blocking` (K, 2) too, points in the map; returns why there is none.

        What blocked the way is remembered as long as the goal. The route there was stays where
        there is no other.
        """
        self._since = None
        self._blocking = np.vstack((self._blocking, blocking))
        refusal = self.plan(place, walls, radius)
        if refusal is not None:
            self._blocking = np.empty((0, 2))
        self.replanned += refusal is None
        return refusal

    def go_round(self, place, radius, position, discs):
        """
        Leave the route where somebody stands on it, and take it again when that is over.

        position: (2,) of the robot; discs: position (N, 2) and radius (N,) of who stands, all in
        the map. A path that was handed in is its planner's to change.
        """
        way = self.way(place, radius)
        if way is None or isinstance(way, GivenPath):
            return
        before = self._detours.now
        with suppress(RouteError):
            self._detours.seek(self.route, _snap(self.route, position), discs, radius)
        if self._detours.now is not before:
            self._since = None

    def rest(self):
        """Note that the robot stands for another reason than what is in its way."""
        self._since = None

    def way(self, place, radius):
        """Return the GivenPath, Route or Detour to follow, None for straight to the goal."""
        walls = self._walls if self.route is not None else None
        given = self._given_path(place, walls, radius)
        return given or self._detours.now or self.route

    def sub_goal(self, place, radius, position):
        """Return where to head for (2,) from `position` (2,), and the metres beyond it."""
        way = self.way(place, radius)
        if way is None:
            return self.goal_in_state(place), 0.0
        if isinstance(way, GivenPath):
            return way.guide(position)
        route, rest = (way.route, way.rest) if isinstance(way, Detour) else (way, 0.0)
        target, beyond = route.guide(_snap(route, position)[None])
        if beyond[0] and np.hypot(*(target[0] - position)) < AT_HAND:
            target, beyond = route.guide(target)
        return target[0], float(beyond[0]) + rest

    def is_stuck(self, place, radius, position, now):
        """Return whether the robot at `position` (2,) has long not got nearer to its goal."""
        way = self.way(place, radius)
        if way is None or isinstance(way, GivenPath):
            return False
        left = float(way.to_go(_snap(way, position)))
        if self._since is None or left < self._nearest - PROGRESS:
            self._nearest, self._since = left, now
        return now - self._since > PATIENCE

    def _given_path(self, place, walls, radius):
        """Return the GivenPath to the goal, None where there is none."""
        relation = place.frame_in_state(self._given[1]) if self._given else None
        goal = self.goal_in_state(place)
        if relation is None or goal is None:
            return None
        points = to_parent(relation, self._given[0])
        leads = np.hypot(*(points[-1] - goal)) <= PATH_END
        return GivenPath(points, walls, radius) if leads else None


def _unusable(position, frame, place):
    """Return why a goal cannot be used, or None."""
    if not np.isfinite(position).all():
        return 'a coordinate is not finite'
    if np.abs(position).max() > FARTHEST:
        return f'farther off than {FARTHEST:g} m'
    if place.frame_in_state(frame) is not None:
        return None
    hint = ('the robot is not localised (no amcl_pose, no transform)' if frame == MAP
            else f'known frames are {place.state_frame}, {place.odom_frame} and '
                 f'{place.base_frame}')
    return f'frame {frame!r} cannot be related to {place.state_frame}: {hint}'


def _snap(route, position):
    """Return the place nearest to `position` (2,) that `route` leads on from."""
    # A robot may stand nearer to a wall than a route would lead it.
    if np.isfinite(route.to_go(position)):
        return position
    near = position + SNAP
    known = np.isfinite(route.to_go(near))
    return near[known.argmax()] if known.any() else position


def _outside(walls, point):
    """Return how far in metres `point` (2,) lies outside the grid of `walls`."""
    size = np.array(walls.distance.shape[::-1]) * walls.resolution
    local = to_child(walls.pose, point)
    return float(np.maximum(-local, local - size).max())


def _with_points(walls, points):
    """Return the DistanceField `walls` with `points` (K, 2) as walls too."""
    height, width = walls.distance.shape
    cells = np.rint(to_child(walls.pose, points) / walls.resolution).astype(np.intp)
    cells = cells[((cells >= 0) & (cells < (width, height))).all(axis=1)]
    if not len(cells):
        return walls
    free = np.ones((height, width), np.uint8)
    free[cells[:, 1], cells[:, 0]] = 0
    distance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_5) * walls.resolution
    return replace(walls, distance=np.minimum(walls.distance, distance))
