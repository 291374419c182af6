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
Worlds drawn from a seed: corridors, bends, curves, junctions, doors and halls with pillars.

What a policy must have met to serve maps it has never seen (docs/scenarios.md).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from zlib import crc32

import numpy as np
from shapely import affinity
from shapely.geometry import box, LineString, MultiPolygon, Point
from shapely.ops import unary_union
from wallnav_ros.simulation.scenario import check_case

KINDS = ('corridor', 'bend', 'curve', 'junction', 'door', 'hall')
END_ROOM = 1.0         # m, between the robot's start or goal and the end of its way
FLOOR_PER_AGENT = 4.0  # m^2, at least, so that a crowd can move
MOST_AGENTS = 12


@dataclass(frozen=True, eq=False)
class Family:
    """
    A scenario whose world is drawn from the episode's seed; stands where a Scenario may.

    kinds, width: as in `draw_world`. document: what its worlds share, as a scenario document.
    build: turns (path, document) into a Scenario.
    """

    name: str
    path: Path
    kinds: tuple
    width: tuple
    document: dict
    build: Callable

    cases = ('none', 'static', 'dynamic', 'mixed')

    def counts(self, case):
        """Return the most agents that stand and walk in `case`; ScenarioError lists the cases."""
        check_case(self, case)
        return {'none': (0, 0), 'static': (MOST_AGENTS // 2, 0), 'dynamic': (0, MOST_AGENTS),
                'mixed': (MOST_AGENTS // 3, MOST_AGENTS // 2)}[case]

    def seen(self, visible):
        """Return this Family with a robot that is `visible` to the crowd, or is not."""
        robot = self.document.get('robot', {}) | {'visible': visible}
        return replace(self, document=self.document | {'robot': robot})

    def at(self, seed):
        """Return the Scenario of `seed`, the same whoever asks and whenever."""
        return _world(self, int(seed))


@lru_cache(maxsize=64)
def _world(family, seed):
    rng = np.random.default_rng((seed, crc32(family.name.encode())))
    world = draw_world(family.kinds, family.width, rng)
    robot = family.document.get('robot', {}) | world.pop('robot')
    return family.build(family.path, family.document | world | {'robot': robot})


def draw_world(kinds, width, rng):
    """
    Return a world as the `walls`, `robot`, `cases` and `agents` of a scenario document.

    kinds: some of KINDS. width: (low, high) m of ways, doors a little narrower. Coordinates are
    metres in a frame turned at random, so that nothing lies along the axes.
    """
    kind = kinds[rng.integers(len(kinds))]
    breadth = rng.uniform(*width)
    floor, way = _SHAPES[kind](breadth, rng)
    turn = rng.uniform(0.0, 360.0)
    floor, way = (affinity.rotate(shape, turn, origin=(0.0, 0.0)) for shape in (floor, way))
    if isinstance(floor, MultiPolygon):
        floor = max(floor.geoms, key=lambda part: part.area)
    ends = [way.interpolate(END_ROOM), way.interpolate(way.length - END_ROOM)]
    if rng.random() < 0.5:
        ends.reverse()
    start, goal = ([end.x, end.y] for end in ends)
    yaw = np.arctan2(goal[1] - start[1], goal[0] - start[0]) + rng.uniform(-1.0, 1.0)
    rings = [floor.exterior, *floor.interiors]
    most = int(min(MOST_AGENTS, floor.area / FLOOR_PER_AGENT))
    # In a narrow way nobody is so wide that the robot could not pass beside them.
    widest = float(np.clip(0.5 * (breadth - 1.0), 0.12, 0.5))
    return {
        'walls': [np.round(ring.coords[:-1], 4).tolist() for ring in rings],
        'robot': {'start': [*start, float(yaw)], 'goal': goal},
        'cases': {'none': {},
                  'static': {'static': int(rng.integers(1, max(2, most // 2 + 1)))},
                  'dynamic': {'dynamic': int(rng.integers(1, max(2, most)))},
                  'mixed': {'static': int(rng.integers(1, max(2, most // 3 + 1))),
                            'dynamic': int(rng.integers(1, max(2, most // 2 + 1)))}},
        'agents': {'radius': [0.1, widest], 'speed': [0.3, 1.5], 'pattern': 'either',
                   'goal': 'visible'},
    }


def _corridor(width, rng):
    return _along(LineString([(0.0, 0.0), (rng.uniform(8.0, 14.0), 0.0)]), width)


def _bend(width, rng):
    first, second = rng.uniform(3.0, 6.0, 2)
    angle = rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 1.4)
    corner = np.array([first + width / 2.0, 0.0])
    end = corner + (second + width / 2.0) * np.array([np.cos(angle), np.sin(angle)])
    return _along(LineString([(0.0, 0.0), corner, end]), width)


def _curve(width, rng):
    radius = rng.uniform(max(2.5, 0.6 * width), 14.0)
    angle = np.linspace(0.0, min(rng.uniform(6.0, 12.0) / radius, 2.5), 25)
    points = radius * np.stack((np.sin(angle), 1.0 - np.cos(angle)), axis=1)
    points[:, 1] *= rng.choice([-1.0, 1.0])
    return _along(LineString(points), width)


def _junction(width, rng):
    half = rng.uniform(5.0, 7.0)
    main = LineString([(-half, 0.0), (half, 0.0)])
    side = LineString([(0.0, rng.choice([0.0, -half])), (rng.uniform(-2.0, 2.0), half)])
    floor = unary_union([_along(main, width)[0], _along(side, rng.uniform(1.2, 4.0))[0]])
    if rng.random() < 0.5:
        return floor, main
    return floor, LineString([(-half + 1.0, 0.0), (0.0, 0.0), side.interpolate(half - 1.0)])


def _door(width, rng):
    depth, height = rng.uniform(4.0, 6.0), rng.uniform(4.0, 7.0)
    gap = max(1.0, 0.6 * min(width, 3.0))
    offset = rng.uniform(-0.5, 0.5) * (height - gap)
    floor = unary_union([
        box(-depth, -height / 2.0, -0.1, height / 2.0),
        box(0.1, -height / 2.0, depth, height / 2.0),
        box(-0.2, offset - gap / 2.0, 0.2, offset + gap / 2.0)])
    far = rng.uniform(-0.3, 0.3, 2) * height
    return floor, LineString([(-depth, far[0]), (0.0, offset), (depth, far[1])])


def _hall(width, rng):
    length, breadth = rng.uniform(8.0, 13.0), rng.uniform(5.0, 9.0)
    floor = box(0.0, -breadth / 2.0, length, breadth / 2.0)
    way = LineString([(0.0, rng.uniform(-0.3, 0.3) * breadth),
                      (length, rng.uniform(-0.3, 0.3) * breadth)])
    ends = [way.interpolate(END_ROOM), way.interpolate(way.length - END_ROOM)]
    for _ in range(rng.integers(1, 7)):
        x, y = rng.uniform(1.5, length - 1.5), rng.uniform(-0.45, 0.45) * breadth
        size = rng.uniform(0.1, 0.9)
        pillar = Point(x, y).buffer(size / 2.0, quad_segs=3) if rng.random() < 0.4 else (
            affinity.rotate(box(x - size, y - size / 3.0, x + size, y + size / 3.0),
                            rng.uniform(0.0, 180.0)))
        # Pillars leave room to pass to each other, to the walls and to the robot's task.
        room = 0.5 * min(width, 2.0) + 0.3
        if min(pillar.distance(other) for other in (floor.boundary, *ends)) > room:
            floor = floor.difference(pillar)
    return floor, way


def _along(way, width):
    return way.buffer(width / 2.0, cap_style='flat', join_style='mitre'), way


_SHAPES = dict(zip(KINDS, (_corridor, _bend, _curve, _junction, _door, _hall)))
