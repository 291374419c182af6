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
"""Whole numbers on a command line: taken, or refused in words that quote them."""

import argparse

import pytest
from wallnav_ros.commands.arguments import (
    above_zero, finite, natural, output_file, output_folder, positive)


def test_whole_numbers_are_taken():
    assert (natural('0'), natural('12'), positive('1')) == (0, 12, 1)


def test_numbers_are_taken():
    assert (finite('-1.5'), finite('2'), above_zero('1e-3')) == (-1.5, 2.0, 0.001)


@pytest.mark.parametrize(('kind', 'text', 'words'), [
    (natural, '-1', '0 or more, got -1'), (natural, '1.5', '0 or more, got 1.5'),
    (natural, 'many', '0 or more, got many'), (positive, '0', 'above 0, got 0'),
    (positive, '-1', 'above 0, got -1'),
    (finite, 'nan', 'finite number, got nan'), (finite, 'inf', 'finite number, got inf'),
    (finite, 'far', 'finite number, got far'), (above_zero, '0', 'above 0, got 0'),
    (above_zero, '-0.1', 'above 0, got -0.1'), (above_zero, 'nan', 'finite number, got nan'),
])
def test_anything_else_is_refused(kind, text, words):
    with pytest.raises(argparse.ArgumentTypeError, match=words):
        kind(text)


def test_results_may_go_to_a_new_folder_of_which_nothing_is_made_yet(tmp_path):
    file, folder = tmp_path / 'a' / 'b.json', tmp_path / 'c' / 'd'

    assert (output_file(str(file)), output_folder(str(folder))) == (file, folder)
    assert output_folder(str(tmp_path)) == tmp_path
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('kind', [output_file, output_folder])
def test_a_place_that_cannot_be_written_is_refused(kind, tmp_path):
    (tmp_path / 'file').write_text('')

    for text in ('', str(tmp_path / 'file' / 'below')):
        with pytest.raises(argparse.ArgumentTypeError, match='choose another'):
            kind(text)


def test_a_file_is_no_folder_and_a_folder_no_file(tmp_path):
    (tmp_path / 'file').write_text('')

    assert output_file(str(tmp_path / 'file')) == tmp_path / 'file'
    with pytest.raises(argparse.ArgumentTypeError, match='no file'):
        output_file(str(tmp_path))
    with pytest.raises(argparse.ArgumentTypeError, match='no folder'):
        output_folder(str(tmp_path / 'file'))
