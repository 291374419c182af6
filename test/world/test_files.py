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
"""Files: assets found by short name or path, and writes that are whole or not at all."""

import os
import stat
import subprocess
import sys

import pytest

from wallnav_ros.world import files
from wallnav_ros.world.files import atomic_write, find_asset, share_directory


@pytest.fixture
def share(tmp_path, monkeypatch):
    """Return an otherwise empty share directory that holds one model."""
    (tmp_path / 'models').mkdir()
    (tmp_path / 'models' / 'default.npz').write_text('weights')
    monkeypatch.setattr(files, 'share_directory', lambda: tmp_path)
    return tmp_path


def test_in_the_source_tree_the_share_directory_is_the_repository(repository):
    assert share_directory() == repository


def test_an_installed_package_finds_its_share_through_the_ament_prefix(tmp_path, monkeypatch):
    share = tmp_path / 'prefix' / 'share' / 'wallnav_ros'
    share.mkdir(parents=True)
    monkeypatch.setattr(files, '__file__', str(tmp_path / 'lib' / 'a' / 'b' / 'files.py'))
    monkeypatch.setenv('AMENT_PREFIX_PATH', os.pathsep.join(['', str(tmp_path / 'prefix')]))

    assert share_directory() == share


def test_where_there_is_no_share_directory_the_fix_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(files, '__file__', str(tmp_path / 'lib' / 'a' / 'b' / 'files.py'))
    monkeypatch.setenv('AMENT_PREFIX_PATH', '')

    with pytest.raises(FileNotFoundError, match='source the workspace'):
        share_directory()


@pytest.mark.parametrize('name', ['default', 'models/default.npz'])
def test_an_asset_is_found_by_its_short_name_or_its_path_in_the_package(share, name):
    assert find_asset('models', name, '.npz') == share / 'models' / 'default.npz'


def test_a_file_of_ones_own_comes_before_a_shipped_one(share, tmp_path, monkeypatch):
    (tmp_path / 'here').mkdir()
    monkeypatch.chdir(tmp_path / 'here')
    (tmp_path / 'here' / 'default').write_text('mine')

    assert find_asset('models', 'default', '.npz').read_text() == 'mine'


def test_an_unknown_asset_is_refused_with_what_there_is(share):
    with pytest.raises(FileNotFoundError, match=r'^best: .* shipped models \(default\)$'):
        find_asset('models', 'best', '.npz')
    with pytest.raises(FileNotFoundError, match="^'': no such file"):
        find_asset('models', '', '.npz')
    with pytest.raises(FileNotFoundError, match=r'\(none\)$'):
        find_asset('maps', 'hall', '.yaml')


def test_a_write_appears_whole_with_ordinary_permissions(tmp_path):
    path = tmp_path / 'new' / 'result.txt'

    with atomic_write(path) as stream:
        stream.write('first')
        assert not path.exists()

    assert path.read_text() == 'first'
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~umask


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / 'result.txt'
    path.write_text('old')

    with pytest.raises(KeyboardInterrupt), atomic_write(path) as stream:
        stream.write('half of the n')
        raise KeyboardInterrupt

    assert path.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [path]


def test_bytes_can_be_written_too(tmp_path):
    with atomic_write(tmp_path / 'x', 'wb') as stream:
        stream.write(b'\0\1')

    assert (tmp_path / 'x').read_bytes() == b'\0\1'


def test_text_is_utf_8_whatever_the_locale(tmp_path):
    program = ('import sys; from wallnav_ros.world.files import atomic_write\n'
               'with atomic_write(sys.argv[1]) as stream: stream.write("\\u2013 m/s\\u00b3")')
    subprocess.run(
        [sys.executable, '-c', program, tmp_path / 'table.md'], check=True,
        env={**os.environ, 'LC_ALL': 'C', 'PYTHONUTF8': '0', 'PYTHONCOERCECLOCALE': '0',
             'PYTHONPATH': os.pathsep.join(sys.path)})

    assert (tmp_path / 'table.md').read_bytes() == '– m/s³'.encode()


def test_a_link_goes_on_leading_to_the_file_that_was_written(tmp_path):
    (tmp_path / 'results').mkdir()
    link = tmp_path / 'latest.json'
    link.symlink_to(tmp_path / 'results' / 'run.json')

    with atomic_write(link) as stream:
        stream.write('{}')

    assert link.is_symlink()
    assert (tmp_path / 'results' / 'run.json').read_text() == '{}'


def test_what_is_no_file_is_written_to_and_not_replaced(tmp_path):
    pipe = tmp_path / 'pipe'
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)

    with atomic_write(pipe) as stream:
        stream.write('result')

    assert os.read(reader, 100) == b'result'
    os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_folder_in_the_place_of_the_file_is_refused(tmp_path):
    with pytest.raises(IsADirectoryError), atomic_write(tmp_path) as stream:
        stream.write('lost')

    assert not list(tmp_path.iterdir())
