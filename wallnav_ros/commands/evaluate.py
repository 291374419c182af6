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
Measure policies greedily over paired seeds, cell by cell, and compare them.

Paper section 7; writes summary.json, episodes.csv, tables.md and pictures of trajectories.
"""

import argparse
from dataclasses import replace
import json
from pathlib import Path
import sys

from wallnav_ros.commands.arguments import natural, output_file, output_folder, positive
from wallnav_ros.evaluation.comparison import compare, comparison_markdown
from wallnav_ros.evaluation.episodes import Campaign, load_policy, run_campaigns
from wallnav_ros.evaluation.tables import markdown, summarise, write_episodes
from wallnav_ros.evaluation.trajectory_figures import draw_cell
from wallnav_ros.evaluation.worker_pool import WorkerDied
from wallnav_ros.policy.value_function import FARTHEST, WeightsError
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.files import atomic_write


def parse(arguments):
    """Return the parsed command line."""
    parser = argparse.ArgumentParser('evaluate', description=__doc__.strip().splitlines()[0])
    parser.add_argument('--model', nargs='+', action='extend', metavar='MODEL',
                        help='weight file, the short name of a shipped one, or orca; the first '
                             'of several is compared with the others (default: wallnav)')
    parser.add_argument('--scenario', nargs='+', default=['curve_path', 'cross_path'],
                        help='scenario files or short names (default: both paths of the paper)')
    parser.add_argument('--case', default='all', help='a case of the scenarios, or all')
    parser.add_argument('--episodes', type=positive, default=100, help='per cell')
    parser.add_argument('--seed', type=natural, default=0,
                        help='of the first episode of each cell')
    parser.add_argument('--horizons', type=_steps, nargs='+', metavar='STEPS',
                        help="decision rule (default: the model's own; 1 is the paper's)")
    parser.add_argument('--turns', type=_steps, nargs='+', metavar='STEPS',
                        help='decision rule: for how long a way may turn before it keeps its '
                             "heading (default: the model's own; 1 is the paper's)")
    parser.add_argument('--caution', type=_seconds, metavar='S',
                        help="decision rule (default: the model's own; 0 is the paper's)")
    parser.add_argument('--constant-velocity', action='store_true',
                        help='decision rule: people are foreseen to keep their velocity, as in '
                             'the paper (default: as the model has learned)')
    parser.add_argument('--robot-visible', action='store_true',
                        help='people see the robot and give way (default: what a scenario says)')
    parser.add_argument('--figures', type=natural, default=6, metavar='N',
                        help='episodes of each cell to draw (default: 6)')
    parser.add_argument('--out', required=True, metavar='DIR', type=output_folder,
                        help='folder for the results')
    parser.add_argument('--workers', type=positive, default=1, help='processes')
    parser.add_argument('--json', metavar='FILE', type=output_file,
                        help='also write the summary here')
    return parser.parse_args(arguments)


def main(arguments=None):
    """Run the command; returns its exit status."""
    options = parse(arguments)
    try:
        # First: a folder that cannot be made should not cost an evaluation.
        options.out.mkdir(parents=True, exist_ok=True)
        _evaluate(options, options.model or ['wallnav'])
    except (OSError, ScenarioError, WeightsError) as error:
        print(f'evaluate: {error}', file=sys.stderr)
        return 2
    except WorkerDied as error:
        print(f'evaluate: {error}, perhaps for want of memory; nothing was written: '
              'give fewer --workers', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print('evaluate: interrupted; nothing was written', file=sys.stderr)
        return 130
    return 0


def _evaluate(options, models):
    """Measure `models`, and write and print what came out."""
    out = options.out
    for model in models:
        load_policy(model, options.horizons, options.caution)
    campaigns = [campaign for model in models for campaign in _campaigns(options, model)]
    results = run_campaigns(campaigns, options.workers)
    cells = len(campaigns) // len(models)
    parts = [slice(start, start + cells) for start in range(0, len(campaigns), cells)]
    summaries = [
        _report(options, out if len(models) == 1 else out / folder, campaigns[part], results[part])
        for folder, part in zip(_folders(models), parts)]
    summary = summaries[0]
    if len(models) > 1:
        comparisons = [compare(results[parts[0]], results[part]) for part in parts[1:]]
        summary = summary | {'models': summaries, 'comparisons': [
            {'model': models[0], 'against': model, **comparison}
            for model, comparison in zip(models[1:], comparisons)]}
        _write(out / 'summary.json', json.dumps(summary, indent=2))
        tables = comparison_markdown(summaries, comparisons)
        _write(out / 'comparison.md', tables)
        print(tables)
    if options.json:
        _write(options.json, json.dumps(summary, indent=2))


def _campaigns(options, model):
    """Return one Campaign per cell."""
    seeds = range(options.seed, options.seed + options.episodes)
    own = Campaign(model, '', '', seeds, options.horizons and tuple(options.horizons),
                   options.caution, True if options.robot_visible else None, options.figures,
                   options.constant_velocity, options.turns and tuple(options.turns))
    return [replace(own, scenario=name, case=case) for name in options.scenario
            for case in _cases(name, options.case)]


def _report(options, out, campaigns, results):
    """Write what is known of one model to `out`; returns its summary."""
    model = campaigns[0].model
    summary = summarise(model, options.seed, results)
    write_episodes(out / 'episodes.csv', [result for cell in results for result in cell])
    tables = markdown(summary)
    _write(out / 'summary.json', json.dumps(summary, indent=2))
    _write(out / 'tables.md', tables)
    for campaign, cell in zip(campaigns, results):
        drawn = cell[:options.figures]
        if drawn:
            draw_cell(out / f'{cell[0].scenario}_{cell[0].case}.png',
                      campaign.episodes([result.seed for result in drawn]), drawn,
                      f'{Path(model).stem} on {cell[0].scenario}, {cell[0].case}')
    print(tables)
    return summary


def _folders(models):
    """Return a folder name for each model, numbered where two would share one."""
    names = [Path(model).stem for model in models]
    return [name if names.count(name) == 1 else f'{name}_{number + 1}'
            for number, name in enumerate(names)]


def _write(path, text):
    with atomic_write(path) as stream:
        stream.write(text)


def _cases(name, case):
    scenario = load_scenario(name)
    if case == 'all':
        return list(scenario.cases)
    scenario.counts(case)
    return [case]


def _steps(text):
    if positive(text) > FARTHEST:
        raise argparse.ArgumentTypeError(f'expected at most {FARTHEST} steps, got {text}')
    return int(text)


def _seconds(text):
    value = float(text)
    if not 0.0 <= value < 10.0:
        raise argparse.ArgumentTypeError(f'expected seconds from 0 to 10, got {text}')
    return value


if __name__ == '__main__':
    sys.exit(main())
