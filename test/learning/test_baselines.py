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
The trainable baselines: equal to their twins in NumPy, and true to what sets each apart.

Paper section 3.
"""

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.evaluation.baselines import BASELINES
from wallnav_ros.evaluation.joint_state import AGENT
from wallnav_ros.policy.features import Features

torch = pytest.importorskip('torch')
kinds = pytest.importorskip('wallnav_ros.learning.kinds')
networks = pytest.importorskip('wallnav_ros.learning.networks')

pytestmark = pytest.mark.extras


@pytest.fixture(params=BASELINES)
def name(request):
    return request.param


def twins(name):
    """Return the torch network of kind `name`, and its NumPy twin."""
    torch.manual_seed(4)
    network = kinds.KINDS[name].build(kinds.KINDS[name].sizes)
    # Nothing may be zero by chance of how it starts, or a fault there would not be seen.
    for parameter in network.parameters():
        torch.nn.init.normal_(parameter, 0.0, 0.3)
    metadata = {'network': {'kind': name, 'sizes': network.sizes}}
    return networks.NetworkValue(network), BASELINES[name].value(metadata, network.tensors())


def states(name, rng, count=40, agents=7, presence=0.6):
    sight = BASELINES[name].sight
    return Features(rng.normal(size=(count, sight.own)).astype(np.float32),
                    np.zeros((count, 0), np.float32),
                    rng.normal(size=(count, agents, sight.agent)).astype(np.float32),
                    rng.random((count, agents)) < presence)


@pytest.mark.parametrize('presence', [0.0, 0.3, 1.0])
def test_the_numpy_twin_gives_the_same_values(name, rng, presence):
    network, twin = twins(name)
    seen = states(name, rng, presence=presence)

    assert twin(seen) == pytest.approx(network(seen), abs=1e-4, rel=1e-4)


def test_both_twins_value_states_with_no_row_for_an_agent(name, rng):
    network, twin = twins(name)
    seen = states(name, rng, agents=0)

    assert twin(seen) == pytest.approx(network(seen), abs=1e-4, rel=1e-4)


def test_the_twin_keeps_leading_axes(name, rng):
    _, twin = twins(name)
    seen = states(name, rng, count=12)
    folded = Features(*(part.reshape(3, 4, *part.shape[1:]) for part in vars(seen).values()))

    assert twin(folded) == pytest.approx(twin(seen).reshape(3, 4), abs=1e-5)


def test_every_exported_tensor_has_the_name_and_shape_that_the_loader_asks_for(name):
    kind, about = kinds.KINDS[name], BASELINES[name]
    network = kind.build(kind.sizes)

    found = {key: array.shape for key, array in network.tensors().items()}

    assert found == about.shapes(kind.sizes, about.sight.own, about.sight.agent)


def test_padding_and_the_order_of_agents_do_not_matter(name, rng):
    _, twin = twins(name)
    seen = states(name, rng)
    garbage = np.where(seen.present[..., None], seen.agents, np.float32(77.0))
    order = rng.permutation(seen.present.shape[1])
    shuffled = replace(seen, agents=garbage[:, order], present=seen.present[:, order])

    assert twin(shuffled) == pytest.approx(twin(seen), abs=1e-4, rel=1e-4)


def test_cadrl_knows_only_the_worst_pair(rng):
    _, twin = twins('cadrl')
    seen = states('cadrl', rng, count=1, agents=5, presence=1.0)
    pairs = [float(twin(replace(seen, agents=seen.agents[:, [row]],
                                present=seen.present[:, [row]]))[0]) for row in range(5)]

    assert twin(seen)[0] == pytest.approx(min(pairs), abs=1e-5)


def test_lstm_rl_reads_the_nearest_agent_last(rng):
    """Its value changes if the distances alone are swapped, so that others come last."""
    _, twin = twins('lstm_rl')
    seen = states('lstm_rl', rng, count=1, agents=2, presence=1.0)
    near, far = seen.agents.copy(), seen.agents.copy()
    near[0, :, AGENT.index('x')], far[0, :, AGENT.index('x')] = (1e-3, 2e-3), (2e-3, 1e-3)
    near[0, :, AGENT.index('y')] = far[0, :, AGENT.index('y')] = 0.0

    assert abs(twin(replace(seen, agents=near)) - twin(replace(seen, agents=far)))[0] > 1e-2


def test_st2_tells_a_frame_from_an_earlier_one(rng):
    _, twin = twins('st2')
    seen = states('st2', rng, count=1, agents=2, presence=1.0)
    swapped = seen.agents.copy()
    swapped[..., len(AGENT):3 * len(AGENT)] = np.roll(
        swapped[..., len(AGENT):3 * len(AGENT)], len(AGENT), axis=-1)

    assert abs(twin(replace(seen, agents=swapped)) - twin(seen))[0] > 1e-3


def test_gradients_reach_every_weight(name, rng):
    kind = kinds.KINDS[name]
    network = kind.build(kind.sizes)
    seen = states(name, rng)

    network(*(torch.from_numpy(part) for part in
              (seen.robot, seen.agents, seen.present))).square().sum().backward()

    assert all(parameter.grad is not None and bool((parameter.grad != 0).any())
               for parameter in network.parameters())
