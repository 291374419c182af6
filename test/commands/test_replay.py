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
"""The replay command: its files, its exit status, and the same output every time."""

import csv
import json
import subprocess
import sys

import cv2
import numpy as np
import pytest

rosbags = pytest.importorskip('rosbags')

from recorded_bags import Bag, HALL, laser_scan, MOUNT, simulate_drive, START  # noqa: E402
from wallnav_ros.commands.replay import main  # noqa: E402

pytestmark = pytest.mark.extras

AT = ['--laser-pose', *map(str, MOUNT)]
CONTRACT = {'scans', 'duration', 'scan_ms_p50', 'scan_ms_p99', 'humans_seen', 'humans_per_scan',
            'commands'}


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return the path of a bag of a simulated drive past one person."""
    return str(simulate_drive().bag.write(tmp_path_factory.mktemp('drive') / 'bag'))


@pytest.fixture(scope='module')
def hall_map(tmp_path_factory):
    """Return the path of a map YAML of the hall, 5 cm a cell."""
    folder = tmp_path_factory.mktemp('hall')
    image = np.full((int(9 / 0.05), int(13 / 0.05)), 254, np.uint8)
    for wall in HALL.segments:
        start, end = (np.floor((point + 0.5) / 0.05).astype(int).tolist() for point in wall)
        cv2.line(image, start, end, 0)
    cv2.imwrite(str(folder / 'hall.png'), image[::-1])
    (folder / 'hall.yaml').write_text(
        'image: hall.png\nresolution: 0.05\norigin: [-0.525, -0.525, 0.0]\nnegate: 0\n'
        'occupied_thresh: 0.65\nfree_thresh: 0.196\n')
    return str(folder / 'hall.yaml')


@pytest.fixture(scope='module')
def result(bag, hall_map, tmp_path_factory):
    """Return the folder that a replay in the hall's map wrote."""
    out = tmp_path_factory.mktemp('out')
    assert main([bag, '--map', hall_map, *AT, '--out', str(out)]) == 0
    return out


def rows(path):
    """Return the rows of a CSV file as dictionaries."""
    with path.open(newline='') as stream:
        return list(csv.DictReader(stream))


def test_tracks_are_listed_scan_by_scan(result):
    tracks = rows(result / 'tracks.csv')

    assert list(tracks[0]) == ['stamp', 'id', 'class', 'x', 'y', 'vx', 'vy', 'radius', 'frame']
    assert {row['class'] for row in tracks} == {'human', 'obstacle'}
    assert {row['frame'] for row in tracks} == {'map'}
    stamps = [float(row['stamp']) for row in tracks]
    assert stamps == sorted(stamps)
    assert '-0.0000' not in (result / 'tracks.csv').read_text()


def test_the_walker_in_the_table_walks_where_the_walker_went(result):
    humans = [row for row in rows(result / 'tracks.csv') if row['class'] == 'human']
    # From x = 8 m at 1 m/s towards the robot's start, 0.7 m to its left.
    expected = [START[0] + 8.0 - (float(row['stamp']) - 1000.0) for row in humans]

    assert len(humans) > 40
    assert np.median(np.abs([float(row['x']) for row in humans] - np.array(expected))) < 0.1
    assert np.median([float(row['vx']) for row in humans]) == pytest.approx(-1.0, abs=0.15)


def test_commands_are_listed_with_the_reason(result):
    commands = rows(result / 'commands.csv')

    assert list(commands[0]) == ['stamp', 'v', 'w', 'decision']
    assert 'driving' in {row['decision'] for row in commands}
    assert all(float(row['v']) >= 0.0 for row in commands)


def test_the_summary_keeps_its_contract(result):
    summary = json.loads((result / 'summary.json').read_text())

    assert set(summary) >= CONTRACT
    assert 'tracking' not in summary
    assert summary['scans'] == 79
    assert summary['duration'] == pytest.approx(7.8, abs=0.01)
    assert summary['humans_seen'] >= 1
    assert 0.0 < summary['scan_ms_p50'] <= summary['scan_ms_p99']
    assert summary['commands'] == len(rows(result / 'commands.csv'))
    assert summary['frame'] == 'map'
    assert summary['map']['used']
    np.testing.assert_allclose(summary['map']['pose_of_odom'], START, atol=0.05)


