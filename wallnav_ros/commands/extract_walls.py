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
Walls of a map file as polylines in metres, written as JSON and drawn over the map.

docs/mapping.md says what a wall is, how far it may be moved and what the figures mean.
"""

import argparse
import json
import math
from pathlib import Path
import sys

from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import Affine2D
import numpy as np

from wallnav_ros.commands.arguments import output_file
from wallnav_ros.mapping.occupancy_map import FREE, load_map, MapError
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.world.files import atomic_write
from wallnav_ros.world.geometry import to_parent

FREE_COLOUR, UNKNOWN_COLOUR = '#ffffff', '#d5dae0'
OCCUPIED_COLOUR, WALL_COLOUR = '#9aa1aa', '#d1242f'


def main(arguments=None):
    """Run the command; returns its exit status: 0, or 2 for input that cannot be used."""
    options = _parse(arguments)
    try:
        occupancy_map = load_map(options.map)
        extraction = extract_walls(occupancy_map, options.tolerance, options.min_size)
        for warning in occupancy_map.warnings:
            print(f'extract_walls: warning: {warning}', file=sys.stderr)
        document = _document(occupancy_map, extraction)
        for path in {options.out, options.json} - {None}:
            with atomic_write(path) as stream:
                json.dump(document, stream, allow_nan=False)
        if options.plot:
            figure = draw_walls(occupancy_map, extraction, Path(options.map).name)
            with atomic_write(options.plot, 'wb') as stream:
                figure.savefig(stream, format='png', dpi=150)
    except (MapError, OSError) as error:
        print(f'extract_walls: {error}', file=sys.stderr)
        return 2
    stats = extraction.stats
    print(f"{options.map}: {stats['width']} x {stats['height']} cells of "
          f"{occupancy_map.resolution:g} m, {stats['polylines']} walls, "
          f"{stats['segments']} segments, {stats['length']:.1f} m, "
          f"moved by at most {stats['tolerance']:g} m")
    return 0


def _parse(arguments):
    parser = argparse.ArgumentParser(prog='extract_walls', description=__doc__.split('\n')[1])
    parser.add_argument('map', metavar='MAP.yaml', help='map file, as nav2_map_server reads it')
    parser.add_argument('--out', metavar='FILE.json', type=output_file,
                        help='write the walls there')
    parser.add_argument('--plot', metavar='FILE.png', type=output_file,
                        help='draw the map and its walls there')
    parser.add_argument('--tolerance', type=_metres, metavar='M',
                        help='metres a wall may be moved by (default: half a cell)')
    parser.add_argument('--min-size', type=_metres, default=0.0, metavar='M',
                        help='leave out speckle: walls smaller than this (default: none)')
    parser.add_argument('--json', metavar='FILE', type=output_file,
                        help='write the walls there as well')
    return parser.parse_args(arguments)


def _metres(text):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f'expected metres, 0 or more, got {text}')
    return value


def _document(occupancy_map, extraction):
    # To the micrometre: more digits would triple the file and say nothing.
    return {'frame': 'map', 'resolution': occupancy_map.resolution,
            'walls': [np.round(polyline, 6).tolist() for polyline in extraction.polylines],
            'stats': extraction.stats, 'warnings': list(occupancy_map.warnings)}


def draw_walls(occupancy_map, extraction, title):
    """Return a Figure of the map with its walls over it, axes in metres of the map frame."""
    low, high = _window(occupancy_map, extraction)
    width, height = high - low
    scale = 12.0 / max(width, height)
    figure = Figure(figsize=(max(scale * width, 4.0) + 1.0, max(scale * height, 3.0) + 1.2),
                    layout='constrained')
    axes = figure.add_subplot()
    _draw_cells(axes, occupancy_map)
    axes.add_collection(LineCollection(
        extraction.polylines, colors=WALL_COLOUR, linewidths=0.9))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect='equal',
             xlabel='x in the map frame (m)', ylabel='y in the map frame (m)',
             facecolor=UNKNOWN_COLOUR)
    stats = extraction.stats
    axes.set_title(f"{title}\n{stats['polylines']} walls, {stats['segments']} segments, "
                   f"moved by at most {100.0 * stats['tolerance']:.3g} cm", fontsize=10)
    axes.grid(color='#000000', alpha=0.12, linewidth=0.5)
    axes.set_axisbelow(False)
    axes.legend(loc='upper right', fontsize=9, handles=_legend())
    return figure


def _draw_cells(axes, occupancy_map):
    kind = np.where(occupancy_map.occupied, 2, np.where(occupancy_map.cells == FREE, 0, 1))
    height, width = kind.shape
    x, y, yaw = occupancy_map.origin
    placed = Affine2D().scale(occupancy_map.resolution).rotate(yaw).translate(x, y)
    axes.imshow(kind, cmap=ListedColormap([FREE_COLOUR, UNKNOWN_COLOUR, OCCUPIED_COLOUR]),
                vmin=0, vmax=2, origin='lower', extent=(0, width, 0, height),
                interpolation='nearest', transform=placed + axes.transData)


def _window(occupancy_map, extraction):
    """Return the lower and upper corner, in metres, of what is worth showing."""
    rows, columns = np.nonzero(occupancy_map.cells == FREE)
    points = [np.empty((0, 2)), *extraction.polylines]
    if len(rows):
        box = [[x, y] for x in (columns.min(), columns.max() + 1)
               for y in (rows.min(), rows.max() + 1)]
        points.append(to_parent(occupancy_map.origin, np.array(box) * occupancy_map.resolution))
    points = np.concatenate(points)
    if not len(points):
        height, width = occupancy_map.cells.shape
        points = to_parent(occupancy_map.origin, np.array(
            [[0, 0], [width, 0], [0, height], [width, height]]) * occupancy_map.resolution)
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.03 * (high - low).max() + occupancy_map.resolution
    return low - margin, high + margin


def _legend():
    return [Line2D([], [], color=WALL_COLOUR, label='walls'),
            Patch(facecolor=OCCUPIED_COLOUR, label='occupied'),
            Patch(facecolor=FREE_COLOUR, edgecolor='#888888', label='free'),
            Patch(facecolor=UNKNOWN_COLOUR, edgecolor='#888888', label='unknown')]


if __name__ == '__main__':
    sys.exit(main())
