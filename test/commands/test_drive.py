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
"""The drive command: whole runs over DDS, honest exit statuses, and no process left behind."""

import json
import os
from pathlib import Path
import signal
import subprocess
import sys
from threading import Event
from time import monotonic

import pytest

rclpy = pytest.importorskip('rclpy')
pyrvo = pytest.importorskip('pyrvo')

from wallnav_ros.commands.drive import main, map_of  # noqa: E402
from wallnav_ros.mapping.occupancy_map import load_map  # noqa: E402
from wallnav_ros.mapping.wall_extraction import extract_walls  # noqa: E402
from wallnav_ros.simulation.episodes import draw_episode  # noqa: E402
from wallnav_ros.simulation.scenario import ScenarioError  # noqa: E402
from wallnav_ros.simulation.scenarios import load_scenario  # noqa: E402
import yaml  # noqa: E402

pytestmark = pytest.mark.extras
NODES = ('simulator_node', 'map_walls_node', 'scan_tracker_node', 'policy_node')
TIMEOUT = 120.0
SCENARIO = """
name: {name}
walls: [[[-2, 2], [6, 2], [6, 2.5], [-2, 2.5]], [[-2, -2], [-2, -2.5], [6, -2.5], [6, -2]]]
robot: {{start: [0, 0, 0], goal: [{goal}, 0], radius: 0.2, preferred_speed: 0.8, visible: false}}
time_limit: {limit}
cases:
  none: {{static: 0, dynamic: 0}}
"""


@pytest.fixture
def corridor(tmp_path):
    """Return a function that writes a short corridor with nobody in it."""
    def write(goal=2.0, limit=20.0):
        path = tmp_path / 'short_corridor.yaml'
        path.write_text(SCENARIO.format(name='short_corridor', goal=goal, limit=limit))
        return path
    return write


@pytest.fixture
def drive(tmp_path, repository):
    """Return a function that starts the command; what it starts is killed with the test."""
    started = []

    def start(*arguments):
        process = subprocess.Popen(
            [sys.executable, '-m', 'wallnav_ros.commands.drive', '--out', tmp_path / 'out',
             *map(str, arguments)], cwd=repository, text=True, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, env={**os.environ, 'OMP_NUM_THREADS': '1'})
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


def children(process):
    """Return the ids of the processes that `process` has started."""
    path = Path(f'/proc/{process.pid}/task/{process.pid}/children')
    return [int(child) for child in path.read_text().split()] if path.is_file() else []


def alive(identifier):
    """Return whether a process runs; one that only waits to be reaped does not."""
    try:
        return Path(f'/proc/{identifier}/stat').read_text().rsplit(')', 1)[1].split()[0] != 'Z'
    except (FileNotFoundError, ProcessLookupError):
        return False


def wait(condition, what):
    deadline = monotonic() + TIMEOUT
    pause = Event()
    while not condition():
        assert monotonic() < deadline, what
        pause.wait(0.02)


def test_a_run_reaches_the_goal_and_leaves_its_results(drive, corridor, tmp_path):
    process = drive('--scenario', corridor(), '--case', 'none', '--seed', 4, '--name', 'demo')
    output, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0, errors
    assert 'goal after' in output and 'least gap' in output
    out = tmp_path / 'out'
    demo = json.loads((out / 'demo.json').read_text())
    assert set(demo) == {'outcome', 'time', 'path_length', 'min_gap_agent', 'min_gap_wall',
                         'scan_to_command_ms_p50', 'scan_to_command_ms_p99'}
    # 2 m less the 0.2 m at which the goal counts as reached, at 0.8 m/s at most.
    assert demo['outcome'] == 'goal' and 1.8 / 0.8 <= demo['time'] < 15.0
    assert 1.75 < demo['path_length'] < 2.5
    assert demo['min_gap_agent'] is None and 1.0 < demo['min_gap_wall'] <= 1.8
    assert 0.0 < demo['scan_to_command_ms_p50'] <= demo['scan_to_command_ms_p99']
    summary = json.loads((out / 'summary.json').read_text())
    assert [run['seed'] for run in summary['runs']] == [4]
    assert (out / 'demo.png').read_bytes().startswith(b'\x89PNG')
    assert sorted(path.stem for path in (out / 'demo_logs').iterdir()) == sorted(NODES)


