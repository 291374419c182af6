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
Commands that are interrupted at the keyboard.

Ctrl-C sends SIGINT.
"""

import signal
import subprocess
import sys


def interrupted(name, began, *arguments):
    """Return exit status and error output of command `name`, interrupted once `began` shows."""
    process = subprocess.Popen(
        [sys.executable, '-m', f'wallnav_ros.commands.{name}', *arguments],
        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
        # A suite in the background ignores Ctrl-C, and so would what it starts.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    assert began in process.stderr.read(20)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    return process.returncode, errors
