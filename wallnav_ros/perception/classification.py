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
has come further than its uncertainty explains; log-odds as in binary Bayes filters (Thrun,
Burgard and Fox 2005, section 4.2).
"""

import numpy as np

from wallnav_ros.world.geometry import distances


def weigh_motion(table, rows, still, fresh, apart, vacated, gait, elapsed, settings):
    """
    Add the evidence of one scan to `motion` of the updated `rows` (K,).

    still, fresh: (K,) shares of the beams on known surfaces and on known free space.
    apart: (K,) bool, nothing large is near.
    vacated: (K,) bool, the place on the trail was seen free in this scan.
    gait: (K,) bool, a leg that moves against another.
    elapsed: seconds the evidence stands for.
    """
    gone = np.hypot(*(table.position[rows] - table.trail[rows, -1]).T)
    doubt = np.sqrt(table.covariance[rows, 0]) + settings.body_noise
    moved = (gone > settings.walking_distance) & (gone > 3.0 * doubt)
    earned = table.human[rows] & (
        (table.proof[rows] > settings.earned_proof) | (table.pair[rows] > 0.3))
    rate = (settings.fresh_rate * np.where((fresh > still) & (gone > 2.0 * doubt), fresh, 0.0)
            + settings.vacated_rate * (vacated & moved)
            + settings.moved_rate * (moved & apart & (still < 0.3))
            + settings.gait_rate * gait
            - settings.still_rate * still * ~moved * ~earned * ~gait)
    rate = np.where(table.radius[rows] < settings.thin_radius, np.minimum(rate, 0.0), rate)
    limit = settings.motion_limit
    table.proof[rows] += np.maximum(rate, 0.0) * elapsed
    table.motion[rows] = np.clip(table.motion[rows] + rate * elapsed, -limit, limit)


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


def settle_labels(table, barred, settings):
    """
    Set the label `human` by `motion`, with hysteresis.

    barred: (N,) bool, tracks that must not become human now.
    """
    certain = (table.motion > settings.human_odds) & (table.score >= 1.0)
    certain &= (table.reach > settings.swing) & (table.hits > 0.6) & (table.apart > 0.3)
    table.human |= certain & ~barred
    table.human &= table.motion > -settings.human_odds
