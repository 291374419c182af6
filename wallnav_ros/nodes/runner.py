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
How every node starts and stops: parameters first, a clean end on SIGINT and SIGTERM.

Exit statuses follow docs/nodes.md: 0 ended on request, 1 crashed, 2 refused to start.
"""

import gc
from pathlib import Path
import signal
import sys
import threading

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

STOP_SIGNALS = {signal.SIGINT, signal.SIGTERM}
# What a constructor may raise when it is given something it cannot work with. RuntimeError is
# how rcl reports arguments and parameter files that it cannot parse.
REFUSALS = (ValueError, OSError, ParameterException, RuntimeError)


def run(make_node, args=None):
    """
    Make a node, spin it until it is asked to end, and return the exit status.

    make_node: called without arguments; the node it returns may have a method `close`, called
    while its publishers still work. What it refuses (REFUSALS) becomes one line on stderr and
    status 2. `args` are command-line arguments, those of the process where None.
    """
    # Blocked in every thread that ROS starts, so that the one below alone takes them; rclpy's
    # own handlers would invalidate the publishers before a last command could be sent.
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    name = Path(sys.argv[0]).stem
    try:
        try:
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
            node = make_node()
        except REFUSALS as error:
            print(f'{name}: {" ".join(str(error).split())}', file=sys.stderr, flush=True)
            return 2
        _spin(node)
        return 0
    finally:
        rclpy.try_shutdown()


def _spin(node):
    # What is there by now stays: going through it would hold up a command for milliseconds.
    gc.collect()
    gc.freeze()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    stop = Future()

    def wait_for_signal():
        signal.sigwait(STOP_SIGNALS)
        stop.set_result(None)

    threading.Thread(target=wait_for_signal, daemon=True).start()
    try:
        # Not spin_once: a node without a timer would go on waiting for its next message.
        executor.spin_until_future_complete(stop)
    finally:
        close = getattr(node, 'close', None)
        if close is not None:
            close()
        executor.shutdown()
        node.destroy_node()
