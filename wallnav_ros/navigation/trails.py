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
Where tracked people were in the last seconds: what a forecast of their ways is made from.

Kept in the odometry's frame, which never jumps; `policy.motion` looks back in time steps.
"""

from bisect import bisect_right
from collections import deque

import numpy as np
from wallnav_ros.policy.motion import PAST
from wallnav_ros.world.tracks import HUMAN

SPACING = 0.08         # s between two memories, at least: lidars may scan far more often
LONGEST_GAP = 0.6      # s between two memories that a place in between is told from


class Trails:
    """Remembers the tracks labelled human of the last PAST time steps of `time_step` s."""

    def __init__(self, time_step):
        self._time_step = time_step
        self._memories = deque()

    def forget(self):
        """Forget everything, as after a jump of the clock."""
        self._memories.clear()

    def take(self, tracks):
        """Remember Tracks in the odometry's frame; those older than the newest are ignored."""
        memories = self._memories
        if memories and tracks.stamp - memories[-1].stamp < SPACING:
            return
        memories.append(tracks)
        # One more than is looked back to, to tell places in between from.
        while len(memories) > 2 and (
                memories[1].stamp < tracks.stamp - (PAST + 1) * self._time_step):
            memories.popleft()

    def of(self, tracks):
        """Return (N, PAST, 2) where Tracks were 1, 2, ... steps before; NaN where not known."""
        trail = np.full((len(tracks), PAST, 2), np.nan)
        human = np.flatnonzero(tracks.label == HUMAN)
        if not len(human):
            return trail
        stamps = [memory.stamp for memory in self._memories]
        for step in range(PAST):
            when = tracks.stamp - (step + 1) * self._time_step
            later = bisect_right(stamps, when)
            if 0 < later < len(stamps) and stamps[later] - stamps[later - 1] < LONGEST_GAP:
                share = (when - stamps[later - 1]) / (stamps[later] - stamps[later - 1])
                before, after = (_places(self._memories[number], tracks.id[human])
                                 for number in (later - 1, later))
                trail[human, step] = before + share * (after - before)
        return trail


def _places(tracks, ids):
    """Return the positions (N, 2) of `ids` (N,) among Tracks, NaN for those that are not there."""
    row, found = np.nonzero(ids[:, None] == tracks.id)
    places = np.full((len(ids), 2), np.nan)
    places[row] = tracks.position[found]
    return places