def test_the_picture_shows_map_robot_goal_and_commands(result):
    picture = cv2.imread(str(result / 'replay.png'))

    def share(blue, green, red):
        return np.mean(np.abs(picture.astype(int) - (blue, green, red)).max(axis=2) < 40)

    assert min(picture.shape[:2]) > 700
    assert share(0xa2, 0x62, 0x0b) > 1e-4, 'the commands over time'
    assert share(0x00, 0xd7, 0xff) > 1e-5, 'the golden star of the goal'
    assert share(181, 122, 87) > 1e-4, 'the walls of the map'
    assert share(0x11, 0x11, 0x11) > 1e-4, 'the way of the robot'


def test_two_runs_write_the_same_tables_to_the_byte(result, bag, hall_map, tmp_path):
    main([bag, '--map', hall_map, *AT, '--out', str(tmp_path)])

    for name in ('tracks.csv', 'commands.csv'):
        assert (tmp_path / name).read_bytes() == (result / name).read_bytes()


def test_ground_truth_adds_scores_and_json_a_copy(bag, tmp_path, capsys):
    pytest.importorskip('motmetrics')
    truth = tmp_path / 'truth.csv'
    truth.write_text(
        'bag_time_s,time_from_bag_start_s,person_id,x_m,y_m,frame_id\n'
        + ''.join(f'{1000.05 + second},{second},1,{8.0 - second},0.7,/odom\n'
                  for second in range(1, 8)))

    status = main([bag, *AT, '--ground-truth', str(truth), '--out', str(tmp_path / 'out'),
                   '--json', str(tmp_path / 'copy.json')])

    summary = json.loads((tmp_path / 'copy.json').read_text())
    assert status == 0
    assert summary == json.loads((tmp_path / 'out' / 'summary.json').read_text())
    assert set(summary['tracking']) >= {'recall', 'motp', 'id_switches', 'mota', 'gate'}
    assert summary['tracking']['annotations'] == 7
    assert 'recall' in capsys.readouterr().out


def test_a_robot_without_odometry_or_mount_is_warned_about(tmp_path, capsys):
    bag = simulate_drive(2.0, with_odometry=False).bag.write(tmp_path / 'bag')

    assert main([str(bag), '--out', str(tmp_path / 'out')]) == 0

    warnings = capsys.readouterr().err
    assert 'no odometry in the bag' in warnings
    assert '--laser-pose X Y YAW' in warnings
    assert json.loads((tmp_path / 'out/summary.json').read_text())['frame'] == 'laser'


@pytest.fixture
def refused(capsys, tmp_path):
    """Return a function that runs the command and returns the one line it is refused with."""
    def run(*arguments):
        status = main([*map(str, arguments), '--out', str(tmp_path / 'out')])
        told = capsys.readouterr()
        assert (status, told.out) == (2, '')
        assert not (tmp_path / 'out').exists()
        line, = told.err.splitlines()
        return line

    return run


def test_a_robot_with_nowhere_to_go_decides_nothing(bag, hall_map, tmp_path):
    assert main([bag, '--map', hall_map, *AT, '--initial-pose', *map(str, START),
                 '--goal', '1e5', '0', '--out', str(tmp_path)]) == 0

    summary = json.loads((tmp_path / 'summary.json').read_text())
    assert summary['decisions'] == {'goal_refused': 1}
    assert summary['decision_ms_p50'] is None and summary['scan_ms_p50'] > 0.0


