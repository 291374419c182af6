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
Pictures of tracks over the beams they came from.

One line per human track, coloured by identity, over all beam ends in grey.
"""

from matplotlib.figure import Figure
import numpy as np

from wallnav_ros.world.files import atomic_write
from wallnav_ros.world.geometry import to_parent


def draw_tracks(path, row, most_points=40_000):
    """Write a PNG of a Row's human tracks to `path`, in the odometry's or laser's frame."""
    figure = Figure(figsize=(7.0, 6.0), dpi=100, layout='constrained')
    axes = figure.add_subplot()
    points = np.concatenate([to_parent(scan.pose, scan.points) for scan in row.tracked])
    points = points[::max(1, len(points) // most_points)]
    axes.plot(*points.T, ',', color='0.7')
    trails = {}
    for scan in row.tracked:
        placed = to_parent(scan.pose, scan.position[scan.human])
        for number, place in zip(scan.ids[scan.human].tolist(), placed):
            trails.setdefault(number, []).append(place)
    for number, trail in trails.items():
        axes.plot(*np.array(trail).T, '-', lw=1.5)
        axes.annotate(str(number), trail[-1], fontsize=7)
    axes.set(title=row.name, xlabel='x [m]', ylabel='y [m]', aspect='equal')
    with atomic_write(path, 'wb') as stream:
        figure.savefig(stream, format='png')
