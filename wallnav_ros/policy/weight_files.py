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
Weight files: .npz archives that are read without trusting anything in them.

NumPy's format with `allow_pickle=False`; what they hold is described in docs/models.md.
"""

import zipfile

import numpy as np

MAX_BYTES = 64 * 1024 * 1024     # a file that unpacks to more is not one of ours


class WeightsError(ValueError):
    """A weight file that cannot be trusted; one line naming file, fault and fix."""


def read_arrays(path):
    """Return {name: array} of the file at `path` (a Path); WeightsError if it is none."""
    if not path.is_file():
        raise WeightsError(f'{path}: no such weight file')
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MAX_BYTES:
                raise WeightsError(f'{path}: unpacks to more than {MAX_BYTES >> 20} MiB; '
                                   'this is not a weight file of this package')
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except WeightsError:
        raise
    except Exception as error:      # a hostile file may raise nearly anything on the way
        reason = ' '.join(str(error).split()) or type(error).__name__
        raise WeightsError(f'{path}: not a readable .npz weight file ({reason}); '
                           'it may be truncated: copy it again') from None


def take_tensors(path, arrays, shapes):
    """Return the tensors of `shapes` {name: shape} out of `arrays`; WeightsError if one is off."""
    for name, shape in shapes.items():
        if name not in arrays:
            raise WeightsError(f'{path}: {name}: tensor missing; export the weights again')
        if arrays[name].shape != shape or arrays[name].dtype != np.float32:
            raise WeightsError(f'{path}: {name}: expected float32 {shape}, found '
                               f'{arrays[name].dtype} {arrays[name].shape}')
        if not np.isfinite(arrays[name]).all():
            raise WeightsError(f'{path}: {name}: holds NaN or infinity; training diverged')
    return {name: arrays[name] for name in shapes}


def widths_fit(value, least, last):
    """Return whether `value` lists `least` or more layer widths, the last being `last` if set."""
    return (isinstance(value, list) and len(value) >= least
            and all(type(width) is int and 0 < width < 10000 for width in value)
            and last in (None, value[-1]))


def is_positive(value):
    """Return whether `value` is a number above 0, and of a size that can be reckoned with."""
    return type(value) in (int, float) and 0.0 < value < 1e6
