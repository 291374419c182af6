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
Policies compared on the same episodes: differences with intervals, and one test over cells.

Paper section 7 (Table 3): one-tailed Wilcoxon signed-rank over the cells, here exact.
"""

from pathlib import Path

import numpy as np
from scipy.stats import rankdata
from wallnav_ros.evaluation.tables import success_text

Z = 1.959964           # of a 95 % interval


def compare(own, other):
    """
    Compare two policies by lists of EpisodeResult per cell, of the same seeds.

    Returns {cells, mean_difference, interval_95, wilcoxon_success, wilcoxon_reward}: rates as
    fractions, own less other; wilcoxon_*: p values of `own` being no better over the cells.
    Raises ValueError where the episodes are not the same.
    """
    cells = [_compare_cell(*pair) for pair in zip(own, other, strict=True)]
    variance = sum(cell.pop('variance') for cell in cells) / len(cells) ** 2
    mean = float(np.mean([cell['difference'] for cell in cells]))
    rewards = [_mean_reward(first) - _mean_reward(second) for first, second in zip(own, other)]
    return {'cells': cells, 'mean_difference': mean,
            'interval_95': _interval(mean, variance),
            'wilcoxon_success': signed_rank_p([cell['difference'] for cell in cells]),
            'wilcoxon_reward': signed_rank_p(rewards)}


def signed_rank_p(differences):
    """
    Return the exact one-tailed p of the Wilcoxon signed-rank test that `differences` are > 0.

    Ties share their mean rank, and differences of 0 have none (Wilcoxon's own rule); every
    assignment of signs is counted, so that ties do no harm.
    """
    differences = np.asarray(differences, dtype=float)
    differences = differences[differences != 0.0]
    # Rounded, for equal shares of the same count may differ in their last bit. Twice the ranks
    # are whole numbers, mean ones too: then all signs are counted rank by rank, not one by one.
    ranks = np.rint(2.0 * rankdata(np.round(np.abs(differences), 9))).astype(int)
    chance = np.ones(1)
    for rank in ranks:
        chance = 0.5 * (np.pad(chance, (0, rank)) + np.pad(chance, (rank, 0)))
    return float(chance[ranks[differences > 0.0].sum():].sum())


def comparison_markdown(summaries, comparisons):
    """
    Return the tables of several models on the same episodes.

    summaries: as of `tables.summarise`, the first being the one compared with the others, to
    which `comparisons` belong one by one.
    """
    names = [Path(summary['model']).stem for summary in summaries]
    lines = ['# ' + ', '.join(names), '', f'Success in %, {summaries[0]["cells"][0]["episodes"]} '
             f'episodes a cell, seeds from {summaries[0]["seed"]}, 95 % intervals (Wilson) in '
             'brackets.', '', '| scenario | case | ' + ' | '.join(names) + ' |',
             '|---' * (2 + len(names)) + '|']
    for cells in zip(*(summary['cells'] for summary in summaries)):
        lines.append(f'| {cells[0]["scenario"]} | {cells[0]["case"]} | '
                     + ' | '.join(map(success_text, cells)) + ' |')
    lines += ['', f'Episode by episode, {names[0]} less the other, in percentage points (95 %): '
              'how many more of the same episodes it wins.', '',
              '| scenario | case | ' + ' | '.join(names[1:]) + ' |',
              '|---' * (1 + len(names)) + '|']
    for cells in zip(*(comparison['cells'] for comparison in comparisons)):
        lines.append(f'| {cells[0]["scenario"]} | {cells[0]["case"]} | '
                     + ' | '.join(map(_points, cells)) + ' |')
    means = [{'difference': comparison['mean_difference'],
              'interval_95': comparison['interval_95']} for comparison in comparisons]
    lines.append('| mean | | ' + ' | '.join(map(_points, means)) + ' |')
    for title, key in (('success', 'wilcoxon_success'), ('total reward', 'wilcoxon_reward')):
        lines.append(f'| Wilcoxon p, {title} | | '
                     + ' | '.join(f'{comparison[key]:.4f}' for comparison in comparisons) + ' |')
    count = len(comparisons[0]['cells'])
    lines += ['', f'Wilcoxon: exact, one-tailed, over the {count} cells; '
              f'{0.5 ** count:.4f} is the least it can give.', '']
    return '\n'.join(lines)


def _compare_cell(own, other):
    if [_key(result) for result in own] != [_key(result) for result in other]:
        raise ValueError('only policies on the same episodes can be compared')
    won = np.array([result.outcome == 'goal' for result in own])
    theirs = np.array([result.outcome == 'goal' for result in other])
    count, wins, losses = len(won), int((won & ~theirs).sum()), int((theirs & ~won).sum())
    difference = (wins - losses) / count
    # Agresti and Min's interval for matched pairs: half a win and half a loss more, so that
    # no difference in few episodes is not taken for certain.
    share = (wins + losses + 1.0) / (count + 2.0)
    shifted = (wins - losses) / (count + 2.0)
    variance = (share - shifted ** 2) / (count + 2.0)
    return {'scenario': own[0].scenario, 'case': own[0].case, 'episodes': count,
            'difference': difference, 'interval_95': _interval(shifted, variance),
            'wins': wins, 'losses': losses, 'variance': variance}


def _key(result):
    return result.scenario, result.case, result.seed


def _mean_reward(results):
    return float(np.mean([sum(result.terms.values()) for result in results]))


def _interval(mean, variance):
    half = Z * float(np.sqrt(variance))
    return [max(-1.0, mean - half), min(1.0, mean + half)]


def _points(figures):
    low, high = figures['interval_95']
    return f'{100 * figures["difference"]:+.1f} ({100 * low:+.1f} to {100 * high:+.1f})'
