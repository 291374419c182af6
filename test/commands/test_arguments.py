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
from wallnav_ros.commands.arguments import natural, positive


def test_whole_numbers_are_taken():
    assert (natural('0'), natural('12'), positive('1')) == (0, 12, 1)


@pytest.mark.parametrize(('kind', 'text', 'words'), [
    (natural, '-1', '0 or more, got -1'), (natural, '1.5', '0 or more, got 1.5'),
    (natural, 'many', '0 or more, got many'), (positive, '0', 'above 0, got 0'),
])
def test_anything_else_is_refused(kind, text, words):
    with pytest.raises(argparse.ArgumentTypeError, match=words):
        kind(text)
