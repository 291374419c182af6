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
From scans to tracks: predict, associate, update, give birth, bury, label.

Constant-velocity Kalman filters with optimal assignment (Bar-Shalom and Li 1995; Kuhn 1955).
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

from wallnav_ros.perception.clustering import describe, split_runs
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.track_table import TrackTable
from wallnav_ros.world.geometry import to_parent
from wallnav_ros.world.tracks import HUMAN, OBSTACLE, Tracks


class Tracker:
    """
    Follows the things a scanner sees; one `update` per scan, in the order of their stamps.

    resets: how often the memory was wiped because time ran backwards or a gap was too long.
    """

    def __init__(self, settings=TrackerSettings()):
        self.settings = settings
        self.resets = 0
        self._table = TrackTable()
        self._stamp = None

    def update(self, scan, pose=None, walls=None, end_pose=None, sensor='scan'):
        """
        Take one Scan and return the Tracks at its stamp.

        pose: (3,) of the laser in the tracking frame (`odom` or `map`) at the scan's stamp;
            without one the laser is taken to stand still and tracks are in its frame.
        walls: DistanceField of the mapped walls in the tracking frame; what they explain is
            left out.
        end_pose: (3,) of the laser when the last beam was taken, to straighten the sweep.
        sensor: name of the scanner, where several feed one tracker.
        """
        settings, table = self.settings, self._table
        elapsed = self._advance(scan.stamp)
        table.predict(elapsed, settings.acceleration_noise)
        pose = np.zeros(3) if pose is None else np.asarray(pose, dtype=float)
        clusters = self._cluster(scan, pose, walls)
        small = np.flatnonzero((clusters.width <= settings.largest_width)
                               & (clusters.depth <= settings.largest_width))
        position, radius = self._measure(clusters, small, pose)
        claimed = self._associate(position, radius, scan.stamp)
        rest = np.setdiff1d(np.arange(len(small)), claimed)
        table.add(position[rest], radius[rest], scan.stamp, settings)
        table.keep(scan.stamp - table.seen <= settings.miss_time)
        return self._report(scan.stamp)

    def _advance(self, stamp):
        """Return the seconds since the last scan, forgetting everything across a jump."""
        elapsed = 0.0 if self._stamp is None else stamp - self._stamp
        if elapsed < -0.5 or elapsed > self.settings.longest_gap:
            self._table.clear()
            self.resets += 1
            elapsed = 0.0
        self._stamp = stamp if self._stamp is None or elapsed >= 0.0 else self._stamp
        return max(elapsed, 0.0)

    def _cluster(self, scan, pose, walls):
        settings = self.settings
        hits = np.flatnonzero(scan.hits & (scan.ranges <= settings.max_range))
        angles, ranges = scan.angles[hits], scan.ranges[hits]
        points = to_parent(pose, np.stack((ranges * np.cos(angles), ranges * np.sin(angles)), 1))
        if walls is not None and len(points):
            free = walls.at(points) > settings.wall_margin
            angles, ranges, points = angles[free], ranges[free], points[free]
        step = abs(scan.angle_increment)
        owner = split_runs(angles, ranges, step, scan.full_circle,
                           settings.break_distance, settings.beam_factor)
        return describe(points, pose[:2], owner, step)

    def _measure(self, clusters, chosen, pose):
        """Return centres (K, 2) and radii (K,) of the discs whose near side was seen."""
        radius = 0.5 * clusters.width[chosen]
        sight = clusters.centroid[chosen] - pose[:2]
        sight /= np.maximum(clusters.distance[chosen], 1e-6)[:, None]
        # Beams spread evenly across a disc hit it, on average, pi/4 of a radius before its centre.
        return clusters.centroid[chosen] + sight * (np.pi / 4.0 * radius)[:, None], radius

    def _associate(self, position, radius, stamp):
        """Pair tracks with measurements, update them, and return the measurements used."""
        table, settings = self._table, self.settings
        if not len(table) or not len(position):
            return np.empty(0, dtype=int)
        gap = np.linalg.norm(table.position[:, None] - position[None], axis=2)
        gate = settings.gate + 2.0 * np.sqrt(table.covariance[:, 0])[:, None]
        gate = np.minimum(gate, 2.0 * settings.gate)
        cost = np.where(gap <= gate, gap, 1e3)
        rows, columns = linear_sum_assignment(cost)
        good = cost[rows, columns] < 1e3
        rows, columns = rows[good], columns[good]
        table.correct(rows, position[columns], radius[columns], stamp, settings.body_noise)
        moved = np.linalg.norm(table.position - table.born_at, axis=1)
        speed = np.linalg.norm(table.velocity, axis=1)
        table.human |= (moved > settings.walking_distance) & (speed > settings.walking_speed)
        return columns

    def _report(self, stamp):
        table = self._table
        shown = np.flatnonzero(stamp - table.born >= self.settings.confirm_time)
        human = table.human[shown]
        velocity = np.where(human[:, None], table.velocity[shown], 0.0)
        label = np.where(human, HUMAN, OBSTACLE).astype(np.uint8)
        return Tracks(stamp, table.id[shown], table.position[shown].copy(), velocity,
                      table.radius[shown].copy(), label)
