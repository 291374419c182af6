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
How fast training is, for the benchmark: rounds of the real trainer, in its process's own time.

Paper section 6; the paper took 48 and 62 hours for 8000 episodes.
"""

from dataclasses import replace
from tempfile import TemporaryDirectory
from time import process_time

from wallnav_ros.learning.device import prepare_device
from wallnav_ros.learning.settings import load_settings
from wallnav_ros.learning.trainer import Trainer
from wallnav_ros.world.files import find_asset


def training_rate(episodes=96, settings=None):
    """
    Return how many episodes an hour of one core trains on, updates included.

    settings: TrainSettings, those of the default configuration where none are given.
    """
    settings = settings or load_settings(find_asset('params/training', 'default', '.yaml'))
    settings = replace(settings, imitation_episodes=32, imitation_updates=1, episodes=episodes,
                       evaluate_every=episodes + 1)
    with TemporaryDirectory() as folder:
        trainer = Trainer(settings, folder, prepare_device('cpu'))
        # A memory to learn from, before the clock starts.
        trainer.imitate()
        began = process_time()
        trainer.learn()
        return 3600.0 * episodes / (process_time() - began)
