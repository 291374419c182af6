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
What every test may ask for: recorded data, seeded randomness, a ROS domain of its own.

Recordings are looked for in $WALLNAV_TEST_DATA, else in ../shared/data beside the repository.
"""

import os
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[1]


def is_strict(config):
    """Return whether this run must leave nothing out: $WALLNAV_REQUIRE_DATA, every extra there."""
    everything = 'not extras' not in config.getoption('markexpr')
    return everything and os.environ.get('WALLNAV_REQUIRE_DATA') == '1'


def pytest_sessionfinish(session):
    """Fail a run in which a test was skipped that must not be."""
    reporter = session.config.pluginmanager.get_plugin('terminalreporter')
    if is_strict(session.config) and reporter.stats.get('skipped'):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter, config):
    """Say why such a run failed."""
    skipped = terminalreporter.stats.get('skipped', ())
    if is_strict(config) and skipped:
        terminalreporter.section('skipped, which WALLNAV_REQUIRE_DATA=1 does not allow')
        for report in skipped:
            terminalreporter.line(f'{report.nodeid}: {report.longrepr[-1]}')


@pytest.fixture(scope='session')
def repository():
    """Return the root of the repository."""
    return REPOSITORY


@pytest.fixture
def rng():
    """Return a random generator that starts the same in every test."""
    return np.random.default_rng(20260101)


@pytest.fixture(scope='session')
def shared_data():
    """
    Return the directory of the recorded scans and maps.

    Skips where it is absent; fails there when $WALLNAV_REQUIRE_DATA is 1.
    """
    data = Path(os.environ.get('WALLNAV_TEST_DATA') or REPOSITORY.parent / 'shared' / 'data')
    if (data / 'scans').is_dir() and (data / 'maps').is_dir():
        return data
    reason = f'no recordings in {data}: set WALLNAV_TEST_DATA to a directory with scans/ and maps/'
    if os.environ.get('WALLNAV_REQUIRE_DATA') == '1':
        pytest.fail(reason, pytrace=False)
    pytest.skip(reason)


@pytest.fixture(scope='session')
def ros_domain_id():
    """
    Return a ROS domain id that no other test process of this machine uses, and enter it.

    Processes started by a test inherit the domain.
    """
    # Told apart from those of `drive` too, which may run beside it.
    from wallnav_ros.commands.node_processes import Domain
    with Domain() as domain:
        yield domain.id
