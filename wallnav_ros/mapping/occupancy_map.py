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
Map files and `map` messages as occupancy grids.

The rules for YAML keys, thresholds, modes and opacity are those of nav2_map_server (map_io).
"""

from collections import Counter
from dataclasses import dataclass
import math
import os
from pathlib import Path
import reprlib
import stat

import cv2
import numpy as np
from wallnav_ros.mapping.map_image import decode_image, ImageError, MOST_PIXELS
import yaml


UNKNOWN, FREE, OCCUPIED = -1, 0, 100
# map_saver's default occupied_thresh, in per cent: from here on a cell counts as wall.
WALL_FROM = 65
# What map_saver (205) and older tools (204, 206) paint where nothing was explored.
_UNEXPLORED_GREYS = (204, 205, 206)
_MOST_YAML_BYTES = 100_000
_MOST_IMAGE_BYTES = 400_000_000
_MOST_COLLECTIONS = 100


class MapError(ValueError):
    """A map that cannot be used: one line that names the file, the field and the fix."""

    def __init__(self, path, field, problem):
        """Say in which `field` of the map at `path` the `problem` lies."""
        super().__init__(' '.join(f'{path}: {field}: {problem}'.split()))


@dataclass(frozen=True)
class OccupancyMap:
    """
    An occupancy grid in the `map` frame, with the conventions of nav_msgs/OccupancyGrid.

    cells: (H, W) int8, row 0 at the bottom: -1 unknown, 0 free, 100 occupied, or between.
    resolution: metres a cell.
    origin: (3,) x, y (metres) and yaw (radians) of the lower left corner of cell (0, 0).
    warnings: what a person should know about this map, a line each.
    """

    cells: np.ndarray
    resolution: float
    origin: np.ndarray
    warnings: tuple = ()

    @property
    def occupied(self):
        """Return which cells (H, W) bool are taken for wall: `WALL_FROM` per cent and above."""
        return self.cells >= WALL_FROM


def load_map(yaml_path):
    """Read a map YAML and its image into an OccupancyMap; raises MapError where it cannot."""
    settings = _Settings.read(Path(yaml_path))
    try:
        grey, opacity = decode_image(settings.image_bytes())
    except ImageError as error:
        raise MapError(yaml_path, f'image ({settings.image.name})', error) from None
    values = settings.cell_of_grey()[grey[::-1]]
    if opacity is not None and settings.mode != 'raw':
        values[opacity[::-1] < 255] = UNKNOWN
    warnings = settings.warn_of_unexplored(grey) + _warn_of_no_walls(values)
    return OccupancyMap(values, settings.resolution, settings.origin, warnings)


def from_occupancy_grid(data, width, height, resolution, origin):
    """
    Return the map in a nav_msgs/OccupancyGrid.

    `data` holds width * height int8 in row-major order from the lower left, `origin` (3,) is
    the pose x, y, yaw. Values outside -1 to 100 mean nothing and become unknown.
    Raises MapError, with the topic in the place of the file.
    """
    cells = np.asarray(data, dtype=np.int8)
    if width < 1 or height < 1 or cells.shape != (width * height,):
        raise MapError('map topic', 'data', f'{cells.size} cells do not fill a grid of {width} x '
                       f'{height}; publish width * height cells')
    if cells.size > MOST_PIXELS:
        raise MapError('map topic', 'info', f'more than {MOST_PIXELS} cells; use a coarser map')
    resolution = _resolution('map topic', resolution)
    origin = _origin('map topic', list(origin))
    cells = np.where((cells < UNKNOWN) | (cells > OCCUPIED), np.int8(UNKNOWN), cells)
    cells = cells.reshape(height, width)
    return OccupancyMap(cells, resolution, origin, _warn_of_no_walls(cells))


@dataclass(frozen=True)
class _Settings:
    """A map YAML, checked; fields as in the file, `image` made a path."""

    path: Path
    image: Path
    mode: str
    resolution: float
    origin: np.ndarray
    negate: bool
    free_thresh: float
    occupied_thresh: float

    @classmethod
    def read(cls, path):
        fields = _read_yaml(path)
        for key in ('image', 'resolution', 'origin', 'negate', 'free_thresh', 'occupied_thresh'):
            if fields.get(key) is None:
                raise MapError(path, key, f"missing; add '{key}: ...'")
        free = _fraction(path, 'free_thresh', fields['free_thresh'])
        occupied = _fraction(path, 'occupied_thresh', fields['occupied_thresh'])
        if free >= occupied:
            raise MapError(path, 'free_thresh', f'{free:g} is not below occupied_thresh '
                           f'{occupied:g}; the usual values are 0.196 and 0.65')
        return cls(path, _image_path(path, fields['image']), _mode(path, fields.get('mode')),
                   _resolution(path, fields['resolution']), _origin(path, fields['origin']),
                   _negate(path, fields['negate']), free, occupied)

    def image_bytes(self):
        """Return the content of the image; raises MapError where there is none."""
        fix = 'put the image there or correct the path'
        for name in (self.image.name, self.path.stem + self.image.suffix):
            beside = self.path.parent / name
            if self.image != beside and os.path.isfile(beside):
                fix = f"if '{name}' beside the YAML is meant, write 'image: {name}'"
                break
        return _read_file(self.path, 'image', self.image, fix, _MOST_IMAGE_BYTES)

    def cell_of_grey(self):
        """Return the cell value (256,) int8 of every grey level."""
        level = np.arange(256)
        if self.mode == 'raw':
            return np.where(level <= OCCUPIED, level, UNKNOWN).astype(np.int8)
        # In float32 as in nav2_map_server: a grey exactly on a threshold falls as it does there.
        shade = level.astype(np.float32) / np.float32(255.0)
        occupancy = shade if self.negate else np.float32(1.0) - shade
        free, occupied = np.float32(self.free_thresh), np.float32(self.occupied_thresh)
        between = np.full(256, UNKNOWN)
        if self.mode == 'scale':
            percent = 100.0 * (occupancy - self.free_thresh) / (
                self.occupied_thresh - self.free_thresh)
            between = np.floor(np.clip(percent, FREE, OCCUPIED) + 0.5)
        cells = np.where(occupancy >= occupied, OCCUPIED, between)
        return np.where(occupancy <= free, FREE, cells).astype(np.int8)

    def warn_of_unexplored(self, grey):
        """Return a warning where the thresholds make the unexplored area of `grey` free."""
        if self.mode == 'raw':
            return ()
        count = cv2.calcHist([grey], [0], None, [256], [0, 256]).ravel()
        cell = self.cell_of_grey()
        warnings = []
        for value in _UNEXPLORED_GREYS:
            # A hundredth of the map: less than that may be furniture somebody painted.
            if cell[value] == FREE and count[value] >= 0.01 * grey.size:
                occupancy = (value if self.negate else 255 - value) / 255.0
                warnings.append(
                    f'{self.path}: free_thresh: {100.0 * count[value] / grey.size:.1f} % of the '
                    f'map is grey {value}, the colour of unexplored area, and counts as free; set '
                    f'free_thresh: {(math.ceil(1000.0 * occupancy) - 1) / 1000.0:g} to keep it '
                    'unknown')
        return tuple(warnings)


def _warn_of_no_walls(cells):
    return () if (cells >= WALL_FROM).any() else ('no cell is occupied: the map has no walls',)


def _read_yaml(path):
    """Return the mapping in the YAML at `path`."""
    text = _read_file(path, 'file', path, 'give the path of a map YAML', _MOST_YAML_BYTES)
    try:
        _refuse_bombs(path, text)
        node = yaml.compose(text, yaml.SafeLoader)
        fields = yaml.safe_load(text)
    except MapError:
        raise
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, 'problem_mark', None)
        where = f'line {mark.line + 1}' if mark else 'file'
        raise MapError(path, where, 'not valid YAML; correct or save the map again') from None
    if not isinstance(fields, dict):
        raise MapError(path, 'file', "not a map YAML; expected lines of 'key: value'")
    # Loaders differ in which of two values they take: a map must not depend on that.
    for key, times in Counter(str(key.value) for key, _ in node.value).items():
        if times > 1:
            raise MapError(path, key, 'given more than once; keep one of the lines')
    return fields


def _refuse_bombs(path, text):
    """Raise MapError for YAML that could take a loader ages or all memory; no map needs it."""
    opened = 0
    for token in yaml.scan(text, yaml.SafeLoader):
        if isinstance(token, yaml.AliasToken):
            raise MapError(path, 'file', 'YAML aliases (*name) are not supported; write it out')
        opened += isinstance(token, (yaml.FlowSequenceStartToken, yaml.FlowMappingStartToken,
                                     yaml.BlockSequenceStartToken, yaml.BlockMappingStartToken))
        if opened > _MOST_COLLECTIONS:
            raise MapError(path, 'file', f'more than {_MOST_COLLECTIONS} lists and mappings; give '
                           'the path of a map YAML')


def _read_file(path, field, target, fix, most):
    """Return the bytes of the regular file `target`, for `field` of the map at `path`."""
    try:
        status = os.stat(target)
        if not stat.S_ISREG(status.st_mode):
            raise MapError(path, field, f"'{target}' is not a regular file; {fix}")
        if status.st_size > most:
            raise MapError(path, field, f"'{target}' is too large ({status.st_size} bytes); {fix}")
        return Path(target).read_bytes()
    except FileNotFoundError:
        raise MapError(path, field, f"'{target}' does not exist; {fix}") from None
    except (OSError, ValueError) as error:
        if isinstance(error, MapError):
            raise
        reason = getattr(error, 'strerror', None) or error
        raise MapError(path, field, f"'{target}' cannot be read ({reason}); {fix}") from None


def _image_path(path, value):
    if not isinstance(value, str) or not value.strip():
        raise _wrong(path, 'image', value, 'the name of an image, such as map.pgm')
    return path.parent / value


def _mode(path, value):
    if value is None:
        return 'trinary'
    if not isinstance(value, str) or value.lower() not in ('trinary', 'scale', 'raw'):
        raise _wrong(path, 'mode', value, 'trinary, scale or raw')
    return value.lower()


def _negate(path, value):
    if value not in (0, 1, '0', '1') or isinstance(value, float):
        raise _wrong(path, 'negate', value, '0 or 1')
    return bool(int(value))


def _number(value):
    """Return `value` as a float, NaN where it is no number."""
    # PyYAML reads 5e-2 as a string, unlike YAML 1.2 and nav2; it reads `yes` as a bool.
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return math.nan
    try:
        return float(value)
    except (ValueError, OverflowError):
        return math.nan


def _fraction(path, key, value):
    number = _number(value)
    if not 0.0 <= number <= 1.0:
        raise _wrong(path, key, value, 'a number from 0 to 1')
    return number


def _resolution(path, value):
    number = _number(value)
    if not 1e-4 <= number <= 100.0:
        raise _wrong(path, 'resolution', value, 'metres a pixel, more than 0, such as 0.05')
    return number


def _origin(path, value):
    numbers = [_number(item) for item in value] if isinstance(value, list) else []
    # Beyond 1e7 m (more than any UTM coordinate) a millimetre is lost in the arithmetic.
    if len(numbers) != 3 or not all(abs(number) <= 1e7 for number in numbers):
        raise _wrong(path, 'origin', value, 'three numbers [x, y, yaw] in metres and radians')
    return np.array(numbers)


def _wrong(path, field, value, expected):
    try:
        shown = reprlib.repr(value)
    except ValueError:
        shown = 'a number of thousands of digits'
    return MapError(path, field, f'{shown} given; expected {expected}')
