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

The freezing robot problem (Trautman and Krause 2010); arcs as in the dynamic window approach
(Fox, Burgard and Thrun 1997).
"""

import numpy as np

from wallnav_ros.world.geometry import closest_approach, drive_unicycle

PROGRESS = 0.3         # m of way that count as getting on
AFTER = 4.0            # s without, before the policy is helped out
HELPED = 1.5           # m of way, after which it is on its own again
DETOUR = 3.0           # m more to go than ever: another goal, or another way to it
FORESIGHT = 2.0        # s, within which somebody may cross the robot's way
STRIDE = 0.8           # m of that way
ROOM = 0.4             # m that whoever crosses leaves, or the policy may well be waiting for them
WALKING = 0.2          # m/s
CREEPING = 0.5         # of the preferred speed
SPEEDS = (1.0, 0.5, 0.25, 0.0)             # of creeping, that arcs are offered at
TURNS = np.linspace(-1.0, 1.0, 17)         # of the fastest turn
FASTEST_TURN = 2.0     # rad/s
TURNING, ON = 0.5, 1.0                     # s that an arc is held, and then gone on straight
STEP = 0.1             # s between the places looked at on it
SPARE = 0.1            # m of room, beyond which more is worth nothing
TOLERANCE = 1e-3       # m by which a robot that is too close may come closer still


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
        return _steer(observation, limits)


def _somebody_crosses(observation):
    """Return whether somebody who walks will be where the robot is, or a stride further on."""
    agents, robot = observation.agents, observation.robot
    toward = robot.goal - robot.position
    ahead = toward * min(1.0, STRIDE / max(float(np.hypot(*toward)), 1e-9))
    places = np.stack((robot.position, robot.position + ahead))[:, None]
    gap = closest_approach(agents.position - places, FORESIGHT * agents.velocity)
    gap -= agents.radius + robot.radius
    return bool(((np.hypot(*agents.velocity.T) > WALKING) & (gap < ROOM)).any())


def _steer(observation, limits):
    """
    Return commands (K, 2) that lead towards the sub-goal, best first.

    Each is an arc and then straight on, worth how near to the sub-goal that leads before it
    comes within the clearance of anything that stands, and the room that it keeps.
    """
    robot = observation.robot
    creeping = CREEPING * float(robot.preferred_speed)
    turns = np.clip(FASTEST_TURN * TURNS, -limits.max_turn_rate, limits.max_turn_rate)
    turns = np.unique(np.where(np.abs(turns) < limits.min_turn_rate, 0.0, turns))
    commands = np.stack(np.meshgrid(np.multiply(SPEEDS, creeping), turns), axis=-1).reshape(-1, 2)
    commands = commands[commands.any(axis=1)]
    turned = STEP * np.arange(1, 1 + round(TURNING / STEP))
    arc = drive_unicycle(robot.pose, commands[:, :1], commands[:, 1:], turned)
    on = drive_unicycle(arc[:, -1:], creeping, 0.0, STEP * np.arange(1, 1 + round(ON / STEP)))
    places = np.concatenate((arc, on), axis=1)[..., :2]
    here, gap = (_gap(observation, where) for where in (robot.position, places))
    free = np.logical_and.accumulate(gap >= min(limits.clearance, float(here) - TOLERANCE), axis=1)
    left = np.hypot(*np.moveaxis(robot.goal - places, -1, 0))
    start = float(np.hypot(*(robot.goal - robot.position)))
    nearest = np.where(free, left, start).min(axis=1)
    room = np.where(free, np.minimum(gap, SPARE), SPARE).min(axis=1)
    return commands[np.argsort(nearest - room, kind='stable')]


def _gap(observation, places):
    """Return the room (...) around a robot at `places` (..., 2) to all that stands."""
    agents, radius = observation.agents, observation.robot.radius
    still = np.hypot(*agents.velocity.T) <= WALKING
    away = places[..., None, :] - agents.position[still]
    agent = (np.hypot(away[..., 0], away[..., 1]) - agents.radius[still]).min(
        axis=-1, initial=np.inf)
    return np.minimum(observation.walls.at(places), agent) - radius
