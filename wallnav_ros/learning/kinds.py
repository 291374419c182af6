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


KINDS = {
    'three_mlp': Kind('three MLPs in series', SIZES, LAYERS, ValueNetwork, WallSight()),
}
