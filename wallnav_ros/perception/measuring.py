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
"""Where a track is, as one cluster, two legs or a disc show it, and how well that is known."""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.perception.discs import follow_discs


@dataclass(frozen=True)
class Measured:
    """
    What a scan says of K tracks.

    position: (K, 2) metres. noise: (K,) metres, error of a coordinate. radius: (K,) metres.
    covered: (K,) bool, something nearer hides a part. disc: (K,) bool, the beams lie on the
    disc that the track is taken for. solid: (K,) bool, and it has proved to be one.
    """

    position: np.ndarray
    noise: np.ndarray
    radius: np.ndarray
    covered: np.ndarray
    disc: np.ndarray
    solid: np.ndarray


def measure(table, rows, seen, one, two, elapsed, settings):
    """
    Return what the Detections `seen` say of `rows` (K,), and correct what their discs are like.

    one, two: (K,) int, the detections of each, the same twice where there is but one.
    elapsed: (K,) s since the tracks were seen before.
    """
    both = one != two
    position = 0.5 * (seen.position[one] + seen.position[two])
    whole = ~both & (table.pair[rows] < 0.05)
    # A leg covers a bit of the other in every step; a body that is covered is displaced.
    least = np.where(whole & (table.radius[rows] > 0.5 * settings.leg_width),
                     0.0, settings.apart_distance)
    sides = (seen.hidden[one] > least[:, None]).sum(axis=1)
    part = whole & (sides > 0)
    position[part] = seen.centre_of(one[part], table.radius[rows[part]], settings)
    apart = np.hypot(*(seen.position[one] - seen.position[two]).T)
    radius = np.maximum(seen.radius[one], seen.radius[two]) + 0.5 * apart
    disc = follow_discs(table, rows, seen.discs, one, ~both, elapsed, settings)
    solid = disc & table.is_solid(settings)[rows]
    centre = seen.discs.centre_for(one, table.disc[rows])
    position[solid], radius[solid] = centre[solid], table.disc[rows[solid]]
    # Where it was as a disc, of which both limbs were seen, is known to a few centimetres.
    clear = disc & (seen.hidden[one] == 0.0).all(axis=1)
    table.centre[rows[clear]] = centre[clear]
    alone = seen.leg[one] & ~both & (table.pair[rows] > 0.3)
    covered = (sides > 0) | (seen.hidden[two] > least[:, None]).any(axis=1)
    noise = np.where(alone, settings.leg_noise, seen.noise[one])
    # With one limb in sight, half of what is not known of the centre is.
    noise = np.hypot(noise, settings.hidden_noise * 0.5 * sides * ~both)
    return Measured(position, noise, radius, covered, disc, solid)
