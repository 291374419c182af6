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
Human or obstacle: evidence of motion, gathered over time, with hysteresis.

A thing walks when it is where nothing was, or when where it was nothing is (visibility), and it
has come further than its uncertainty and one mix-up with a neighbour explain; log-odds as in
binary Bayes filters (Thrun, Burgard and Fox 2005, section 4.2).
"""

import numpy as np

from wallnav_ros.world.geometry import distances

_SURE = 4.0              # standard deviations; dozens of things a second reach three by chance
_CENTRE_NOISE = 0.015    # m; no disc is placed better, however well a few centres agree


def weigh_motion(table, rows, still, fresh, moved_rate, vacated, gait, elapsed, settings,
                 leap_share=0.0, discs=False):
    """
    Add the evidence of one scan to `motion` of the updated `rows` (K,).

    still, fresh: (K,) shares of the beams on known surfaces and on known free space.
    moved_rate: (K,) log-odds a second that having moved counts, whatever earlier views say.
    vacated: (K,) bool, the place on the trail was seen free in this scan.
    gait: (K,) log-odds a second from legs that move against each other.
    elapsed: seconds the evidence stands for.
    leap_share: share of the longest leap of each that may be a mix-up with a neighbour.
    discs: (K,) bool, seen as the discs they are taken for, with nothing around them but things.
    """
    gone = _way(table, rows, leap_share)
    doubt = np.sqrt(table.covariance[rows, 0]) + settings.body_noise
    swift = np.hypot(*table.velocity[rows].T) > settings.walking_speed
    moved = swift & (gone > settings.walking_distance) & (gone > 3.0 * doubt)
    slid = np.any(discs) and discs & _have_slid(table, rows, settings)
    arrived = swift & (fresh > still) & (gone > 2.0 * doubt)
    earned = table.human[rows] & (
        (table.proof[rows] > settings.earned_proof) | (table.pair[rows] > 0.3))
    rate = (settings.fresh_rate * fresh * arrived
            + settings.vacated_rate * (vacated & moved)
            + moved_rate * (moved & (still < 0.3))
            + settings.disc_rate * slid
            + gait
            - settings.still_rate * still * ~(moved | slid | earned | (gait > 0.0)))
    rate = np.where(table.radius[rows] < settings.thin_radius, np.minimum(rate, 0.0), rate)
    limit = settings.motion_limit
    table.proof[rows] += np.maximum(rate, 0.0) * elapsed
    table.motion[rows] = np.clip(table.motion[rows] + rate * elapsed, -limit, limit)


def _way(table, rows, leap_share):
    """
    Return how far (K,) metres `rows` have come on their trail, less a share of the longest leap.

    One leap is what mixing up two things that stand looks like; it takes more to be a way.
    """
    way = np.concatenate((table.place[rows, None], table.trail[rows]), axis=1)
    leap = np.hypot(*(way[:, 1:] - way[:, :-1]).T).max(axis=0)
    return np.hypot(*(way[:, 0] - way[:, -1]).T) - leap_share * leap


def _have_slid(table, rows, settings):
    """
    Return (K,) bool: the centres of the discs `rows` on their trail tell of a way.

    A straight line through them is longer than `disc_distance`, and than _SURE standard deviations
    of what their distances from it make of a thing that stands.
    """
    centres = np.concatenate((table.centre[rows, None], table.centres[rows]), axis=1)
    known = np.isfinite(centres[..., 0])
    count = known.sum(axis=1)
    weight = known / np.maximum(count, 1)[:, None]
    number = np.arange(centres.shape[1])
    step = np.where(known, number - (weight @ number)[:, None], 0.0)
    centres = np.where(known[..., None], centres, 0.0)
    centres = centres - np.einsum('kt,ktd->kd', weight, centres)[:, None]
    spread = np.maximum((step ** 2).sum(axis=1), 1e-6)
    slope = np.einsum('kt,ktd->kd', step, centres) / spread[:, None]
    apart = known[..., None] * (centres - slope[:, None] * step[..., None])
    variance = (apart ** 2).sum(axis=(1, 2)) / np.maximum(2 * count - 4, 1)
    doubt = np.sqrt(np.maximum(variance, _CENTRE_NOISE ** 2) / spread)
    span = step.max(axis=1) - step.min(axis=1)
    slope = np.hypot(slope[:, 0], slope[:, 1])
    return (known[:, 0] & (count >= 3) & (slope * span > settings.disc_distance)
            & (slope > _SURE * doubt))


def find_gait(table, settings):
    """
    Return (N,) bool: leg-sized tracks that swing against another one within a stride.

    How one leg lies to the other changes with every step, and does so whatever is wrong with
    the robot's own motion; the legs of a chair keep their distance.
    """
    walking, thick = np.zeros(len(table), dtype=bool), table.radius > settings.thin_radius
    legs = np.flatnonzero((table.radius < settings.leg_width / 2.0) & thick
                          & (table.apart > 0.9) & (table.hits > 0.4))
    # Two legs have no third beside them; chairs and shelves do.
    others = table.position[thick & (table.hits > 0.4)]
    gap = distances(table.position[legs], others)
    legs = legs[(gap < settings.stride).sum(axis=1) == 2]
    if len(legs) < 2:
        return walking
    offset = table.position[legs, None] - table.position[None, legs]
    past = table.trail[legs, None] - table.trail[None, legs]
    swing = np.linalg.norm(offset[:, :, None] - past, axis=-1).max(axis=-1)
    reach = np.maximum(np.linalg.norm(offset, axis=-1), np.linalg.norm(past, axis=-1).max(-1))
    pair = (reach < settings.stride) & (swing > settings.swing)
    np.fill_diagonal(pair, False)
    walking[legs] = pair.any(axis=1)
    return walking


def weigh_gait(walking, still, certain, settings):
    """
    Return the log-odds a second (K,) that legs which are `walking` (K,) bool are worth.

    still: (K,) share of the beams on known surfaces. certain: whether the scan agreed with
    earlier ones; if not, nothing stands around that could be told from them: no furniture either.
    """
    if not certain:
        return settings.gait_rate * settings.open_gait * walking
    # A leg that swings is not where something has stood for longer than a step takes.
    return settings.gait_rate * (walking & (still < 0.5))


def settle_labels(table, barred, settings, plain=False):
    """
    Set the label `human` by `motion`, with hysteresis.

    barred: (N,) bool, tracks that must not become human now. plain: (N,) bool, there is nothing
    around them but what the map has taken out, so that they do not flicker.
    """
    certain = (table.motion > settings.human_odds) & (table.score >= 1.0)
    steady = table.hits > np.where(plain, 0.3, 0.6)
    certain &= (table.reach > settings.swing) & steady & (table.apart > 0.3)
    table.human |= certain & ~barred
    table.human &= table.motion > -settings.human_odds
