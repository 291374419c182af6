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
"""Fixtures of the tests over DDS; what they hand out is in `nodes_over_dds`."""

from nodes_over_dds import NodeProcess, Robot
import numpy as np
import pytest
from wallnav_ros.policy import features
from wallnav_ros.policy.value_function import FORMAT, layer_shapes, ValueFunction


@pytest.fixture(scope='session')
def straight_weights(tmp_path_factory):
    """
    Return a weight file whose value falls with the distance to the goal and the angle off it.

    Set by hand: the first two units of the last network carry those two features through.
    """
    sizes = {'mlp1': [4, 4], 'mlp2': [4, 4], 'attention': [4, 1], 'mlp3': [4, 4, 1]}
    tensors = {name: np.zeros(shape, np.float32) for name, shape in layer_shapes(sizes).items()}
    tensors['mlp3.0.weight'][features.ROBOT.index('goal_distance'), 0] = 1.0
    tensors['mlp3.0.weight'][features.ROBOT.index('heading_cos'), 1] = 1.0
    tensors['mlp3.0.bias'][1] = 1.0
    tensors['mlp3.1.weight'][0, 0] = tensors['mlp3.1.weight'][1, 1] = 1.0
    tensors['mlp3.2.weight'][:2, 0] = -3.0, 0.3
    metadata = {
        'format': FORMAT, 'network': {'kind': 'three_mlp', 'sizes': sizes},
        'features': features.describe(), 'actions': {'max_turn_rate': 1.8}, 'reward': 'R4',
        'decision': {'horizons': [2, 4], 'caution': 0.0}, 'time_step': 0.25, 'discount': 0.9,
        'training': {}}
    path = tmp_path_factory.mktemp('models') / 'straight.npz'
    ValueFunction(metadata, tensors).save(path)
    return path


@pytest.fixture
def start(ros_domain_id):
    """Return a function that starts a node process, which ends with the test at the latest."""
    started = []

    def start_node(name, parameters=(), arguments=()):
        started.append(NodeProcess(name, parameters, arguments))
        return started[-1]

    yield start_node
    for process in started:
        process.kill()


@pytest.fixture
def make_robot(ros_domain_id):
    """Return a function that makes a Robot, closed when the test ends."""
    made = []

    def make(**options):
        made.append(Robot(**options))
        return made[-1]

    yield make
    for robot in made:
        robot.close()


@pytest.fixture
def robot(make_robot):
    """Return a Robot on the plain topics."""
    return make_robot()
