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
Argument types that several tools share: whole numbers, refused in words.

For argparse's `type=`.
"""

import argparse


def natural(text):
    """Return `text` as a whole number, 0 or more."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'expected a whole number, 0 or more, got {text}')
    return int(text)


def positive(text):
    """Return `text` as a whole number above 0."""
    if not natural(text):
        raise argparse.ArgumentTypeError(f'expected a whole number above 0, got {text}')
    return int(text)
