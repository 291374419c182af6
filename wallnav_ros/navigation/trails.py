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
Where tracked people have been: what a forecast of their ways is made from.

Kept in the odometry's frame, which never jumps; `policy.motion` looks back in time steps.
"""

from bisect import bisect_right
from collections import deque

import numpy as np
from wallnav_ros.policy.motion import HISTORY, PAST
from wallnav_ros.world.tracks import HUMAN

SPACING = 0.08         # s between two memories, at least: lidars may scan far more often
LONGEST_GAP = 0.6      # s between two memories that a place in between is told from


class Trails:
    """
    Remembers where tracks were, in time steps of `time_step` s.

    The last PAST steps are told to the moment; older ones, back to HISTORY, to the nearest step.
    """

    def __init__(self, time_step):
        self._time_step = time_step
        self.forget()

    def forget(self):
        """Forget everything, as after a jump of the clock."""
        self._memories = deque()
        self._ids = np.empty(0, dtype=np.uint32)
        self._places = np.empty((0, HISTORY + 1, 2))
        self._due = None

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
        self._keep_places(tracks)

    def _keep_places(self, tracks):
        """Keep where everybody is, once a time step, in `_places`, newest first."""
        if self._due is None:
            self._due = tracks.stamp
        steps = int((tracks.stamp - self._due) // self._time_step) + 1
        if steps < 1:
            return
        self._due += steps * self._time_step
        ids = np.union1d(self._ids, tracks.id)
        places = np.full((len(ids), HISTORY + 1, 2), np.nan)
        if steps <= HISTORY:
            places[np.searchsorted(ids, self._ids), steps:] = self._places[:, :-steps]
        places[np.searchsorted(ids, tracks.id), 0] = tracks.position
        remembered = np.isfinite(places[..., 0]).any(axis=1)
        self._ids, self._places = ids[remembered], places[remembered]

    def of(self, tracks):
        """
        Return (N, HISTORY, 2) where Tracks were 1, 2, ... steps before; NaN where not known.

        What is labelled an obstacle is taken to have stood where it is.
        """
        trail = np.full((len(tracks), HISTORY, 2), np.nan)
        human = tracks.label == HUMAN
        trail[~human, :PAST] = tracks.position[~human, None]
        rows = np.flatnonzero(human)
        if len(rows):
            trail[rows, :PAST] = self._last_steps(tracks.stamp, tracks.id[rows])
            kept, found = np.nonzero(tracks.id[rows, None] == self._ids)
            trail[rows[kept], PAST:] = self._places[found, PAST + 1:]
        return trail

    def _last_steps(self, stamp, ids):
        """Return (N, PAST, 2) where `ids` (N,) were 1, 2, ... steps before `stamp` s."""
        trail = np.full((len(ids), PAST, 2), np.nan)
        stamps = [memory.stamp for memory in self._memories]
        for step in range(PAST):
            when = stamp - (step + 1) * self._time_step
            later = bisect_right(stamps, when)
            if 0 < later < len(stamps) and stamps[later] - stamps[later - 1] < LONGEST_GAP:
                share = (when - stamps[later - 1]) / (stamps[later] - stamps[later - 1])
                before, after = (_places(self._memories[number], ids)
                                 for number in (later - 1, later))
                trail[:, step] = before + share * (after - before)
        return trail


def _places(tracks, ids):
    """Return the positions (N, 2) of `ids` (N,) among Tracks, NaN for those that are not there."""
    row, found = np.nonzero(ids[:, None] == tracks.id)
    places = np.full((len(ids), 2), np.nan)
    places[row] = tracks.position[found]
    return places
