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
Score the tracker on recordings and in the simulator, and rebuild docs/tracking.md.

CLEAR MOT figures by motmetrics; see the page for gates and targets.
"""

import argparse
from pathlib import Path
import sys

from rosbags.rosbag2 import ReaderError
from tqdm import tqdm

from wallnav_ros.commands.arguments import output_file
from wallnav_ros.evaluation.recordings import RecordingError
from wallnav_ros.evaluation.tracking_figures import draw_tracks
from wallnav_ros.evaluation.tracking_report import (
    page, read_rows, recording_line, simulation_lines)
from wallnav_ros.world.files import atomic_write

# What is drawn, by the recording's name: those whose authors state a licence.
PICTURED = ('leg_tracker_bench_moving_1', 'leg_tracker_bench_following_outdoor_1',
            'leg_tracker_stationary')


def main(arguments=None):
    """Run the command; returns its exit status: 0, or 2 for input that cannot be used."""
    parser = argparse.ArgumentParser(
        prog='score_tracking', description='Score the tracker and rebuild docs/tracking.md.')
    parser.add_argument('data', metavar='DATA_DIR', type=Path,
                        help='folder with rosbag2 folders, at any depth')
    parser.add_argument('--out', metavar='FILE.md', type=output_file,
                        default=Path('docs/tracking.md'))
    options = parser.parse_args(arguments)
    try:
        recordings, pictures = [], []
        for row in tqdm(read_rows(options.data), unit='recording', disable=None):
            recordings.append(recording_line(row))
            if row.name in PICTURED:
                file = f'figures/tracking_{row.name.replace("/", "_")}.png'
                draw_tracks(options.out.parent / file, row)
                pictures.append((file, f'Human tracks of {row.name}'))
        if not recordings:
            raise RecordingError(f'{options.data}: holds no rosbag2 folder: name another')
        text = page(recordings, simulation_lines(), pictures)
    except (RecordingError, ReaderError, OSError) as error:
        print(f'score_tracking: {error}', file=sys.stderr)
        return 2
    with atomic_write(options.out) as stream:
        stream.write(text)
    print(f'score_tracking: {len(recordings)} recordings scored in {options.out}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
