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
The baselines in torch: CADRL, LSTM-RL and ST2, the twins of `evaluation.baseline_values`.

Chen et al. 2017, Everett et al. 2018 and Yang et al. 2023; SARL is networks.ValueNetwork.
"""

import torch
from torch import nn

from wallnav_ros.evaluation.baseline_values import HEADS
from wallnav_ros.learning.networks import linear_tensors, mlp


class CadrlNetwork(nn.Module):
    """
    The least value of any pair of robot and agent; alone, of a pair with nobody.

    Inputs as in every network here: own (S, own), agents (S, N, agent), present (S, N) bool.
    """

    def __init__(self, sizes, own, agent):
        super().__init__()
        self.sizes = sizes
        self.value = mlp(own + agent, sizes['value'])

    def forward(self, own, agents, present):
        """Return values (S,) of S states."""
        state, agent = torch.nonzero(present, as_tuple=True)
        alone = torch.nonzero(~present.any(dim=1))[:, 0]
        rows = torch.cat((agents[state, agent], agents.new_zeros(len(alone), agents.shape[-1])))
        state = torch.cat((state, alone))
        pair = self.value(torch.cat((own[state], rows), dim=1))[:, 0]
        return own.new_full((len(own),), torch.inf).scatter_reduce(0, state, pair, 'amin')

    def tensors(self):
        """Return {name: float32 array} as `evaluation.baseline_values` reads them."""
        return linear_tensors('value', self.value)


class LstmNetwork(nn.Module):
    """Agents, each beside the robot, read one by one into an LSTM, the farthest first."""

    def __init__(self, sizes, own, agent):
        super().__init__()
        self.sizes = sizes
        self.embed = mlp(own + agent, sizes['embed'], last_relu=True)
        self.cell = nn.LSTMCell(sizes['embed'][-1], sizes['lstm'][-1])
        self.value = mlp(own + sizes['lstm'][-1], sizes['value'])

    def forward(self, own, agents, present):
        """Return values (S,) of S states."""
        distance = torch.hypot(agents[..., 0], agents[..., 1])
        order = torch.argsort(torch.where(present, -distance, torch.inf), dim=1, stable=True)
        agents = torch.take_along_dim(agents, order[..., None], dim=1)
        count = present.sum(dim=1)
        hidden = cell = own.new_zeros(len(own), self.cell.hidden_size)
        for number in range(int(count.max()) if len(count) else 0):
            read = self.embed(torch.cat((own, agents[:, number]), dim=1))
            newer_hidden, newer_cell = self.cell(read, (hidden, cell))
            more = (count > number)[:, None]
            hidden = torch.where(more, newer_hidden, hidden)
            cell = torch.where(more, newer_cell, cell)
        return self.value(torch.cat((own, hidden), dim=1))[:, 0]

    def tensors(self):
        """Return {name: float32 array} as `evaluation.baseline_values` reads them."""
        cell = self.cell
        found = {'lstm.input.weight': cell.weight_ih.T, 'lstm.hidden.weight': cell.weight_hh.T,
                 'lstm.bias': cell.bias_ih + cell.bias_hh}
        return {**{name: tensor.detach().cpu().numpy().copy() for name, tensor in found.items()},
                **linear_tensors('embed', self.embed), **linear_tensors('value', self.value)}


class EncoderLayer(nn.Module):
    """One layer of a transformer's encoder, normalised after each of its two parts."""

    def __init__(self, width, forward):
        super().__init__()
        self.attend = nn.Linear(width, 3 * width)
        self.join = nn.Linear(width, width)
        self.norm1, self.norm2 = nn.LayerNorm(width), nn.LayerNorm(width)
        self.feed = mlp(width, [*forward, width])

    def forward(self, tokens, mask=None):
        """Return `tokens` (S, L, D) after the layer; `mask` (S, L) marks real ones."""
        size, length, width = tokens.shape
        parts = self.attend(tokens).reshape(size, length, 3, HEADS, width // HEADS)
        query, key, value = parts.permute(2, 0, 3, 1, 4)
        score = query @ key.transpose(-1, -2) / (width // HEADS) ** 0.5
        if mask is not None:
            score = score.masked_fill(~mask[:, None, None], -1e9)
        seen = (score.softmax(dim=-1) @ value).transpose(1, 2).reshape(size, length, width)
        tokens = self.norm1(tokens + self.join(seen))
        return self.norm2(tokens + self.feed(tokens))

    def tensors(self, name):
        """Return {name: float32 array}, every name beginning with `name`."""
        found = linear_tensors(f'{name}.forward', self.feed)
        for part in ('attend', 'join', 'norm1', 'norm2'):
            layer = getattr(self, part)
            found[f'{name}.{part}.weight'] = layer.weight.detach().cpu().numpy().T.copy()
            found[f'{name}.{part}.bias'] = layer.bias.detach().cpu().numpy().copy()
        return found


class SpatialTemporalNetwork(nn.Module):
    """Agents attend to each other within each frame, then each to its own earlier frames."""

    def __init__(self, sizes, own, agent, frames):
        super().__init__()
        self.sizes = sizes
        self.embed = mlp(own + agent // frames, sizes['embed'])
        width = sizes['embed'][-1]
        self.frame = nn.Parameter(torch.zeros(frames, width))
        self.spatial = EncoderLayer(width, sizes['forward'])
        self.temporal = EncoderLayer(width, sizes['forward'])
        self.value = mlp(own + width, sizes['value'])

    def forward(self, own, agents, present):
        """Return values (S,) of S states."""
        frames, width = self.frame.shape
        count, most = present.shape
        crowd = own.new_zeros(count, width)
        state, agent = torch.nonzero(present, as_tuple=True)
        if len(state):
            # Attention costs the square of the crowd, so what is padding throughout is cut off.
            most = int(agent.max()) + 1
            agents, present = agents[:, :most], present[:, :most]
            rows = agents.reshape(count, most, frames, -1).transpose(1, 2)
            own_rows = own[:, None, None].expand(-1, frames, most, -1)
            tokens = self.embed(torch.cat((own_rows, rows), dim=-1))
            mask = present.repeat_interleave(frames, dim=0)
            tokens = self.spatial(tokens.reshape(-1, most, width), mask)
            tokens = tokens.reshape(count, frames, most, width)[state, :, agent]
            newest = self.temporal(tokens + self.frame)[:, 0]
            crowd = crowd.index_add(0, state, newest)
            crowd = crowd / present.sum(dim=1).clamp(min=1)[:, None]
        return self.value(torch.cat((own, crowd), dim=1))[:, 0]

    def tensors(self):
        """Return {name: float32 array} as `evaluation.baseline_values` reads them."""
        return {'frame': self.frame.detach().cpu().numpy().copy(),
                **linear_tensors('embed', self.embed), **self.spatial.tensors('spatial'),
                **self.temporal.tensors('temporal'), **linear_tensors('value', self.value)}
