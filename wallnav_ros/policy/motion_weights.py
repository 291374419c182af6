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
A MotionModel as tensors and metadata: alone in a file, or beside the value network's weights.

The policy's file carries the motion model it was trained with, so that one file is the policy.
"""

import json
from pathlib import Path

import numpy as np
from wallnav_ros.policy.motion import INPUTS, MotionModel, OUTPUTS, VERSION
from wallnav_ros.policy.weight_files import read_arrays, take_tensors, WeightsError, widths_fit
from wallnav_ros.world.files import atomic_write


def motion_parts(model):
    """Return the metadata, and the tensors {name: float32 array}, that keep a MotionModel."""
    tensors = {}
    for number, (weight, bias) in enumerate(model.layers):
        tensors[f'motion.{number}.weight'] = weight
        tensors[f'motion.{number}.bias'] = bias
    return {'motion': {'version': VERSION, 'sizes': [len(bias) for _, bias in model.layers],
                       'training': model.training}}, tensors


def motion_of(path, metadata, arrays):
    """
    Return the MotionModel in a weight file's `metadata` and `arrays`, None if there is none.

    Raises WeightsError naming `path`.
    """
    about = metadata.get('motion')
    if about is None:
        return None
    if not isinstance(about, dict) or not widths_fit(about.get('sizes'), 1, OUTPUTS):
        raise WeightsError(f'{path}: metadata.motion.sizes: expected layer widths ending in '
                           f'{OUTPUTS}; export the weights again')
    if about.get('version') != VERSION:
        raise WeightsError(f'{path}: metadata.motion.version: {about.get("version")!r} is not '
                           f'{VERSION}, the version this package computes: train it again')
    shapes, width = {}, INPUTS
    for number, size in enumerate(about['sizes']):
        shapes[f'motion.{number}.weight'] = (width, size)
        shapes[f'motion.{number}.bias'] = (size,)
        width = size
    tensors = take_tensors(path, arrays, shapes)
    layers = [(tensors[f'motion.{number}.weight'], tensors[f'motion.{number}.bias'])
              for number in range(len(about['sizes']))]
    return MotionModel(layers, about.get('training', {}))


def save_motion(model, path):
    """Write a MotionModel to `path` (.npz), whole or not at all."""
    about, tensors = motion_parts(model)
    with atomic_write(path, 'wb') as stream:
        np.savez_compressed(stream, metadata=np.array(json.dumps(about, sort_keys=True)),
                            **tensors)


def load_motion(path):
    """Return the MotionModel in the file at `path`; WeightsError (one line) if it holds none."""
    path = Path(path)
    arrays = read_arrays(path)
    try:
        metadata = json.loads(str(arrays.pop('metadata')))
    except (KeyError, json.JSONDecodeError, RecursionError):
        metadata = None
    if not isinstance(metadata, dict) or 'motion' not in metadata:
        raise WeightsError(f'{path}: metadata.motion: missing; this is no motion model')
    return motion_of(path, metadata, arrays)
