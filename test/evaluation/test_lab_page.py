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
"""The page about the laboratory tests says what the runs' results say."""

import pytest

from wallnav_ros.evaluation.lab_page import page, Series


def run(outcome='goal', time=10.0, agent=0.3, wall=0.1):
    return {'outcome': outcome, 'time': time, 'min_gap_agent': agent, 'min_gap_wall': wall,
            'scan_to_command_ms_p50': 21.4}


@pytest.fixture
def text():
    """Return the page about three runs of one test, and two of another with noise."""
    return page([
        Series('lab_1', (0.0, 0.0),
               [run(time=8.0, agent=None), run(time=9.0, agent=None)], 'a.png'),
        Series('lab_2', (0.05, 0.035), [
            run(time=30.0), run('collision', 12.0, agent=-0.01), run('timeout', 120.0, wall=0.02)],
            'b.png')])


def cells(text, first):
    row = next(line for line in text.splitlines() if line.startswith(f'| {first} |'))
    return [cell.strip() for cell in row.strip('|').split('|')]


def test_a_row_tells_outcomes_times_and_least_gaps(text):
    assert cells(text, 'lab_1') == [
        'lab_1', 'perfect', '2 of 2', '0 / 0', '0', '8.5 s (14 s)', '9.0 s', '– / 0.10 m',
        '21 ms']


def test_times_are_those_of_runs_that_reached_the_goal(text):
    assert cells(text, 'lab_2') == [
        'lab_2', '5 cm and 2 degrees', '1 of 3', '1 / 0', '1', '30.0 s (58 s)', '30.0 s',
        '-0.01 m / 0.02 m', '21 ms']


def test_every_row_has_its_picture(text):
    assert '![lab_1, perfect pose](a.png)' in text
    assert '![lab_2, pose off by 5 cm and 2 degrees](b.png)' in text
    assert 'every test 2 to 3 times' in text


def test_the_conditions_of_the_runs_are_told(text):
    assert '2 % of the way' in text and '--speed 1 ' in text and 'chrt' not in text
    told = page([Series('lab_1', (0.0, 0.0), [run()], 'a.png')], 3.0, real_time=True)
    assert '--runs 1 --speed 3 ' in told and 'chrt --rr' in told
