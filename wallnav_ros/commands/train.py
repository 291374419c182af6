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
Train a value network from a configuration file.

Paper algorithm 1; see docs/learning.md.
"""

import argparse
import json
import sys

from wallnav_ros.commands.arguments import output_file, output_folder
from wallnav_ros.world.files import atomic_write, find_asset


def parse(arguments):
    """Return the parsed command line."""
    parser = argparse.ArgumentParser('train', description=__doc__.strip().splitlines()[0])
    parser.add_argument('--config', required=True,
                        help='YAML file, or the short name of one shipped in params/training')
    parser.add_argument('--out', required=True, metavar='DIR', type=output_folder,
                        help='folder for checkpoints, logs, curves and the exported weights')
    parser.add_argument('--resume', action='store_true',
                        help='go on from the checkpoint in --out')
    parser.add_argument('--set', nargs='+', action='extend', default=[], metavar='KEY=VALUE',
                        help='settings that replace what the file says, such as reward=R1 or '
                             '"without=[walls]"')
    parser.add_argument('--device', default='cpu', help='torch device (default: cpu)')
    parser.add_argument('--json', metavar='FILE', type=output_file,
                        help='write there where the best weights are and every evaluation')
    return parser.parse_args(arguments)


def main(arguments=None):
    """Run the command; returns its exit status."""
    options = parse(arguments)
    try:
        from wallnav_ros.learning.checkpoints import CheckpointError
        from wallnav_ros.learning.device import DeviceError, prepare_device
        from wallnav_ros.learning.settings import load_settings, SettingsError
        from wallnav_ros.learning.trainer import Trainer, TrainingDiverged
        from wallnav_ros.simulation.scenario import ScenarioError
    except ModuleNotFoundError as error:
        print(f'train: {error.name} is not installed: pip install {error.name}', file=sys.stderr)
        return 2
    try:
        settings = load_settings(find_asset('params/training', options.config, '.yaml'),
                                 options.set)
        device = prepare_device(options.device)
        options.out.mkdir(parents=True, exist_ok=True)
        trainer = Trainer(settings, options.out, device)
        weights = trainer.run(resume=options.resume)
        if options.json:
            with atomic_write(options.json) as stream:
                json.dump({'weights': str(weights), **trainer.counts,
                           'evaluations': trainer.rows['evaluation']}, stream, indent=2,
                          default=float)
    except (OSError, SettingsError, ScenarioError, CheckpointError, DeviceError) as error:
        print(f'train: {error}', file=sys.stderr)
        return 2
    except TrainingDiverged as error:
        print(f'train: {error}', file=sys.stderr)
        return 1
    except MemoryError as error:
        print(f'train: {error}: lower memory, parallel or batch_size', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print('train: interrupted; --resume goes on from the last checkpoint', file=sys.stderr)
        return 130
    print(f'best weights: {weights}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
