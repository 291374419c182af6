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
The package through colcon: built in a clean workspace, its nodes started from there.

`ros2 run` executes the very files under install/wallnav_ros/lib/wallnav_ros.
"""

import shutil
import signal
import subprocess
import sys
import time

from nodes_over_dds import TIMEOUT
import pytest
import rclpy

PACKAGE = 'wallnav_ros'
ASSETS = ('params', 'maps', 'models', 'scenarios', 'launch', 'rviz')

pytestmark = pytest.mark.extras


@pytest.fixture(scope='module')
def tracked_files(repository):
    """Return the files of the repository, as git sees them, without ignored ones."""
    listing = subprocess.run(
        ['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard'],
        cwd=repository, check=True, capture_output=True, text=True).stdout
    return [name for name in listing.split('\0') if (repository / name).is_file()]


@pytest.fixture(scope='module')
def workspace(repository, tracked_files, tmp_path_factory):
    """Return a colcon workspace with this package built in it."""
    folder = tmp_path_factory.mktemp('workspace')
    for name in tracked_files:
        target = folder / 'src' / PACKAGE / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(repository / name, target)
    built = subprocess.run(
        [sys.executable, '-m', 'colcon', 'build', '--packages-select', PACKAGE,
         '--event-handlers', 'console_direct+'],
        cwd=folder, capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


def sourced(workspace, *command):
    """Return the command line that runs `command` in the workspace's own environment."""
    return ['bash', '-c', '. install/setup.bash && exec "$@"', 'bash', *map(str, command)]


def test_every_asset_is_installed(workspace, tracked_files):
    share = workspace / 'install' / PACKAGE / 'share' / PACKAGE
    assets = [name for name in tracked_files if name.split('/')[0] in ASSETS]

    missing = [name for name in assets if not (share / name).is_file()]

    assert {name.split('/')[0] for name in assets} == set(ASSETS)
    assert missing == []


def test_the_package_is_in_the_ament_index(workspace):
    prefix = workspace / 'install' / PACKAGE / 'share'

    assert (prefix / 'ament_index' / 'resource_index' / 'packages' / PACKAGE).is_file()
    assert (prefix / PACKAGE / 'package.xml').is_file()


def test_installed_code_finds_the_installed_assets(workspace):
    code = ('import wallnav_ros.world.files as files\n'
            'print(files.__file__)\n'
            'print(files.share_directory())')

    done = subprocess.run(sourced(workspace, sys.executable, '-c', code), cwd=workspace,
                          capture_output=True, text=True, check=True)

    module, share = done.stdout.split()
    assert module.startswith(str(workspace / 'install'))
    assert share == str(workspace / 'install' / PACKAGE / 'share' / PACKAGE)


@pytest.fixture
def listener(ros_domain_id):
    """Return a node in the test's domain."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=ros_domain_id)
    node = rclpy.create_node('listener', context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


def wait_until_started(listener, name, process):
    """Wait until the node of `process` is in the ROS graph."""
    deadline = time.monotonic() + TIMEOUT
    while not listener.wait_for_node(name, timeout=0.5):
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < deadline, f'{name} is not in the ROS graph'


@pytest.mark.parametrize('name, arguments', [
    ('policy_node', []),
    ('scan_tracker_node', []),
    ('map_walls_node', ['-p', 'map:=src/wallnav_ros/maps/cross_path.yaml']),
    ('simulator_node', []),
])
@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGTERM])
def test_an_installed_node_starts_and_stops_cleanly(workspace, listener, name, arguments, stop):
    executable = workspace / 'install' / PACKAGE / 'lib' / PACKAGE / name
    process = subprocess.Popen(
        sourced(workspace, executable, '--ros-args', *arguments), cwd=workspace,
        stderr=subprocess.PIPE, text=True)
    try:
        wait_until_started(listener, name, process)
        process.send_signal(stop)
        _, errors = process.communicate(timeout=TIMEOUT)
    finally:
        process.kill()
        process.wait()

    assert process.returncode == 0, errors
    assert 'Traceback' not in errors
