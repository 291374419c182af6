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

# Places remembered of each track, one every `trail_spacing` seconds.
TRAIL = 16
# Roundness of a track of which nobody knows whether it is a disc.
UNJUDGED = 0.5


class TrackTable:
    """
    N tracks, one row each.

    id: (N,) uint32. position, velocity: (N, 2) m, m/s. place: (N, 2) m, as measured last.
    covariance: (N, 3) variance of a position coordinate, its covariance with the velocity's,
    variance of the velocity's. steady_position, steady_velocity, steady_covariance: the same, of
    a filter that expects nobody to turn: it tells a velocity better, and loses whoever does.
    radius: (N,) m. disc: (N,) m, radius of the disc that its beams lie on, 0 before they did;
    disc_variance: (N,) m^2; roundness: (N,) share of the recent scans in which they did.
    pair: (N,) share of the recent scans in which two legs were seen.
    apart: (N,) share of the recent scans in which it stood clear of anything large; hits: (N,)
    share in which it was seen. seen: (N,) s and turn: (N,) int, the stamp and the scan of the last
    time.
    score: (N,) evidence that it exists, 1 when certain.
    motion: (N,) log-odds that it moves by itself; proof: (N,) all that ever spoke for it.
    human: (N,) bool, the label with hysteresis.
    reach: (N,) m, the furthest it has been from where it was born, born_at (N, 2).
    trail: (N, TRAIL, 2) m, where it was, newest first. centre: (N, 2) m, as a disc seen all across
    in the last scan, NaN otherwise; centres: (N, TRAIL, 2) m, the same, with the trail.
    """

    COLUMNS = {'id': ((), np.uint32), 'position': ((2,), float), 'velocity': ((2,), float),
               'covariance': ((3,), float), 'steady_position': ((2,), float),
               'steady_velocity': ((2,), float), 'steady_covariance': ((3,), float),
               'radius': ((), float), 'disc': ((), float),
               'disc_variance': ((), float), 'roundness': ((), float), 'pair': ((), float),
               'apart': ((), float), 'hits': ((), float),
               'seen': ((), float), 'turn': ((), int), 'score': ((), float),
               'motion': ((), float), 'proof': ((), float), 'human': ((), bool),
               'reach': ((), float), 'born_at': ((2,), float), 'place': ((2,), float),
               'trail': ((TRAIL, 2), float), 'centre': ((2,), float),
               'centres': ((TRAIL, 2), float)}

    def __init__(self):
        self._next = 1
        self._trail_stamp = -np.inf
        self.clear()

    def __len__(self):
        """Return the number of tracks."""
        return len(self.id)

    def clear(self):
        """Drop every track; identities are not used again."""
        for name, (shape, kind) in self.COLUMNS.items():
            setattr(self, name, np.empty((0,) + shape, dtype=kind))
        self._trail_stamp = -np.inf

    def keep(self, which):
        """Keep only the rows `which` (N,) bool."""
        if which.all():
            return
        for name in self.COLUMNS:
            setattr(self, name, getattr(self, name)[which])

    def is_solid(self, settings):
        """Return (N,) bool: has proved to be a disc, and is wider than a leg."""
        return (self.roundness > settings.roundness) & (self.radius > 0.5 * settings.leg_width)

    def unlabel(self):
        """Forget everything that spoke for or against a track's being human."""
        self.motion, self.proof = np.zeros(len(self)), np.zeros(len(self))
        self.human = np.zeros(len(self), dtype=bool)

    def add(self, position, radius, pair, stamp, settings):
        """Start a track at rest on each of `position` (K, 2); `pair` (K,) where on two legs."""
        count = len(position)
        if not count:
            return
        spread = np.tile((settings.leg_noise ** 2, 0.0, settings.birth_speed_noise ** 2),
                         (count, 1))
        fresh = {'id': np.arange(self._next, self._next + count), 'position': position,
                 'covariance': spread, 'steady_position': position, 'steady_covariance': spread,
                 'radius': radius, 'roundness': np.full(count, UNJUDGED), 'pair': pair,
                 'born_at': position, 'place': position, 'seen': np.full(count, stamp),
                 'trail': np.repeat(position[:, None], TRAIL, axis=1),
                 'centre': np.full((count, 2), np.nan),
                 'centres': np.full((count, TRAIL, 2), np.nan)}
        self._next += count
        for name, (shape, kind) in self.COLUMNS.items():
            rows = fresh.get(name, np.zeros((count,) + shape))
            setattr(self, name, np.concatenate((getattr(self, name), np.asarray(rows, kind))))

    def predict(self, elapsed, settings):
        """Move every track `elapsed` seconds on, under white acceleration."""
        self.position, self.velocity, self.covariance = self._predicted(
            self.position, self.velocity, self.covariance, elapsed,
            settings.acceleration_noise, settings)
        self.steady_position, self.steady_velocity, self.steady_covariance = self._predicted(
            self.steady_position, self.steady_velocity, self.steady_covariance, elapsed,
            settings.steady_noise, settings)
        self.place = self.position.copy()
        self.centre = np.full((len(self), 2), np.nan)

    def _predicted(self, position, velocity, covariance, elapsed, noise, settings):
        """Return position, velocity and covariance `elapsed` seconds on."""
        speed = np.hypot(*velocity.T)
        share = np.minimum(1.0, settings.fastest / np.maximum(speed, 1e-6))
        share = np.where(self.motion < -1.5, np.exp(-elapsed / settings.rest_time), share)
        velocity = velocity * share[:, None]
        place, cross, speed = covariance.T
        density = noise ** 2
        return position + elapsed * velocity, velocity, np.stack((
            place + 2.0 * elapsed * cross + elapsed ** 2 * speed + density * elapsed ** 3 / 3.0,
            cross + elapsed * speed + density * elapsed ** 2 / 2.0,
            speed + density * elapsed), axis=1)

    def correct(self, rows, position, noise, stamp):
        """Correct `rows` (K,) by `position` (K, 2), each coordinate known to `noise` (K,) m."""
        self.position[rows], self.velocity[rows], self.covariance[rows] = _corrected(
            self.position[rows], self.velocity[rows], self.covariance[rows], position, noise)
        (self.steady_position[rows], self.steady_velocity[rows],
         self.steady_covariance[rows]) = _corrected(
            self.steady_position[rows], self.steady_velocity[rows], self.steady_covariance[rows],
            position, noise)
        self.place[rows] = position
        self.seen[rows] = stamp

    def lay_trail(self, stamp, spacing):
        """Push the present places onto the trails once every `spacing` seconds."""
        gone = np.hypot(*(self.position - self.born_at).T)
        self.reach = np.maximum(self.reach, gone)
        if stamp - self._trail_stamp >= spacing - 1e-3:
            self.trail = np.concatenate((self.place[:, None], self.trail[:, :-1]), axis=1)
            self.centres = np.concatenate((self.centre[:, None], self.centres[:, :-1]), axis=1)
            self._trail_stamp = stamp


def _corrected(position, velocity, covariance, measured, noise):
    """Return position, velocity and covariance after `measured` (K, 2), each to `noise` (K,)."""
    place, cross, speed = covariance.T
    total = place + np.square(noise)
    gain, rate = place / total, cross / total
    innovation = measured - position
    return (position + gain[:, None] * innovation, velocity + rate[:, None] * innovation,
            np.stack(((1.0 - gain) * place, (1.0 - gain) * cross, speed - rate * cross), axis=1))
