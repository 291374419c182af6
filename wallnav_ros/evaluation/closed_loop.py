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
A robot among people with no ROS in between: the simulated world, its scanner, the navigator.

Paper section 8 (the real robot); what `drive` does over DDS, repeatable and as fast as it goes.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from wallnav_ros.navigation.localisation import MAP
from wallnav_ros.perception.scan import Scan
from wallnav_ros.simulation.batch import RUNNING
from wallnav_ros.simulation.lidar import Lidar
from wallnav_ros.simulation.live_world import LiveWorld, Schedule, TICK


@dataclass(frozen=True)
class Rig:
    """
    How the robot senses, and how late it acts.

    lidar: the scanner, at the middle of the base. scan_rate, odom_rate, control_rate: Hz.
    delay: s from the moment something is sensed until a command that answers it is in effect.
    tick: s that the world is advanced by at a time.
    """

    lidar: Lidar = Lidar()
    scan_rate: float = 10.0
    odom_rate: float = 40.0
    control_rate: float = 20.0
    delay: float = 0.025
    tick: float = TICK


class ClosedLoop:
    """
    Drives a LiveWorld with a Navigator that senses it, a little at a time.

    world, navigator: as given. status: the Status that the navigator gave last, or None.
    """

    def __init__(self, world: LiveWorld, navigator, rng, rig=Rig(), started=1.0):
        """Start at `started` s of the robot's clock; `rng` draws the scanner's noise."""
        self.world, self.navigator, self.status = world, navigator, None
        self._rng, self._rig, self._started, self._ticks = rng, rig, started, 0
        self._schedule = Schedule()
        self._sent, self._command = deque(), np.zeros(2)

    @property
    def now(self):
        """Return the time by the robot's clock, in seconds."""
        return self._started + self._rig.tick * self._ticks

    def run(self, watch=None):
        """Send the goal and drive until the episode ends; `watch(loop)` sees every tick."""
        self._sense()
        refusal = self.navigator.set_goal(self.world.goal, MAP)
        if refusal is not None:
            raise ValueError(f'goal: {refusal}')
        while self.world.outcome == RUNNING:
            self.step()
            if watch is not None:
                watch(self)
        return self.world.summary()

    def step(self):
        """Advance by one tick."""
        self._ticks += 1
        while self._sent and self._sent[0][0] <= self.now:
            self._command = self._sent.popleft()[1]
        self.world.advance(self._command, self._rig.tick)
        self._sense()
        if self._is_due('control', self._rig.control_rate):
            self._control()

    def _sense(self):
        navigator, world, now = self.navigator, self.world, self.now
        if self._is_due('odometry', self._rig.odom_rate):
            navigator.take_odometry(now, world.odometry, world.measured, now)
        if self._is_due('scan', self._rig.scan_rate):
            fix = world.next_fix()
            if fix is not None:
                navigator.localisation.add_fix(now, fix)
            lidar, plan = self._rig.lidar, navigator.plan
            ranges = lidar.scan(world.pose, world.episode.scenario.walls, world.agents(),
                                self._rng)
            navigator.take_scan(Scan(now, ranges, lidar.angle_min, lidar.angle_increment,
                                     lidar.range_min, lidar.range_max), now)
            if navigator.plan is not plan:
                self._control()

    def _control(self):
        self.status = self.navigator.update(self.now, self.now)
        self._sent.append((self.now + self._rig.delay, self.status.command))

    def _is_due(self, name, rate):
        return self._schedule.is_due(name, rate, self._rig.tick * self._ticks)
