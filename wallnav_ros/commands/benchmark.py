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
Measure every hot stage, from the scan to the command, and episodes an hour.

docs/benchmark.md explains the figures; quote ratios where the machine is shared.
"""

import argparse
import json
from pathlib import Path
import statistics
import sys
import tempfile

from tqdm import tqdm

from wallnav_ros.commands import drive
from wallnav_ros.commands.arguments import output_file
from wallnav_ros.evaluation import stages
from wallnav_ros.evaluation.episodes import load_policy
from wallnav_ros.policy.value_function import load_value_function, WeightsError
from wallnav_ros.world.files import atomic_write, find_asset


def parse(arguments):
    """Return the parsed command line."""
    parser = argparse.ArgumentParser('benchmark', description=__doc__.strip().splitlines()[0])
    parser.add_argument('--model', default='wallnav', help='weight file, or a shipped name')
    parser.add_argument('--json', metavar='FILE', type=output_file,
                        help='also write the figures here')
    parser.add_argument('--without-dds', action='store_true',
                        help='leave out the run of real nodes, which takes half a minute')
    return parser.parse_args(arguments)


def main(arguments=None):
    """Run the command; returns its exit status."""
    options = parse(arguments)
    try:
        weights = load_value_function(find_asset('models', options.model, '.npz'))
    except (FileNotFoundError, WeightsError) as error:
        print(f'benchmark: {error}', file=sys.stderr)
        return 2
    jobs = {f'tracking, {beams} beams, {things} things':
            lambda beams=beams, things=things: stages.time_tracking(beams, things)
            for beams in stages.BEAMS for things in stages.THINGS}
    jobs |= {f'decision, {agents} agents':
             lambda agents=agents: stages.time_decision(weights, agents)
             for agents in stages.CROWDS}
    jobs['wall extraction, 2736 x 1280 cells'] = stages.time_wall_extraction
    jobs['route, 30 m on a floor of 60 m x 60 m'] = stages.time_route
    jobs['simulator step, 15 agents'] = stages.time_simulator
    jobs['simulator step, 15 agents, 25 side by side'] = (
        lambda: stages.time_simulator(episodes=25))
    if not options.without_dds:
        jobs['scan to command over DDS'] = lambda: _scan_to_command(options.model)
    figures = {}
    for name, job in tqdm(jobs.items(), 'benchmark', unit='stage'):
        figures[name] = job()
        if figures[name] is None:
            print(f'benchmark: {name}: the run failed', file=sys.stderr)
            return 1
    width = max(map(len, figures))
    print(f'{"stage":{width}}  {"p50 ms":>9}  {"p99 ms":>9}')
    for name, figure in figures.items():
        print(f'{name:{width}}  {figure["ms_p50"]:9.3f}  {figure["ms_p99"]:9.3f}')
    rates = _rates(options.model)
    for name, rate in rates.items():
        print(f'{name}: {rate:,.0f} episodes an hour of one core')
    if options.json:
        with atomic_write(options.json) as stream:
            json.dump({'model': options.model, 'stages': figures, 'episodes_per_hour': rates},
                      stream, indent=2)
    return 0


def _rates(model):
    """Return the episodes per hour of evaluation and, where torch is installed, of training."""
    rates = {'evaluation': round(stages.evaluation_rate(load_policy(model)))}
    try:
        from wallnav_ros.learning.rate import training_rate
    except ModuleNotFoundError as error:
        print(f'training: left out, {error.name} is not installed', file=sys.stderr)
        return rates
    return rates | {'training': round(training_rate())}


def _scan_to_command(model):
    """Return the latency among 15 agents, medians of three drives, or None where one failed."""
    with tempfile.TemporaryDirectory() as folder:
        drive.main(['--scenario', 'cross_path', '--case', 'mixed', '--seed', '43', '--runs', '3',
                    '--out', folder, '--beams', '1081', '--scan-rate', '40', '--model', model])
        summary = Path(folder) / 'summary.json'
        if not summary.is_file():
            return None
        runs = json.loads(summary.read_text())['runs']
    figures = {name: [run[f'scan_to_command_{name}'] for run in runs]
               for name in ('ms_p50', 'ms_p99')}
    if None in figures['ms_p50']:
        return None
    return {name: statistics.median(values) for name, values in figures.items()}


if __name__ == '__main__':
    sys.exit(main())
