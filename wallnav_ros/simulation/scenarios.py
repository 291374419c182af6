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
Read scenario files, naming file, field and fix of whatever is wrong in them.

Paper section 1 (world); the file format is in docs/scenarios.md.
"""

from functools import lru_cache
import reprlib

import numpy as np
from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.occupancy_map import load_map, MapError
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.simulation.family import Family, KINDS
from wallnav_ros.simulation.free_space import CELL, free_points, within_polygon
from wallnav_ros.simulation.furniture import chair_legs
from wallnav_ros.simulation.scenario import Scenario, ScenarioError
from wallnav_ros.world.files import find_asset
from wallnav_ros.world.walls import Walls
import yaml

PATTERNS = ('walk_to_goal', 'walk_back_and_forth', 'either')
GOALS = ('visible', 'anywhere')
FARTHEST = 200.0   # m that a start or goal may lie from the walls, or a goal from the start
ROBOT_DEFAULTS = {'radius': 0.2, 'preferred_speed': 0.8, 'visible': False, 'berth': 0.0}
AGENT_DEFAULTS = {'radius': [0.1, 0.5], 'speed': [0.3, 1.5], 'pattern': 'walk_back_and_forth',
                  'spawn': 'free', 'goal': 'visible'}


@lru_cache(maxsize=32)
def load_scenario(name):
    """
    Load a Scenario, or a Family of them, by file or by the short name it is shipped under.

    Raises ScenarioError (one line: file, field, fix) or FileNotFoundError.
    """
    path = find_asset('scenarios', str(name), '.yaml')
    try:
        document = yaml.load(path.read_text(), _PlainLoader)
    # ValueError: not UTF-8, or a date such as 2026-13-01; RecursionError: nested too deeply.
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ScenarioError(f'{path}: not valid YAML: {" ".join(str(error).split())}') from None
    if not isinstance(document, dict):
        raise ScenarioError(f'{path}: expected a mapping with name, walls or map, robot, cases')
    reader = _Reader(path, document)
    return reader.family() if 'family' in document else reader.scenario()


class _PlainLoader(yaml.SafeLoader):
    """Safe YAML without aliases: nested ones grow a small file beyond all memory."""

    def compose_node(self, parent, index):
        """Compose a node that is written out."""
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError('aliases (*name) are not supported; write it out')
        return super().compose_node(parent, index)


class _Reader:
    """Turns one parsed document into a Scenario, naming the field of the first fault."""

    def __init__(self, path, document):
        self.path = path
        self.document = document

    def scenario(self):
        """Return the validated Scenario."""
        self._known(self.document, '', {'name', 'map', 'walls', 'furniture', 'chairs', 'robot',
                                        'time_limit', 'cases', 'agents'})
        name = self.document.get('name', self.path.stem)
        if not (isinstance(name, str) and name.strip()):
            self._fail('name', 'expected a short name')
        polygons, mapped, map_path, walls = self._walls()
        robot = {**ROBOT_DEFAULTS, **self._section('robot')}
        self._known(robot, 'robot.', {'start', 'goal', *ROBOT_DEFAULTS})
        if not isinstance(robot['visible'], bool):
            self._fail('robot.visible', 'expected true or false')
        start = self._numbers('robot.start', robot.get('start'), 3)
        goal = self._numbers('robot.goal', robot.get('goal'), 2)
        radius = self._positive('robot.radius', robot['radius'])
        field, free = self._space(walls, start[:2], goal, radius)
        agents = self._agents()
        return Scenario(
            name=name, path=self.path, polygons=polygons, mapped=mapped, map_path=map_path,
            walls=walls, field=field, start=start, goal=goal, radius=radius,
            preferred_speed=self._positive('robot.preferred_speed', robot['preferred_speed']),
            visible=robot['visible'], berth=self._berth(robot['berth']),
            time_limit=self._positive('time_limit', self.document.get('time_limit', 45.0)),
            cases=self._cases(), agents=agents, free=free, spawn=self._spawn(agents, free))

    def family(self):
        """Return the validated Family."""
        self._known(self.document, '', {'name', 'family', 'robot', 'time_limit'})
        family = {'kinds': list(KINDS), 'width': [1.2, 5.0], **self._section('family')}
        self._known(family, 'family.', {'kinds', 'width'})
        kinds = family['kinds']
        if not (isinstance(kinds, list) and kinds and all(kind in KINDS for kind in kinds)):
            self._fail('family.kinds', f'choose some of {", ".join(KINDS)}')
        width = self._numbers('family.width', family['width'], 2)
        if not 1.0 <= width[0] <= width[1] <= 10.0:
            self._fail('family.width', 'expected [low, high] with 1 <= low <= high <= 10 m')
        robot = self._section('robot')
        self._known(robot, 'robot.', set(ROBOT_DEFAULTS))
        name = str(self.document.get('name', self.path.stem))
        shared = {key: self.document[key] for key in ('robot', 'time_limit')
                  if key in self.document}
        return Family(name, self.path, tuple(kinds), tuple(width), {'name': name, **shared},
                      lambda path, document: _Reader(path, document).scenario())

    def _walls(self):
        if ('map' in self.document) == ('walls' in self.document):
            self._fail('walls', 'give exactly one of walls (polygons in metres) and map')
        if 'map' in self.document:
            for key in {'furniture', 'chairs'} & set(self.document):
                self._fail(key, 'needs walls as polygons; draw it into the map instead')
            name = self.document['map']
            if not isinstance(name, str):
                self._fail('map', 'expected the path of a map YAML file')
            beside = self.path.parent / name
            try:
                map_path = beside if beside.is_file() else find_asset('maps', name, '.yaml')
                return (), 0, map_path, extract_walls(load_map(map_path)).walls
            except (FileNotFoundError, MapError) as error:
                self._fail('map', error)
        polygons = self._polygons('walls')
        mapped = len(polygons)
        polygons += self._polygons('furniture')
        chairs = self.document.get('chairs', [])
        if not isinstance(chairs, list):
            self._fail('chairs', 'expected a list of [x, y, yaw]')
        for number, chair in enumerate(chairs):
            polygons += chair_legs(self._numbers(f'chairs[{number}]', chair, 3))
        return polygons, mapped, None, Walls.from_polylines(polygons, closed=True)

    def _polygons(self, key):
        """Return the polygons, tuple of (K, 2), that `key` lists."""
        try:
            polygons = tuple(np.asarray(polygon, dtype=float)
                             for polygon in self.document.get(key, ()))
            Walls.from_polylines(polygons, closed=True)
            return polygons
        except (TypeError, ValueError, OverflowError) as error:
            self._fail(key, f'expected a list of polygons [[x, y], ...] in metres ({error})')

    def _space(self, walls, start, goal, radius):
        """Return the DistanceField and the free points, having checked the robot's task."""
        near = walls.segments.reshape(-1, 2) if len(walls) else start[None]
        for key, point in (('start', start), ('goal', goal)):
            if not np.abs(near - point).max(axis=1).min() < FARTHEST:
                self._fail(f'robot.{key}', f'more than {FARTHEST:.0f} m away; units are metres')
        try:
            field = distance_field(walls)
        except ValueError as error:
            self._fail('map' if 'map' in self.document else 'walls', error)
        free = free_points(walls, field, start, goal)
        if not len(free) or walls.distance(start[None])[0] <= radius:
            self._fail('robot.start', 'lies in or against a wall; move it into free space')
        # Agents stay between the walls; the robot may also go round the outside of them all.
        reach = np.vstack((free, free_points(walls, field, start, goal, margin=1.0)))
        missed = np.abs(reach - goal).max(axis=1).min() > CELL
        if missed or walls.distance(goal[None])[0] <= radius:
            self._fail('robot.goal', 'lies in or against a wall, or walls part it from the start')
        return field, free

    def _berth(self, value):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < 10:
            self._fail('robot.berth', f'expected metres, 0 or more, got {reprlib.repr(value)}')
        return float(value)

    def _cases(self):
        cases = self._section('cases')
        if not cases:
            self._fail('cases', 'name at least one case, such as none: {static: 0, dynamic: 0}')
        for case, counts in cases.items():
            field = f'cases.{case}'
            if not isinstance(counts, dict):
                self._fail(field, 'expected {static: n, dynamic: n}')
            self._known(counts, f'{field}.', {'static', 'dynamic'})
            for kind, count in counts.items():
                if isinstance(count, bool) or not isinstance(count, int) or count < 0:
                    self._fail(f'{field}.{kind}', 'expected a whole number, 0 or more')
        return cases

    def _agents(self):
        agents = {**AGENT_DEFAULTS, **self._section('agents')}
        self._known(agents, 'agents.', set(AGENT_DEFAULTS))
        for key in ('radius', 'speed'):
            agents[key] = self._numbers(f'agents.{key}', agents[key], 2)
            if not 0.0 < agents[key][0] <= agents[key][1]:
                self._fail(f'agents.{key}', 'expected [low, high] with 0 < low <= high')
        for key, choices in (('pattern', PATTERNS), ('goal', GOALS)):
            if agents[key] not in choices:
                self._fail(f'agents.{key}', f'choose one of {", ".join(choices)}')
        return agents

    def _spawn(self, agents, free):
        if agents['spawn'] == 'free':
            return ()
        if not agents['spawn']:
            self._fail('agents.spawn', 'expected free or a list of polygons [[x, y], ...]')
        try:
            polygons = [np.asarray(polygon, dtype=float).reshape(-1, 2)
                        for polygon in agents['spawn']]
        except (TypeError, ValueError, OverflowError):
            self._fail('agents.spawn', 'expected free or a list of polygons [[x, y], ...]')
        spawn = tuple(free[within_polygon(free, polygon)] for polygon in polygons)
        for number, points in enumerate(spawn):
            if not len(points):
                self._fail(f'agents.spawn[{number}]', 'holds no point that the robot can reach')
        return spawn

    def _section(self, key):
        section = self.document.get(key, {})
        if not isinstance(section, dict):
            self._fail(key, 'expected a mapping')
        return section

    def _numbers(self, field, value, count):
        try:
            numbers = np.asarray(value, dtype=float)
        except (TypeError, ValueError, OverflowError):
            numbers = np.empty(0)
        if numbers.shape != (count,) or not np.isfinite(numbers).all():
            self._fail(field, f'expected {count} finite numbers, got {reprlib.repr(value)}')
        return numbers

    def _positive(self, field, value):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value < 1e6:
            self._fail(field, f'expected a positive number, got {reprlib.repr(value)}')
        return float(value)

    def _known(self, section, prefix, known):
        for key in section:
            if key not in known:
                self._fail(f'{prefix}{key}', f'unknown; known are {", ".join(sorted(known))}')

    def _fail(self, field, fix):
        raise ScenarioError(' '.join(f'{self.path}: {field}: {fix}'.split()))
