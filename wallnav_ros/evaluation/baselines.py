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
The trained baselines as policies: CADRL, LSTM-RL, SARL and ST2, from their weight files.

Paper section 3; none of them sees walls.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from wallnav_ros.evaluation.baseline_values import CadrlValue, LstmValue, SpatialTemporalValue
from wallnav_ros.evaluation.joint_state import JointSight
from wallnav_ros.policy import value_function
from wallnav_ros.policy.lookahead import Lookahead

FRAMES = 3             # steps that ST2 looks back over, this one included


@dataclass(frozen=True)
class Baseline:
    """
    One kind of baseline.

    title: for people. sight: what it is told. layers: see `policy.value_function.LAYERS`.
    shapes: from layer sizes and the sight's widths to {tensor name: shape}. value: from metadata
    and tensors to a function of Features.
    """

    title: str
    sight: JointSight
    layers: tuple
    shapes: Callable
    value: Callable


BASELINES = {
    'cadrl': Baseline('CADRL: the least value of any pair of robot and agent', JointSight(),
                      CadrlValue.layers, CadrlValue.shapes, CadrlValue),
    'lstm_rl': Baseline('LSTM-RL: agents read into an LSTM, the farthest first', JointSight(),
                        LstmValue.layers, LstmValue.shapes, LstmValue),
    'sarl': Baseline('SARL: agents pooled by self-attention', JointSight(),
                     value_function.LAYERS, value_function.layer_shapes,
                     value_function.ValueFunction),
    'st2': Baseline(f'ST2: a spatial-temporal transformer over {FRAMES} steps',
                    JointSight(FRAMES), SpatialTemporalValue.layers,
                    partial(SpatialTemporalValue.shapes, frames=FRAMES), SpatialTemporalValue),
}


def is_baseline(path):
    """Return whether the weight file at `path` holds a baseline; WeightsError if it is none."""
    metadata, _ = value_function.read_weights(path)
    return metadata['network'].get('kind') in BASELINES


def load_baseline(path, horizons=None, caution=None, turns=None):
    """
    Return the policy of a baseline's weight file.

    `horizons`, `caution` and `turns` override its decision rule. Raises WeightsError (one line).
    """
    metadata, arrays = value_function.read_weights(path)
    kind = BASELINES[metadata['network']['kind']]
    sight = kind.sight
    tensors = value_function.checked_tensors(
        path, metadata, arrays, sight.describe(), kind.layers,
        lambda sizes: kind.shapes(sizes, sight.own, sight.agent))
    lookahead = Lookahead.from_weights(kind.value(metadata, tensors), horizons, caution,
                                       constant_velocity=True, turns=turns)
    return sight.policy(sight.lookahead(lookahead.value, lookahead.actions, lookahead.rule))
