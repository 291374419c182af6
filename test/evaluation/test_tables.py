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
Results to numbers: rates, intervals and means worked by hand, rows and tables as promised.

Wilson's interval: E. B. Wilson, "Probable inference", 1927.
"""

import csv
import json

import numpy as np
import pytest
from wallnav_ros.evaluation.metrics import COMFORT
from wallnav_ros.evaluation.tables import (
    cell_summary, COLUMNS, markdown, summarise, write_episodes)
from wallnav_ros.simulation.rollout import EpisodeResult

pytestmark = pytest.mark.extras


def result(outcome='goal', seed=0, time=10.0, length=8.0, agent=0.5, wall=1.0, **terms):
    return EpisodeResult('cross_path', 'mixed', seed, outcome, time, length, agent, wall,
                         {'R_g': 10.0 if outcome == 'goal' else 0.0, 'R_c': 0.0, **terms},
                         np.zeros((2, 3)), np.array([0.3, 2.0]))


CELL = [result(time=9.0, length=7.9, agent=np.inf), result(time=11.0, length=8.3),
        result(time=10.0), result('collision', time=3.0, length=2.0, agent=-0.1, R_c=-0.5),
        result('timeout', time=45.0, length=1.0)]


def test_rates_are_shares_of_all_episodes():
    cell = cell_summary(CELL)

    assert cell['episodes'] == 5
    assert (cell['scenario'], cell['case']) == ('cross_path', 'mixed')
    assert [cell[rate] for rate in ('success_rate', 'collision_rate', 'wall_collision_rate',
                                    'timeout_rate')] == [0.6, 0.2, 0.0, 0.2]


def test_times_and_lengths_are_those_of_episodes_that_arrived():
    cell = cell_summary(CELL)

    assert cell['mean_time'] == pytest.approx(10.0)
    assert cell['mean_path_length'] == pytest.approx((7.9 + 8.3 + 8.0) / 3)


def test_a_summary_of_an_open_world_with_nobody_in_it_is_valid_json():
    cell = cell_summary([result(agent=np.inf, wall=np.inf)])

    assert cell['mean_min_gap_agent'] is None and cell['mean_min_gap_wall'] is None
    json.dumps(cell, allow_nan=False)


def test_gaps_are_means_over_all_that_met_anybody():
    cell = cell_summary(CELL)

    assert cell['mean_min_gap_agent'] == pytest.approx((0.5 + 0.5 - 0.1 + 0.5) / 4)
    assert cell['mean_min_gap_wall'] == 1.0


def test_reward_terms_are_means_over_all_episodes():
    assert cell_summary(CELL)['reward_terms'] == pytest.approx({'R_g': 6.0, 'R_c': -0.1})


def test_intervals_are_wilsons():
    """Three of five: (p + z^2/2n -+ z sqrt(p(1-p)/n + z^2/4n^2)) / (1 + z^2/n), z = 1.95996."""
    n, p, z = 5, 0.6, 1.959964
    middle, half = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))

    interval = cell_summary(CELL)['intervals_95']['success_rate']

    assert interval == pytest.approx([(middle - half) / (1 + z * z / n),
                                      (middle + half) / (1 + z * z / n)], abs=1e-6)


def test_all_or_nothing_has_an_interval_too():
    cell = cell_summary([result()] * 100)

    # 100 of 100: down to n / (n + z^2).
    assert cell['intervals_95']['success_rate'] == pytest.approx([100 / 103.8415, 1.0], abs=1e-4)
    assert cell['intervals_95']['timeout_rate'][0] == 0.0


def test_a_cell_where_nobody_arrived_has_no_mean_time():
    cell = cell_summary([result('timeout', agent=np.inf)])

    assert cell['mean_time'] is None
    assert cell['mean_path_length'] is None
    assert cell['mean_min_gap_agent'] is None


def test_a_summary_is_json_without_nan():
    text = json.dumps(summarise('orca', 3, [CELL, [result('timeout', agent=np.inf)]]),
                      allow_nan=False)

    assert json.loads(text)['cells'][0]['success_rate'] == 0.6


def test_a_summary_has_the_fields_of_the_contract():
    summary = summarise('orca', 3, [CELL])

    assert {'model', 'seed', 'cells'} <= set(summary)
    assert {'scenario', 'case', 'episodes', 'success_rate', 'collision_rate',
            'wall_collision_rate', 'timeout_rate', 'mean_time', 'mean_path_length',
            'intervals_95', 'reward_terms'} <= set(summary['cells'][0])


def test_episodes_are_written_one_a_row_with_their_terms(tmp_path):
    write_episodes(tmp_path / 'episodes.csv', CELL)

    with open(tmp_path / 'episodes.csv', newline='') as stream:
        header, *rows = csv.reader(stream)
    assert header == [*COLUMNS, *COMFORT, 'R_g', 'R_c']
    # In one of two steps somebody was nearer than 0.45 m, and so than 1.2 m.
    assert rows[0] == ['0', 'cross_path', 'mixed', 'goal', '9', '7.9', 'inf', '1', '0', '4.5',
                       '4.5', '10', '0']
    assert rows[3] == ['0', 'cross_path', 'mixed', 'collision', '3', '2', '-0.1', '1', '0',
                       '1.5', '1.5', '0', '-0.5']
    assert len(rows) == 5


def test_tables_show_every_cell_with_its_interval():
    summary = summarise('orca', 3, [CELL, [result('timeout', agent=np.inf)]])

    lines = markdown(summary).splitlines()

    rows = [line for line in lines if line.startswith('| cross_path | mixed |')]
    assert len(rows) == 6      # three tables of two cells
    low, high = summary['cells'][0]['intervals_95']['success_rate']
    assert f'60.0 ({100 * low:.1f}–{100 * high:.1f}) | 20.0 | 0.0 | 20.0 | 10.00' in rows[0]
    assert rows[1].endswith('| – | – | – |')
    # Gap to walls, jerk, and half of 9, 11, 10, 3 and 45 s in intimate and personal space.
    assert rows[2] == '| cross_path | mixed | 1.00 | 0.00 | 7.80 | 7.80 |'
    # Total, R_g and R_c.
    assert rows[4] == '| cross_path | mixed | 5.90 | 6.00 | -0.10 |'
    columns = {line.count('|') for line in rows[4:]}
    assert columns == {next(line for line in lines if 'total' in line).count('|')}
