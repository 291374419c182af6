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
"""The suite's own promise: where the recordings are required, nothing is left out unseen."""

import os
import shutil
import subprocess
import sys

import pytest

SKIPPING = ('import pytest\n\n\n'
            '@pytest.mark.skip(reason="the wind")\ndef test_one():\n    pass\n\n\n'
            'def test_two():\n    pass\n')


@pytest.mark.parametrize('required, options, status', [
    ('1', (), pytest.ExitCode.TESTS_FAILED),
    ('1', ('-m', 'not extras'), pytest.ExitCode.OK),
    ('0', (), pytest.ExitCode.OK),
])
def test_a_skip_fails_a_full_run_that_requires_the_recordings(
        repository, tmp_path, required, options, status):
    shutil.copy(repository / 'test' / 'conftest.py', tmp_path)
    (tmp_path / 'test_skipping.py').write_text(SKIPPING)

    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-c', os.devnull, '--rootdir', tmp_path, tmp_path,
         *options],
        cwd=tmp_path, env=os.environ | {'WALLNAV_REQUIRE_DATA': required}, capture_output=True,
        text=True, timeout=60)

    assert done.returncode == status, done.stdout + done.stderr
    assert ('the wind' in done.stdout) == (status != 0)
    assert '1 passed, 1 skipped' in done.stdout.splitlines()[-1]


def test_the_recordings_are_found_by_the_variable_that_names_them(tmp_path, repository):
    shutil.copy(repository / 'test' / 'conftest.py', tmp_path)
    (tmp_path / 'test_data.py').write_text(
        'def test_data(shared_data):\n    assert shared_data.name == "elsewhere"\n')

    def run(data):
        return subprocess.run(
            [sys.executable, '-m', 'pytest', '-c', os.devnull, '--rootdir', tmp_path, tmp_path],
            cwd=tmp_path, capture_output=True, text=True, timeout=60,
            env=os.environ | {'WALLNAV_REQUIRE_DATA': '1', 'WALLNAV_TEST_DATA': str(data)})

    absent = run(tmp_path / 'elsewhere')
    for name in ('scans', 'maps'):
        (tmp_path / 'elsewhere' / name).mkdir(parents=True)
    present = run(tmp_path / 'elsewhere')

    assert absent.returncode == pytest.ExitCode.TESTS_FAILED
    assert 'set WALLNAV_TEST_DATA to a directory with scans/ and maps/' in absent.stdout
    assert present.returncode == pytest.ExitCode.OK, present.stdout
