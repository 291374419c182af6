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
Discs under clusters of beam ends, and tracks that prove to be discs.

Pillars, bins, bodies seen all round and the agents of crowd simulators are discs. Their centre
lies where a circle through their beams has it, however much of them is hidden or broken off;
legs, and people whose arms stand out, only look so for a moment. Geometric circle fit by
Gauss-Newton (Gander, Golub and Strebel 1994), with a prior on the radius.
"""

from dataclasses import dataclass

import numpy as np

# Where the beams that cross a disc evenly hit it, on average, before its centre: pi / 4 radii.
FRONT = np.pi / 4.0
_LEAST_BEAMS = 5
_STEPS = 3
_STRIDE = 0.2       # m that one step may move a centre along an axis; it lies that near
_LIMB = 0.03        # m of a radius that grazing beams do not show
_SPREAD = 0.1       # m; standard deviation of the radius, given the width that is seen
_DRIFT = 0.02       # m over root second; a body that turns shows another width
_AGREE = 2.5        # standard deviations within which two radii are one disc's
_SPAN = 0.5         # s over which a track is judged


@dataclass(frozen=True)
class Discs:
    """
    The best disc through each of D clusters.

    centre: (D, 2) metres. radius: (D,) metres. pull: (D, 2) metres that the centre moves for
    each metre of radius. doubt: (D,) metres, standard deviation of the radius.
    fits: (D,) bool, its beams lie on it. tells: (D,) bool, they would not if it were none.
    """

    centre: np.ndarray
    radius: np.ndarray
    pull: np.ndarray
    doubt: np.ndarray
    fits: np.ndarray
    tells: np.ndarray

    def centre_for(self, which, radius):
        """Return the centres (K, 2) of discs `which` (K,), if their radii are `radius` (K,) m."""
        return self.centre[which] + self.pull[which] * (radius - self.radius[which])[:, None]


def find_discs(points, owner, clusters, chosen, sight, wide, settings):
    """
    Return the Discs of the clusters `chosen` (D,) int of Clusters.

    points: (P, 2) metres; owner: (P,) int, their clusters. sight: (D, 2) unit vectors from the
    scanner. wide: (D,) bool, wider than a leg: none is looked for elsewhere.
    """
    total = len(chosen)
    radius = 0.5 * clusters.width[chosen]
    centre = clusters.centroid[chosen] + FRONT * radius[:, None] * sight
    pull, doubt = np.zeros((total, 2)), np.full(total, _SPREAD)
    fits, tells = np.zeros(total, dtype=bool), np.zeros(total, dtype=bool)
    tried = np.flatnonzero(wide & (clusters.count[chosen] >= _LEAST_BEAMS))
    if len(tried):
        row = np.full(len(clusters), len(tried))
        row[chosen[tried]] = np.arange(len(tried))
        row = row[owner]
        # The beams of one cluster after those of another, as sums over runs need them.
        order = np.argsort(row, kind='stable')[:np.count_nonzero(row < len(tried))]
        centre[tried], radius[tried], pull[tried], doubt[tried], error = _fit(
            points[order].T, row[order], centre[tried].T, radius[tried] + _LIMB,
            settings.match_noise)
        fits[tried] = (error < settings.match_noise) & (
            radius[tried] < 0.5 * settings.largest_width)
        tells[tried] = ~fits[tried] | (doubt[tried] < settings.disc_doubt)
    return Discs(centre, radius, pull, doubt, fits, tells)


def _fit(points, owner, centre, expected, noise):
    """
    Return centre (D, 2), radius (D,), pull (D, 2), doubt (D,) and RMS error (D,) of the discs.

    points: (2, P) metres, each known to `noise` metres; owner: (P,) their disc, 0 .. D-1, in
    order. centre: (2, D) metres to begin with; expected: (D,) metres, the prior's mean radius.
    """
    disc = np.concatenate((centre, expected[None]))
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    count = np.diff(first, append=len(owner))
    prior = (noise / _SPREAD) ** 2
    terms = np.empty((4, len(owner)))
    terms[2] = 1.0
    # A flat surface says nothing of where along it the centre lies.
    ridge = np.diag((1e-3, 1e-3, 1e-3 + prior))
    for _ in range(_STEPS):
        x, y, radius = disc.take(owner, axis=1)
        x, y = points[0] - x, points[1] - y
        distance = np.sqrt(x * x + y * y) + 1e-6
        terms[0], terms[1], terms[3] = x / distance, y / distance, distance - radius
        sums = np.add.reduceat(terms[:, None] * terms[None, :], first, axis=2).T
        covariance, gradient = np.linalg.inv(sums[:, :3, :3] + ridge), sums[:, :3, 3]
        gradient[:, 2] += prior * (expected - disc[2])
        change = (covariance @ gradient[..., None])[..., 0].T
        disc += np.maximum(np.minimum(change, _STRIDE), -_STRIDE)
        disc[2] = np.maximum(disc[2], 0.02)
    variance = covariance[:, 2, 2]
    return (disc[:2].T, disc[2], covariance[:, :2, 2] / variance[:, None],
            noise * np.sqrt(variance), np.sqrt(sums[:, 3, 3] / count))


def follow_discs(table, rows, discs, which, single, elapsed, settings):
    """
    Correct what is known of the discs of `rows` (K,), seen as `which` (K,) of the Discs.

    single: (K,) bool, seen as one cluster. elapsed: (K,) s since they were seen before.
    Returns (K,) bool, the beams lie on the disc that the track is taken for.
    """
    measured, doubt = discs.radius[which], discs.doubt[which] ** 2
    variance = table.disc_variance[rows] + _DRIFT ** 2 * elapsed
    known = table.disc[rows] > 0.0
    jump = measured - table.disc[rows]
    agrees = single & discs.fits[which]
    agrees &= ~known | (np.abs(jump) < _AGREE * np.sqrt(variance + doubt))
    share = np.minimum(elapsed / _SPAN, 1.0) * (discs.tells[which] | ~single)
    table.roundness[rows] += share * (agrees - table.roundness[rows])
    gain = np.where(known, variance / (variance + doubt), 1.0)
    table.disc[rows] += agrees * gain * jump
    table.disc_variance[rows] = np.where(agrees, gain * doubt, variance)
    return agrees
