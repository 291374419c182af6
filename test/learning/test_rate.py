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
The benchmark's training rate: rounds of the real trainer.

Its size is not judged here: the machine is shared.
"""

import pytest

pytest.importorskip('torch')
rate = pytest.importorskip('wallnav_ros.learning.rate')
settings = pytest.importorskip('wallnav_ros.learning.settings')

pytestmark = pytest.mark.extras


def test_the_rate_of_training_is_that_of_rounds_with_updates():
    tiny = settings.TrainSettings(scenarios={'cross_path': 1}, cases={'none': 1}, parallel=4,
                                  updates=2, batch_size=8, horizons=(1,))

    assert 60.0 < rate.training_rate(4, tiny) < 360000.0
