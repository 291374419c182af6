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
What earlier scans say of a place: was it seen empty, was it occupied, or was it out of sight.

Visibility reasoning on range images, the grid-free kin of Wolf and Sukhatme 2005's free-space
maps: a thing found where an earlier beam passed through has moved there.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.world.geometry import to_parent

# Half widths, in beams, of the windows that stand for a margin in metres across the beam: each
# twice the one before, so that a window is the least of two of the size before.
_WINDOWS = (1, 2, 4, 8, 16)


@dataclass(frozen=True)
class View:
    """
    A scan as a lookup table: the free depth and the surfaces within a window of each beam.

    stamp: seconds; pose: (3,) of the laser in the tracking frame, its yaw at the first beam.
    step: radians from beam to beam, in that frame: what a turning laser sweeps is stretched.
    depths: (L, B, 3) float32, metres, for L widths of the window: what every beam in it passes
        through, 0 where one is unknown; its nearest surface, inf without; its farthest, -inf.
    """

    stamp: float
    pose: np.ndarray
    step: float
    depths: np.ndarray


def make_view(scan, pose, clear_range, sweep=np.zeros(3)):
    """
    Return the View of `scan` from a laser at `pose` (3,) that moved by `sweep` (3,) meanwhile.

    `pose` is that at the first beam, `sweep` the last beam's relative to it.
    A beam without a return counts as free up to `clear_range` metres: beyond it, dark or
    slanting things may return nothing.
    """
    beams, widest = len(scan.ranges), _WINDOWS[-1]
    rows = np.empty((beams, 3), dtype=np.float32)
    rows[:, 0] = np.where(scan.clear, min(clear_range, scan.range_max), 0.0)
    rows[:, 1:] = np.inf
    # The farthest is kept with its sign changed until the end: then all three are minima.
    np.copyto(rows, scan.ranges[:, None] * (1.0, 1.0, -1.0), where=scan.hits[:, None],
              casting='same_kind')
    least = rows.take(np.arange(-widest, beams + widest), axis=0,
                      mode='wrap' if scan.full_circle else 'clip')
    least = np.minimum(np.minimum(least[:-2], least[2:]), least[1:-1])
    depths = np.empty((len(_WINDOWS), beams, 3), dtype=np.float32)
    for number, half in enumerate(_WINDOWS):
        if number:
            reach = half - _WINDOWS[number - 1]
            least = np.minimum(least[:-2 * reach], least[2 * reach:])
        depths[number] = least[widest - half:widest - half + beams]
    np.negative(depths[..., 2], out=depths[..., 2])
    middle = to_parent(pose, 0.5 * sweep[:2])
    return View(scan.stamp, np.array([*middle, pose[2]]),
                scan.angle_increment + sweep[2] / max(beams - 1, 1), depths)


def look_up(views, scan, points, lateral, depth, slack):
    """
    Return (free, occupied), each (K, P) bool: what each of K `views` says of `points` (P, 2).

    views: of scans with the geometry of `scan`, a Scan. points: in the tracking frame, metres.
    lateral: metres; every beam that passes within this distance must agree that it is free.
    depth: metres; a surface this near in depth is the same surface, and one must lie this far
        behind a place that is called free.
    slack: the same as `depth` for each metre of distance (angular error on slanting walls).
    Both are False where the view did not reach.
    """
    # Single precision resolves a tenth of a millimetre here, at half the cost.
    points = points.astype(np.float32)
    poses = np.array([view.pose for view in views], dtype=np.float32)[:, None]
    x, y = points[:, 0] - poses[..., 0], points[:, 1] - poses[..., 1]
    distance = np.sqrt(x * x + y * y)
    step = np.array([view.step for view in views], dtype=np.float32)[:, None]
    index, seen = _beams_towards(np.arctan2(y, x) - poses[..., 2], scan, step)
    row = _windows(distance * abs(scan.angle_increment), lateral) * len(scan.ranges) + index
    depths = np.empty((*row.shape, 3), dtype=np.float32)
    for view, rows, found in zip(views, row, depths):
        view.depths.reshape(-1, 3).take(rows, axis=0, out=found, mode='clip')
    margin = depth + slack * distance
    free = seen & (depths[..., 0] > distance + margin)
    occupied = (depths[..., 1] - margin <= distance) & (distance <= depths[..., 2] + margin)
    return free, occupied & seen


def _beams_towards(bearing, scan, step):
    """
    Return the beams (...) int of `scan` towards `bearing` (...), and bool where it has one.

    step: (...) radians from beam to beam.
    """
    if not step.all():
        return np.zeros(bearing.shape, dtype=np.intp), np.ones(bearing.shape, dtype=bool)
    index = np.rint((bearing - scan.angle_min) / step)
    # Of all bearings that are whole turns apart, the one on or after the first beam.
    turn = 2.0 * np.pi / np.abs(step)
    index = np.rint(index - turn * np.floor((index + 0.5) / turn))
    seen = index < len(scan.ranges)
    return np.where(seen, index, 0.0).astype(np.intp), seen


def _windows(spacing, lateral):
    """Return the number (...) of the window that spans `lateral` m where beams are `spacing` m."""
    number = np.zeros(spacing.shape, dtype=np.int8)
    for half in _WINDOWS[:-1]:
        number += spacing * half < lateral
    return number.astype(np.intp)


class ViewMemory:
    """
    A few earlier views of one scanner, dense in the last second and sparse before.

    spacing: seconds between the views kept at first. count: how many are kept.
    """

    def __init__(self, spacing=0.25, count=8):
        self.spacing = spacing
        self.count = count
        self._views = []

    def older_than(self, stamp, like):
        """Return the views taken before `stamp` seconds with as many beams as the view `like`."""
        return [view for view in self._views
                if view.stamp <= stamp and view.depths.shape == like.depths.shape]

    def add(self, view):
        """Remember `view` if it is due, thinning the oldest ones out."""
        views = self._views
        if views and view.depths.shape != views[-1].depths.shape:
            views.clear()
        if views and view.stamp - views[-1].stamp < self.spacing:
            return
        views.append(view)
        if len(views) > self.count:
            ages = view.stamp - np.array([held.stamp for held in views])
            # Keep the ages in about equal ratios: drop the view its neighbours stand in for best.
            loss = (ages[:-2] - ages[2:]) / (ages[1:-1] + self.spacing)
            del views[1 + int(np.argmin(loss))]
