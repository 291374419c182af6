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
Choose where torch computes, and how many threads it takes.

One thread: small matrices gain nothing from more, and lose where cores are shared.
"""

import torch


class DeviceError(ValueError):
    """A torch device that is not there."""


def prepare_device(name):
    """Return the torch device called `name`, one thread set; DeviceError where there is none."""
    torch.set_num_threads(1)
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (AssertionError, RuntimeError) as error:     # what torch raises where there is none
        raise DeviceError(f'--device {name}: {str(error).splitlines()[0]}') from None
    return device
