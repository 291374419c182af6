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
Measure a policy greedily over paired seeds, cell by cell.

Paper section 7; writes summary.json, episodes.csv and tables.md.
"""

import argparse
import json
from pathlib import Path
import sys

from wallnav_ros.evaluation.episodes import Campaign, load_policy, run_campaigns
from wallnav_ros.evaluation.tables import markdown, summarise, write_episodes
from wallnav_ros.policy.value_function import WeightsError
from wallnav_ros.simulation.scenarios import load_scenario, ScenarioError
from wallnav_ros.world.files import atomic_write


def parse(arguments):
    """Return the parsed command line."""
    parser = argparse.ArgumentParser('evaluate', description=__doc__.strip().splitlines()[0])
    parser.add_argument('--model', default='wallnav',
                        help='weight file, the short name of a shipped one, or orca')
    parser.add_argument('--scenario', nargs='+', default=['curve_path', 'cross_path'],
                        help='scenario files or short names (default: both paths of the paper)')
    parser.add_argument('--case', default='all', help='a case of the scenarios, or all')
    parser.add_argument('--episodes', type=_positive, default=100, help='per cell')
    parser.add_argument('--seed', type=_natural, default=0,
                        help='of the first episode of each cell')
    parser.add_argument('--horizons', type=_positive, nargs='+', metavar='STEPS',
                        help="decision rule (default: the model's own; 1 is the paper's)")
    parser.add_argument('--caution', type=_seconds, metavar='S',
                        help="decision rule (default: the model's own; 0 is the paper's)")
    parser.add_argument('--out', required=True, help='folder for the results')
    parser.add_argument('--workers', type=_positive, default=1, help='processes')
    parser.add_argument('--json', metavar='FILE', help='also write the summary here')
    return parser.parse_args(arguments)


def main(arguments=None):
    """Run the command; returns its exit status."""
    options = parse(arguments)
    out = Path(options.out)
    try:
        # First: a folder that cannot be written should not cost an evaluation.
        out.mkdir(parents=True, exist_ok=True)
        load_policy(options.model, options.horizons, options.caution)
        campaigns = [
            Campaign(options.model, name, case,
                     range(options.seed, options.seed + options.episodes),
                     options.horizons and tuple(options.horizons), options.caution)
            for name in options.scenario for case in _cases(name, options.case)]
        results = run_campaigns(campaigns, options.workers)
    except (OSError, ScenarioError, WeightsError) as error:
        print(f'evaluate: {error}', file=sys.stderr)
        return 2
    summary = summarise(options.model, options.seed, results)
    write_episodes(out / 'episodes.csv', [result for cell in results for result in cell])
    tables = markdown(summary)
    for path in [out / 'summary.json', *([options.json] if options.json else [])]:
        with atomic_write(path) as stream:
            json.dump(summary, stream, indent=2)
    with atomic_write(out / 'tables.md') as stream:
        stream.write(tables)
    print(tables)
    return 0


def _cases(name, case):
    scenario = load_scenario(name)
    if case == 'all':
        return list(scenario.cases)
    scenario.counts(case)
    return [case]


def _natural(text):
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'expected a whole number, 0 or more, got {text}')
    return int(text)


def _positive(text):
    if not _natural(text):
        raise argparse.ArgumentTypeError(f'expected a whole number above 0, got {text}')
    return int(text)


def _seconds(text):
    value = float(text)
    if not 0.0 <= value < 10.0:
        raise argparse.ArgumentTypeError(f'expected seconds from 0 to 10, got {text}')
    return value


if __name__ == '__main__':
    sys.exit(main())