def test_runs_that_do_not_arrive_give_status_one_and_take_a_seed_each(drive, corridor, tmp_path):
    process = drive('--scenario', corridor(limit=1.0), '--case', 'none', '--runs', 2,
                    '--speed', 2.0, '--json', tmp_path / 'result.json')
    process.communicate(timeout=TIMEOUT)
    assert process.returncode == 1
    runs = json.loads((tmp_path / 'result.json').read_text())['runs']
    assert [(run['seed'], run['outcome']) for run in runs] == [(1, 'timeout'), (2, 'timeout')]
    assert (tmp_path / 'out' / 'run_000.png').is_file()
    assert (tmp_path / 'out' / 'run_001.png').is_file()


def test_what_a_node_refuses_is_bad_input(drive, corridor):
    process = drive('--scenario', corridor(), '--case', 'none', '--scan-rate', 1000)
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 2
    assert 'parameter scan_rate: outside its limits, 1 to 80' in errors.splitlines()[-1]


def test_runs_before_one_that_cannot_be_drawn_are_kept(drive, corridor, tmp_path):
    path = corridor(limit=1.0)
    # Whether a person as wide as these fits beside the robot's way is a matter of the seed.
    path.write_text(path.read_text().replace('none: {static: 0, dynamic: 0}', 'wide: {static: 1}')
                    + 'agents: {radius: [0.1, 2.0]}\n')
    scenario = load_scenario(path)

    def fits(seed):
        try:
            return draw_episode(scenario, 'wide', seed) is not None
        except ScenarioError:
            return False

    seed = next(seed for seed in range(100) if fits(seed) and not fits(seed + 1))
    process = drive('--scenario', path, '--case', 'wide', '--runs', 2, '--seed', seed)
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 2
    assert 'no room for agent 1' in errors.splitlines()[-1]
    summary = json.loads((tmp_path / 'out' / 'summary.json').read_text())
    assert [run['seed'] for run in summary['runs']] == [seed]


def test_a_drawn_world_is_driven_with_its_own_map(drive, tmp_path):
    # The world of this seed is crossed within seconds.
    process = drive('--scenario', 'family', '--case', 'none', '--seed', 8, '--speed', 2.0)
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0, errors
    drawn = extract_walls(load_map(tmp_path / 'out' / 'run_000_map.yaml')).walls
    corners = load_scenario('family').at(8).walls.segments[:, 0]
    # 0.71 of a cell of 0.05 m in drawing, half a cell more in simplifying.
    assert drawn.distance(corners).max() < 1.21 * 0.05


def test_a_shipped_map_is_used_with_the_shipped_scenario_alone(repository, tmp_path):
    shipped = repository / 'scenarios' / 'cross_path.yaml'
    document = yaml.safe_load(shipped.read_text())
    # A copy of the same name with a pillar more.
    document['walls'].append([[2.0, 1.0], [2.5, 1.0], [2.5, 1.5]])
    (tmp_path / 'cross_path.yaml').write_text(yaml.safe_dump(document))
    drawn = tmp_path / 'out' / 'run_000_map.yaml'

    assert map_of(load_scenario(shipped), drawn) == repository / 'maps' / 'cross_path.yaml'
    assert map_of(load_scenario(tmp_path / 'cross_path.yaml'), drawn) == drawn
    assert extract_walls(load_map(drawn)).walls.distance([[2.0, 1.0]]) < 0.05


@pytest.mark.parametrize('sent, status', [
    (signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_no_node_outlives_the_command(drive, corridor, sent, status):
    process = drive('--scenario', corridor(goal=5.0), '--case', 'none')
    wait(lambda: len(children(process)) == len(NODES) or process.poll() is not None, 'nodes')
    nodes = children(process)
    assert len(nodes) == len(NODES)
    process.send_signal(sent)
    process.communicate(timeout=TIMEOUT)
    assert process.returncode == status
    wait(lambda: not any(map(alive, nodes)), 'the end of every node')


@pytest.mark.parametrize('arguments, told', [
    (('--scenario', 'atlantis'), 'atlantis'), (('--case', 'crowded'), 'crowded'),
    (('--model', 'no_such_model'), 'no_such_model'), (('--runs', '0'), '--runs'),
    (('--speed', '0'), '--speed'), (('--runs', '2', '--name', 'demo'), '--name'),
    (('--beams', '1'), '--beams'), (('--json', '/dev/null/x'), '--json')])
def test_what_cannot_be_driven_is_refused_before_anything_starts(
        tmp_path, capsys, arguments, told):
    try:
        status = main(['--out', str(tmp_path), *arguments])
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert told in capsys.readouterr().err.splitlines()[-1]
