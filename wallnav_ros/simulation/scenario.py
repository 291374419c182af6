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
A scenario: a world, a robot's task and the cases that people it.

Paper section 1 (world); read from files by `simulation.scenarios`.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from wallnav_ros.mapping.map_writer import write_map
from wallnav_ros.mapping.route import plan_route, RouteError
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import nearest_on_segments
from wallnav_ros.world.walls import Walls

ROUTE_RADII = 0.05     # m, between the robot radii that routes are planned for
OPEN_MAP = 10.0        # m that the map of a world without walls holds around start and goal


class ScenarioError(ValueError):
    """A scenario file that cannot be used; one line naming file, field and fix."""


@dataclass(frozen=True, eq=False)
class Scenario:
    """
    A validated scenario file.

    name: short name; path: the file it came from.
    polygons: tuple of (K, 2) closed walls in metres, empty when the walls come from a map; the
    first `mapped` of them are on the robot's map, the rest is furniture.
    map_path: path of the map's YAML, or None.
    walls, field: the walls as segments and as distances, in the `map` frame.
    start: (3,) robot pose; goal: (2,); radius, preferred_speed: robot; visible: to the crowd,
    which then leaves `berth` m around it.
    time_limit: seconds.
    cases: {case: {'static': n, 'dynamic': n}}.
    agents: the `agents` section with defaults filled in.
    free: (P, 2) points the robot could reach; spawn: the free points of each spawn polygon.
    """

    name: str
    path: Path
    polygons: tuple
    mapped: int
    map_path: Path
    walls: Walls
    field: DistanceField
    start: np.ndarray
    goal: np.ndarray
    radius: float
    preferred_speed: float
    visible: bool
    berth: float
    time_limit: float
    cases: dict
    agents: dict
    free: np.ndarray
    spawn: tuple

    def at(self, seed):
        """Return the Scenario of episode `seed`: itself, where a Family draws one."""
        return self

    def seen(self, visible):
        """Return this Scenario with a robot that is `visible` to the crowd, or is not."""
        return _seen(self, visible)

    def counts(self, case):
        """Return how many agents stand and walk in `case`; ScenarioError lists the cases."""
        check_case(self, case)
        return self.cases[case].get('static', 0), self.cases[case].get('dynamic', 0)

    def wall_distances(self, points):
        """
        Return how far (P,) the nearest and (P,) the farthest wall is from `points` (P, 2), in m.

        The farthest is algorithm 2's d_max: each polygon counts by its nearest point. Walls from
        a map are one whole, so there it exceeds its limit only where the robot has left the map.
        """
        gap = nearest_on_segments(points, self.walls.segments) - points[:, None]
        distance = np.sqrt(np.einsum('...i,...i->...', gap, gap))
        nearest = distance.min(axis=1)
        if not self.polygons:
            return nearest, nearest
        return nearest, np.minimum.reduceat(distance, self._polygon_starts, axis=1).max(axis=1)

    def route(self, radius):
        """Return the Route to the goal for a robot of `radius` m, or None: it fits nowhere."""
        return _route(self, ROUTE_RADII * float(np.ceil(np.round(radius / ROUTE_RADII, 6))))

    def draw_map(self, path, resolution=0.05):
        """
        Write a map of the walls without the furniture to `path` (.yaml), its image beside it.

        Polygons are solid, those of two points thin walls. Raises ScenarioError where one cannot
        be drawn.
        """
        mapped = self.polygons[:self.mapped]
        ends = np.vstack((self.start[:2], self.goal))
        bounds = None if mapped else (*(ends.min(axis=0) - OPEN_MAP),
                                      *(ends.max(axis=0) + OPEN_MAP))
        try:
            write_map(path, [polygon for polygon in mapped if len(polygon) > 2],
                      [polygon for polygon in mapped if len(polygon) == 2], bounds, resolution)
        except ValueError as error:
            raise ScenarioError(f'{self.path}: walls: {error}') from None

    @cached_property
    def _polygon_starts(self):
        sizes = [len(polygon) for polygon in self.polygons]
        return np.cumsum([0, *sizes[:-1]])


def check_case(scenario, case):
    """Raise ScenarioError, which lists the cases, where a Scenario or Family has no `case`."""
    if case not in scenario.cases:
        raise ScenarioError(f'{scenario.path}: cases: no case {case!r}, '
                            f'choose one of {", ".join(scenario.cases)}')


@lru_cache(maxsize=64)
def _seen(scenario, visible):
    return replace(scenario, visible=visible)


@lru_cache(maxsize=64)
def _route(scenario, radius):
    try:
        return plan_route(scenario.field, scenario.goal, radius)
    except RouteError:
        return None
