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
The benchmark's stages: each measures real calls and reports ordered figures.

Their speed is not judged here: the machine is shared.
"""

import pytest

from wallnav_ros.evaluation import stages
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.value_function import load_value_function
from wallnav_ros.simulation.orca import OrcaPolicy
from wallnav_ros.world.files import find_asset

pytestmark = pytest.mark.extras

CALLS = stages.WARM_UP + 3


def test_measure_leaves_the_warm_up_out_and_orders_its_percentiles():
    seen = []

    figure = stages.measure(seen.append, range(CALLS))

    assert seen == list(range(CALLS))
    assert figure['calls'] == 3
    assert 0.0 <= figure['ms_p50'] <= figure['ms_p99']


@pytest.mark.parametrize('stage', [
    lambda: stages.time_tracking(180, 5, CALLS),
    lambda: stages.time_tracking(180, 0, CALLS),
    lambda: stages.time_decision(
        load_value_function(find_asset('models', 'wallnav', '.npz')), 5, CALLS),
    lambda: stages.time_simulator(CALLS),
    lambda: stages.time_simulator(CALLS, episodes=3),
], ids=['tracking', 'tracking an empty hall', 'decision', 'simulator', 'simulator, batched'])
def test_every_stage_runs_on_real_code(stage):
    figure = stage()

    assert figure['calls'] == 3
    assert 0.0 < figure['ms_p50'] <= figure['ms_p99']


def test_episodes_side_by_side_share_the_cost_of_a_step():
    alone, shared = (min(stages.time_simulator(40, episodes)['ms_p50'] for _ in range(3))
                     for episodes in (1, 10))

    assert shared < 0.9 * alone


def test_the_rate_of_evaluation_counts_all_eight_cells():
    rate = stages.evaluation_rate(OrcaPolicy(make_actions()), episodes=1)

    # An ORCA episode takes from a hundredth of a second to a minute, on any machine.
    assert 60.0 < rate < 360000.0
