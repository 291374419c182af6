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
The package as rosdep, colcon and pip see it: manifest, versions, executables.

REP-149 (package.xml, format 3) and REP-132 (the changelog) say what must be there.
"""

from importlib import metadata
import re
import runpy
import sys

from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import parse_package
import pytest

PACKAGE = 'wallnav_ros'
NODES = {'policy_node', 'scan_tracker_node', 'map_walls_node', 'simulator_node'}
TOOLS = {'extract_walls', 'replay', 'train', 'evaluate', 'drive', 'benchmark', 'make_maps',
         'score_tracking', 'train_motion', 'lab_tests'}

# Keys of the ROS distribution and of Ubuntu 24.04 in the rosdep database.
ROSDEP_KEYS = {
    'ament_copyright', 'ament_flake8', 'ament_pep257', 'builtin_interfaces', 'diagnostic_msgs',
    'geometry_msgs', 'launch', 'launch_ros', 'nav_msgs', 'rcl_interfaces', 'rclpy',
    'rosgraph_msgs', 'sensor_msgs', 'std_msgs', 'tf2_ros', 'visualization_msgs',
    'python3-matplotlib', 'python3-numpy', 'python3-opencv', 'python3-pytest', 'python3-scipy',
    'python3-shapely', 'python3-yaml',
}


@pytest.fixture(scope='module')
def manifest(repository):
    """Return package.xml, parsed and validated by catkin_pkg."""
    warnings = []
    package = parse_package(str(repository / 'package.xml'), warnings=warnings)
    package.validate(warnings=warnings)
    assert warnings == []
    return package


@pytest.fixture(scope='module')
def distribution():
    """Return what pip or colcon installed of this package."""
    return metadata.distribution(PACKAGE)


def console_scripts(distribution):
    return {entry.name: entry.value for entry in distribution.entry_points}


def test_the_manifest_is_an_ament_python_package(manifest):
    assert manifest.name == PACKAGE
    assert manifest.package_format == 3
    assert manifest.get_build_type() == 'ament_python'
    assert manifest.licenses == ['Apache-2.0']


def test_manifest_setup_and_changelog_name_the_same_version(repository, manifest, distribution):
    changelog = get_changelog_from_path(str(repository), PACKAGE)
    newest = next(version for version, _, _ in changelog.foreach_version())

    assert manifest.version == distribution.version == newest


def test_every_dependency_is_a_rosdep_key_that_ubuntu_24_04_resolves(manifest):
    names = {dependency.name for dependency in manifest.exec_depends + manifest.test_depends}

    assert names <= ROSDEP_KEYS
    assert not manifest.build_depends


@pytest.mark.parametrize('library, key', [
    ('numpy', 'python3-numpy'), ('scipy', 'python3-scipy'), ('cv2', 'python3-opencv'),
    ('shapely', 'python3-shapely'), ('yaml', 'python3-yaml'),
    ('matplotlib', 'python3-matplotlib'),
    *((name, name) for name in ('rclpy', 'sensor_msgs', 'nav_msgs', 'geometry_msgs', 'std_msgs',
                                'visualization_msgs', 'diagnostic_msgs', 'rosgraph_msgs',
                                'builtin_interfaces', 'rcl_interfaces', 'tf2_ros')),
])
def test_a_library_the_nodes_import_is_declared_and_nothing_else_is(
        repository, manifest, library, key):
    declared = {dependency.name for dependency in manifest.exec_depends}
    pattern = re.compile(rf'^\s*(import|from) {library}\b', re.MULTILINE)
    imported = any(pattern.search(path.read_text())
                   for path in (repository / PACKAGE).rglob('*.py'))

    assert imported == (key in declared)


def test_the_executables_are_those_of_the_contract(distribution):
    expected = {name: f'{PACKAGE}.nodes.{name}:main' for name in NODES}
    expected |= {name: f'{PACKAGE}.commands.{name}:main' for name in TOOLS}

    assert console_scripts(distribution) == expected


def test_every_module_that_has_a_main_is_an_executable(repository):
    rooms = [repository / PACKAGE / name for name in ('nodes', 'commands')]

    executables = {path.stem for room in rooms for path in room.glob('*.py')
                   if re.search(r'^def main\(', path.read_text(), re.MULTILINE)}
    assert executables == NODES | TOOLS


@pytest.mark.extras
@pytest.mark.parametrize('name', sorted(NODES | TOOLS))
def test_an_executable_has_a_main(distribution, name):
    (entry,) = distribution.entry_points.select(name=name)

    assert callable(entry.load())


@pytest.fixture
def run_as_module(monkeypatch):
    """
    Return a function that does what `python -m` does with a tool; it returns the exit status.

    In this process, where the libraries that take a second to import are there already.
    """
    def run(tool, *arguments):
        module = f'{PACKAGE}.commands.{tool}'
        monkeypatch.setattr(sys, 'argv', [tool, *arguments])
        # Imported before, it would be there twice: runpy warns of that.
        monkeypatch.delitem(sys.modules, module, raising=False)
        with pytest.raises(SystemExit) as end:
            runpy.run_module(module, run_name='__main__')
        return end.value.code
    return run


@pytest.mark.extras
@pytest.mark.parametrize('tool', sorted(TOOLS))
def test_a_tool_explains_itself(tool, run_as_module, capsys):
    assert run_as_module(tool, '--help') == 0
    assert capsys.readouterr().out.startswith(f'usage: {tool} ')


@pytest.mark.extras
@pytest.mark.parametrize('tool', sorted(TOOLS))
def test_a_tool_refuses_an_unknown_option_with_status_2(tool, run_as_module, capsys):
    assert run_as_module(tool, '--no-such-option') == 2
    assert capsys.readouterr().err.startswith(f'usage: {tool} ')


def anchors(page):
    """Return the names that the headings of a page go by in links."""
    headings = re.findall(r'^#+ (.*)$', page.read_text(), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-') for heading in headings}


def test_every_link_between_the_pages_leads_somewhere(repository):
    pages = [repository / 'README.md', repository / 'CONTRIBUTING.md',
             *repository.glob('docs/*.md')]
    links = [(page, page.parent / file if file else page, anchor) for page in pages
             for file, anchor in re.findall(r'\]\(([^)#\s]*)#?([^)\s]*)\)', page.read_text())
             if not file.startswith(('http://', 'https://'))]

    broken = [f'{page.name}: {target.name}#{anchor}' for page, target, anchor in links
              if not target.exists() or (anchor and anchor not in anchors(target))]

    assert any(anchor for *_, anchor in links)
    assert broken == []
