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
Nodes as separate processes in a ROS domain of their own, none of which outlives its starter.

prctl(2) PR_SET_PDEATHSIG ends them even when the starter is killed; REP-149 for domain ports.
"""

import ctypes
from functools import partial
import os
from pathlib import Path
import signal
import socket
import subprocess
import sys

# The DDS ports of higher domains fall into Linux's range of ephemeral ports.
DOMAINS = range(1, 100)
GRACE = 5.0                # s that a node has to end by itself
_PR_SET_PDEATHSIG = 1


class ProcessEnded(RuntimeError):
    """A node ended though nobody asked it to; the message says which, and its last line."""


class NodeRefused(ProcessEnded):
    """A node would not start with what it was given."""


class Domain:
    """
    A ROS domain id that nobody else on this machine uses, as a context manager.

    While it is open, this process and its children are in it and see only this machine.
    """

    def __enter__(self):
        """Find a free domain and enter it; raises OSError when all are taken."""
        self._reservation = socket.socket(socket.AF_UNIX)
        self._saved = {name: os.environ.get(name)
                       for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE')}
        self.id = self._reserve()
        os.environ['ROS_DOMAIN_ID'] = str(self.id)
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        return self

    def __exit__(self, *_):
        """Leave the domain and give it up."""
        self._reservation.close()
        for name, value in self._saved.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value

    def _reserve(self):
        for offset in range(len(DOMAINS)):
            domain = DOMAINS[(os.getpid() + offset) % len(DOMAINS)]
            try:
                # An abstract name has one owner and goes with the process, however that ends.
                self._reservation.bind(f'\0wallnav_ros_domain_{domain}')
            except OSError:
                continue
            if not _in_use(domain):
                return domain
            self._reservation.close()
            self._reservation = socket.socket(socket.AF_UNIX)
        raise OSError('every ROS domain from 1 to 99 is in use on this machine')


def _in_use(domain):
    """Return whether a first participant of `domain` runs on this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(('', 7400 + 250 * domain + 10))
        except OSError:
            return True
    return False


class NodeGroup:
    """Node processes that are all ended when the context is left, whatever the reason."""

    def __init__(self, log_folder):
        """Write the output of every node to a file of `log_folder`."""
        self._logs = Path(log_folder)
        self._logs.mkdir(parents=True, exist_ok=True)
        self._running = {}

    def __enter__(self):
        """Return the group."""
        return self

    def __exit__(self, *_):
        """End every node: asked to first, killed where it does not listen."""
        for process in self._running.values():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for process in self._running.values():
            try:
                process.wait(GRACE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def start(self, name, parameters):
        """Start node `name` of this package with `parameters`, a mapping of YAML values."""
        command = [sys.executable, '-m', f'wallnav_ros.nodes.{name}', '--ros-args']
        for key, value in parameters.items():
            command += ['-p', f'{key}:={_yaml(value)}']
        root = str(Path(__file__).resolve().parents[2])
        paths = [root, *filter(None, [os.environ.get('PYTHONPATH')])]
        with open(self._logs / f'{name}.log', 'wb') as log:
            self._running[name] = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
                env={**os.environ, 'PYTHONPATH': os.pathsep.join(paths)},
                # Ctrl-C is for the starter alone, which then ends its nodes in order.
                start_new_session=True, preexec_fn=partial(_die_with, os.getpid()))

    def check(self):
        """Raise ProcessEnded when a node is no longer there."""
        for name, process in self._running.items():
            if process.poll() is not None:
                lines = (self._logs / f'{name}.log').read_text(errors='replace').splitlines()
                # Their exit statuses are those of `nodes.runner`.
                kind = NodeRefused if process.returncode == 2 else ProcessEnded
                raise kind(f'{name} ended with status {process.returncode}: '
                           f'{lines[-1] if lines else "no output"}')


_LIBC = ctypes.CDLL(None, use_errno=True)


def _die_with(parent):
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    # It may have been killed between the fork and that.
    if os.getppid() != parent:
        os._exit(1)


def _yaml(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return '[' + ', '.join(_yaml(part) for part in value) + ']'
    return repr(float(value)) if isinstance(value, float) else str(value)
