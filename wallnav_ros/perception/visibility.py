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
from scipy.ndimage import maximum_filter1d, minimum_filter1d

# Half widths, in beams, of the windows that stand for a margin in metres across the beam.
_WINDOWS = (1, 2, 4, 8, 16)


@dataclass(frozen=True)
class View:
    """
    A scan as a lookup table: the free depth and the surfaces within a window of each beam.

    stamp: seconds; pose: (3,) of the laser in the tracking frame.
    free: (L, B) metres that every beam in the window passes through; 0 where one is unknown.
    near, far: (L, B) metres of the nearest and the farthest surface within the window.
    """

    stamp: float
    pose: np.ndarray
    free: np.ndarray
    near: np.ndarray
    far: np.ndarray


def make_view(scan, pose, clear_range):
    """
    Return the View of `scan` taken from `pose` (3,).

    A beam without a return counts as free up to `clear_range` metres: beyond it, dark or
    slanting things may return nothing.
    """
    mode = 'wrap' if scan.full_circle else 'nearest'
    hits, ranges = scan.hits, scan.ranges.astype(np.float32)
    through = np.where(hits, ranges, np.where(scan.clear, min(clear_range, scan.range_max), 0.0))
    low = np.where(hits, ranges, np.inf).astype(np.float32)
    high = np.where(hits, ranges, -np.inf).astype(np.float32)
    through = through.astype(np.float32)
    sizes = [2 * half + 1 for half in _WINDOWS]
    return View(scan.stamp, np.asarray(pose, float),
                np.stack([minimum_filter1d(through, size, mode=mode) for size in sizes]),
                np.stack([minimum_filter1d(low, size, mode=mode) for size in sizes]),
                np.stack([maximum_filter1d(high, size, mode=mode) for size in sizes]))


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
    poses = np.stack([view.pose for view in views])[:, None].astype(np.float32)
    x, y = points[:, 0] - poses[..., 0], points[:, 1] - poses[..., 1]
    distance = np.sqrt(x * x + y * y)
    beams, step = len(scan.ranges), scan.angle_increment
    bearing = np.arctan2(y, x) - poses[..., 2] - scan.angle_min
    # The bearing that lies within a turn of the first beam, in the direction of the sweep.
    turns = bearing / abs(step) if step else bearing * 0.0
    around = 2.0 * np.pi / abs(step) if step else np.inf
    index = np.rint(turns if step > 0.0 else -turns)
    if np.isfinite(around):
        index = np.where(index < -0.5, index + np.ceil(-index / around) * around, index)
        index = np.where(index >= around - 0.5, index % around, index)
        index = np.rint(index)
    seen = (index >= 0) & (index < beams)
    index = np.where(seen, index, 0).astype(np.intp)
    half = lateral / np.maximum(distance * abs(step), 1e-6)
    flat = index + beams * sum(half > window for window in _WINDOWS[:-1])
    margin = depth + slack * distance

    def take(name):
        table = np.stack([getattr(view, name).ravel() for view in views])
        return np.take_along_axis(table, flat, axis=1)

    free = seen & (take('free') > distance + margin)
    occupied = (take('near') - margin <= distance) & (distance <= take('far') + margin)
    return free, occupied & seen & ~free


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
                if view.stamp <= stamp and view.free.shape == like.free.shape]

    def add(self, view):
        """Remember `view` if it is due, thinning the oldest ones out."""
        views = self._views
        if views and view.free.shape != views[-1].free.shape:
            views.clear()
        if views and view.stamp - views[-1].stamp < self.spacing:
            return
        views.append(view)
        if len(views) > self.count:
            ages = view.stamp - np.array([held.stamp for held in views])
            # Keep the ages in about equal ratios: drop the view its neighbours stand in for best.
            loss = (ages[:-2] - ages[2:]) / (ages[1:-1] + self.spacing)
            del views[1 + int(np.argmin(loss))]

    def clear(self):
        """Forget every view."""
        self._views.clear()
