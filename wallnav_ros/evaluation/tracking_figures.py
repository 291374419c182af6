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
Pictures of human tracks, annotated people and the robot's way over the walls around them.

Walls are the cells in which beams end in many scans; the rest is left out, or people would show.
"""

import itertools

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
import numpy as np

from wallnav_ros.world.files import atomic_write
from wallnav_ros.world.geometry import to_parent

CELL = 0.05          # m, of the grid in which beam ends are counted
LEAST_HITS = 4       # beams that end in a cell that is shown, seen from a scanner that moves
LEAST_SHARE = 0.05   # the same as a share of the scans, from one that does not
LONG_TRAIL = 1.0     # m between its ends; shorter trails are drawn as a dot where they are
ANNOTATED, ROBOT, WALLS = 'tab:red', 'tab:green', '0.7'
TRACKS = ('tab:blue', 'tab:purple', 'tab:cyan', 'tab:brown', 'tab:pink', 'midnightblue')


def draw_tracks(path, row):
    """Write a PNG of a Row's human tracks to `path`, in the odometry's or laser's frame."""
    figure = Figure(figsize=(9.0, 7.5), dpi=100, layout='constrained')
    axes = figure.add_subplot()
    robot = np.array([scan.pose[:2] for scan in row.tracked])
    moves = np.ptp(robot, axis=0).any()
    least = LEAST_HITS if moves else max(LEAST_HITS, int(LEAST_SHARE * len(row.tracked)))
    cells = wall_cells([to_parent(scan.pose, scan.points) for scan in row.tracked], least)
    axes.plot(*cells.T, 's', ms=1.0, mew=0.0, color=WALLS, zorder=1)
    trails = human_trails(row.tracked)
    for trail, color in zip(trails, itertools.cycle(TRACKS)):
        moved = np.hypot(*np.ptp(trail, axis=0)) > LONG_TRAIL
        axes.plot(*trail.T, '-' if moved else '.', lw=1.2, ms=4.0, color=color, alpha=0.7,
                  zorder=2)
        axes.plot(*trail[-1], 'o', ms=2.5, color=color, zorder=3)
    shown = [_key(WALLS, f'beams end here {least} times or more', marker='s', ls=''),
             _key(TRACKS[0], f'{len(trails)} human tracks, dot: end', marker='o', ms=3.0)]
    if row.truth is not None:
        people = annotated_places(row.tracked, row.truth)
        axes.plot(*people.T, 'x', ms=4.0, mew=0.8, color=ANNOTATED, alpha=0.5, zorder=1.5)
        shown.append(_key(ANNOTATED, f'{len(people)} annotated positions', marker='x', ls=''))
    if moves:
        axes.plot(*robot.T, '--', lw=1.2, color=ROBOT, zorder=3)
        shown.append(_key(ROBOT, 'way of the scanner, from the triangle', ls='--'))
    else:
        shown.append(_key(ROBOT, 'scanner, in its own frame', marker='^', ls=''))
    axes.plot(*robot[0], '^', ms=7.0, color=ROBOT, zorder=5)
    _frame(axes, np.concatenate([*trails, robot]))
    figure.legend(handles=shown, loc='outside lower center', ncols=2, fontsize=8)
    axes.set(title=row.name, xlabel='x [m]', ylabel='y [m]')
    with atomic_write(path, 'wb') as stream:
        figure.savefig(stream, format='png')


def wall_cells(scans, least):
    """Return centres (C, 2) m of cells in which `least` beams of `scans`, each (P, 2), end."""
    points = np.concatenate(scans)
    cells, count = np.unique(np.floor(points / CELL).astype(np.int64), axis=0, return_counts=True)
    return (cells[count >= least] + 0.5) * CELL


def human_trails(tracked):
    """Return the places (K, 2) of every human track of TrackedScans, in the picture's frame."""
    trails = {}
    for scan in tracked:
        placed = to_parent(scan.pose, scan.position[scan.human])
        for number, place in zip(scan.ids[scan.human].tolist(), placed):
            trails.setdefault(number, []).append(place)
    return [np.array(trail) for trail in trails.values()]


def annotated_places(tracked, truth):
    """Return the positions (K, 2) of a GroundTruth in the picture's frame."""
    scans = truth.scan_index([scan.bag_time for scan in tracked])
    rows = np.flatnonzero(scans >= 0)
    return np.array([to_parent(tracked[scans[row]].pose, truth.position[row][None])[0]
                     for row in rows]).reshape(-1, 2)


def _frame(axes, places, margin=1.5):
    """Show what people and robot cover and `margin` m around: far walls would dwarf it."""
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect='equal')


def _key(color, label, **style):
    return Line2D([], [], color=color, label=label, **{'ms': 5.0, 'lw': 1.2, **style})
