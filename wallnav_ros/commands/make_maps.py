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
Draw scenarios as map files, PNG and YAML, so that the nodes read them as they would a real map.

Solid polygons are painted by `mapping.map_writer`; the keys are those of nav2_map_server.
"""

import argparse
from pathlib import Path
import sys

from wallnav_ros.commands.arguments import above_zero, output_folder
from wallnav_ros.simulation.scenario import Scenario, ScenarioError
from wallnav_ros.simulation.scenarios import load_scenario


def parse(arguments):
    """Return the parsed command line."""
    parser = argparse.ArgumentParser('make_maps', description=__doc__.strip().splitlines()[0])
    parser.add_argument('--scenario', nargs='+', metavar='NAME_OR_FILE',
                        default=['curve_path', 'cross_path'],
                        help='scenarios with walls as polygons, painted without their furniture '
                             '(default: both paths of the paper)')
    parser.add_argument('--resolution', type=above_zero, default=0.05, metavar='M',
                        help='metres a cell (default: %(default)s)')
    parser.add_argument('--out', type=output_folder, default=Path('maps'), metavar='DIR',
                        help='folder for NAME.yaml and NAME.png (default: %(default)s)')
    return parser.parse_args(arguments)


def main(arguments=None):
    """Run the command; returns its exit status."""
    options = parse(arguments)
    try:
        # All are read before any is written.
        scenarios = [_drawable(load_scenario(name)) for name in options.scenario]
        for scenario in scenarios:
            path = options.out / f'{scenario.path.stem}.yaml'
            scenario.draw_map(path, options.resolution)
            print(path)
    except (OSError, ScenarioError) as error:
        print(f'make_maps: {error}', file=sys.stderr)
        return 2
    return 0


def _drawable(scenario):
    if not isinstance(scenario, Scenario):
        raise ScenarioError(f'{scenario.path}: family: has another world for every seed; '
                            'name a scenario with walls')
    if not scenario.polygons:
        raise ScenarioError(f'{scenario.path}: walls: no polygons to draw; '
                            'its walls come from a map or it has none')
    return scenario


if __name__ == '__main__':
    sys.exit(main())
