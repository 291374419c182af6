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
Walls as line segments in metres: exact distances and exact ray casting.

The exact counterpart of `DistanceField`, used wherever truth matters more than speed.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.world.geometry import nearest_on_segments


@dataclass(frozen=True)
class Walls:
    """
    Line segments in one frame (`map`, unless said otherwise), in metres.

    segments: (M, 2, 2) start and end points; M may be 0.
    """

    segments: np.ndarray

    @classmethod
    def from_polylines(cls, polylines, closed=False):
        """
        Build walls from polylines, each (K, 2); `closed` joins every last point to its first.

        Raises ValueError when a polyline has fewer than two points or is not finite.
        """
        pieces = [np.empty((0, 2, 2))]
        for number, polyline in enumerate(polylines):
            points = np.asarray(polyline, dtype=float)
            if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
                raise ValueError(f'wall {number}: expected at least two [x, y] points')
            if not np.isfinite(points).all():
                raise ValueError(f'wall {number}: a coordinate is not finite')
            if closed:
                points = np.vstack((points, points[:1]))
            pieces.append(np.stack((points[:-1], points[1:]), axis=1))
        return cls(np.concatenate(pieces))

    def __len__(self):
        """Return the number of segments."""
        return len(self.segments)

    def distance(self, points):
        """Return how far (P,) in metres `points` (P, 2) are from the nearest wall."""
        points = np.asarray(points, dtype=float)
        if not len(self):
            return np.full(len(points), np.inf)
        gap = nearest_on_segments(points, self.segments) - points[:, None]
        return np.sqrt((gap * gap).sum(axis=-1).min(axis=1))

    def raycast(self, origin, angles, max_range):
        """
        Return the range (K,) at which rays from `origin` (2,) at `angles` (K,) hit a wall.

        Angles are in the walls' frame, in radians; a ray that meets nothing within `max_range`
        metres returns inf. Each segment is tested only against the rays within its own
        bearing span, so the cost follows what a ray can see rather than rays x segments.
        """
        angles = np.asarray(angles, dtype=float)
        ranges = np.full(len(angles), np.inf)
        ray, segment = _candidate_pairs(self.segments - np.asarray(origin), angles, max_range)
        if not len(ray):
            return ranges
        start = self.segments[segment, 0] - origin
        along = self.segments[segment, 1] - self.segments[segment, 0]
        x, y = np.cos(angles[ray]), np.sin(angles[ray])
        across = x * along[:, 1] - y * along[:, 0]
        with np.errstate(divide='ignore', invalid='ignore'):
            reach = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
            fraction = (start[:, 0] * y - start[:, 1] * x) / across
        # A hair of tolerance, so that no ray slips between two segments that share a corner.
        hit = (fraction >= -1e-9) & (fraction <= 1.0 + 1e-9) & (reach >= 0.0)
        hit &= reach <= max_range
        np.minimum.at(ranges, ray[hit], reach[hit])
        return ranges


def _candidate_pairs(segments, angles, max_range):
    """Return index arrays (ray, segment) of every ray within the bearing span of a segment."""
    ends = np.arctan2(segments[..., 1], segments[..., 0])
    gap = nearest_on_segments(np.zeros((1, 2)), segments)[0]
    near = np.flatnonzero((gap * gap).sum(axis=-1) <= max_range ** 2)
    # A segment seen from a point off it spans less than half a turn, from `low`, leftwards.
    turn = (ends[near, 1] - ends[near, 0] + np.pi) % (2.0 * np.pi) - np.pi
    low = np.where(turn >= 0.0, ends[near, 0], ends[near, 1])
    span = np.abs(turn)
    order = np.argsort(angles % (2.0 * np.pi), kind='stable')
    turned = (angles % (2.0 * np.pi))[order]
    # Rays are laid out over two turns, so a span that crosses the zero bearing stays one slice.
    twice = np.concatenate((turned, turned + 2.0 * np.pi))
    low = low % (2.0 * np.pi)
    first = np.searchsorted(twice, low - 1e-9)
    last = np.searchsorted(twice, low + span + 1e-9)
    count = last - first
    segment = np.repeat(near, count)
    offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return order[(np.repeat(first, count) + offset) % len(angles)], segment
