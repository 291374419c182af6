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
Take a part out of our network, to measure what it is worth.

Weights that are kept at zero, so that what is left is exported and decides as any other network.
"""

from wallnav_ros.learning.networks import OWN
from wallnav_ros.policy import features as feature_set

ABLATIONS = ('walls', 'attention')
WALL_COLUMNS = ('wall_gap', 'clearance', 'clearance_ahead')


def ablate(network, without):
    """
    Take the parts of `without` (some of ABLATIONS) out of a ValueNetwork, in place.

    walls: nothing of the walls enters. attention: every agent weighs the same.
    """
    if 'walls' in without:
        robot, agent = ([number for number, name in enumerate(names) if name in WALL_COLUMNS]
                        for names in (feature_set.ROBOT, feature_set.AGENT))
        own = robot + list(range(len(feature_set.ROBOT), OWN))
        _silence(network.mlp1[0], own + [OWN + number for number in agent])
        _silence(network.mlp3[0], own)
    if 'attention' in without:
        last = network.attention[-1]
        _silence(last, list(range(last.in_features)))


def _silence(layer, columns):
    """Set the weights of `columns` of a linear layer's inputs to zero, for good."""
    mask = layer.weight.new_ones(layer.weight.shape)
    mask[:, columns] = 0.0
    layer.weight.data.mul_(mask)
    # A weight that is zero and gets no gradient stays zero under any of torch's optimisers.
    layer.weight.register_hook(lambda gradient: gradient * mask)
