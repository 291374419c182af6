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
Results to numbers: rates with intervals per cell, CSV rows and Markdown tables.

Paper section 7 (Fig. 4, Table 2); intervals are Wilson's.
"""

import csv

import numpy as np
from scipy.stats import binomtest

from wallnav_ros.evaluation.metrics import COMFORT, comfort, INTIMATE, PERSONAL
from wallnav_ros.simulation.batch import OUTCOMES
from wallnav_ros.world.files import atomic_write

RATES = {'success_rate': 'goal', 'collision_rate': 'collision',
         'wall_collision_rate': 'wall_collision', 'timeout_rate': 'timeout'}
COLUMNS = ('seed', 'scenario', 'case', 'outcome', 'time', 'path_length', 'min_gap_agent',
           'min_gap_wall')


def cell_summary(results):
    """Return one cell's entry of summary.json from its EpisodeResults."""
    count = len(results)
    cell = {'scenario': results[0].scenario, 'case': results[0].case, 'episodes': count}
    intervals = {}
    for rate, outcome in RATES.items():
        hits = sum(result.outcome == outcome for result in results)
        cell[rate] = hits / count
        interval = binomtest(hits, count).proportion_ci(0.95, method='wilson')
        intervals[rate] = [float(interval.low), float(interval.high)]
    reached = [result for result in results if result.outcome == 'goal']
    cell['mean_time'] = _mean([result.time for result in reached])
    cell['mean_path_length'] = _mean([result.path_length for result in reached])
    # Where there was nobody, or no wall, a gap is infinite, for which JSON has no word.
    for name in ('min_gap_agent', 'min_gap_wall'):
        gaps = [getattr(result, name) for result in results]
        cell[f'mean_{name}'] = _mean([gap for gap in gaps if np.isfinite(gap)])
    comforts = [comfort(result) for result in results]
    for name in COMFORT:
        key = name if name.startswith('mean') else f'mean_{name}'
        cell[key] = _mean([figures[name] for figures in comforts])
    cell['intervals_95'] = intervals
    cell['reward_terms'] = {name: _mean([result.terms[name] for result in results])
                            for name in results[0].terms}
    return cell


def write_episodes(path, results):
    """Write one CSV row per EpisodeResult: COLUMNS, COMFORT, then the reward terms."""
    terms = list(results[0].terms)
    with atomic_write(path, newline='') as stream:
        writer = csv.writer(stream)
        writer.writerow([*COLUMNS, *COMFORT, *terms])
        for result in results:
            figures = comfort(result)
            writer.writerow([*(_text(getattr(result, name)) for name in COLUMNS),
                             *(_text(figures[name]) for name in COMFORT),
                             *(_text(result.terms[name]) for name in terms)])


def markdown(summary):
    """Return the tables of a summary: rates with intervals, comfort, mean reward terms."""
    cells = summary['cells']
    return '\n'.join([
        f'# {summary["model"]}, {cells[0]["episodes"]} episodes a cell, seeds from '
        f'{summary["seed"]}', '', *_rate_table(cells), '', *_comfort_table(cells), '',
        *_reward_table(cells), ''])


def _rate_table(cells):
    lines = ['| scenario | case | success % | collision % | wall % | timeout % | time s '
             '| path m | min gap to agents m |', '|---|---|---|---|---|---|---|---|---|']
    for cell in cells:
        rates = [success_text(cell), *(f'{100 * cell[rate]:.1f}' for rate in list(RATES)[1:])]
        means = [_number(cell[name]) for name in ('mean_time', 'mean_path_length',
                                                  'mean_min_gap_agent')]
        row = ' | '.join([cell['scenario'], cell['case'], *rates, *means])
        lines.append(f'| {row} |')
    return lines


def _comfort_table(cells):
    lines = ['| scenario | case | min gap to walls m | mean jerk m/s³ '
             f'| s with people within {INTIMATE} m | within {PERSONAL} m |', '|---' * 6 + '|']
    for cell in cells:
        means = [_number(cell[name]) for name in (
            'mean_min_gap_wall', 'mean_jerk', 'mean_intimate_time', 'mean_personal_time')]
        lines.append(f'| {cell["scenario"]} | {cell["case"]} | ' + ' | '.join(means) + ' |')
    return lines


def _reward_table(cells):
    terms = list(cells[0]['reward_terms'])
    lines = ['| scenario | case | total | ' + ' | '.join(terms) + ' |',
             '|---' * (len(terms) + 3) + '|']
    for cell in cells:
        values = [sum(cell['reward_terms'].values()), *cell['reward_terms'].values()]
        lines.append(f'| {cell["scenario"]} | {cell["case"]} | '
                     + ' | '.join(f'{value:.2f}' for value in values) + ' |')
    return lines


def success_text(cell):
    """Return the success rate of a cell's summary and its interval, in percent."""
    low, high = cell['intervals_95']['success_rate']
    return f'{100 * cell["success_rate"]:.1f} ({100 * low:.1f}–{100 * high:.1f})'


def summarise(model, seed, results):
    """Return summary.json's document from one list of EpisodeResult per cell."""
    return {'model': model, 'seed': seed, 'outcomes': list(OUTCOMES[1:]),
            'cells': [cell_summary(cell) for cell in results]}


def _mean(values):
    return float(np.mean(values)) if len(values) else None


def _number(value):
    return '–' if value is None else f'{value:.2f}'


def _text(value):
    return f'{value:.6g}' if isinstance(value, float) else value
