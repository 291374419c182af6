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
Policies on the same episodes: differences, intervals and the test over cells, by hand.

Wilcoxon, "Individual comparisons by ranking methods", 1945; Agresti and Min, 2005.
"""

import numpy as np
import pytest
from scipy.stats import wilcoxon
from wallnav_ros.evaluation.comparison import compare, comparison_markdown, signed_rank_p
from wallnav_ros.evaluation.tables import summarise
from wallnav_ros.simulation.rollout import EpisodeResult

pytestmark = pytest.mark.extras


def cell(outcomes, case='mixed'):
    """Return results of seeds 0, 1, ...: g reached the goal, c collided."""
    return [EpisodeResult('cross_path', case, seed, 'goal' if outcome == 'g' else 'collision',
                          10.0, 8.0, 0.5, 1.0, {'R_g': 10.0 if outcome == 'g' else 0.0},
                          np.zeros((2, 3)), np.full(40, 2.0))
            for seed, outcome in enumerate(outcomes)]


def test_eight_wins_of_eight_give_the_least_p():
    assert signed_rank_p(0.01 * np.arange(1, 9)) == pytest.approx(0.5 ** 8)


def test_p_is_worked_by_hand():
    """Ranks 1 (negative), 2, 3: of 8 signs, only +++ and -++ reach a sum of 4."""
    assert signed_rank_p([0.3, -0.1, 0.2]) == pytest.approx(2 / 8)


def test_p_is_scipys_where_that_is_exact(rng):
    for _ in range(20):
        differences = rng.normal(0.3, 1.0, size=8)

        assert signed_rank_p(differences) == pytest.approx(
            wilcoxon(differences, alternative='greater', method='exact').pvalue)


def test_ties_share_their_rank():
    """Ranks 1.5, 1.5 (one of them negative), 3: sums of signs >= 3 are +++ and two of -++."""
    assert signed_rank_p([0.1, -0.1, 0.2]) == pytest.approx(3 / 8)


def test_many_cells_take_no_longer_than_few():
    """Of 2 ** 60 assignments of signs, the one that is seen is the only one with its sum."""
    assert signed_rank_p(np.arange(1, 61)) == pytest.approx(0.5 ** 60)
    assert signed_rank_p(-np.arange(1, 61)) == pytest.approx(1.0)


@pytest.mark.parametrize('differences, p', [
    ([], 1.0), ([0.0, 0.0], 1.0), ([0.1], 0.5), ([-0.1], 1.0), ([0.0, 0.1], 0.5)])
def test_hardly_any_difference_proves_nothing(differences, p):
    assert signed_rank_p(differences) == p


def test_a_cells_difference_counts_the_episodes_that_only_one_won():
    figures = compare([cell('ggggcc')], [cell('gcccgc')])['cells'][0]

    assert (figures['wins'], figures['losses'], figures['episodes']) == (3, 1, 6)
    assert figures['difference'] == pytest.approx(2 / 6)
    # Half a win and half a loss more: 5 of 8 differ, by 2 of 8.
    half = 1.959964 * np.sqrt((5 / 8 - (2 / 8) ** 2) / 8)
    assert figures['interval_95'] == pytest.approx([0.25 - half, 0.25 + half])


def test_pairing_narrows_the_interval():
    """Nine of ten the same, one more won: twice as many episodes would be needed unpaired."""
    low, high = compare([cell('g' * 90 + 'c' * 10)],
                        [cell('g' * 89 + 'c' * 11)])['cells'][0]['interval_95']

    unpaired = 2 * 1.96 * np.sqrt(2 * 0.9 * 0.1 / 100)
    assert high - low < 0.5 * unpaired


def test_the_mean_over_cells_has_the_interval_of_independent_cells():
    one, other = [cell('gg' * 20), cell('gc' * 20)], [cell('gc' * 20), cell('gc' * 20)]

    figures = compare(one, other)

    assert figures['mean_difference'] == pytest.approx(0.25)
    halves = [(high - low) / 2 for low, high in
              (part['interval_95'] for part in figures['cells'])]
    low, high = figures['interval_95']
    assert (high - low) / 2 == pytest.approx(np.hypot(*halves) / 2)


def test_other_episodes_are_not_compared():
    with pytest.raises(ValueError, match='same episodes'):
        compare([cell('gg')], [cell('ggg')])
    with pytest.raises(ValueError, match='same episodes'):
        compare([cell('gg')], [cell('gg', case='static')])


def test_the_table_has_every_model_and_cell():
    ours = [cell('gggg'), cell('ggcg', 'static')]
    theirs = [cell('gcgc'), cell('ggcc', 'static')]
    summaries = [summarise('ours', 0, ours), summarise('theirs', 0, theirs)]

    text = comparison_markdown(summaries, [compare(ours, theirs)])

    assert '| scenario | case | ours | theirs |' in text
    assert '| cross_path | mixed | 100.0 (51.0–100.0) | 50.0 (15.0–85.0) |' in text
    assert '| cross_path | mixed | +50.0 (' in text
    assert '| mean | | +37.5 (' in text
    assert '| Wilcoxon p, success | | 0.2500 |' in text
    assert 'over the 2 cells; 0.2500 is the least' in text
    tables = [line for line in text.splitlines() if line.startswith('|')]
    assert {line.count('|') for line in tables[:4]} == {5}
    assert {line.count('|') for line in tables[4:]} == {4}
