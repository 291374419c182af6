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
Let several processes work on a list of jobs, and notice at once when one of them is killed.

concurrent.futures can wait for ever there: while its thread marks the pending jobs as broken, the
reader of the results cancels them; that thread then dies before it has ended the other workers.
"""

from collections import deque
import multiprocessing
from multiprocessing.connection import wait
import signal


class WorkerDied(RuntimeError):
    """A worker process ended before its work was done."""


def work_off(function, jobs, workers):
    """
    Yield (number, function(job)) of every job, numbered from 0, in the order they are done.

    function: importable by name, as are jobs and results by pickle. An exception of one job is
    raised here. Raises WorkerDied where a process ended; none outlives the generator.
    """
    waiting = deque(enumerate(jobs))
    pool = {}
    try:
        for _ in range(min(workers, len(waiting))):
            _start(function, pool)
        at_work = {link: _hand_out(waiting, link, process) for link, process in pool.items()}
        while at_work:
            # A link whose process has died is ready too, with its end.
            for link in wait(at_work):
                yield at_work.pop(link), _result(link, pool[link])
                if waiting:
                    at_work[link] = _hand_out(waiting, link, pool[link])
    finally:
        for process in pool.values():
            process.kill()
        for process in pool.values():
            process.join()


def _start(function, pool):
    """Add a process to `pool`, {our end of its pipe: process}."""
    context = multiprocessing.get_context('spawn')
    ours, theirs = context.Pipe()
    pool[ours] = process = context.Process(
        target=_serve, args=(function, theirs), daemon=True)
    process.start()
    # With the only other end in the process, its death is the end of what is read here.
    theirs.close()


def _hand_out(waiting, link, process):
    """Send the next job; returns its number."""
    number, job = waiting.popleft()
    try:
        link.send(job)
    except OSError:
        raise WorkerDied(_death(process)) from None
    return number


def _result(link, process):
    try:
        result, error = link.recv()
    except (EOFError, OSError):
        raise WorkerDied(_death(process)) from None
    if error is not None:
        raise error
    return result


def _death(process):
    process.join()
    if process.exitcode < 0:
        return f'a worker was killed ({signal.Signals(-process.exitcode).name})'
    return f'a worker ended with status {process.exitcode}'


def _serve(function, link):
    """Answer every job with (result, exception) until nobody is left who asks."""
    # Ctrl-C reaches every process of the terminal; the one that asks ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            job = link.recv()
        except (EOFError, OSError):
            return
        try:
            answer = function(job), None
        except Exception as error:
            answer = None, error
        try:
            link.send(answer)
        except OSError:
            return
