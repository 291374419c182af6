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
Along the way by hand where the policy gets nowhere though nobody is in its way.

The freezing robot problem (Trautman and Krause 2010); steering by pursuit of the sub-goal.
"""

import numpy as np

from wallnav_ros.world.geometry import closest_approach, wrap_angle

PROGRESS = 0.3         # m of way that count as getting on
AFTER = 4.0            # s without, before the policy is helped out
HELPED = 1.5           # m of way, after which it is on its own again
DETOUR = 3.0           # m more to go than ever: another goal, or another way to it
FORESIGHT = 2.0        # s, within which somebody may cross the robot's way
STRIDE = 0.8           # m of that way
ROOM = 0.4             # m that whoever crosses leaves, or the policy may well be waiting for them
WALKING = 0.2          # m/s
CREEPING = 0.5         # of the preferred speed
STEER = 2.0            # rad/s a radian off
STRAIGHT = 0.2         # rad off, up to which the robot drives while it turns


class Thaw:
    """Notices a policy that gets nowhere, and steers for the sub-goal for a while."""

    def __init__(self):
        self._nearest, self._since, self._until = np.inf, None, None

    def offer(self, observation, limits, now):
        """
        Return commands (K, 2) to use in place of the policy's at `now` (s), best first, or None.

        limits: BaseLimits. The commands are still to be checked for whether the robot can stop
        after them.
        """
        robot = observation.robot
        left = float(robot.beyond + np.hypot(*(robot.goal - robot.position)))
        anew = self._since is None or left > self._nearest + DETOUR
        if anew or left < self._nearest - PROGRESS:
            self._nearest, self._since = left, now
        if anew or (self._until is not None and left <= self._until):
            self._until = None
        if self._until is None and now - self._since > AFTER:
            self._until = left - HELPED
        if self._until is None or _somebody_crosses(observation):
            return None
        return _steer(robot, limits)


def _somebody_crosses(observation):
    """Return whether somebody who walks will be where the robot is, or a stride further on."""
    agents, robot = observation.agents, observation.robot
    toward = robot.goal - robot.position
    ahead = toward * min(1.0, STRIDE / max(float(np.hypot(*toward)), 1e-9))
    places = np.stack((robot.position, robot.position + ahead))[:, None]
    gap = closest_approach(agents.position - places, FORESIGHT * agents.velocity)
    gap -= agents.radius + robot.radius
    return bool(((np.hypot(*agents.velocity.T) > WALKING) & (gap < ROOM)).any())


def _steer(robot, limits):
    """Return commands (K, 2) towards the sub-goal: on and turning, slower, turning alone."""
    toward = robot.goal - robot.position
    off = float(wrap_angle(np.arctan2(toward[1], toward[0]) - robot.pose[2]))
    turn = float(np.clip(STEER * off, -limits.max_turn_rate, limits.max_turn_rate))
    in_place = np.array([[0.0, np.copysign(max(abs(turn), limits.min_turn_rate), off)]])
    if abs(off) > STRAIGHT:
        return in_place
    if abs(turn) < limits.min_turn_rate:
        turn = 0.0
    speed = CREEPING * float(robot.preferred_speed) * np.array([1.0, 0.5, 0.25])
    return np.vstack((np.column_stack((speed, np.full(3, turn))), in_place))
