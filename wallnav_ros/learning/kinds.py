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
The kinds of network that can be trained, and what the trainer must know about each.

Paper section 3: ours, and the baselines it is compared with.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from wallnav_ros.evaluation.baselines import BASELINES, FRAMES
from wallnav_ros.learning.baselines import CadrlNetwork, LstmNetwork, SpatialTemporalNetwork
from wallnav_ros.learning.networks import SIZES, ValueNetwork
from wallnav_ros.learning.sight import WallSight
from wallnav_ros.policy.value_function import LAYERS


@dataclass(frozen=True)
class Kind:
    """
    One kind of network.

    title: for people. sizes: layer widths unless the settings give others. layers: what such
    sizes must be, see `policy.value_function.LAYERS`. build: from sizes to a torch module with
    `sizes` and `tensors()`. sight: what it is told, and how it decides.
    """

    title: str
    sizes: dict
    layers: tuple
    build: Callable
    sight: object


def _baseline(name, sizes, network):
    about = BASELINES[name]
    build = partial(network, own=about.sight.own, agent=about.sight.agent)
    return Kind(about.title, sizes, about.layers, build, about.sight)


KINDS = {
    'three_mlp': Kind('three MLPs in series', SIZES, LAYERS, ValueNetwork, WallSight()),
    'cadrl': _baseline('cadrl', {'value': [150, 100, 100, 1]}, CadrlNetwork),
    'lstm_rl': _baseline('lstm_rl', {'embed': [96, 64], 'lstm': [50], 'value': [128, 96, 1]},
                         LstmNetwork),
    'sarl': _baseline('sarl', SIZES, ValueNetwork),
    'st2': _baseline('st2', {'embed': [32], 'forward': [32], 'value': [128, 96, 1]},
                     partial(SpatialTemporalNetwork, frames=FRAMES)),
}
