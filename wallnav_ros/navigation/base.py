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
What the base can do, and the commands that are on their way to it.

Velocities reachable within a step as in the dynamic window (Fox, Burgard and Thrun 1997).
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from wallnav_ros.policy.actions import ActionSet

SAME = 1e-4            # s; seconds since 1970 are known to a quarter of a microsecond only


@dataclass(frozen=True)
class BaseLimits:
    """
    What the base can do, and how late it does it.

    max_speed, max_turn_rate: m/s and rad/s. min_turn_rate: rad/s, below which it does not turn.
    acceleration, turn_acceleration: m/s^2 and rad/s^2, of speeding up and of braking alike.
    latency: s from what the sensors saw until a command takes effect.
    clearance: m kept from everything, on top of the radius.
    reverse: whether it may back off from what it cannot pass.
    """

    max_speed: float = 1.0
    max_turn_rate: float = 2.0
    min_turn_rate: float = 0.0
    acceleration: float = 2.5
    turn_acceleration: float = 5.0
    latency: float = 0.1
    clearance: float = 0.03
    reverse: bool = False

    @property
    def rates(self):
        """Return how fast a command may change: (2,) m/s^2 and rad/s^2."""
        return np.array([self.acceleration, self.turn_acceleration])


def achievable(actions, limits):
    """Return the ActionSet with turn rates that the base can do, each the nearest it can."""
    rate = np.clip(actions.turn_rate, -limits.max_turn_rate, limits.max_turn_rate)
    least = min(limits.min_turn_rate, limits.max_turn_rate)
    slow = np.where(np.abs(rate) < 0.5 * least, 0.0, np.sign(rate) * least)
    return ActionSet(actions.speed, np.where(np.abs(rate) < least, slow, rate))


class Ramp:
    """
    Leads the base from one command to another no faster than it can follow.

    command: (2,) m/s and rad/s, the last one given. Times are seconds of the clock in use.
    """

    def __init__(self, limits):
        self.limits = limits
        self.forget()

    def forget(self):
        """Forget what was given, as after a jump of the clock: the base stands."""
        self.command, self._reached, self._then = np.zeros(2), np.zeros(2), None
        self._given = deque([(-np.inf, np.zeros(2))])

    def towards(self, wanted, now, period):
        """
        Return the command (2,) to give at `now` on the way to `wanted` (2,).

        It is where the base can be within `period` s, when the next command is due, and never
        beyond the limits in force.
        """
        limits, reached = self.limits, self._reached_by(now)
        change = limits.rates * period
        most = np.array([limits.max_speed, limits.max_turn_rate])
        least = -most * (1.0 if limits.reverse else 0.0, 1.0)
        return np.clip(reached + np.clip(wanted - reached, -change, change), least, most)

    def give(self, command, now):
        """Note that `command` (2,) is given at `now`; returns it."""
        self._reached, self._then, self.command = self._reached_by(now), now, command
        self._given.append((now, command))
        while len(self._given) > 1 and self._given[1][0] <= now - self.limits.latency:
            self._given.popleft()
        return command

    def in_effect(self, now, delays):
        """Return the commands (K, 2) that take effect `delays` (K,) s after `now`."""
        given, commands = zip(*self._given)
        sent = now + np.asarray(delays) - self.limits.latency
        return np.array(commands)[np.searchsorted(given, sent + SAME, side='right') - 1]

    def _reached_by(self, now):
        """Return the velocity (2,) that a base without delay has by `now`."""
        if self._then is None:
            return self._reached
        change = self.limits.rates * max(now - self._then, 0.0)
        return self._reached + np.clip(self.command - self._reached, -change, change)
