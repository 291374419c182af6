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
"""The command extract_walls: JSON and picture for a good map, one line and status 2 for a bad."""

import json
import os
import subprocess
import sys

import cv2
from map_files import MISPLACED_MAPS, REAL_MAPS, write_map_files
import numpy as np
import pytest

from wallnav_ros.commands.extract_walls import main

BLOCK = np.full((4, 6), 254)
BLOCK[1:3, 1:5] = 0


@pytest.fixture
def block(tmp_path):
    """Return a map of 6 x 4 cells of 0.5 m with a block of 4 x 2 cells in it, and an origin."""
    return write_map_files(tmp_path, BLOCK, resolution='0.5', origin='[10.0, -2.0, 0.0]')


def test_walls_are_written_in_metres_of_the_map_frame(block, tmp_path, capsys):
    assert main([str(block), '--out', str(tmp_path / 'walls.json')]) == 0

    document = json.loads((tmp_path / 'walls.json').read_text())
    assert document['frame'] == 'map'
    assert document['resolution'] == 0.5
    wall, = document['walls']
    assert wall[0] == wall[-1]
    assert sorted(map(tuple, wall[1:])) == [(10.5, -1.5), (10.5, -0.5), (12.5, -1.5), (12.5, -0.5)]
    assert document['stats']['segments'] == 4
    assert document['stats']['length'] == 6.0
    assert document['warnings'] == []
    assert '4 segments, 6.0 m, moved by at most 0.25 m' in capsys.readouterr().out


def test_json_and_out_give_the_same_document_in_folders_made_for_them(block, tmp_path):
    out, copy = tmp_path / 'new' / 'walls.json', tmp_path / 'walls' / 'copy.json'

    assert main([str(block), '--out', str(out), '--json', str(copy)]) == 0

    assert out.read_bytes() == copy.read_bytes()


def test_tolerance_and_speckle_are_settings(tmp_path):
    pixels = np.full((30, 30), 254)
    pixels[5, 5] = 0
    pixels[np.tril_indices(30, -12)] = 0
    path = write_map_files(tmp_path, pixels, resolution='0.1')

    def stats(*options):
        assert main([str(path), *options, '--out', str(tmp_path / 'walls.json')]) == 0
        return json.loads((tmp_path / 'walls.json').read_text())['stats']

    exact, coarse = stats('--tolerance', '0'), stats('--tolerance', '0.2', '--min-size', '0.15')
    assert exact['segments'] > 30 > coarse['segments']
    assert (exact['polylines'], coarse['polylines']) == (2, 1)
    assert coarse['speckles_dropped'] == 1


def test_the_plot_shows_walls_over_the_map(block, tmp_path):
    assert main([str(block), '--plot', str(tmp_path / 'walls.png')]) == 0

    picture = cv2.imread(str(tmp_path / 'walls.png')).astype(int)
    blue, green, red = np.moveaxis(picture, 2, 0)
    assert min(picture.shape[:2]) > 500
    assert ((red > 180) & (green < 80) & (blue < 90)).sum() > 1000


def test_a_warning_of_the_map_is_passed_on(tmp_path, capsys):
    pixels = np.full((5, 5), 205)
    pixels[2] = 0

    assert main([str(write_map_files(tmp_path, pixels, free_thresh='0.25'))]) == 0

    assert 'extract_walls: warning: ' in capsys.readouterr().err


@pytest.mark.parametrize('fields, data, field', [
    ({'resolution': '0'}, None, 'resolution'), ({'image': 'lost.pgm'}, None, 'image'),
    ({'image': None}, None, 'image'), ({'origin': '[0, 0]'}, None, 'origin'),
    ({'free_thresh': '0.9'}, None, 'free_thresh'), ({}, b'', 'image'),
    ({}, b'P5 20 20 255 ', 'image'), ({'image': '/nowhere/map.pgm'}, None, 'image')])
def test_a_bad_map_gives_one_line_and_status_2(tmp_path, capsys, fields, data, field):
    path = write_map_files(tmp_path, BLOCK, data, **fields)

    assert main([str(path), '--out', str(tmp_path / 'walls.json')]) == 2

    line, = capsys.readouterr().err.splitlines()
    assert line.startswith(f'extract_walls: {path}: {field}')
    assert not (tmp_path / 'walls.json').exists()


@pytest.mark.parametrize('options', [
    [], ['--tolerance', '-1'], ['--tolerance', 'nan'], ['--min-size', 'small'], ['--depth', '1'],
    ['--out', '/'], ['--plot', '/'], ['--json', '/']])
def test_wrong_options_are_wrong_usage(block, options, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([str(block), *options] if options else [])

    assert stopped.value.code == 2


@pytest.mark.parametrize('name', MISPLACED_MAPS)
def test_maps_broken_as_published_end_the_process_with_status_2(shared_data, name, repository):
    ended = subprocess.run(
        [sys.executable, '-m', 'wallnav_ros.commands.extract_walls',
         str(shared_data / 'maps' / name)],
        cwd=repository, env=os.environ, capture_output=True, text=True, check=False)

    assert ended.returncode == 2
    assert ended.stdout == ''
    assert len(ended.stderr.splitlines()) == 1
    assert 'image' in ended.stderr


@pytest.mark.parametrize('name', REAL_MAPS)
def test_real_maps_give_walls(shared_data, name, tmp_path):
    assert main([str(shared_data / 'maps' / name), '--json', str(tmp_path / 'walls.json')]) == 0

    document = json.loads((tmp_path / 'walls.json').read_text())
    assert len(document['walls']) == document['stats']['polylines'] > 0
    assert np.isfinite(np.concatenate(document['walls'])).all()
