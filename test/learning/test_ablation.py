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
Networks with a part taken out: what is gone does not matter, and stays gone while it learns.

The ablations of docs/learning.md.
"""

import numpy as np
import pytest

from wallnav_ros.policy import features as feature_set
from wallnav_ros.policy.features import Features
from wallnav_ros.policy.value_function import ValueFunction

torch = pytest.importorskip('torch')
networks = pytest.importorskip('wallnav_ros.learning.networks')
ablation = pytest.importorskip('wallnav_ros.learning.ablation')

pytestmark = pytest.mark.extras

SIZES = {'mlp1': [12, 10], 'mlp2': [9, 7], 'attention': [8, 1], 'mlp3': [11, 6, 1]}
WALLS = ('wall_gap', 'clearance', 'clearance_ahead')


def trained(without):
    """Return the NumPy twin of an ablated network after a few steps of learning."""
    torch.manual_seed(0)
    network = networks.ValueNetwork(SIZES)
    ablation.ablate(network, without)
    optimizer = torch.optim.Adam(network.parameters(), 1e-2)
    for _ in range(20):
        own, agents = torch.randn(50, networks.OWN), torch.randn(50, 4, networks.AGENT)
        value = network(own, agents, torch.rand(50, 4) < 0.7)
        optimizer.zero_grad()
        (value - own[:, 0] - own[:, -1]).square().mean().backward()
        optimizer.step()
    return ValueFunction({'network': {'kind': 'three_mlp', 'sizes': SIZES}}, network.tensors())


def states(rng, count=30, agents=4):
    draw = [rng.normal(size=shape).astype(np.float32) for shape in (
        (count, len(feature_set.ROBOT)), (count, feature_set.WALL_RAYS),
        (count, agents, len(feature_set.AGENT)))]
    return Features(*draw, rng.random((count, agents)) < 0.7)


def with_other_walls(seen, rng):
    robot, agents = seen.robot.copy(), seen.agents.copy()
    for rows, names in ((robot, feature_set.ROBOT), (agents, feature_set.AGENT)):
        for number, name in enumerate(names):
            if name in WALLS:
                rows[..., number] = rng.normal(size=rows.shape[:-1])
    return Features(robot, rng.normal(size=seen.walls.shape).astype(np.float32), agents,
                    seen.present)


def test_without_walls_no_wall_changes_a_value(rng):
    seen = states(rng)
    other = with_other_walls(seen, rng)

    blind, whole = trained(('walls',)), trained(())

    assert (blind(other) == blind(seen)).all()
    assert not np.isclose(whole(other), whole(seen)).any()


def test_without_walls_everything_else_still_counts(rng):
    seen, other = states(rng), states(rng)
    value = trained(('walls',))

    assert not np.isclose(value(Features(other.robot, seen.walls, seen.agents, seen.present)),
                          value(seen)).any()


def test_without_attention_every_agent_weighs_the_same(rng):
    """What three agents add up to is the mean of what each is alone."""
    seen, present = states(rng, agents=3), np.ones((30, 3), dtype=bool)
    own = np.concatenate((seen.robot, seen.walls), axis=1)

    def crowd(value, rows):
        return value._crowd(own, seen.agents[:, rows], present[:, rows])

    even, weighing = trained(('attention',)), trained(())

    mean = np.mean([crowd(even, [row]) for row in range(3)], axis=0)
    assert crowd(even, [0, 1, 2]) == pytest.approx(mean, abs=1e-5)
    mean = np.mean([crowd(weighing, [row]) for row in range(3)], axis=0)
    assert crowd(weighing, [0, 1, 2]) != pytest.approx(mean, abs=1e-3)


def test_nothing_taken_out_is_nothing_changed():
    torch.manual_seed(0)
    network = networks.ValueNetwork(SIZES)
    before = {name: tensor.copy() for name, tensor in network.tensors().items()}

    ablation.ablate(network, ())

    assert all((tensor == before[name]).all() for name, tensor in network.tensors().items())
