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
Beam ends to clusters: breaks where neighbours lie further apart than one surface explains.

Range-scaled jump distance, after Dietmayer et al. 2001 and Borges and Aldon 2004.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Clusters:
    """
    Runs of neighbouring beam ends, in the frame of the points they were made from.

    owner: (P,) int, the cluster of every point.
    count: (C,) points in each.
    centroid: (C, 2) metres.
    width: (C,) metres across the line of sight, half a beam added at either end.
    depth: (C,) metres along the line of sight.
    distance: (C,) metres from the scanner to the centroid.
    """

    owner: np.ndarray
    count: np.ndarray
    centroid: np.ndarray
    width: np.ndarray
    depth: np.ndarray
    distance: np.ndarray

    def __len__(self):
        """Return the number of clusters."""
        return len(self.count)


def split_runs(angles, ranges, step, closed=False,
               break_distance=0.12, beam_factor=2.5, break_limit=0.5):
    """
    Return the cluster (P,) of each beam end of a sweep, given in beam order.

    angles, ranges: (P,) radians and metres of the beams that hit something.
    step: radians between two beams; with `closed` the last beam is next to the first.
    Two neighbours are one surface when they are within `break_distance` metres, or within
    `beam_factor` times what their angle spans at their range, up to `break_limit` metres.
    Missing beams between them widen the angle up to `beam_factor` steps.
    """
    if not len(ranges):
        return np.empty(0, dtype=np.intp)
    following = np.concatenate((ranges[1:], ranges[:1]))
    turn = np.abs(np.concatenate((angles[1:], angles[:1])) - angles)
    turn = np.minimum(turn, np.abs(2.0 * np.pi - turn))
    chord = np.sqrt(np.maximum(
        ranges ** 2 + following ** 2 - 2.0 * ranges * following * np.cos(turn), 0.0))
    spacing = np.minimum(ranges, following) * np.minimum(turn, beam_factor * step)
    broken = chord > np.minimum(np.maximum(beam_factor * spacing, break_distance), break_limit)
    owner = np.concatenate(([0], np.cumsum(broken[:-1])))
    if closed and not broken[-1]:
        owner[owner == owner[-1]] = 0
    return owner


def describe(points, origin, owner, step):
    """
    Return the Clusters of `points` (P, 2) seen from `origin` (2,), with `owner` (P,) given.

    `step` is the angle between beams in radians. Owners must be 0 .. C-1, each used.
    """
    total = int(owner.max()) + 1 if len(owner) else 0
    if not total:
        nothing = np.empty(0)
        return Clusters(owner, nothing.astype(int), np.empty((0, 2)), nothing, nothing, nothing)
    count = np.bincount(owner, minlength=total)
    x, y = points[:, 0], points[:, 1]
    centroid = np.empty((total, 2))
    centroid[:, 0] = np.bincount(owner, x) / count
    centroid[:, 1] = np.bincount(owner, y) / count
    sight = centroid - origin
    distance = np.hypot(sight[:, 0], sight[:, 1])
    sight /= np.maximum(distance, 1e-6)[:, None]
    ahead, aside = sight[owner, 0], sight[owner, 1]
    order = np.argsort(owner, kind='stable')
    first = np.cumsum(count) - count
    depth = _spread((x * ahead + y * aside)[order], first)
    width = _spread((y * ahead - x * aside)[order], first) + distance * step
    return Clusters(owner, count, centroid, width, depth, distance)


def extent(points, owner):
    """Return the diagonal (C,) in metres of the box around the points (P, 2) of each owner."""
    if not len(owner):
        return np.empty(0)
    order = np.argsort(owner, kind='stable')
    count = np.bincount(owner)
    first = np.cumsum(count) - count
    return np.hypot(*(_spread(points[order, axis], first) for axis in (0, 1)))


def _spread(values, first):
    """Return max - min (C,) of the runs of `values` (P,) that begin at `first` (C,)."""
    return np.maximum.reduceat(values, first) - np.minimum.reduceat(values, first)
