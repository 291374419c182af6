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
Along the way by hand where the policy stands though nobody is near.

The freezing robot problem (Trautman and Krause 2010); steering by pursuit of the sub-goal.
"""

import numpy as np

from wallnav_ros.world.geometry import wrap_angle

SLOW = 0.3             # of the preferred speed; whoever drives slower is as good as standing
AFTER = 2.0            # s of it before the policy is helped out
NEAR = 2.0             # m to somebody who walks, for whom the policy may well be waiting
WALKING = 0.2          # m/s
CREEPING = 0.5         # of the preferred speed
STEER = 2.0            # rad/s a radian off
STRAIGHT = 0.2         # rad off, up to which the robot drives while it turns


class Thaw:
    """Notices a policy that has frozen, and steers for the sub-goal until it has not."""

    def __init__(self):
        self._since = None

    def offer(self, observation, wanted, limits, now):
        """
        Return commands (K, 2) to use in place of `wanted` (2,), the best first, or None.

        wanted: what the policy chose at `now` (s). limits: BaseLimits. The commands are still to
        be checked for whether the robot can stop after them.
        """
        robot = observation.robot
        frozen = wanted[0] < SLOW * robot.preferred_speed
        if not frozen or _somebody_near(observation):
            self._since = None
        elif self._since is None:
            self._since = now
        if self._since is None or now - self._since < AFTER:
            return None
        return _steer(robot, limits)


def _somebody_near(observation):
    agents, robot = observation.agents, observation.robot
    gap = np.hypot(*(agents.position - robot.position).T) - agents.radius - robot.radius
    return bool(((np.hypot(*agents.velocity.T) > WALKING) & (gap < NEAR)).any())


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
