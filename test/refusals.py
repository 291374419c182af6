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
"""What tests of refusals share: bad input ends in one line that begins with its file."""

import pytest


def refusal_of(error, read, path):
    """Return the line with which `read(path)` raises `error`, less the file's name."""
    with pytest.raises(error) as caught:
        read(path)
    line = str(caught.value)
    assert '\n' not in line
    assert line.startswith(f'{path}: ')
    return line.removeprefix(f'{path}: ')


def refusal_by(command, main, capsys, *arguments):
    """Return the line with which `main` of `command` ends at status 2, less the command's name."""
    assert main(list(arguments)) == 2
    line, = capsys.readouterr().err.splitlines()
    assert line.startswith(f'{command}: ')
    return line.removeprefix(f'{command}: ')
