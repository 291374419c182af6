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
Whether what the robot knows is fresh enough to move on it.

Every input has a timeout on its age by stamp and by receipt; the clock itself is watched, and
so is the control loop.
"""

from collections import deque
from dataclasses import dataclass

CLOCK_STEP_BACK = 0.1      # s; less is two messages of /clock out of order
CLOCK_STANDSTILL = 0.5     # s of wall time without the clock moving
AHEAD = 0.5                # s a stamp may be ahead of the clock
STARVED = 0.5              # s without a control step; a base stops by itself after about as long


@dataclass(frozen=True)
class Stop:
    """
    Why the robot stands.

    cause: one word that stays the same while the reason does; detail: for people.
    """

    cause: str
    detail: str


class Feed:
    """
    Watches one input.

    timeout: s that it may be old. count: messages used so far. rate: messages a second, smoothed.
    """

    def __init__(self, name, timeout=0.4):
        self.name, self.timeout = name, timeout
        self.count, self.rate = 0, 0.0
        self.forget()

    def forget(self):
        """Forget what was received, as after a jump of the clock."""
        self.stamp = self.received = None
        self._refused = ''

    def refused(self, reason):
        """Note that a message was received that could not be used, and why."""
        self._refused = f'; last refused: {reason}'

    def arrived(self, stamp, now):
        """Note a message stamped `stamp` and received at `now`, both in seconds."""
        if self.received is not None and now > self.received:
            period = now - self.received
            weight = 0.1 if self.rate else 1.0
            self.rate += weight * (1.0 / period - self.rate)
        self.stamp, self.received, self._refused = stamp, now, ''
        self.count += 1

    def age(self, now):
        """Return the seconds since the last message was received and since its stamp, or None."""
        return None if self.received is None else (now - self.received, now - self.stamp)

    def fault(self, now):
        """Return the Stop this input calls for, or None."""
        if self.received is None:
            return Stop(f'{self.name}_missing',
                        f'{self.name}: nothing usable yet{self._refused}')
        waited, old = self.age(now)
        if waited > self.timeout:
            return Stop(f'{self.name}_stale', f'{self.name}: nothing usable for {waited:.2f} s '
                        f'(timeout {self.timeout:g} s){self._refused}')
        if old > self.timeout:
            return Stop(f'{self.name}_stale', f'{self.name}: stamped {old:.2f} s ago (timeout '
                        f'{self.timeout:g} s); do the clocks agree, is use_sim_time set?'
                        f'{self._refused}')
        if old < -AHEAD:
            return Stop(f'{self.name}_ahead', f'{self.name}: stamped {-old:.2f} s ahead of the '
                                              'clock; do the clocks agree, is use_sim_time set?')
        return None


class ClockWatch:
    """
    Notices a clock that was set back or stands still, by the side of a steady one.

    jumps: how often it was set back.
    """

    def __init__(self):
        self.jumps = 0
        self._now = self._moved = None

    def set_back(self, now, steady):
        """Note `now` (s, the clock in use) at `steady` (s); returns whether it was set back."""
        back = self._now is not None and now < self._now - CLOCK_STEP_BACK
        if self._now is None or now > self._now or back:
            self._now, self._moved = now, steady
        self.jumps += back
        return back

    def fault(self, steady):
        """Return the Stop the clock calls for, or None."""
        if not self._now:
            return Stop('clock_missing', 'clock: no /clock received yet')
        if steady - self._moved > CLOCK_STANDSTILL:
            return Stop('clock_stopped', f'clock: stands still for {steady - self._moved:.2f} s')
        return None


class LoopWatch:
    """
    Notices control steps that come late, in seconds of a steady clock.

    period: s that lie between two steps at most, of late. overruns: steps that came later than
    twice the period asked for. longest: s, the longest that one took.
    """

    def __init__(self, period):
        self.asked = self.period = period
        self.overruns, self.longest = 0, 0.0
        self._last, self._recent = None, deque(maxlen=5)

    def step(self, steady):
        """Note a step at `steady`; returns the Stop it calls for, or None."""
        gap = 0.0 if self._last is None else steady - self._last
        self._last = steady
        self._recent.append(min(gap, STARVED))
        self.period = max(self.asked, *self._recent)
        self.longest = max(self.longest, gap)
        self.overruns += gap > 2.0 * self.asked
        if gap <= STARVED:
            return None
        return Stop('overrun', f'control: no step for {gap:.2f} s; does the machine keep up?')
