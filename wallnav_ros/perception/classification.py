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


def weigh_motion(table, rows, still, fresh, apart, vacated, elapsed, settings):
    """
    Add the evidence of one scan to `motion` of the updated `rows` (K,).

    still, fresh: (K,) shares of the beams on known surfaces and on known free space.
    apart: (K,) bool, nothing large is near. vacated: (K,) bool, the place on the trail was seen free in this scan.
    elapsed: seconds the evidence stands for.
    """
    gone = np.linalg.norm(table.position[rows] - table.trail[rows, -1], axis=1)
    doubt = np.sqrt(table.covariance[rows, 0]) + settings.body_noise
    speed = np.linalg.norm(table.velocity[rows], axis=1)
    moved = ((gone > settings.walking_distance) & (gone > 3.0 * doubt)
             & (speed > settings.walking_speed))
    earned = table.human[rows] & (table.reach[rows] > settings.earned_distance)
    rate = (settings.fresh_rate * np.where((fresh > still) & (gone > 2.0 * doubt), fresh, 0.0)
            + settings.vacated_rate * (vacated & moved)
            + settings.moved_rate * (moved & apart & (still < 0.3))
            - settings.still_rate * still * ~moved * ~earned)
    rate = np.where(table.radius[rows] < settings.thin_radius, np.minimum(rate, 0.0), rate)
    limit = settings.motion_limit
    table.motion[rows] = np.clip(table.motion[rows] + rate * elapsed, -limit, limit)


def settle_labels(table, barred, settings):
    """
    Set the label `human` by `motion`, with hysteresis.

    barred: (N,) bool, tracks that must not become human now.
    """
    walked = table.reach > settings.walking_distance
    certain = (table.motion > settings.human_odds) & walked & (table.score >= 1.0)
    table.human |= certain & ~barred
    table.human &= table.motion > -settings.human_odds
