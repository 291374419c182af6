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
The pinned dependencies under requirements/, and what install.sh says where it cannot help.

Every list is installed with `-c constraints.txt`; a version is written down in one place only.
"""

from importlib.metadata import requires
import os
import subprocess
import sys

from packaging.requirements import Requirement
import pytest

LISTS = ('ros', 'robot', 'tools', 'no_deps', 'ros_test', 'test', 'oldest', 'constraints')


def read_list(repository, name):
    """Return the requirements of a list; an option, such as an index address, is none."""
    lines = (repository / 'requirements' / f'{name}.txt').read_text().splitlines()
    return [Requirement(text) for line in lines if (text := line.partition('#')[0].strip())]


@pytest.fixture(scope='module')
def pins(repository):
    """Return {list: {name: version}}, without what a list only names."""
    return {name: {requirement.name: str(requirement.specifier).removeprefix('==')
                   for requirement in read_list(repository, name) if requirement.specifier}
            for name in LISTS}


def test_there_is_no_list_besides_those_tested_here(repository):
    assert {path.stem for path in repository.glob('requirements/*.txt')} == set(LISTS)


@pytest.mark.parametrize('name', LISTS)
def test_every_version_is_exact(repository, pins, name):
    for requirement in read_list(repository, name):
        if requirement.specifier:
            (specifier,) = requirement.specifier
            assert specifier.operator == '=='
            assert '*' not in specifier.version
        else:
            assert requirement.name in pins['constraints']


def test_a_version_is_written_in_one_place(pins):
    current = [name for key, names in pins.items() if key != 'oldest' for name in names]

    assert sorted(current) == sorted(set(current))


def test_the_oldest_set_is_that_of_the_nodes_and_the_test_runner(pins):
    assert set(pins['oldest']) == {*pins['robot'], 'pytest'}


def test_the_ranges_of_the_extras_admit_the_pinned_versions(pins):
    pinned = {name: version for key, names in pins.items() if key != 'oldest'
              for name, version in names.items()}
    ranges = [Requirement(text) for text in requires('wallnav_ros')]

    outside = [str(wanted) for wanted in ranges
               if not wanted.specifier.contains(pinned[wanted.name])]

    assert len(ranges) > 10
    assert outside == []


def install(repository, venv, wanted='demo', **variables):
    """Run install.sh in a bare environment that has `variables` besides, up to its first word."""
    clean = {'PATH': os.environ['PATH'], 'HOME': os.environ.get('HOME', '/')} | variables
    return subprocess.run([repository / 'requirements' / 'install.sh', venv, wanted],
                          env=clean, capture_output=True, text=True, timeout=60)


def test_a_python_that_is_not_there_is_named(repository, tmp_path):
    done = install(repository, tmp_path / 'venv', PYTHON='no-such-python')

    assert done.returncode == 1
    assert 'needs Python 3.11 or newer, found none as no-such-python' in done.stderr
    assert not (tmp_path / 'venv').exists()


def test_a_sourced_ros_of_another_python_is_named(repository, tmp_path):
    done = install(repository, tmp_path / 'venv', ROS_DISTRO='jazzy',
                   PYTHON=sys._base_executable)

    assert done.returncode == 1
    assert 'ROS 2 jazzy is sourced, but' in done.stderr
    assert not (tmp_path / 'venv').exists()


def test_a_platform_without_wheels_is_told_to_source_a_ros(repository, tmp_path):
    (tmp_path / 'uname').write_text('#!/bin/sh\n[ "$1" = -s ] && echo Linux || echo aarch64\n')
    (tmp_path / 'uname').chmod(0o755)

    done = install(repository, tmp_path / 'venv', PATH=f'{tmp_path}:{os.environ["PATH"]}')

    assert done.returncode == 1
    assert 'wheels exist for x86_64 Linux only (this is Linux aarch64)' in done.stderr
    assert '. /opt/ros/jazzy/setup.sh' in done.stderr


@pytest.mark.parametrize('system, variables, reason', [
    ('false', {'ROS_DISTRO': 'jazzy'}, 'made without the ROS 2 jazzy that is now sourced'),
    ('true', {}, 'made with a sourced ROS 2: source it again'),
])
def test_an_environment_of_the_other_kind_is_refused(
        repository, tmp_path, system, variables, reason):
    (tmp_path / 'bin').mkdir()
    (tmp_path / 'bin' / 'python').symlink_to(sys.executable)
    (tmp_path / 'pyvenv.cfg').write_text(f'include-system-site-packages = {system}\n')

    done = install(repository, tmp_path, 'check', **variables)

    assert done.returncode == 1
    assert reason in done.stderr
    assert 'make clean' in done.stderr
