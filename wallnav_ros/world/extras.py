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
"""What a tool says when a library of its own is missing: one line, and the way out."""

from pathlib import Path
import sys

# The target of the Makefile that installs each, from the lists in requirements/.
EXTRAS = {'gymnasium': 'test', 'motmetrics': 'test', 'pyrvo': 'setup', 'rosbags': 'setup',
          'torch': 'test', 'tqdm': 'setup'}


def explain_missing_extras():
    """Let the interpreter end with that line, not with a traceback, when an extra is missing."""
    before = sys.excepthook

    def explain(kind, error, traceback):
        name = (getattr(error, 'name', None) or '').partition('.')[0]
        if not issubclass(kind, ModuleNotFoundError) or name not in EXTRAS:
            before(kind, error, traceback)
            return
        print(f'{Path(sys.argv[0]).stem}: {name} is not installed: run `make {EXTRAS[name]}` in '
              f'the sources of wallnav_ros, or pip install {name}', file=sys.stderr)
    sys.excepthook = explain
