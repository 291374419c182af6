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
The pool of processes: every job done once, its exceptions handed on, and no waiting for the dead.

The functions worked off are Python's own: a process of its own must be able to import them.
"""

import math
import multiprocessing
import signal

import pytest
from wallnav_ros.evaluation.worker_pool import work_off, WorkerDied


def test_every_job_is_done_once_whatever_the_number_of_workers():
    for workers in (1, 3, 20):
        results = list(work_off(math.sqrt, [0.0, 1.0, 4.0, 9.0, 16.0, 25.0, 36.0], workers))

        assert sorted(results) == [(number, float(number)) for number in range(7)]
        assert not multiprocessing.active_children()


def test_there_may_be_nothing_to_do():
    assert list(work_off(math.sqrt, [], 2)) == []


def test_an_exception_of_a_job_is_raised_and_leaves_no_process():
    with pytest.raises(ValueError, match='math domain error'):
        list(work_off(math.sqrt, [1.0, -1.0, *[4.0] * 100], 2))

    assert not multiprocessing.active_children()


def test_a_worker_that_is_killed_at_work_is_named_with_the_signal_and_ends_the_others():
    jobs = [signal.SIGKILL, *[signal.SIGCONT] * 1000]

    with pytest.raises(WorkerDied, match=r'a worker was killed \(SIGKILL\)'):
        list(work_off(signal.raise_signal, jobs, 2))

    assert not multiprocessing.active_children()


def test_a_worker_that_is_killed_with_half_of_its_result_handed_over_is_noticed():
    # The second result is far more than a pipe holds, and nobody reads it after the first.
    results = work_off(bytes, [1, 100_000_000], 2)
    next(results)
    for process in multiprocessing.active_children():
        process.kill()

    with pytest.raises(WorkerDied, match='SIGKILL'):
        next(results)
    assert not multiprocessing.active_children()


def test_a_worker_that_ends_by_itself_is_noticed_too():
    with pytest.raises(WorkerDied, match='a worker ended with status 3'):
        list(work_off(exit, [3], 1))


def test_nothing_goes_on_when_the_results_are_no_longer_wanted():
    results = work_off(math.sqrt, [1.0] * 1000, 2)
    next(results)
    results.close()

    assert not multiprocessing.active_children()
