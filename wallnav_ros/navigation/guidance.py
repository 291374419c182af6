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
Where to go: the goal, kept in the frame it was given in.

REP-105: a goal in `map` stays put there, one in `odom` drifts with it.
"""

import numpy as np

from wallnav_ros.navigation.localisation import MAP
from wallnav_ros.navigation.watchdogs import Stop
from wallnav_ros.world.geometry import to_parent


class Guide:
    """
    Holds the goal, or why there is none.

    goal: the position (2,) and the name of its frame, or None. ended: the Stop that explains
    why there is none.
    """

    def __init__(self):
        self.goal = None
        self.ended = Stop('no_goal', 'no goal')

    def end(self, stop):
        """Drop the goal, `stop` (a Stop) being the reason; returns it."""
        self.goal, self.ended = None, stop
        return stop

    def take_goal(self, position, frame, place):
        """
        Drive to `position` (2,) metres in `frame`, `place` (Localisation) relating the frames.

        Returns None, or why the goal is refused; there is no goal then.
        """
        refusal = _unusable(position, frame, place)
        if refusal is not None:
            self.end(Stop('goal_refused', f'goal: {refusal}'))
            return refusal
        if frame == place.base_frame:
            position, frame = to_parent(place.frame_in_state(frame), position), place.state_frame
        self.goal = np.asarray(position, dtype=float), frame
        return None

    def goal_in_state(self, place):
        """Return the goal (2,) in the state frame, None where its frame is not known now."""
        position, frame = self.goal
        relation = place.frame_in_state(frame)
        return None if relation is None else to_parent(relation, position)


def _unusable(position, frame, place):
    """Return why a goal cannot be used, or None."""
    if not np.isfinite(position).all():
        return 'a coordinate is not finite'
    if place.frame_in_state(frame) is not None:
        return None
    hint = ('the robot is not localised (no amcl_pose, no transform)' if frame == MAP
            else f'known frames are {place.state_frame}, {place.odom_frame} and '
                 f'{place.base_frame}')
    return f'frame {frame!r} cannot be related to {place.state_frame}: {hint}'
