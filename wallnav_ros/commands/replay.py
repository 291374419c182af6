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
Replay a recorded bag through tracker and policy, with no ROS graph.

Writes tracks.csv, commands.csv, summary.json and replay.png (docs/replay.md).
"""

import argparse
from collections import Counter
from contextlib import contextmanager
import csv
import json
from pathlib import Path
import sys
from time import perf_counter

import numpy as np
from tqdm import tqdm

from wallnav_ros.commands.arguments import above_zero, finite, output_file, output_folder
from wallnav_ros.evaluation.ground_truth import load_ground_truth
from wallnav_ros.evaluation.recordings import Recording, RecordingError
from wallnav_ros.evaluation.replay import replay_recording
from wallnav_ros.evaluation.replay_figures import draw_replay
from wallnav_ros.evaluation.replay_stage import set_stage
from wallnav_ros.evaluation.survey import survey_recording
from wallnav_ros.mapping.occupancy_map import load_map, MapError
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.navigation.navigator import NavigatorSettings
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.value_function import load_value_function, WeightsError
from wallnav_ros.world.files import atomic_write, find_asset
from wallnav_ros.world.tracks import HUMAN

# m, as the nodes' parameter wall_min_size.
SPECKLE = 0.1
CLASSES = {True: 'human', False: 'obstacle'}


def main(arguments=None):
    """Run the command; returns its exit status: 0, or 2 for input that cannot be used."""
    options = _parse(arguments)
    try:
        summary = _replay(options)
    except (RecordingError, MapError, WeightsError, OSError) as error:
        print(f'replay: {error}', file=sys.stderr)
        return 2
    for warning in summary['warnings']:
        print(f'replay: warning: {warning}', file=sys.stderr)
    print(_headline(summary, options.out))
    return 0


def _parse(arguments):
    parser = argparse.ArgumentParser(
        prog='replay', description='Replay a recorded bag through tracker and policy.')
    parser.add_argument('bag', metavar='BAG_DIR', help='rosbag2 folder (sqlite3 or mcap)')
    parser.add_argument('--map', metavar='MAP.yaml', help='map of the place')
    parser.add_argument('--initial-pose', nargs=3, type=finite, metavar=('X', 'Y', 'YAW'),
                        help='of the robot in the map at the start (default: found by matching)')
    parser.add_argument('--goal', nargs=2, type=finite, metavar=('X', 'Y'),
                        help='metres; in the map where the robot is located in it, else in the '
                             'odometry frame (default: where the robot ended)')
    parser.add_argument('--scan-topic', metavar='T', help='default: the only LaserScan')
    parser.add_argument('--odom-topic', metavar='T', help='default: the only Odometry')
    parser.add_argument('--laser-pose', nargs=3, type=finite, metavar=('X', 'Y', 'YAW'),
                        help='of the laser on the robot (default: from the tf in the bag)')
    parser.add_argument('--ground-truth', metavar='FILE.csv', help='annotated people')
    parser.add_argument('--model', default='wallnav', metavar='NAME_OR_FILE',
                        help='weights of the policy (default: %(default)s)')
    parser.add_argument('--robot-radius', type=above_zero, default=NavigatorSettings.radius,
                        metavar='M',
                        help='default: %(default)s')
    parser.add_argument('--preferred-speed', type=above_zero, metavar='M/S',
                        default=NavigatorSettings.preferred_speed,
                        help='default: %(default)s')
    parser.add_argument('--out', required=True, metavar='DIR', type=output_folder,
                        help='folder for the results')
    parser.add_argument('--json', metavar='FILE', type=output_file,
                        help='write summary.json here as well')
    options = parser.parse_args(arguments)
    if options.initial_pose and not options.map:
        parser.error('--initial-pose is a pose in the map: give --map too')
    return options


def _replay(options):
    """Do it all, write the files and return the summary."""
    started = perf_counter()
    lookahead = Lookahead.from_weights(load_value_function(
        find_asset('models', options.model, '.npz')))
    truth = load_ground_truth(options.ground_truth) if options.ground_truth else None
    mapped = load_map(options.map) if options.map else None
    recording = Recording(options.bag, options.scan_topic, options.odom_topic)
    survey = survey_recording(recording, options.laser_pose)
    staging = set_stage(
        survey, NavigatorSettings(options.robot_radius, options.preferred_speed),
        None if mapped is None else extract_walls(mapped, min_size=SPECKLE).walls,
        options.initial_pose, options.goal)
    with tqdm(total=recording.scan_count, unit='scan', disable=None, desc='replay') as bar:
        replay = replay_recording(recording, staging.stage, Tracker(), lookahead, bar.update)
    if not replay.tracks:
        reasons = '; '.join(f'{count} {why}' for why, count in replay.left_out.items())
        raise RecordingError(f'{options.bag}: {recording.scan_topic}: no scan could be placed '
                             f'({reasons}): choose other topics')
    summary = _figures(replay, perf_counter() - started)
    summary.update(bag=str(options.bag), scan_topic=recording.scan_topic,
                   odom_topic=recording.odom_topic, **staging.summary)
    summary['warnings'] = [
        *(mapped.warnings if mapped else ()), *staging.warnings,
        *(f'{count} messages left out: {why}' for why, count in replay.left_out.items())]
    people = None
    if truth is not None:
        # It brings pandas, which takes as long to import as a short bag to replay.
        from wallnav_ros.evaluation.replay_scores import score_replay
        summary['tracking'], people = score_replay(replay, survey, staging.stage, truth)
    _write(options, replay, staging, summary)
    draw_replay(options.out / 'replay.png', _title(options, summary), replay, survey,
                staging.stage, staging.walls, people)
    return summary


def _figures(replay, seconds):
    """Return the part of the summary that is measured."""
    humans = [tracks.id[tracks.label == HUMAN] for tracks in replay.tracks]
    duration = float(replay.bag_times[-1] - replay.bag_times[0])
    figures = {
        'scans': len(replay.tracks), 'duration': round(duration, 3),
        'humans_seen': len(np.unique(np.concatenate(humans))),
        'humans_per_scan': round(float(np.mean([len(ids) for ids in humans])), 4),
        'commands': len(replay.commands), 'decisions': dict(Counter(replay.decisions)),
        'left_out': dict(replay.left_out),
        'seconds': round(seconds, 3), 'real_time_factor': round(duration / seconds, 1)}
    for name, spent in (('scan', replay.scan_ms), ('decision', replay.decision_ms)):
        for share in (50, 99):
            # A robot that has nowhere to go decides nothing.
            figures[f'{name}_ms_p{share}'] = (
                round(float(np.percentile(spent, share)), 3) if len(spent) else None)
    return figures


def _write(options, replay, staging, summary):
    """Write the tables and the summary into the folder `options.out`."""
    with _table(options.out / 'tracks.csv') as write:
        write(('stamp', 'id', 'class', 'x', 'y', 'vx', 'vy', 'radius', 'frame'))
        for tracks in replay.tracks:
            stamp = f'{tracks.stamp:.6f}'
            for row in zip(tracks.id, tracks.label == HUMAN, tracks.position, tracks.velocity,
                           tracks.radius):
                number, human, position, velocity, radius = row
                write((stamp, number, CLASSES[bool(human)],
                       *map(_decimal, (*position, *velocity, radius)),
                       staging.stage.frame))
    with _table(options.out / 'commands.csv') as write:
        write(('stamp', 'v', 'w', 'decision'))
        for stamp, command, decision in zip(replay.stamps, replay.commands, replay.decisions):
            write((f'{stamp:.6f}', *map(_decimal, command), decision))
    for path in filter(None, (options.out / 'summary.json', options.json)):
        with atomic_write(path) as stream:
            json.dump(summary, stream, indent=2)
            stream.write('\n')


def _decimal(value):
    """Return `value` with four decimals, and zero without a sign."""
    return f'{round(float(value), 4) + 0.0:.4f}'


@contextmanager
def _table(path):
    """Open a CSV file that appears whole; yields the function that writes a row."""
    with atomic_write(path, newline='') as stream:
        yield csv.writer(stream, lineterminator='\n').writerow


def _title(options, summary):
    bag = Path(options.bag).resolve()
    return (f'{bag.parent.name}/{bag.name}: {summary["duration"]:.0f} s, '
            f'scans: {summary["scans"]}, people tracked: {summary["humans_seen"]}\n'
            + '; '.join(_short(summary)))


def _short(summary):
    """Yield what a reader of the picture must know that it does not show."""
    if summary['odom_topic'] is None:
        yield 'no odometry: the robot is assumed to stand still'
    if summary.get('map'):
        yield ('located in the map by ' + summary['map']['from'] if summary['map']['used']
               else 'map not used: the robot could not be located in it')
    yield f'goal: {summary["goal"]["from"]}'


def _headline(summary, out):
    """Return the line that the command ends with."""
    text = (f'{summary["duration"]:.1f} s in {summary["seconds"]:.1f} s '
            f'({summary["real_time_factor"]:g} x real time), scans: {summary["scans"]}, '
            f'people: {summary["humans_seen"]}, commands: {summary["commands"]}')
    if 'tracking' in summary:
        text += ', ' + ', '.join(f'{name} {value}' for name, value in summary['tracking'].items())
    return f'{text}: {out}'


if __name__ == '__main__':
    sys.exit(main())
