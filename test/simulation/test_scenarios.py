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
Scenario files: the paper's two paths as they should be, and every fault in one line.

Paper section 1; docs/scenarios.md describes the format.
"""

import copy

import numpy as np
import pytest
from refusals import refusal_of
from wallnav_ros.mapping.map_writer import write_map
from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.simulation.scenarios import load_scenario
import yaml

CASES = ('none', 'static', 'dynamic', 'mixed')
SQUARE = [[2.0, -1.0], [3.0, -1.0], [3.0, 1.0], [2.0, 1.0]]
PLAIN = {
    'name': 'plain', 'walls': [SQUARE, [[-5, -5], [-5, 5], [-5.1, 0]]],
    'robot': {'start': [0.0, 0.0, 0.0], 'goal': [0.0, 3.0]},
    'cases': {'none': {}, 'busy': {'static': 1, 'dynamic': 2}},
}


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a document, or text, as a scenario file."""
    def write(document, name='scenario.yaml'):
        path = tmp_path / name
        path.write_text(document if isinstance(document, str) else yaml.safe_dump(document))
        return path
    return write


def changed(field, value):
    """Return PLAIN with the dotted `field` set to `value`, or removed where that is None."""
    document = copy.deepcopy(PLAIN)
    *parents, last = field.split('.')
    section = document
    for parent in parents:
        section = section.setdefault(parent, {})
    section[last] = value
    if value is None:
        del section[last]
    return document


def refusal(path):
    """Return the line with which `path` is refused, less the file's name."""
    line = refusal_of(ScenarioError, load_scenario, path)
    assert len(line) < 400
    return line


def test_the_curve_path_is_that_of_the_paper():
    scenario = load_scenario('curve_path')

    assert scenario.start == pytest.approx([4.0, -4.0, 0.75 * np.pi], abs=1e-6)
    assert scenario.goal.tolist() == [-4.0, 4.0]
    assert (scenario.radius, scenario.preferred_speed, scenario.time_limit) == (0.2, 0.8, 45.0)
    assert scenario.visible is False
    assert {case: scenario.counts(case) for case in CASES} == {
        'none': (0, 0), 'static': (8, 0), 'dynamic': (0, 8), 'mixed': (3, 5)}


def test_the_curves_walls_are_arcs_of_10_and_15_m_about_one_centre():
    scenario = load_scenario('curve_path')
    angles = np.linspace(0.01, 0.5 * np.pi - 0.01, 300)
    around = np.stack((np.cos(angles), np.sin(angles)), axis=-1)

    for radius in (10.0, 15.0):
        on_arc = np.array([-8.0, -8.0]) + radius * around
        assert scenario.walls.distance(on_arc).max() < 0.004
    # Half way between the arcs both are 2.5 m away.
    middle = np.array([-8.0, -8.0]) + 12.5 * around
    assert scenario.walls.distance(middle) == pytest.approx(np.full(300, 2.5), abs=0.004)


def test_the_cross_path_is_that_of_the_paper():
    scenario = load_scenario('cross_path')

    assert scenario.start == pytest.approx([0.0, -4.0, 0.5 * np.pi], abs=1e-6)
    assert scenario.goal.tolist() == [0.0, 4.0]
    assert {case: scenario.counts(case) for case in CASES} == {
        'none': (0, 0), 'static': (15, 0), 'dynamic': (0, 8), 'mixed': (5, 10)}
    assert len(scenario.polygons) == 4


def test_the_crosss_arms_are_four_metres_wide_and_reach_to_six():
    walls = load_scenario('cross_path').walls

    # The corners of the blocks, and the middle of the junction: 2 sqrt(2) from all four.
    corners = [[x, y] for x in (-2.0, 2.0) for y in (-2.0, 2.0)]
    assert walls.distance(corners) == pytest.approx(np.zeros(4))
    assert walls.distance([[0.0, 0.0]]) == pytest.approx([2.0 * np.sqrt(2.0)])
    # Along an arm the walls are 2 m away to both sides, out to its end.
    along = [[3.0, 0.0], [5.9, 0.0], [0.0, -5.9], [-4.0, 0.0]]
    assert walls.distance(along) == pytest.approx(np.full(4, 2.0))
    assert np.abs(walls.segments).max() == 6.0


