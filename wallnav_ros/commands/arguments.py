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
Argument types that several tools share: what cannot be used is refused before any work.

For argparse's `type=`.
"""

import argparse
import math
import os
from pathlib import Path


def natural(text):
    """Return `text` as a whole number, 0 or more."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'expected a whole number, 0 or more, got {text}')
    return int(text)


def positive(text):
    """Return `text` as a whole number above 0."""
    if not text.isdecimal() or not int(text):
        raise argparse.ArgumentTypeError(f'expected a whole number above 0, got {text}')
    return int(text)


def finite(text):
    """Return `text` as a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'expected a finite number, got {text}')
    return value


def above_zero(text):
    """Return `text` as a finite number above 0."""
    value = finite(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f'expected a number above 0, got {text}')
    return value


def output_file(text):
    """Return `text` as the Path of a file that can be written; its folders may be new."""
    path = Path(text)
    place = path if path.exists() else _there(path)
    if not text or path.is_dir() or not (place == path or place.is_dir()) or (
            not os.access(place, os.W_OK)):
        raise argparse.ArgumentTypeError(f'no file can be written at {text!r}: choose another')
    return path


def output_folder(text):
    """Return `text` as the Path of a folder that files can be written to; it may be new."""
    place = _there(Path(text) / 'file')
    if not text or not place.is_dir() or not os.access(place, os.W_OK):
        raise argparse.ArgumentTypeError(f'no folder can be written at {text!r}: choose another')
    return Path(text)


def _there(path):
    """Return the nearest folder above `path` that exists."""
    return next(folder for folder in path.absolute().parents if folder.exists())
