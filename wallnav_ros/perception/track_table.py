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
The tracks as columns of a table: states and covariances predicted and corrected at once.

A constant-velocity model with the same noise along x and y needs one 2 x 2 covariance a track
(Bar-Shalom, Li and Kirubarajan 2001, section 6.2).
"""

import numpy as np


class TrackTable:
    """
    N tracks, one row each.

    id: (N,) uint32; position, velocity: (N, 2) m, m/s; covariance: (N, 3) variance of a
    position coordinate, its covariance with the velocity, variance of the velocity.
    radius: (N,) m; born, seen: (N,) s; born_at: (N, 2) m; human: (N,) bool.
    """

    COLUMNS = {'id': ((), np.uint32), 'position': ((2,), float), 'velocity': ((2,), float),
               'covariance': ((3,), float), 'radius': ((), float), 'born': ((), float),
               'seen': ((), float), 'born_at': ((2,), float), 'human': ((), bool)}

    def __init__(self):
        self._next = 1
        self.clear()

    def __len__(self):
        """Return the number of tracks."""
        return len(self.id)

    def clear(self):
        """Drop every track; identities are not used again."""
        for name, (shape, kind) in self.COLUMNS.items():
            setattr(self, name, np.empty((0,) + shape, dtype=kind))

    def keep(self, which):
        """Keep only the rows `which` (N,) bool."""
        if which.all():
            return
        for name in self.COLUMNS:
            setattr(self, name, getattr(self, name)[which])

    def add(self, position, radius, stamp, settings):
        """Start a track at rest on each of `position` (K, 2)."""
        count = len(position)
        if not count:
            return
        spread = (settings.body_noise ** 2, 0.0, settings.birth_speed_noise ** 2)
        fresh = {'id': np.arange(self._next, self._next + count), 'position': position,
                 'velocity': np.zeros((count, 2)), 'covariance': np.tile(spread, (count, 1)),
                 'radius': radius, 'born': np.full(count, stamp), 'seen': np.full(count, stamp),
                 'born_at': position, 'human': np.zeros(count, bool)}
        self._next += count
        for name, (_, kind) in self.COLUMNS.items():
            column = np.concatenate((getattr(self, name), fresh[name].astype(kind)))
            setattr(self, name, column)

    def predict(self, elapsed, noise):
        """Move every track `elapsed` seconds on, under white acceleration of density `noise`."""
        self.position = self.position + elapsed * self.velocity
        place, cross, speed = self.covariance.T
        density = noise ** 2
        self.covariance = np.stack((
            place + 2.0 * elapsed * cross + elapsed ** 2 * speed + density * elapsed ** 3 / 3.0,
            cross + elapsed * speed + density * elapsed ** 2 / 2.0,
            speed + density * elapsed), axis=1)

    def correct(self, rows, position, radius, stamp, noise):
        """Correct `rows` (K,) by `position` (K, 2), known to `noise` (K,) or () metres."""
        place, cross, speed = self.covariance[rows].T
        total = place + np.square(noise)
        gain, rate = place / total, cross / total
        innovation = position - self.position[rows]
        self.position[rows] += gain[:, None] * innovation
        self.velocity[rows] += rate[:, None] * innovation
        self.covariance[rows] = np.stack(
            ((1.0 - gain) * place, (1.0 - gain) * cross, speed - rate * cross), axis=1)
        self.radius[rows] += 0.3 * (radius - self.radius[rows])
        self.seen[rows] = stamp
