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
Train the model that foresees where people go, from simulated crowds.

Its weights are what `train` hands to the policy it trains (docs/learning.md).
"""

import argparse
import sys

from wallnav_ros.commands.arguments import natural, output_file, positive
from wallnav_ros.evaluation.worker_pool import WorkerDied
from wallnav_ros.policy.motion_weights import save_motion
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.world.files import atomic_write


def parse(arguments):
    """Return the parsed command line."""
    parser = argparse.ArgumentParser('train_motion',
                                     description=__doc__.strip().splitlines()[0])
    parser.add_argument('--scenario', nargs='+', default=['curve_path', 'cross_path', 'family'],
                        help='scenario files or short names whose crowds are watched')
    parser.add_argument('--crowds', type=positive, default=40000, help='that are watched')
    parser.add_argument('--epochs', type=positive, default=24)
    parser.add_argument('--seed', type=natural, default=0)
    parser.add_argument('--workers', type=positive, default=1,
                        help='processes that watch; the result does not depend on it')
    parser.add_argument('--device', default='cpu', help='torch device to fit on, such as cuda')
    parser.add_argument('--out', required=True, metavar='FILE', type=output_file,
                        help='weights (.npz)')
    options = parser.parse_args(arguments)
    if options.out.suffix != '.npz':
        parser.error('--out: expected a name ending in .npz; its card is the same name with .md')
    return options


def main(arguments=None):
    """Run the command; returns its exit status."""
    options = parse(arguments)
    try:
        from wallnav_ros.learning.device import DeviceError, prepare_device
        from wallnav_ros.learning.motion import train_motion
        from wallnav_ros.learning.trainer import TrainingDiverged
    except ModuleNotFoundError as error:
        print(f'train_motion: {error.name} is not installed: pip install {error.name}',
              file=sys.stderr)
        return 2
    try:
        model = train_motion(options.scenario, options.crowds, options.epochs, options.seed,
                             options.workers, prepare_device(options.device))
        save_motion(model, options.out)
        with atomic_write(options.out.with_suffix('.md')) as stream:
            stream.write(card(model.training))
    except (OSError, ScenarioError, DeviceError) as error:
        print(f'train_motion: {error}', file=sys.stderr)
        return 2
    except (TrainingDiverged, WorkerDied) as error:
        print(f'train_motion: {error}', file=sys.stderr)
        return 1
    about = model.training['unseen']
    print('off after 2.5 s on crowds not learnt from, m: '
          + ', '.join(f'{name} {value:.3f}' for name, value in about.items()))
    return 0


def card(training):
    """Return in Markdown the card of a motion model from what it was trained with."""
    unseen = training['unseen']
    return f"""# Motion model

Where people go in the next 2.5 s; described in docs/models.md.

- Learned from {training['crowds']} simulated crowds ({training['states']} states) of
  {', '.join(training['scenarios'])}; {training['epochs']} epochs, seed {training['seed']},
  commit {training['commit']}.
- Off after 2.5 s, root mean square, crowds of other seeds: likeliest way
  {unseen['likeliest']:.3f} m, best of its ways {unseen['best']:.3f} m, constant velocity
  {unseen['constant_velocity']:.3f} m.
- Real people were never in its data: ORCA crowds avoid each other, keep their speed and turn round
  at their goals.
"""


if __name__ == '__main__':
    sys.exit(main())
