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
Which room of the package may import which: the arrows of docs/architecture.md, enforced.

The imports are read from the syntax trees, those inside functions included.
"""

import ast
from pathlib import Path
import sys

import pytest

PACKAGE = 'wallnav_ros'
ROOMS = ('world', 'mapping', 'perception', 'policy', 'navigation', 'simulation', 'learning',
         'evaluation', 'nodes', 'commands')

# Ubuntu 24.04 has these by rosdep key; the nodes must run on nothing else.
ROBOT_LIBRARIES = {'numpy', 'scipy', 'cv2', 'shapely', 'yaml', 'matplotlib'}
ROS = {'rclpy', 'ament_index_python', 'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs',
       'nav_msgs', 'rcl_interfaces', 'rosgraph_msgs', 'sensor_msgs', 'std_msgs', 'tf2_ros',
       'visualization_msgs'}
TOOL_LIBRARIES = {'pyrvo', 'rosbags', 'tqdm', 'gymnasium', 'motmetrics'}

ALLOWED_ROOMS = {
    'world': set(),
    'mapping': {'world'},
    'perception': {'world'},
    'policy': {'world'},
    'navigation': {'world', 'mapping', 'perception', 'policy'},
    'simulation': {'world', 'policy', 'mapping'},
    'learning': set(ROOMS) - {'nodes', 'commands'},
    'evaluation': set(ROOMS) - {'learning', 'nodes', 'commands'},
    'nodes': set(ROOMS) - {'learning', 'commands'},
    'commands': set(ROOMS),
}
ALLOWED_LIBRARIES = {
    'world': {'numpy'},
    'mapping': ROBOT_LIBRARIES,
    'perception': ROBOT_LIBRARIES,
    'policy': ROBOT_LIBRARIES,
    'navigation': ROBOT_LIBRARIES,
    'simulation': ROBOT_LIBRARIES | TOOL_LIBRARIES,
    'learning': ROBOT_LIBRARIES | TOOL_LIBRARIES | {'torch'},
    'evaluation': ROBOT_LIBRARIES | TOOL_LIBRARIES,
    'nodes': ROBOT_LIBRARIES | ROS,
    'commands': ROBOT_LIBRARIES | TOOL_LIBRARIES | ROS,
}


def imported_modules(source, module):
    """
    Return the dotted names that `source`, the text of `module`, imports, wherever it does.

    `from a import b` gives a.b, since b may be a module; relative imports are made absolute.
    """
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parents = module.split('.')[:-node.level] if node.level else []
            base = '.'.join([*parents, *([node.module] if node.module else [])])
            names |= {f'{base}.{alias.name}' for alias in node.names}
        elif (isinstance(node, ast.Call) and node.args
              and getattr(node.func, 'attr', getattr(node.func, 'id', None))
              in ('import_module', '__import__')):
            # A name that is computed could be anything, and is reported as such.
            name = getattr(node.args[0], 'value', None)
            names.add(name if isinstance(name, str) else '<computed import>')
    return names


def violations(source, module):
    """Return a sorted list of the imports of `module` that its room may not have."""
    room = module.split('.')[1]
    found = []
    for name in imported_modules(source, module):
        parts = name.split('.')
        if parts[0] == PACKAGE:
            # `from wallnav_ros import x` where x is no room reaches for the package itself.
            target = parts[1] if len(parts) > 1 else ''
            if target != room and target not in ALLOWED_ROOMS[room]:
                found.append(name)
        elif parts[0] not in sys.stdlib_module_names | ALLOWED_LIBRARIES[room]:
            found.append(name)
    return sorted(found)


def package_modules(repository):
    """Return (path, dotted module name) of every module of every room."""
    return [
        (path, '.'.join(path.relative_to(repository).with_suffix('').parts))
        for path in sorted((repository / PACKAGE).rglob('*.py'))
        if path.parent != repository / PACKAGE
    ]


def test_every_room_is_in_the_table(repository):
    rooms = {path.parent.name for path in (repository / PACKAGE).glob('*/__init__.py')}

    assert rooms == set(ROOMS) == set(ALLOWED_ROOMS) == set(ALLOWED_LIBRARIES)


@pytest.mark.parametrize('room', ROOMS)
def test_a_room_imports_only_what_its_row_allows(repository, room):
    modules = [entry for entry in package_modules(repository) if entry[1].split('.')[1] == room]

    found = {str(path.relative_to(repository)): bad for path, module in modules
             if (bad := violations(path.read_text(), module))}

    assert modules
    assert found == {}


@pytest.mark.parametrize('room, source, caught', [
    ('world', 'import scipy', ['scipy']),
    ('world', 'from wallnav_ros.mapping import occupancy_map',
     ['wallnav_ros.mapping.occupancy_map']),
    ('mapping', 'from wallnav_ros.perception.tracking import Tracker',
     ['wallnav_ros.perception.tracking.Tracker']),
    ('mapping', 'import tqdm', ['tqdm']),
    ('perception', 'import wallnav_ros.mapping.wall_extraction as walls',
     ['wallnav_ros.mapping.wall_extraction']),
    ('perception', 'from ..policy import actions', ['wallnav_ros.policy.actions']),
    ('policy', 'def f():\n    import torch', ['torch']),
    ('policy', 'from wallnav_ros import mapping', ['wallnav_ros.mapping']),
    ('policy', 'from .. import perception', ['wallnav_ros.perception']),
    ('navigation', 'import rclpy', ['rclpy']),
    ('navigation', 'from wallnav_ros.simulation import crowd', ['wallnav_ros.simulation.crowd']),
    ('simulation', 'from wallnav_ros.perception import tracking',
     ['wallnav_ros.perception.tracking']),
    ('simulation', 'import rclpy.node', ['rclpy.node']),
    ('learning', 'from wallnav_ros.nodes import conversions',
     ['wallnav_ros.nodes.conversions']),
    ('learning', 'from sensor_msgs.msg import LaserScan', ['sensor_msgs.msg.LaserScan']),
    ('evaluation', 'import torch.nn', ['torch.nn']),
    ('evaluation', 'from wallnav_ros.learning import trainer', ['wallnav_ros.learning.trainer']),
    ('nodes', 'import importlib\nimportlib.import_module("wallnav_ros.learning.networks")',
     ['wallnav_ros.learning.networks']),
    ('nodes', 'import importlib\nimportlib.import_module(name)', ['<computed import>']),
    ('nodes', 'import pyrvo', ['pyrvo']),
    ('nodes', 'try:\n    import tqdm\nexcept ImportError:\n    tqdm = None', ['tqdm']),
    ('commands', 'import torch', ['torch']),
    ('commands', 'import pandas', ['pandas']),
])
def test_a_forbidden_import_is_caught(room, source, caught):
    assert violations(source, f'{PACKAGE}.{room}.bad') == caught


@pytest.mark.parametrize('room', ROOMS)
def test_the_standard_library_numpy_and_the_own_room_are_always_allowed(room):
    source = f'import os\nimport numpy as np\nfrom wallnav_ros.{room}.other import name'

    assert violations(source, f'{PACKAGE}.{room}.good') == []


def reachable_libraries(repository, module):
    """Return every library outside the package that `module` loads, through the package too."""
    waiting, seen, libraries = [module], set(), set()
    while waiting:
        name = waiting.pop()
        path = repository / Path(*name.split('.'))
        if path.is_dir():
            name, path = f'{name}.__init__', path / '__init__.py'
        path = path.with_suffix('.py')
        if name in seen or not path.is_file():
            continue
        seen.add(name)
        for imported in imported_modules(path.read_text(), name):
            if imported.split('.')[0] == PACKAGE:
                waiting += [imported, imported.rpartition('.')[0]]
            else:
                libraries.add(imported.split('.')[0])
    return libraries - sys.stdlib_module_names


@pytest.mark.parametrize('node', ['policy_node', 'scan_tracker_node', 'map_walls_node'])
def test_a_node_of_the_robot_reaches_nothing_that_apt_lacks(repository, node):
    libraries = reachable_libraries(repository, f'{PACKAGE}.nodes.{node}')

    assert 'rclpy' in libraries
    assert libraries <= ROBOT_LIBRARIES | ROS


def test_reachable_libraries_follows_imports_through_the_package(tmp_path):
    room = tmp_path / PACKAGE / 'nodes'
    room.mkdir(parents=True)
    (room / 'a.py').write_text('from wallnav_ros.nodes import b')
    (room / 'b.py').write_text('def f():\n    from wallnav_ros.nodes.c import name')
    (room / 'c.py').write_text('import os\nimport torch\nname = 1')

    assert reachable_libraries(tmp_path, f'{PACKAGE}.nodes.a') == {'torch'}
