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
Walkers of whom now one foot is seen and now the other, each standing on the ground.

Track initiation from a few appearances (Blackman and Popoli 1999, section 6.4): feet that come
down where nothing was, each a step from the last.
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

from wallnav_ros.perception.association import Association
from wallnav_ros.perception.visibility import look_up
from wallnav_ros.world.geometry import distances

# The place of a foot half a second ago, on the trail: where it stood before this step.
_STANCE = 5
_FAR = 1e3


def appear(seen, settings):
    """Return log-odds (D,) of Detections `seen`: for legs that came where nothing was."""
    leg = seen.leg & seen.apart & (seen.radius > settings.thin_radius)
    return settings.arrival_odds * seen.fresh * (leg & (seen.fresh > settings.arrival_share))


def take_steps(table, seen, match, view, scan, settings):
    """
    Return the Association `match` with steps: feet come down a step from where one was lifted.

    Moves the tracks in `table` to where their next foot is, with the velocity of that step.
    seen: Detections of `scan`; view: the View of it, to tell that the old place is empty.
    """
    feet = np.flatnonzero(~match.used & seen.leg & (seen.count >= 3)
                          & (seen.fresh > settings.arrival_share))
    lifted = np.flatnonzero((match.first < 0) & (table.motion > 0.0)
                            & (table.radius < settings.leg_width / 2.0)
                            & (scan.stamp - table.seen < settings.step_time))
    if len(feet) and len(lifted):
        empty = look_up([view], scan, table.place[lifted], settings.view_lateral, 0.2, 0.0)[0][0]
        lifted = lifted[empty]
    if not len(feet) or not len(lifted):
        return match
    gap = distances(table.position[lifted], seen.position[feet])
    cost = np.where(gap < settings.step_length, gap, _FAR)
    one, two = linear_sum_assignment(cost)
    good = cost[one, two] < _FAR
    rows, feet = lifted[one[good]], feet[two[good]]
    position = seen.position[feet]
    table.velocity[rows] = ((position - table.trail[rows, _STANCE])
                            / ((_STANCE + 1) * settings.trail_spacing))
    table.covariance[rows] = (settings.leg_noise ** 2, 0.0, 0.25 * settings.birth_speed_noise ** 2)
    table.position[rows] = position
    table.score[rows] = 1.0
    for share in (table.hits, table.apart):
        share[rows] = np.maximum(share[rows], 0.5)
    table.motion[rows] += settings.arrival_odds * seen.fresh[feet]
    first, used = match.first.copy(), match.used.copy()
    first[rows], used[feet] = feet, True
    return Association(first, match.second, used)
