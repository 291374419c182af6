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
"""A tool without its library says so in one line."""

import subprocess
import sys

import pytest

from wallnav_ros.world.extras import EXTRAS

RUN = """
import runpy, sys
sys.argv = [{tool!r}]
sys.modules[{missing!r}] = None          # as if it were not installed
runpy.run_module('wallnav_ros.commands.' + {tool!r}, run_name='__main__')
"""


def run_without(missing, tool):
    """Return the ended process of a tool run without the library `missing`."""
    return subprocess.run([sys.executable, '-c', RUN.format(missing=missing, tool=tool)],
                          capture_output=True, text=True, timeout=60.0)


@pytest.mark.parametrize('tool, missing, target', [
    ('evaluate', 'tqdm', 'setup'), ('evaluate', 'pyrvo', 'setup'), ('replay', 'rosbags', 'setup'),
    ('score_tracking', 'motmetrics', 'test')])
def test_the_line_names_the_tool_the_library_and_the_way_out(tool, missing, target):
    for library in {'tqdm', 'pyrvo', 'rosbags'} - {missing}:
        pytest.importorskip(library)
    ended = run_without(missing, tool)
    assert ended.returncode == 1
    line, = ended.stderr.splitlines()
    assert line.startswith(f'{tool}: {missing} is not installed')
    assert f'make {target}`' in line and f'pip install {missing}' in line


def test_every_library_is_in_a_list_of_what_its_target_installs(repository):
    lists = {'setup': ('tools.txt', 'no_deps.txt'), 'test': ('test.txt',)}
    for library, target in EXTRAS.items():
        listed = [line.partition('==')[0] for name in lists[target]
                  for line in (repository / 'requirements' / name).read_text().splitlines()]
        assert library in listed


def test_any_other_missing_module_keeps_its_traceback():
    ended = run_without('json', 'extract_walls')
    assert ended.returncode == 1
    assert 'Traceback' in ended.stderr and '`make' not in ended.stderr
