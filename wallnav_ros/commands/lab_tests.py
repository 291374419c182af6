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
Drive the paper's laboratory tests over DDS, many times each, and write docs/lab.md.

Table 4 of the paper; the runs are those of `drive`.
"""

import argparse
import json
import os
import shutil
import sys

from wallnav_ros.commands import drive
from wallnav_ros.commands.arguments import natural, output_file, output_folder, positive
from wallnav_ros.evaluation.lab_page import DRIFT, page, PAPER_TIMES, Series
from wallnav_ros.world.files import atomic_write

POSES = {'perfect': (0.0, 0.0), 'noisy': (0.05, 0.035)}     # m and rad


def main(arguments=None):
    """Run the command; returns its exit status: 0 only if every run reached the goal."""
    options = _parse(arguments)
    status = 0
    for pose in options.poses:
        for lab in options.labs:
            status = max(status, drive.main([
                '--scenario', lab, '--case', 'lab', '--runs', str(options.runs),
                '--seed', str(options.seed), '--model', options.model,
                '--out', str(options.out / f'{lab}_{pose}'), '--speed', str(options.speed),
                '--odom-drift', str(DRIFT), '--localisation-noise', *map(str, POSES[pose])]))
            if status > 1:
                return status
    if options.page is not None:
        try:
            _write_page(options.out, options.page, options.speed)
        except OSError as error:
            print(f'lab_tests: {error}', file=sys.stderr)
            return 1
    return status


def _parse(arguments):
    parser = argparse.ArgumentParser('lab_tests', description=__doc__.strip().splitlines()[0])
    parser.add_argument('--out', required=True, type=output_folder, help='folder for the results')
    parser.add_argument('--runs', type=positive, default=20, help='of each test')
    parser.add_argument('--seed', type=natural, default=1, help='of the first run of each')
    parser.add_argument('--labs', nargs='*', default=list(PAPER_TIMES), choices=PAPER_TIMES)
    parser.add_argument('--poses', nargs='*', default=list(POSES), choices=POSES,
                        help='in the map, that the robot is given')
    parser.add_argument('--speed', type=float, default=1.0,
                        help='simulated seconds per second')
    parser.add_argument('--model', default='wallnav', help='weight file, or a shipped name')
    parser.add_argument('--page', type=output_file, metavar='FILE.md',
                        help='write this page about all results in the folder')
    return parser.parse_args(arguments)


def _write_page(out, path, speed):
    """Write the page at `path`, and its pictures beside it, about the results in folder `out`."""
    series = []
    for pose, noise in POSES.items():
        for lab in PAPER_TIMES:
            folder = out / f'{lab}_{pose}'
            if not (folder / 'summary.json').is_file():
                continue
            picture = f'figures/{lab}_{pose}.png'
            (path.parent / 'figures').mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder / 'run_000.png', path.parent / picture)
            runs = json.loads((folder / 'summary.json').read_text(encoding='utf-8'))['runs']
            series.append(Series(lab, noise, runs, picture))
    with atomic_write(path) as stream:
        stream.write(page(series, speed, os.sched_getscheduler(0) != os.SCHED_OTHER))


if __name__ == '__main__':
    sys.exit(main())