def test_a_map_too_large_to_be_used_is_refused(refused, bag, tmp_path):
    image = np.full((900, 900), 254, np.uint8)
    image[[0, -1]] = 0
    cv2.imwrite(str(tmp_path / 'world.png'), image)
    (tmp_path / 'world.yaml').write_text(
        'image: world.png\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\n'
        'occupied_thresh: 0.65\nfree_thresh: 0.196\n')

    line = refused(bag, *AT, '--map', tmp_path / 'world.yaml')

    assert line.startswith('replay: --map: walls span 902 m x 902 m: too many nodes')


def test_input_that_cannot_be_used_gives_one_line_and_status_2(refused, bag, tmp_path):
    broken = tmp_path / 'broken.npz'
    broken.write_bytes(b'not weights')
    for arguments, told in (
            ((tmp_path / 'nowhere',), 'nowhere: no such folder'),
            ((tmp_path,), 'metadata.yaml: missing'),
            ((bag, '--map', tmp_path / 'no.yaml'), "no.yaml' does not exist"),
            ((bag, '--model', broken), 'broken.npz'),
            ((bag, '--model', 'nobody'), 'nobody: no such file, nor one of the shipped models'),
            ((bag, '--ground-truth', tmp_path / 'no.csv'), 'no.csv: cannot be read as CSV'),
            ((bag, '--scan-topic', 'lidar'), '--scan-topic lidar: not in the bag'),
            ((bag, '--odom-topic', 'scan'), 'is a sensor_msgs/msg/LaserScan, needs a nav_msgs')):
        line = refused(*arguments)
        assert line.startswith('replay: ')
        assert told in line


def test_a_bag_whose_scans_cannot_be_placed_is_refused(refused, tmp_path):
    drive = simulate_drive(2.0).bag
    bag = Bag([message for message in drive.messages if message[1] == '/odom'])
    bag.add(2000.0, '/scan', laser_scan(5.0, [1.0, 2.0, 3.0]))

    line = refused(bag.write(tmp_path / 'bag'))

    assert 'no scan could be placed (1 scan: no odometry at its stamp)' in line


@pytest.mark.parametrize('arguments', [
    ['--goal', 'nan', '0'], ['--goal', '1'], ['--laser-pose', '1', '2', 'inf'],
    ['--robot-radius', '0'], ['--preferred-speed', '-1'], ['--bogus'],
    ['--initial-pose', '0', '0', '0']])
def test_bad_usage_gives_status_2(bag, tmp_path, arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main([bag, *arguments, '--out', str(tmp_path / 'out')])

    assert caught.value.code == 2
    assert 'usage: replay' in capsys.readouterr().err


def test_it_runs_as_a_module_without_a_progress_bar_in_a_log(bag, tmp_path):
    done = subprocess.run(
        [sys.executable, '-m', 'wallnav_ros.commands.replay', bag, *AT, '--out', tmp_path / 'out'],
        capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert 'real time' in done.stdout
    assert done.stderr == ''


def test_a_real_drive_is_located_in_the_map_of_its_floor(shared_data, tmp_path):
    map_file, = (shared_data / 'maps/olin_mac_1st_floor').glob('*.yaml')

    status = main([str(shared_data / 'scans/olin_mac_1st_floor_take_2'), '--map', str(map_file),
                   '--out', str(tmp_path)])

    summary = json.loads((tmp_path / 'summary.json').read_text())
    assert status == 0
    assert summary['frame'] == 'map'
    # The map was made with the same odometry, give or take.
    np.testing.assert_allclose(summary['map']['pose_of_odom'], (-0.3, 0.0, 0.08), atol=0.3)
    assert summary['laser_pose'] == pytest.approx([0.0039, 0.0, 1.5708], abs=1e-3)
    assert summary['scans'] == 354
    assert summary['left_out'] == {'scan: no odometry at its stamp': 3}
    # Two or three are there. Pieces of what the map lacks made it 14 once.
    assert summary['humans_seen'] <= 8


def test_two_scanners_ask_for_a_choice(refused, shared_data):
    assert '/front_scan, /rear_scan' in refused(
        shared_data / 'scans/obstacle_detector_two_scanners/rosbag2')
