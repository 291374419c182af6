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
The value network in torch: the trainable twin of `policy.value_function`.

Paper section 3 (Fig. 2): three MLPs in series, agents weighted by attention.
"""

import numpy as np
import torch
from torch import nn

from wallnav_ros.policy import features as feature_set

OWN = len(feature_set.ROBOT) + feature_set.WALL_RAYS
AGENT = len(feature_set.AGENT)
SIZES = {'mlp1': [96, 64], 'mlp2': [64, 32], 'attention': [64, 1], 'mlp3': [128, 96, 1]}


def mlp(width, sizes, last_relu=False):
    """Return linear layers of `sizes` from `width` inputs with ReLU between them."""
    layers = []
    for number, output in enumerate(sizes):
        layers.append(nn.Linear(width, output))
        if number < len(sizes) - 1 or last_relu:
            layers.append(nn.ReLU())
        width = output
    return nn.Sequential(*layers)


def linear_tensors(name, layers):
    """Return {name: float32 array} of the linear ones of `layers`, weights (inputs, outputs)."""
    found = {}
    for number, layer in enumerate(part for part in layers if isinstance(part, nn.Linear)):
        found[f'{name}.{number}.weight'] = layer.weight.detach().cpu().numpy().T.copy()
        found[f'{name}.{number}.bias'] = layer.bias.detach().cpu().numpy().copy()
    return found


class ValueNetwork(nn.Module):
    """
    The value of a state, from features as in `policy.features`.

    Agents enter as rows (only those present), so an empty corridor costs nothing.
    """

    def __init__(self, sizes=None, own=OWN, agent=AGENT):
        super().__init__()
        self.sizes = sizes or SIZES
        hidden = self.sizes['mlp1'][-1]
        self.mlp1 = mlp(own + agent, self.sizes['mlp1'], last_relu=True)
        self.mlp2 = mlp(hidden, self.sizes['mlp2'], last_relu=True)
        self.attention = mlp(2 * hidden, self.sizes['attention'])
        self.mlp3 = mlp(own + self.sizes['mlp2'][-1], self.sizes['mlp3'])

    def forward(self, own, agents, present):
        """
        Return values (S,) of S states.

        own: (S, 23) robot and wall features; agents: (S, N, 13); present: (S, N) bool.
        """
        state, agent = torch.nonzero(present, as_tuple=True)
        crowd = own.new_zeros(len(own), self.sizes['mlp2'][-1])
        if len(state):
            crowd = crowd.index_add(0, state, self._weighted(own, agents[state, agent], state))
        return self.mlp3(torch.cat((own, crowd), dim=1))[:, 0]

    def _weighted(self, own, rows, state):
        """Return each agent's contribution (R, C) to its state's crowd feature."""
        first, split = self.mlp1[0], own.shape[1]
        # As in the NumPy twin: the part of the first layer that a state's agents share.
        shared = nn.functional.linear(own, first.weight[:, :split], first.bias)
        hidden = nn.functional.linear(rows, first.weight[:, split:]) + shared[state]
        hidden = self.mlp1[1:](hidden)
        count = torch.bincount(state, minlength=len(own)).clamp(min=1)[:, None]
        mean = hidden.new_zeros(len(own), hidden.shape[1]).index_add(0, state, hidden) / count
        first, split = self.attention[0], hidden.shape[1]
        shared = nn.functional.linear(mean, first.weight[:, split:], first.bias)
        score = nn.functional.linear(hidden, first.weight[:, :split]) + shared[state]
        score = self.attention[1:](score)[:, 0]
        highest = score.detach().new_full((len(own),), -torch.inf)
        highest = highest.scatter_reduce(0, state, score.detach(), 'amax')
        score = torch.exp(score - highest[state])
        weight = score / score.new_zeros(len(own)).index_add(0, state, score)[state]
        return self.mlp2(hidden) * weight[:, None]

    def tensors(self):
        """Return {name: float32 array} as `policy.value_function` reads them."""
        found = {}
        for name in ('mlp1', 'mlp2', 'attention', 'mlp3'):
            found.update(linear_tensors(name, getattr(self, name)))
        return found


class NetworkValue:
    """Lets a Lookahead ask a torch network: Features (S, ...) to values (S,)."""

    def __init__(self, network):
        self.network = network
        self.device = next(network.parameters()).device

    @torch.no_grad()
    def __call__(self, features):
        """Return the values (S,) as float64."""
        own = np.concatenate((features.robot, features.walls), axis=-1)
        arrays = (own, features.agents, features.present)
        tensors = (torch.from_numpy(np.array(part)).to(self.device) for part in arrays)
        return self.network(*tensors).cpu().numpy().astype(float)
