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
Campaigns of paired seeds: the same results on any number of workers.

Paper section 7.
"""

import numpy as np
import pytest
from wallnav_ros.evaluation.episodes import BATCH, Campaign, load_policy, run_campaigns
from wallnav_ros.policy import features as feature_set
from wallnav_ros.policy.value_function import (
    FORMAT, layer_shapes, ValueFunction, WeightsError)
from wallnav_ros.simulation.orca import OrcaPolicy

pytestmark = pytest.mark.extras

SIZES = {'mlp1': [8, 6], 'mlp2': [6, 4], 'attention': [5, 1], 'mlp3': [8, 1]}


@pytest.fixture(scope='module')
def scenario(tmp_path_factory):
    """Return a small hall with a short time limit."""
    path = tmp_path_factory.mktemp('scenario') / 'hall.yaml'
    path.write_text('walls: [[[-2, -4], [4, -4], [4, -4.2]], [[1, 3], [2, 3], [2, 4]]]\n'
                    'robot: {start: [0, 0, 0], goal: [2, 0]}\ntime_limit: 4.0\n'
                    'cases: {none: {}, busy: {static: 2, dynamic: 2}}\n'
                    'agents: {radius: [0.1, 0.3], goal: anywhere}\n')
    return str(path)


@pytest.fixture(scope='module')
def weights(tmp_path_factory):
    """Return an untrained weight file."""
    rng = np.random.default_rng(3)
    tensors = {name: rng.normal(0.0, 0.3, shape).astype(np.float32)
               for name, shape in layer_shapes(SIZES).items()}
    path = tmp_path_factory.mktemp('weights') / 'untrained.npz'
    ValueFunction({
        'format': FORMAT, 'network': {'kind': 'three_mlp', 'sizes': SIZES},
        'features': feature_set.describe(), 'actions': {'max_turn_rate': 1.8}, 'reward': 'R4',
        'decision': {'horizons': [1], 'caution': 0.0}, 'time_step': 0.25, 'discount': 0.9,
        'training': {}}, tensors).save(path)
    return str(path)


def figures(results):
    return [(result.scenario, result.case, result.seed, result.outcome, result.time,
             result.path_length, result.min_gap_agent, result.min_gap_wall, result.terms)
            for cell in results for result in cell]


def test_results_come_by_campaign_and_in_the_order_of_seeds(scenario):
    campaigns = [Campaign('orca', scenario, 'busy', range(5, 5 + BATCH + 3)),
                 Campaign('orca', scenario, 'none', range(2))]

    busy, none = run_campaigns(campaigns)

    assert [result.seed for result in busy] == list(range(5, 5 + BATCH + 3))
    assert [(result.seed, result.case) for result in none] == [(0, 'none'), (1, 'none')]


@pytest.mark.parametrize('model', ['orca', 'weights'])
def test_two_workers_give_the_results_of_one(scenario, weights, model):
    model = weights if model == 'weights' else model
    campaigns = [Campaign(model, scenario, 'busy', range(BATCH + 2)),
                 Campaign(model, scenario, 'none', range(3))]

    alone = run_campaigns(campaigns)
    together = run_campaigns(campaigns, workers=2)

    assert figures(together) == figures(alone)
    assert all((one.path == other.path).all() for cell, twin in zip(alone, together)
               for one, other in zip(cell, twin))


def test_an_episode_does_not_depend_on_where_the_campaign_starts_but_for_rounding(scenario):
    """Seed 4 as the fifth episode of one campaign and as the first of another."""
    late, early = (run_campaigns([Campaign('orca', scenario, 'busy', seeds)])[0]
                   for seeds in (range(5), range(4, 6)))

    assert (late[4].seed, late[4].outcome) == (early[0].seed, early[0].outcome)
    assert late[4].path == pytest.approx(early[0].path)


def test_orca_and_weight_files_are_policies(weights):
    assert isinstance(load_policy('orca'), OrcaPolicy)
    assert load_policy(weights).lookahead.rule.horizons == (1,)
    assert load_policy(weights, (2, 4)).lookahead.rule.horizons == (2, 4)
    assert load_policy(weights, caution=0.3).lookahead.rule.caution == 0.3


def test_an_unknown_model_lists_the_shipped_ones():
    with pytest.raises(FileNotFoundError, match='nobody: no such file, nor one of the shipped'):
        load_policy('nobody')


def test_a_broken_weight_file_is_refused(tmp_path):
    (tmp_path / 'broken.npz').write_bytes(b'PK')

    with pytest.raises(WeightsError, match='not a readable .npz weight file'):
        load_policy(str(tmp_path / 'broken.npz'))
