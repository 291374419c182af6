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
The three-MLP value network's forward pass in NumPy, and its weight files.

Paper section 3 (Fig. 2); trained by `wallnav_ros.learning`, proven equal to it by a test.
"""

from dataclasses import dataclass
import json
from pathlib import Path

import numpy as np

from wallnav_ros.policy import features as feature_set
from wallnav_ros.policy.motion import MotionModel
from wallnav_ros.policy.motion_weights import motion_of, motion_parts
from wallnav_ros.policy.rewards import REWARDS
from wallnav_ros.policy.weight_files import (
    is_positive, read_arrays, take_tensors, WeightsError, widths_fit)
from wallnav_ros.world.files import atomic_write

FORMAT = 1
FARTHEST = 100         # steps ahead that a decision may look: more would hold up the robot
STATES_AT_ONCE = 128             # more leave the core's cache: twice as slow a state
LEAST_SCORE = np.float32(-1e30)  # of padding, below that of any agent
# The stacks of layers: name, least number of layers, width of the last where it is fixed.
LAYERS = (('mlp1', 1, None), ('mlp2', 1, None), ('attention', 2, 1), ('mlp3', 1, 1))
METADATA = ('format', 'network', 'features', 'actions', 'reward', 'decision', 'time_step',
            'discount', 'training')


def layer_shapes(sizes, own=len(feature_set.ROBOT) + feature_set.WALL_RAYS,
                 agent=len(feature_set.AGENT)):
    """
    Return {tensor name: shape} of the network whose layer `sizes` are given.

    `sizes` maps mlp1, mlp2, attention and mlp3 to lists of layer widths; `own` and `agent` are
    the widths of its inputs. Weights are (inputs, outputs), as in y = x @ W + b.
    """
    inputs = {'mlp1': own + agent, 'mlp2': sizes['mlp1'][-1],
              'attention': 2 * sizes['mlp1'][-1], 'mlp3': own + sizes['mlp2'][-1]}
    shapes = {}
    for name, width in inputs.items():
        for number, output in enumerate(sizes[name]):
            shapes[f'{name}.{number}.weight'] = (width, output)
            shapes[f'{name}.{number}.bias'] = (output,)
            width = output
    return shapes


@dataclass(frozen=True)
class ValueFunction:
    """
    Weights and what they were trained with.

    metadata: see docs/models.md; tensors: {name: float32 array} as in `layer_shapes`.
    motion: the MotionModel that it was trained with, or None.
    """

    metadata: dict
    tensors: dict
    motion: MotionModel | None = None

    def __call__(self, features):
        """Return the values (...) of `features`, whose leading axes are (...)."""
        leading = features.robot.shape[:-1]
        own = np.concatenate((features.robot, features.walls), axis=-1).reshape(
            -1, features.robot.shape[-1] + features.walls.shape[-1])
        agents = features.agents.reshape(len(own), *features.agents.shape[-2:])
        present = features.present.reshape(len(own), agents.shape[1])
        value = np.empty(len(own), dtype=np.float32)
        for start in range(0, len(own), STATES_AT_ONCE):
            rows = slice(start, start + STATES_AT_ONCE)
            crowd = self._crowd(own[rows], agents[rows], present[rows])
            value[rows] = self._stack(
                'mlp3', np.concatenate((own[rows], crowd), axis=-1))[:, 0]
        return value.reshape(leading)

    def _crowd(self, own, agents, present):
        """Return the attention-weighted sum (S, C) of agent features; zero without agents."""
        taken = present.any(axis=0)
        if not taken.any():
            width = self.metadata['network']['sizes']['mlp2'][-1]
            return np.zeros((len(own), width), dtype=np.float32)
        # Padding goes along at no weight: to pick out the others costs more than it saves,
        # except where a place is empty in every state.
        if not present.all():
            present = present[:, taken]
            agents = np.where(present[..., None], agents[:, taken], np.float32(0.0))
        weight, split = self.tensors['mlp1.0.weight'], own.shape[1]
        hidden = self._joint('mlp1', agents, weight[split:], own, weight[:split])
        count = np.maximum(present.sum(axis=1, keepdims=True, dtype=np.float32), 1.0)
        mean = _weighted_sum(present / count, hidden)
        weight, split = self.tensors['attention.0.weight'], hidden.shape[-1]
        score = self._joint('attention', hidden, weight[:split], mean, weight[split:])[..., 0]
        score = np.where(present, score, LEAST_SCORE)
        score = np.exp(score - score.max(axis=1, keepdims=True)) * present
        # The best of the agents adds 1; the sum is less where there are none.
        score /= np.maximum(score.sum(axis=1, keepdims=True), 1.0)
        return _weighted_sum(score, self._stack('mlp2', hidden, last_relu=True))

    def _joint(self, name, each, weight, common, common_weight):
        """
        Return what a stack makes (S, N, C) of `each` agent's (S, N, F) and a `common` part (S, G).

        Its first layer is split: the part that all agents of a state have in common is multiplied
        once per state instead of once per agent. A ReLU ends every stack but the attention's.
        """
        shared = common @ common_weight + self.tensors[f'{name}.0.bias']
        x = each.reshape(-1, each.shape[-1]) @ weight
        x = x.reshape(*each.shape[:2], -1)
        x += shared[:, None]
        np.maximum(x, 0.0, out=x)
        return self._stack(name, x, first=1, last_relu=name != 'attention')

    def _stack(self, name, x, first=0, last_relu=False):
        """Return the rows (..., C) that the layers of a stack from `first` on make of `x`."""
        leading, x = x.shape[:-1], x.reshape(-1, x.shape[-1])
        count = len(self.metadata['network']['sizes'][name])
        for number in range(first, count):
            x = x @ self.tensors[f'{name}.{number}.weight']
            x += self.tensors[f'{name}.{number}.bias']
            if number < count - 1 or last_relu:
                np.maximum(x, 0.0, out=x)
        return x.reshape(*leading, -1)

    def save(self, path):
        """Write the weights to `path` (.npz), whole or not at all."""
        about, tensors = ({}, {}) if self.motion is None else motion_parts(self.motion)
        text = json.dumps(self.metadata | about, sort_keys=True)
        with atomic_write(path, 'wb') as stream:
            np.savez_compressed(stream, metadata=np.array(text), **self.tensors, **tensors)


def _weighted_sum(weight, rows):
    """Return the sums (S, C) of `rows` (S, N, C) times their `weight` (S, N)."""
    return (weight[:, None] @ rows)[:, 0]


def load_value_function(path):
    """
    Load a weight file, trusting nothing in it.

    Raises WeightsError (one line) when the file is missing, truncated, not an .npz, was
    trained on other features or lacks a tensor.
    """
    metadata, arrays = read_weights(path)
    kind = metadata['network'].get('kind', 'three_mlp')
    if kind != 'three_mlp':
        raise WeightsError(f'{path}: metadata.network.kind: {kind!r} does not see walls and is '
                           'for `evaluate` alone: give weights of kind three_mlp')
    tensors = checked_tensors(path, metadata, arrays, feature_set.describe(), LAYERS,
                              layer_shapes)
    return ValueFunction(metadata, tensors, motion_of(path, metadata, arrays))


def read_weights(path):
    """
    Return the metadata and the arrays of a weight file of any kind of network.

    Raises WeightsError; what depends on the kind is left to `checked_tensors`.
    """
    path = Path(path)
    arrays = read_arrays(path)
    return _read_metadata(path, arrays.pop('metadata', None)), arrays


def sizes_fit(sizes, layers):
    """Return whether `sizes` names layer widths for every row of `layers` (see LAYERS)."""
    return isinstance(sizes, dict) and set(sizes) == {name for name, _, _ in layers} and all(
        widths_fit(sizes[name], least, last) for name, least, last in layers)


def expected_sizes(layers):
    """Return in words what `sizes_fit` asks for."""
    return 'layer widths for ' + ', '.join(
        name + (f' ({least} or more)' if least > 1 else '')
        + (f' ending in {last}' if last else '') for name, least, last in layers)


def checked_tensors(path, metadata, arrays, features, layers, shapes_of):
    """
    Return the tensors {name: float32 array} of a weight file of one kind.

    features: what it must have been trained on. layers: see LAYERS. shapes_of: from layer
    sizes to {tensor name: shape}. Raises WeightsError.
    """
    sizes = metadata['network'].get('sizes')
    if not sizes_fit(sizes, layers):
        raise WeightsError(f'{path}: metadata.network.sizes: expected {expected_sizes(layers)}; '
                           'export the weights again')
    if metadata['features'] != features:
        raise WeightsError(
            f'{path}: features: trained on other features than this version computes '
            f'(version {metadata["features"].get("version")}, here {features["version"]}): '
            'retrain it or install the version it came with')
    return take_tensors(path, arrays, shapes_of(sizes))


def _read_metadata(path, text):
    try:
        metadata = json.loads(str(text)) if text is not None else None
    except (json.JSONDecodeError, RecursionError):
        metadata = None
    if not isinstance(metadata, dict):
        raise WeightsError(f'{path}: metadata: missing or not JSON; export the weights again')
    if set(metadata) == {'motion'}:
        raise WeightsError(f'{path}: a motion model alone decides nothing: give the weights of a '
                           'policy')
    for key in METADATA:
        if key not in metadata:
            raise WeightsError(f'{path}: metadata.{key}: missing; export the weights again')
    if metadata['format'] != FORMAT:
        raise WeightsError(f'{path}: metadata.format: {metadata["format"]!r} is not {FORMAT}, '
                           'the format this version reads')
    for key in ('network', 'features', 'actions', 'decision'):
        if not isinstance(metadata[key], dict):
            raise WeightsError(f'{path}: metadata.{key}: expected a mapping')
    for key, holds, expected in _expectations(metadata):
        if not holds:
            raise WeightsError(f'{path}: metadata.{key}: expected {expected}; '
                               'export the weights again')
    return metadata


def _expectations(metadata):
    """Yield (key, whether it holds, what is expected) of what a decision is computed from."""
    yield 'actions', set(metadata['actions']) == {'max_turn_rate'} and is_positive(
        metadata['actions']['max_turn_rate']), 'a max_turn_rate above 0'
    yield 'network.kind', isinstance(metadata['network'].get('kind', ''), str), 'text'
    horizons = metadata['decision'].get('horizons')
    yield 'decision.horizons', widths_fit(horizons, 1, None) and max(horizons) <= FARTHEST, (
        f'a list of steps, each from 1 to {FARTHEST}')
    turns = metadata['decision'].get('turns', [1])
    yield 'decision.turns', widths_fit(turns, 1, None) and max(turns) <= FARTHEST, (
        f'a list of steps, each from 1 to {FARTHEST}')
    caution = metadata['decision'].get('caution')
    yield 'decision.caution', caution == 0 or is_positive(caution), 'seconds, 0 or more'
    aversion = metadata['decision'].get('aversion', 0)
    yield 'decision.aversion', aversion == 0 or is_positive(aversion), 'a number, 0 or more'
    yield 'time_step', is_positive(metadata['time_step']), 'seconds above 0'
    yield 'discount', is_positive(metadata['discount']) and metadata['discount'] <= 1, (
        'a number above 0, at most 1')
    yield 'reward', metadata['reward'] in REWARDS, f'one of {", ".join(REWARDS)}'
