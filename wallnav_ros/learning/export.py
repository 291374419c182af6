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
Export a trained network to the .npz that the robot reads, with its provenance inside.

docs/models.md describes the metadata; `policy.value_function` refuses files without it.
"""

from dataclasses import asdict
import subprocess

from wallnav_ros.policy.value_function import FORMAT, ValueFunction
from wallnav_ros.world.files import share_directory


def export_weights(trainer, path):
    """Write the trainer's target network to `path` (.npz); returns its metadata."""
    settings = trainer.settings
    metadata = {
        'format': FORMAT,
        'name': settings.name,
        'network': {'kind': settings.kind, 'sizes': trainer.target.sizes},
        'features': trainer.sight.describe(),
        'actions': {'max_turn_rate': settings.max_turn_rate},
        'reward': settings.reward,
        'decision': {'horizons': list(settings.decision_horizons),
                     'turns': list(settings.turns),
                     'caution': settings.caution, 'aversion': settings.aversion},
        'time_step': settings.time_step,
        'discount': settings.discount,
        'training': {'settings': asdict(settings), 'episodes': trainer.counts['episodes'],
                     'seconds': round(trainer.counts['seconds'], 1), 'commit': commit()},
    }
    ValueFunction(metadata, trainer.target.tensors(), trainer.motion).save(path)
    return metadata


def commit():
    """Return the commit of the source tree, '+' appended when it has changes, or 'unknown'."""
    try:
        return subprocess.run(
            ['git', 'describe', '--always', '--dirty=+', '--abbrev=12', '--exclude=*'],
            cwd=share_directory(), capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return 'unknown'
