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
Which track caused which detections: optimal assignment, two legs to a person.

Munkres assignment on normalised distances (Kuhn 1955), every person having two places to fill,
after the joint leg tracker of Leigh et al. 2015.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from wallnav_ros.world.geometry import distances

_NEVER = 1e6


@dataclass(frozen=True)
class Association:
    """
    first, second: (N,) int, the detections of each track, -1 for none.

    used: (D,) bool, detections that belong to a track.
    """

    first: np.ndarray
    second: np.ndarray
    used: np.ndarray


def associate(table, detections, settings):
    """Return the Association of the predicted tracks in `table` with `detections`."""
    tracks, count = len(table), len(detections)
    first, second = np.full(tracks, -1), np.full(tracks, -1)
    used = np.zeros(count, dtype=bool)
    if not tracks or not count:
        return Association(first, second, used)
    cost = _costs(table, detections, settings)
    # Only legs come in twos, and only what moves walks on two.
    walks = np.flatnonzero((table.motion > 0.0) & ~table.is_solid(settings))
    strides = np.hypot(*table.velocity[walks].T) > settings.walking_speed * 2.0
    again = cost[walks] + settings.second_leg_cost
    again += settings.mismatch_cost * strides[:, None] * detections.still
    again[:, ~detections.leg | (detections.radius < settings.thin_radius)] = _NEVER
    cost = np.concatenate((cost, again))
    # A pair that costs more is worse than two that are missed: a gate and two mismatches.
    dearest = settings.human_gate ** 2 + 2.0 * settings.mismatch_cost
    cost = np.minimum(cost, dearest)
    rows, columns = linear_sum_assignment(cost)
    good = cost[rows, columns] < dearest
    rows, columns = rows[good], columns[good]
    single = rows < tracks
    first[rows[single]] = columns[single]
    second[walks[rows[~single] - tracks]] = columns[~single]
    lone = (first < 0) & (second >= 0)
    first[lone], second[lone] = second[lone], -1
    _unpair(first, second, detections, settings)
    used[first[first >= 0]] = True
    used[second[second >= 0]] = True
    return Association(first, second, used)


def _costs(table, detections, settings):
    """Return the cost (N, D) of every pairing; _NEVER outside the gate."""
    squared = distances(table.position, detections.position) ** 2
    disc = table.is_solid(settings)[:, None] & detections.discs.fits[None]
    squared = np.where(disc, distances(table.position, detections.discs.centre) ** 2, squared)
    spread = np.where(table.motion > 0.0, settings.leg_noise, 2.0 * settings.body_noise) ** 2
    variance = (table.covariance[:, 0] + spread)[:, None] + detections.noise[None] ** 2
    distance = squared / variance
    cost = distance + np.log(variance / settings.body_noise ** 2)
    moving = (table.human & (np.hypot(*table.velocity.T) > 2.0 * settings.walking_speed))[:, None]
    standing = (table.motion < 0.0)[:, None]
    cost += settings.mismatch_cost * (moving * detections.still + standing * detections.fresh)
    ratio = np.log((table.radius[:, None] + 0.05) / (detections.radius[None] + 0.05))
    cost += settings.size_cost * ratio ** 2
    # A speck is no leg: each feeds the track of its like, and another only for want of better.
    speck = (detections.radius < settings.thin_radius)[None]
    cost += settings.mismatch_cost * (speck != (table.radius <= settings.thin_radius)[:, None])
    # Who is known goes before what may be a flicker.
    cost += settings.mismatch_cost * (table.score < 1.0)[:, None]
    gate = np.where(table.human, settings.human_gate, settings.gate)
    return np.where(distance <= gate[:, None] ** 2, cost, _NEVER)


def _unpair(first, second, detections, settings):
    """Take the second leg away where the two are not both legs within a stride."""
    paired = np.flatnonzero(second >= 0)
    one, two = first[paired], second[paired]
    apart = np.hypot(*(detections.position[one] - detections.position[two]).T)
    wrong = (apart > settings.stride) | ~detections.leg[one]
    second[paired[wrong]] = -1
