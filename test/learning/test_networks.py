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
The trainable value network: what its twin in NumPy must reproduce.

Paper section 3 (Fig. 2); equality with the twin is in test/policy/test_value_function.py.
"""

import pytest

from wallnav_ros.policy import features as feature_set
from wallnav_ros.policy.value_function import layer_shapes

torch = pytest.importorskip('torch')
networks = pytest.importorskip('wallnav_ros.learning.networks')

pytestmark = pytest.mark.extras

OWN = len(feature_set.ROBOT) + feature_set.WALL_RAYS
AGENT = len(feature_set.AGENT)


@pytest.fixture
def network():
    torch.manual_seed(1)
    return networks.ValueNetwork({'mlp1': [12, 10], 'mlp2': [9, 7], 'attention': [8, 1],
                                  'mlp3': [11, 6, 1]})


def states(count, agents, presence=0.6):
    generator = torch.Generator().manual_seed(2)
    return (torch.randn(count, OWN, generator=generator),
            torch.randn(count, agents, AGENT, generator=generator),
            torch.rand(count, agents, generator=generator) < presence)


def test_tensors_are_named_and_shaped_as_weight_files_want_them():
    network = networks.ValueNetwork()

    found = {name: array.shape for name, array in network.tensors().items()}

    assert found == layer_shapes(networks.SIZES)


def test_every_parameter_is_exported():
    network = networks.ValueNetwork()

    assert sum(array.size for array in network.tensors().values()) == sum(
        parameter.numel() for parameter in network.parameters())


def test_each_state_is_valued_by_itself(network):
    own, agents, present = states(9, 5)

    together = network(own, agents, present)

    for row in range(9):
        alone = network(own[row:row + 1], agents[row:row + 1], present[row:row + 1])
        assert alone.item() == pytest.approx(together[row].item(), abs=1e-5)


def test_states_without_agents_have_a_value(network):
    own, agents, present = states(4, 3, presence=0.0)

    assert torch.equal(network(own, agents, present),
                       network(own, agents[:, :0], present[:, :0]))


@pytest.mark.parametrize('presence', [0.0, 0.6])
def test_gradients_are_finite_and_reach_what_was_used(network, presence):
    own, agents, present = states(16, 5, presence)

    network(own, agents, present).square().sum().backward()

    reached = {name for name, parameter in network.named_parameters()
               if parameter.grad is not None and parameter.grad.abs().sum() > 0.0}
    assert all(torch.isfinite(parameter.grad).all() for parameter in network.parameters()
               if parameter.grad is not None)
    rooms = {name.split('.')[0] for name in reached}
    assert rooms == ({'mlp1', 'mlp2', 'attention', 'mlp3'} if presence else {'mlp3'})


def test_a_lookahead_gets_float64_values_without_gradients(network, rng):
    from wallnav_ros.policy.features import Features
    own, agents, present = (part.numpy() for part in states(6, 4))
    features = Features(own[:, :len(feature_set.ROBOT)], own[:, len(feature_set.ROBOT):],
                        agents, present)

    values = networks.NetworkValue(network)(features)

    assert values.dtype == float
    assert values == pytest.approx(network(*states(6, 4)).detach().numpy())
