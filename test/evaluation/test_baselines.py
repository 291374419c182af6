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
Baselines from their weight files: run by `evaluate`, refused where they do not fit.

Paper section 3; that they equal what was trained is in test/learning/test_baselines.py.
"""

import numpy as np
import pytest
from wallnav_ros.evaluation.baselines import BASELINES, load_baseline
from wallnav_ros.evaluation.episodes import Campaign, load_policy, run_campaigns
from wallnav_ros.policy.value_function import (
    FORMAT, load_value_function, ValueFunction, WeightsError)

pytestmark = pytest.mark.extras

SIZES = {'cadrl': {'value': [8, 1]}, 'lstm_rl': {'embed': [7], 'lstm': [6], 'value': [8, 1]},
         'sarl': {'mlp1': [8, 6], 'mlp2': [6, 4], 'attention': [5, 1], 'mlp3': [8, 1]},
         'st2': {'embed': [8], 'forward': [8], 'value': [8, 1]}}


@pytest.fixture(params=BASELINES)
def kind(request):
    return request.param


def write(path, kind, change=None, **changes):
    """Write untrained weights of `kind`, `change` applied to its tensors."""
    rng, about = np.random.default_rng(3), BASELINES[kind]
    tensors = {name: rng.normal(0.0, 0.3, shape).astype(np.float32) for name, shape in
               about.shapes(SIZES[kind], about.sight.own, about.sight.agent).items()}
    if change:
        change(tensors)
    metadata = {
        'format': FORMAT, 'network': {'kind': kind, 'sizes': SIZES[kind]},
        'features': about.sight.describe(), 'actions': {'max_turn_rate': 1.8}, 'reward': 'R4',
        'decision': {'horizons': [1], 'caution': 0.0}, 'time_step': 0.25, 'discount': 0.9,
        'training': {}, **changes}
    ValueFunction(metadata, tensors).save(path)
    return str(path)


def test_a_weight_file_of_any_baseline_is_a_policy(tmp_path, kind):
    policy = load_policy(write(tmp_path / 'some.npz', kind))

    assert policy.lookahead.sight == BASELINES[kind].sight
    assert policy.lookahead.rule.horizons == (1,)
    changed = load_policy(str(tmp_path / 'some.npz'), (2, 4), 0.1, turns=(1, 3))
    assert changed.lookahead.rule.horizons == (2, 4)
    assert changed.lookahead.rule.caution == 0.1
    assert changed.lookahead.rule.turns == (1, 3)


def test_its_campaigns_are_the_same_on_any_number_of_workers(tmp_path, kind):
    path = write(tmp_path / 'some.npz', kind)
    campaigns = [Campaign(path, 'cross_path', case, range(2)) for case in ('none', 'mixed')]

    alone, together = (run_campaigns(campaigns, workers) for workers in (1, 2))

    for cell, twin in zip(alone, together):
        for one, other in zip(cell, twin):
            assert (one.outcome, one.terms) == (other.outcome, other.terms)
            assert one.path.tobytes() == other.path.tobytes()


def test_the_robot_takes_none_of_them(tmp_path, kind):
    with pytest.raises(WeightsError, match=f"kind: '{kind}' does not see walls"):
        load_value_function(write(tmp_path / 'some.npz', kind))


@pytest.mark.parametrize('changes, line', [
    ({'features': {'version': 0}}, 'features: trained on other features'),
    ({'network': {'kind': 'cadrl', 'sizes': {'value': [8]}}},
     r'metadata.network.sizes: expected layer widths for value ending in 1'),
    ({'network': {'kind': 'cadrl', 'sizes': {'value': [9, 1]}}},
     r'value.0.weight: expected float32 \(13, 9\)'),
    ({'time_step': 0}, 'metadata.time_step')])
def test_weights_that_do_not_fit_are_refused(tmp_path, changes, line):
    with pytest.raises(WeightsError, match=line):
        load_baseline(write(tmp_path / 'some.npz', 'cadrl', **changes))


def test_a_tensor_missing_or_not_finite_is_refused(tmp_path, kind):
    name = next(iter(BASELINES[kind].shapes(SIZES[kind], 6, BASELINES[kind].sight.agent)))

    with pytest.raises(WeightsError, match=f'{name}: tensor missing'):
        load_baseline(write(tmp_path / 'some.npz', kind, lambda tensors: tensors.pop(name)))
    with pytest.raises(WeightsError, match=f'{name}: holds NaN'):
        load_baseline(write(tmp_path / 'some.npz', kind,
                            lambda tensors: tensors[name].fill(np.nan)))
