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
Annotated positions of people, and which scan of a recording each of them was clicked on.

Pairing as in Leigh et al. 2015's annotations: stamped after the scan they belong to.
"""

import csv
from dataclasses import dataclass
from pathlib import Path
import reprlib

import numpy as np

from wallnav_ros.evaluation.recordings import RecordingError

COLUMNS = ('bag_time_s', 'time_from_bag_start_s', 'person_id', 'x_m', 'y_m', 'frame_id')


@dataclass(frozen=True)
class GroundTruth:
    """
    Annotated people, one row each, in file order.

    bag_time: (N,) seconds, in the recorder's clock. person: (N,) int.
    position: (N, 2) metres, in the frame of the same row.
    frame: (N,) str, without leading slashes.
    """

    bag_time: np.ndarray
    person: np.ndarray
    position: np.ndarray
    frame: np.ndarray

    def __len__(self):
        """Return the number of annotated positions."""
        return len(self.person)

    def scan_index(self, bag_times):
        """
        Return the index (N,) of the scan each row belongs to, -1 for rows before the first.

        `bag_times` (S,) are the receive times of the scans, ascending: a row belongs to the
        last scan at or before it.
        """
        return np.searchsorted(np.asarray(bag_times), self.bag_time, side='right') - 1


def load_ground_truth(path):
    """Return the GroundTruth in the CSV file `path`; RecordingError names line and column."""
    path = Path(path)
    try:
        with path.open(newline='', encoding='utf-8') as stream:
            rows = csv.reader(stream)
            header = tuple(next(rows, ()))
            if header != COLUMNS:
                raise RecordingError(f'{path}: line 1: header is {",".join(header)!r}: '
                                     f'make it {",".join(COLUMNS)!r}')
            parsed = [_row(path, rows.line_num, row) for row in rows if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f'{path}: cannot be read as CSV: {error}') from error
    if not parsed:
        raise RecordingError(f'{path}: holds no annotated position: add rows, or leave it out')
    bag_time, person, x, y, frame = zip(*parsed)
    return GroundTruth(np.array(bag_time), np.array(person), np.column_stack((x, y)),
                       np.array(frame))


def _row(path, line, row):
    """Return (bag time, person, x, y, frame) of one CSV row."""
    if len(row) != len(COLUMNS):
        raise RecordingError(f'{path}: line {line}: {len(row)} columns, needs {len(COLUMNS)}')
    values = {}
    for name, text, kind in zip(COLUMNS[:5], row, (float, float, int, float, float)):
        try:
            values[name] = kind(text)
        except ValueError:
            raise RecordingError(f'{path}: line {line}: {name}: {reprlib.repr(text)} is not '
                                 f'{"a whole number" if kind is int else "a number"}') from None
        # Infinity, NaN, and more than an array of int64 or a sum of squares can hold.
        if not abs(values[name]) < 1e18:
            raise RecordingError(f'{path}: line {line}: {name}: must be finite and below 1e18, '
                                 f'is {reprlib.repr(text)}')
    return (values['bag_time_s'], values['person_id'], values['x_m'], values['y_m'],
            row[5].strip().lstrip('/'))