@pytest.mark.parametrize('name', ['curve_path', 'cross_path'])
def test_agents_of_the_paths_are_those_of_table_1(name):
    agents = load_scenario(name).agents

    assert agents['radius'].tolist() == [0.1, 0.5]
    assert agents['speed'].tolist() == [0.3, 1.5]
    assert agents['pattern'] == 'either'


def test_walking_agents_of_the_cross_start_near_the_ends_of_its_arms():
    regions = load_scenario('cross_path').spawn

    assert len(regions) == 4
    for points in regions:
        assert (np.abs(points).max(axis=1) >= 4.0).all()
        assert (np.abs(points).min(axis=1) <= 2.0).all()


@pytest.mark.parametrize('name', ['curve_path', 'cross_path'])
def test_free_space_is_inside_the_corridor(name):
    scenario = load_scenario(name)

    assert (scenario.walls.distance(scenario.free) > 0.1).all()
    if name == 'curve_path':
        from_centre = np.linalg.norm(scenario.free + 8.0, axis=1)
        assert ((from_centre > 10.0) & (from_centre < 15.0)).all()
    else:
        assert (np.abs(scenario.free).min(axis=1) < 2.0).all()


@pytest.mark.parametrize('name', ['curve_path', 'cross_path'])
def test_the_field_agrees_with_the_walls(name, rng):
    scenario = load_scenario(name)
    points = scenario.free[rng.integers(len(scenario.free), size=500)]

    assert scenario.field.at(points) == pytest.approx(scenario.walls.distance(points), abs=0.01)


def test_the_farthest_wall_counts_each_polygon_by_its_nearest_point():
    scenario = load_scenario('cross_path')

    # From (0, -4) the nearest points of the far blocks are their corners (+-2, 2).
    nearest, farthest = scenario.wall_distances(np.array([[0.0, -4.0], [0.5, 0.0]]))
    assert nearest == pytest.approx([2.0, np.hypot(1.5, 2.0)])
    assert farthest == pytest.approx([np.hypot(2.0, 6.0), np.hypot(2.5, 2.0)])


def test_what_a_file_leaves_out_has_the_papers_defaults(write):
    scenario = load_scenario(write(PLAIN))

    assert scenario.name == 'plain'
    assert (scenario.radius, scenario.preferred_speed, scenario.time_limit) == (0.2, 0.8, 45.0)
    assert scenario.visible is False
    assert scenario.counts('none') == (0, 0)
    assert scenario.agents['radius'].tolist() == [0.1, 0.5]
    assert scenario.spawn == ()


def test_a_file_without_a_name_is_called_after_itself(write):
    assert load_scenario(write(changed('name', None), 'lobby.yaml')).name == 'lobby'


def test_an_open_world_has_free_space_about_the_robot_and_its_goal(write):
    scenario = load_scenario(write({**PLAIN, 'walls': [], 'robot': {
        'start': [100.0, 0.0, 0.0], 'goal': [120.0, 0.0]}}))

    assert len(scenario.walls) == 0
    low, high = scenario.free.min(axis=0), scenario.free.max(axis=0)
    assert low == pytest.approx([90.0, -10.0], abs=0.11)
    assert high == pytest.approx([120.0, 10.0], abs=0.11)


def test_a_robot_may_drive_past_a_single_wall(write):
    scenario = load_scenario(write({**PLAIN, 'walls': [SQUARE], 'robot': {
        'start': [0.0, 0.0, 0.0], 'goal': [5.0, 0.5]}}))

    assert len(scenario.free)


