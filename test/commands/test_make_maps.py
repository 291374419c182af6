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
Scenarios drawn as maps: what is read back is where the polygons are.

Both ways: no wall of the one lies far from the walls of the other.
"""

from pathlib import Path

import numpy as np
import pytest
from wallnav_ros.commands.make_maps import main
from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.simulation.scenarios import load_scenario

SHIPPED = ('curve_path', 'cross_path')


def points_along(walls, spacing=0.01):
    """Return points (P, 2) at most `spacing` metres apart along `walls`."""
    pieces = [np.linspace(start, end, max(2, int(np.ceil(np.linalg.norm(end - start) / spacing))))
              for start, end in walls.segments]
    return np.concatenate(pieces)


def disagreement(one, other):
    """Return the farthest that a point of either walls lies from the other ones, in metres."""
    return max(other.distance(points_along(one)).max(), one.distance(points_along(other)).max())


@pytest.mark.parametrize('name', SHIPPED)
def test_the_shipped_map_is_what_the_command_writes(repository, tmp_path, name):
    assert main(['--scenario', name, '--out', str(tmp_path)]) == 0

    # The pixels, not the bytes: how a PNG is packed is the image library's affair.
    written, shipped = tmp_path / f'{name}.yaml', repository / 'maps' / f'{name}.yaml'
    assert written.read_text() == shipped.read_text()
    assert (load_map(written).cells == load_map(shipped).cells).all()


@pytest.mark.parametrize('name', SHIPPED)
def test_walls_read_from_the_shipped_map_lie_where_the_scenarios_do(repository, name):
    found = extract_walls(load_map(repository / 'maps' / f'{name}.yaml')).walls

    # 0.71 of a cell of 0.05 m in drawing, half a cell more in simplifying.
    assert disagreement(found, load_scenario(name).walls) <= 1.21 * 0.05


def test_a_finer_map_is_nearer(tmp_path):
    main(['--scenario', 'curve_path', '--resolution', '0.02', '--out', str(tmp_path)])

    found = extract_walls(load_map(tmp_path / 'curve_path.yaml')).walls

    assert disagreement(found, load_scenario('curve_path').walls) <= 1.21 * 0.02


def test_the_maps_of_both_paths_are_drawn_by_default(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    assert main([]) == 0

    assert sorted(path.name for path in Path('maps').iterdir()) == [
        'cross_path.png', 'cross_path.yaml', 'curve_path.png', 'curve_path.yaml']
    assert capsys.readouterr().out.split() == ['maps/curve_path.yaml', 'maps/cross_path.yaml']


def write_scenario(path, walls, robot='{start: [0, 0, 0], goal: [0.5, 0]}'):
    path.write_text(f'name: other\n{walls}\nrobot: {robot}\ncases: {{none: {{}}}}\n')
    return str(path)


def test_a_map_is_called_after_its_scenarios_file(tmp_path):
    scenario = write_scenario(tmp_path / 'box.yaml', 'walls: [[[2, 2], [3, 2], [3, 3]]]')

    assert main(['--scenario', scenario, '--out', str(tmp_path / 'out')]) == 0

    assert (tmp_path / 'out' / 'box.png').is_file()


@pytest.mark.parametrize('walls, line', [
    ('walls: []', 'walls: no polygons to draw; its walls come from a map or it has none'),
    ('walls: [[[2, 0], [3, 1], [3, 0], [2, 1]]]', 'walls: polygon 0: its outline crosses itself'),
    ('walls: [', 'not valid YAML'),
])
def test_what_cannot_be_drawn_is_refused_in_one_line(tmp_path, capsys, walls, line):
    scenario = write_scenario(tmp_path / 'bad.yaml', walls)

    status = main(['--scenario', 'curve_path', scenario, '--out', str(tmp_path / 'out')])

    error = capsys.readouterr().err
    assert status == 2
    assert error.startswith(f'make_maps: {scenario}: {line}')
    assert error.count('\n') == 1


def test_a_scenario_that_is_unknown_or_has_no_map_is_refused(tmp_path, capsys):
    assert main(['--scenario', 'nowhere', '--out', str(tmp_path)]) == 2
    assert main(['--scenario', 'family', '--out', str(tmp_path)]) == 2

    assert capsys.readouterr().err.count('\n') == 2


@pytest.mark.parametrize('option', [*(f'--resolution={text}' for text in (
    '0', '-1', 'nan', 'inf', 'fine')), '--out=/dev/null'])
def test_an_option_that_means_nothing_is_bad_usage(option, capsys):
    with pytest.raises(SystemExit) as caught:
        main([option])

    assert caught.value.code == 2
    assert option.partition('=')[0] in capsys.readouterr().err
