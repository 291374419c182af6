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


@pytest.mark.parametrize('tool, missing', [
    ('evaluate', 'tqdm'), ('evaluate', 'pyrvo'), ('replay', 'rosbags')])
def test_the_line_names_the_tool_the_library_and_the_way_out(tool, missing):
    for library in {'tqdm', 'pyrvo', 'rosbags'} - {missing}:
        pytest.importorskip(library)
    ended = run_without(missing, tool)
    assert ended.returncode == 1
    line, = ended.stderr.splitlines()
    assert line.startswith(f'{tool}: {missing} is not installed')
    assert 'make setup' in line and f'pip install {missing}' in line


def test_any_other_missing_module_keeps_its_traceback():
    ended = run_without('json', 'extract_walls')
    assert ended.returncode == 1
    assert 'Traceback' in ended.stderr and 'make setup' not in ended.stderr