def test_walls_may_come_from_a_map_beside_the_file(write, tmp_path):
    write_map(tmp_path / 'square.yaml', [np.array(SQUARE)], bounds=(-5, -5, 5, 5))
    document = {**changed('walls', None), 'map': 'square.yaml'}

    scenario = load_scenario(write(document))

    assert scenario.map_path == tmp_path / 'square.yaml'
    assert scenario.polygons == ()
    # The square's edges lie between cells of 0.05 m, so the map moves no wall.
    points = np.array([[0.0, 0.0], [2.5, 3.0], [3.5, 1.5]])
    assert scenario.walls.distance(points) == pytest.approx([2.0, 2.0, np.hypot(0.5, 0.5)],
                                                            abs=1e-6)
    # A map is one whole: its farthest wall is its nearest.
    assert scenario.wall_distances(points[:1])[1] == pytest.approx([2.0])


def test_an_unknown_name_lists_the_shipped_scenarios():
    with pytest.raises(FileNotFoundError, match='nowhere: no such file.*cross_path, curve_path'):
        load_scenario('nowhere')


def test_an_unknown_case_lists_the_cases():
    with pytest.raises(ScenarioError, match="cases: no case 'full', choose one of none, static"):
        load_scenario('cross_path').counts('full')


@pytest.mark.parametrize('text', [
    'walls: [', 'a: 2026-13-01', '\x00', '[' * 500, 'key: *unknown'], ids=range(5))
def test_text_that_is_not_yaml_is_refused(write, text):
    assert refusal(write(text)).startswith('not valid YAML')


def test_aliases_are_refused_before_they_grow(write):
    """Nine lists of nine of the last: a billion numbers from 300 characters."""
    lists = ['&a [1, 1, 1, 1, 1, 1, 1, 1, 1]']
    lists += [f'&{name} [{", ".join(["*" + last] * 9)}]'
              for last, name in zip('abcdefgh', 'bcdefghi')]

    line = refusal(write('walls: [' + ', '.join(lists) + ']'))

    assert line == 'not valid YAML: aliases (*name) are not supported; write it out'


def test_bytes_that_are_not_text_are_refused(tmp_path):
    path = tmp_path / 'image.yaml'
    path.write_bytes(bytes(range(128, 256)))

    assert refusal(path).startswith('not valid YAML')


@pytest.mark.parametrize('text', ['', '- 1', 'just text', '3'])
def test_a_document_that_is_no_mapping_is_refused(write, text):
    assert refusal(write(text)).startswith('expected a mapping')


