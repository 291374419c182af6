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
The baselines' forward passes in NumPy: CADRL, LSTM-RL and ST2 (SARL's is ours without walls).

Chen et al. 2017, Everett et al. 2018 and Yang et al. 2023; proven equal to torch by a test.
"""

from dataclasses import dataclass

import numpy as np

HEADS = 2              # of every attention in ST2
NORM_EPSILON = 1e-5


@dataclass(frozen=True)
class BaselineValue:
    """
    Weights and what they were trained with.

    metadata: see docs/models.md; tensors: {name: float32 array}, matrices (inputs, outputs).
    """

    metadata: dict
    tensors: dict

    def __call__(self, features):
        """Return the values (...) of `features`, whose leading axes are (...)."""
        leading = features.robot.shape[:-1]
        own = features.robot.reshape(-1, features.robot.shape[-1])
        agents = features.agents.reshape(len(own), *features.agents.shape[-2:])
        return self._values(own, agents, features.present.reshape(len(own), -1)).reshape(leading)

    def _stack(self, name, x):
        """Return `x` after the layers called `name`, ReLU between them."""
        number = 0
        while f'{name}.{number}.weight' in self.tensors:
            x = np.maximum(x, 0.0) if number else x
            x = x @ self.tensors[f'{name}.{number}.weight']
            x += self.tensors[f'{name}.{number}.bias']
            number += 1
        return x


class CadrlValue(BaselineValue):
    """The least value of any pair of robot and agent; alone, of a pair with nobody."""

    layers = (('value', 1, 1),)

    @staticmethod
    def shapes(sizes, own, agent):
        """Return {tensor name: shape}."""
        return stack_shapes('value', own + agent, sizes['value'])

    def _values(self, own, agents, present):
        state, agent = np.nonzero(present)
        alone = np.flatnonzero(~present.any(axis=1))
        rows = np.concatenate((agents[state, agent],
                               np.zeros((len(alone), agents.shape[-1]), np.float32)))
        state = np.concatenate((state, alone))
        pair = self._stack('value', np.concatenate((own[state], rows), axis=1))[:, 0]
        value = np.full(len(own), np.inf, np.float32)
        np.minimum.at(value, state, pair)
        return value


class LstmValue(BaselineValue):
    """
    Agents, each beside the robot, read one by one into an LSTM, the farthest first.

    Its last state says what matters. The layers before it are those of Chen et al. 2019.
    """

    layers = (('embed', 1, None), ('lstm', 1, None), ('value', 1, 1))

    @staticmethod
    def shapes(sizes, own, agent):
        """Return {tensor name: shape}."""
        hidden = sizes['lstm'][-1]
        return {**stack_shapes('embed', own + agent, sizes['embed']),
                'lstm.input.weight': (sizes['embed'][-1], 4 * hidden),
                'lstm.hidden.weight': (hidden, 4 * hidden), 'lstm.bias': (4 * hidden,),
                **stack_shapes('value', own + hidden, sizes['value'])}

    def _values(self, own, agents, present):
        distance = np.hypot(agents[..., 0], agents[..., 1])
        order = np.argsort(np.where(present, -distance, np.inf), axis=1, kind='stable')
        count = present.sum(axis=1)
        width = len(self.tensors['lstm.hidden.weight'])
        hidden, cell = np.zeros((2, len(own), width), np.float32)
        for number in range(count.max(initial=0)):
            rows = np.flatnonzero(count > number)
            read = np.concatenate((own[rows], agents[rows, order[rows, number]]), axis=1)
            read = np.maximum(self._stack('embed', read), 0.0)
            gates = (read @ self.tensors['lstm.input.weight'] + self.tensors['lstm.bias']
                     + hidden[rows] @ self.tensors['lstm.hidden.weight'])
            enter, keep, new, leave = np.split(gates, 4, axis=1)
            cell[rows] = (_sigmoid(keep) * cell[rows] + _sigmoid(enter) * np.tanh(new))
            hidden[rows] = _sigmoid(leave) * np.tanh(cell[rows])
        return self._stack('value', np.concatenate((own, hidden), axis=1))[:, 0]


class SpatialTemporalValue(BaselineValue):
    """Agents attend to each other within each frame, then each to its own earlier frames."""

    layers = (('embed', 1, None), ('forward', 1, None), ('value', 1, 1))

    @staticmethod
    def shapes(sizes, own, agent, frames):
        """Return {tensor name: shape}."""
        width = sizes['embed'][-1]
        return {**stack_shapes('embed', own + agent // frames, sizes['embed']),
                'frame': (frames, width), **_block_shapes('spatial', width, sizes['forward']),
                **_block_shapes('temporal', width, sizes['forward']),
                **stack_shapes('value', own + width, sizes['value'])}

    def _values(self, own, agents, present):
        frames, width = self.tensors['frame'].shape
        count, most = present.shape
        crowd = np.zeros((count, width), np.float32)
        state, agent = np.nonzero(present)
        if len(state):
            # (S, F, N, columns): every agent of every frame beside the robot.
            rows = np.moveaxis(agents.reshape(count, most, frames, -1), 2, 1)
            own_rows = np.broadcast_to(own[:, None, None], (*rows.shape[:3], own.shape[1]))
            tokens = self._stack('embed', np.concatenate((own_rows, rows), axis=-1))
            mask = np.repeat(present, frames, axis=0)
            tokens = self._block('spatial', tokens.reshape(-1, most, width), mask)
            tokens = tokens.reshape(count, frames, most, width)[state, :, agent]
            tokens = self._block('temporal', tokens + self.tensors['frame'])
            np.add.at(crowd, state, tokens[:, 0])
            crowd /= np.maximum(present.sum(axis=1), 1)[:, None].astype(np.float32)
        return self._stack('value', np.concatenate((own, crowd), axis=1))[:, 0]

    def _block(self, name, tokens, mask=None):
        """Return `tokens` (S, L, D) after one encoder layer; `mask` (S, L) marks real ones."""
        size, length, width = tokens.shape
        parts = tokens @ self.tensors[f'{name}.attend.weight']
        parts += self.tensors[f'{name}.attend.bias']
        parts = parts.reshape(size, length, 3, HEADS, width // HEADS)
        query, key, value = np.moveaxis(parts, (2, 3), (0, 2))
        score = query @ np.swapaxes(key, -1, -2) / np.float32(np.sqrt(width // HEADS))
        if mask is not None:
            score = np.where(mask[:, None, None], score, np.float32(-1e9))
        score = np.exp(score - score.max(axis=-1, keepdims=True))
        score /= score.sum(axis=-1, keepdims=True)
        seen = np.swapaxes(score @ value, 1, 2).reshape(size, length, width)
        seen = seen @ self.tensors[f'{name}.join.weight'] + self.tensors[f'{name}.join.bias']
        tokens = self._norm(f'{name}.norm1', tokens + seen)
        return self._norm(f'{name}.norm2', tokens + self._stack(f'{name}.forward', tokens))

    def _norm(self, name, x):
        x = x - x.mean(axis=-1, keepdims=True)
        x /= np.sqrt((x * x).mean(axis=-1, keepdims=True) + np.float32(NORM_EPSILON))
        return x * self.tensors[f'{name}.weight'] + self.tensors[f'{name}.bias']


def stack_shapes(name, width, sizes):
    """Return {tensor name: shape} of layers of `sizes` from `width` inputs."""
    shapes = {}
    for number, output in enumerate(sizes):
        shapes[f'{name}.{number}.weight'] = (width, output)
        shapes[f'{name}.{number}.bias'] = (output,)
        width = output
    return shapes


def _block_shapes(name, width, forward):
    return {f'{name}.attend.weight': (width, 3 * width), f'{name}.attend.bias': (3 * width,),
            f'{name}.join.weight': (width, width), f'{name}.join.bias': (width,),
            **{f'{name}.{norm}.{part}': (width,) for norm in ('norm1', 'norm2')
               for part in ('weight', 'bias')},
            **stack_shapes(f'{name}.forward', width, [*forward, width])}


def _sigmoid(x):
    # By tanh: exp of a large negative number would overflow.
    return np.float32(0.5) * (np.tanh(np.float32(0.5) * x) + np.float32(1.0))