@pytest.mark.parametrize('field, value, line', [
    ('wals', [], 'wals: unknown; known are agents, cases'),
    ('name', 7, 'name: expected a short name'),
    ('name', '  ', 'name: expected a short name'),
    ('walls', None, 'walls: give exactly one of walls (polygons in metres) and map'),
    ('map', 'm.yaml', 'walls: give exactly one of walls (polygons in metres) and map'),
    ('walls', 5, 'walls: expected a list of polygons'),
    ('walls', 'square', 'walls: expected a list of polygons'),
    ('walls', [[[0, 0]]], 'walls: expected a list of polygons [[x, y], ...] in metres (wall 0'),
    ('walls', [SQUARE, [[0, 0, 1], [1, 1, 1]]], 'walls: expected a list of polygons'),
    ('walls', [[[0, 0], [0, float('nan')]]], 'walls: expected a list of polygons'),
    ('walls', [SQUARE, [[1e7, 0], [1e7, 1]]], 'walls: walls span'),
    ('robot', None, 'robot.start: expected 3 finite numbers, got None'),
    ('robot', 'fast', 'robot: expected a mapping'),
    ('robot.colour', 'red', 'robot.colour: unknown; known are berth, goal'),
    ('robot.start', [0, 0], 'robot.start: expected 3 finite numbers, got [0, 0]'),
    ('robot.start', [0, 0, float('inf')], 'robot.start: expected 3 finite numbers'),
    ('robot.start', [0, 0, 10 ** 400], 'robot.start: expected 3 finite numbers'),
    ('walls', [[[0, 0], [0, 10 ** 400]]], 'walls: expected a list of polygons'),
    ('agents.spawn', [[[0, 0], [0, 10 ** 400]]], 'agents.spawn: expected free or a list'),
    ('robot.start', ['here', 0, 0], 'robot.start: expected 3 finite numbers'),
    ('robot.start', [2.5, 0, 0], 'robot.goal: lies in or against a wall, or walls part it'),
    ('robot.start', [1.9, 0, 0], 'robot.start: lies in or against a wall; move it'),
    ('robot.start', [1e5, 0, 0], 'robot.start: more than 200 m away'),
    ('robot.goal', None, 'robot.goal: expected 2 finite numbers, got None'),
    ('robot.goal', [1e300, 0], 'robot.goal: more than 200 m away'),
    ('robot.goal', [2.5, 0.0], 'robot.goal: lies in or against a wall, or walls part it'),
    ('robot.goal', [1.85, 0.0], 'robot.goal: lies in or against a wall, or walls part it'),
    ('robot.radius', 0, 'robot.radius: expected a positive number, got 0'),
    ('robot.radius', True, 'robot.radius: expected a positive number, got True'),
    ('robot.preferred_speed', -0.8, 'robot.preferred_speed: expected a positive number'),
    ('robot.preferred_speed', 'fast', 'robot.preferred_speed: expected a positive number'),
    ('robot.visible', 1, 'robot.visible: expected true or false'),
    ('time_limit', float('nan'), 'time_limit: expected a positive number, got nan'),
    ('cases', None, 'cases: name at least one case'),
    ('cases', {}, 'cases: name at least one case'),
    ('cases', ['none'], 'cases: expected a mapping'),
    ('cases.busy', 5, 'cases.busy: expected {static: n, dynamic: n}'),
    ('cases.busy.static', -1, 'cases.busy.static: expected a whole number, 0 or more'),
    ('cases.busy.static', 1.5, 'cases.busy.static: expected a whole number, 0 or more'),
    ('cases.busy.static', True, 'cases.busy.static: expected a whole number, 0 or more'),
    ('cases.busy.flying', 1, 'cases.busy.flying: unknown; known are dynamic, static'),
    ('agents.size', 1, 'agents.size: unknown; known are goal, pattern, radius, spawn, speed'),
    ('agents.radius', [0.5, 0.1], 'agents.radius: expected [low, high] with 0 < low <= high'),
    ('agents.radius', 0.3, 'agents.radius: expected 2 finite numbers, got 0.3'),
    ('agents.speed', [0.0, 1.0], 'agents.speed: expected [low, high] with 0 < low <= high'),
    ('agents.pattern', 'fly', 'agents.pattern: choose one of walk_to_goal, walk_back_and_forth'),
    ('agents.goal', 'home', 'agents.goal: choose one of visible, anywhere'),
    ('agents.spawn', 'anywhere', 'agents.spawn: expected free or a list of polygons'),
    ('agents.spawn', [], 'agents.spawn: expected free or a list of polygons'),
    ('agents.spawn', [[[40, 40], [41, 40], [41, 41]]],
     'agents.spawn[0]: holds no point that the robot can reach'),
])
def test_a_fault_is_named_by_file_field_and_fix(write, field, value, line):
    assert refusal(write(changed(field, value))).startswith(line)


def test_a_goal_behind_closed_walls_is_refused(write):
    ring = [[-2, -2], [2, -2], [2, 2], [-2, 2]]

    line = refusal(write({**PLAIN, 'walls': [ring, SQUARE]}))

    assert line == 'robot.goal: lies in or against a wall, or walls part it from the start'


@pytest.mark.parametrize('name, line', [
    (7, 'map: expected the path of a map YAML file'),
    ('none.yaml', 'map: none.yaml: no such file, nor one of the shipped maps'),
    ('broken.yaml', 'map: '),
])
def test_a_map_that_cannot_be_read_is_refused(write, tmp_path, name, line):
    (tmp_path / 'broken.yaml').write_text('image: gone.png\nresolution: 0.05\n')

    assert refusal(write({**changed('walls', None), 'map': name})).startswith(line)


@pytest.mark.parametrize('name', ['cross_path', 'family'])
def test_a_world_may_be_had_with_a_robot_that_people_see(name):
    world = load_scenario(name)

    assert not world.at(3).visible
    assert world.seen(True).at(3).visible
    assert not world.seen(True).seen(False).at(3).visible
    assert (world.seen(True).at(3).walls.segments == world.at(3).walls.segments).all()
    assert world.at(3) is world.at(3)


def test_chairs_and_furniture_stand_in_the_world_but_not_on_the_map(write):
    scenario = load_scenario(write(changed('chairs', [[0.5, 0.5, 0.0]])))
    assert scenario.mapped == len(PLAIN['walls'])
    assert len(scenario.polygons) == scenario.mapped + 4
    # The outer edge of a leg, 0.2 m from the middle of the seat and 1.5 cm further.
    legs = np.concatenate(scenario.polygons[scenario.mapped:])
    np.testing.assert_allclose(np.abs(legs - 0.5).max(axis=0), 0.215)


def drawn(scenario, tmp_path):
    """Return the Walls that a robot reads from the map of a Scenario."""
    scenario.draw_map(tmp_path / 'drawn.yaml')
    return extract_walls(load_map(tmp_path / 'drawn.yaml')).walls


def test_a_map_is_drawn_with_thin_walls_and_without_the_furniture(write, tmp_path):
    thin, shelf = [[-1, 4], [4, 4]], [[-2, -2], [-1, -2], [-1, -1.5]]

    walls = drawn(load_scenario(write({**PLAIN, 'walls': [SQUARE, thin], 'furniture': [shelf]})),
                  tmp_path)

    # A cell is 0.05 m: that near are a side of the square and the line, but not the shelf.
    on_side, on_line, on_shelf = walls.distance([[2.0, 0.0], [1.5, 4.0], [-1.5, -2.0]])
    assert max(on_side, on_line) < 0.05
    assert on_shelf > 3.0


def test_the_map_of_an_open_world_holds_start_and_goal(write, tmp_path):
    scenario = load_scenario(write({**PLAIN, 'walls': []}))

    assert not len(drawn(scenario, tmp_path))

    found = load_map(tmp_path / 'drawn.yaml')
    extent = np.array(found.cells.shape[::-1]) * found.resolution
    for point in (scenario.start[:2], scenario.goal):
        assert (found.origin[:2] + 5.0 < point).all()
        assert (point < found.origin[:2] + extent - 5.0).all()


def test_walls_that_cannot_be_drawn_are_refused(write, tmp_path):
    path = write({**PLAIN, 'walls': [[[3, 3], [5, 5], [5, 3], [3, 5]]]})

    line = refusal_of(ScenarioError, lambda _: drawn(load_scenario(path), tmp_path), path)

    assert line.startswith('walls: polygon 0: its outline crosses itself')


@pytest.mark.parametrize('name, people', [('lab_1', 0), ('lab_2', 5), ('lab_3', 7)])
def test_the_laboratory_scenarios_can_be_drawn(name, people):
    episode = draw_episode(load_scenario(name), 'lab', 3)
    assert len(episode.radius) == people and episode.robot.radius == 0.24
    assert len(episode.scenario.polygons) >= episode.scenario.mapped + 24
    assert np.isfinite(episode.scenario.route(0.25).to_go(episode.robot.position))
