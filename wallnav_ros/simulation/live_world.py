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
One episode in continuous time: a robot with inertia among the crowd, watched for its outcome.

Paper section 1; the crowd is the one of `evaluate` for the same seed, interpolated in between.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.policy.outcomes import GOAL_TOLERANCE
from wallnav_ros.simulation.batch import (
    COLLISION, GOAL, OUTCOMES, RUNNING, TIMEOUT, WALL_COLLISION)
from wallnav_ros.simulation.crowd import Crowd
from wallnav_ros.world.geometry import closest_approach, drive_unicycle, wrap_angle
from wallnav_ros.world.state import Agents

CROWD_STEP = 0.25          # s, the time step that policies are trained and evaluated with
FIX_MEMORY = 0.9           # how much of a localisation's error is still there at its next fix
FIX_DISTANCE, FIX_TURN = 0.1, 0.1    # m and rad between two poses of the localisation
TICK = 0.0125              # s to advance by at a time; a whole number of them makes a crowd step


@dataclass(frozen=True)
class Base:
    """
    What the robot's base can do and how well it measures itself.

    max_speed, max_turn_rate: m/s and rad/s; acceleration, turn_acceleration: m/s^2 and rad/s^2.
    drift: standard deviation of the odometry's scale errors (of distance and of turns) and of
    its turning error in rad per metre. fix_noise, fix_turn_noise: of the localisation, m and rad.
    """

    max_speed: float = 1.0
    max_turn_rate: float = 2.0
    acceleration: float = 2.5
    turn_acceleration: float = 5.0
    drift: float = 0.0
    fix_noise: float = 0.0
    fix_turn_noise: float = 0.0


class Schedule:
    """Tells when things that happen at rates of their own are due."""

    def __init__(self):
        self._next = {}

    def is_due(self, name, rate, now):
        """Return whether `name`, `rate` times a second from 0 s on, is due at `now` (s)."""
        due = self._next.setdefault(name, 0.0)
        if now < due - 1e-9:
            return False
        self._next[name] = due + 1.0 / rate
        return True


class LiveWorld:
    """
    An episode that is advanced a little at a time.

    time: s since it began, until it ended. pose: (3,) the robot's true pose and velocity: (2,)
    m/s, rad/s. odometry: (3,) its pose by its wheels, from zero at the start. goal: (2,) m.
    outcome: index into OUTCOMES; once it is not RUNNING the robot stands. path_length,
    min_gap_agent, min_gap_wall: m. history: a row (time, pose, agents' positions) per crowd step.
    """

    def __init__(self, episode, base, rng):
        self.episode, self.base = episode, base
        self.time, self.outcome = 0.0, RUNNING
        self.pose, self.velocity = episode.robot.pose.copy(), np.zeros(2)
        self.odometry, self.measured = np.zeros(3), np.zeros(2)
        self.goal = episode.robot.goal
        self.path_length, self.min_gap_agent, self.min_gap_wall = 0.0, np.inf, np.inf
        self.history = []
        self._rng = rng
        self._errors = rng.normal(0.0, base.drift, 3)
        self._fix_error, self._fixed_at = rng.normal(size=3), None
        self._crowd = Crowd(episode, CROWD_STEP)
        self._elapsed, self._steps = 0.0, 0
        self._before = self._after = self._crowd.agents()
        self._record()

    def agents(self):
        """Return the Agents as they are now, in the scenario's frame."""
        # Before the first step nobody has moved: before and after are the same crowd.
        fraction = self._elapsed / CROWD_STEP - (self._steps - 1) if self._steps else 0.0
        motion = self._after.position - self._before.position
        return Agents.of(self._before.position + fraction * motion, motion / CROWD_STEP,
                         self._before.radius)

    def fix(self):
        """Return the robot's pose (3,) as a localisation sees it: off by a slow error."""
        fresh = np.sqrt(1.0 - FIX_MEMORY ** 2) * self._rng.normal(size=3)
        self._fix_error = FIX_MEMORY * self._fix_error + fresh
        base = self.base
        pose = self.pose + self._fix_error * (base.fix_noise, base.fix_noise, base.fix_turn_noise)
        return np.array([pose[0], pose[1], float(wrap_angle(pose[2]))])

    def next_fix(self):
        """Return the next fix (3,), None until the robot has moved as far as AMCL waits for."""
        if self._fixed_at is not None:
            moved = self.pose - self._fixed_at
            if np.hypot(*moved[:2]) < FIX_DISTANCE and np.abs(wrap_angle(moved[2])) < FIX_TURN:
                return None
        self._fixed_at = self.pose.copy()
        return self.fix()

    def advance(self, command, duration):
        """Drive by `command` (2,), m/s and rad/s, for `duration` seconds (<= CROWD_STEP)."""
        if self._elapsed + duration > self._steps * CROWD_STEP + 1e-9:
            self._step_crowd()
        pose, agents = self.pose, self.agents()
        self._elapsed += duration
        if self.outcome != RUNNING:
            self.velocity = self.measured = np.zeros(2)
            return
        self.time = self._elapsed
        self._drive(command, duration)
        self._judge(pose, agents)

    def summary(self):
        """Return what happened so far, as plain numbers; gaps are None where nothing was near."""
        return {
            'scenario': self.episode.scenario.name, 'case': self.episode.case,
            'seed': self.episode.seed, 'outcome': OUTCOMES[self.outcome],
            'time': round(self.time, 3), 'path_length': round(self.path_length, 3),
            'min_gap_agent': _finite(self.min_gap_agent),
            'min_gap_wall': _finite(self.min_gap_wall)}

    def trajectories(self):
        """Return the history as plain lists: times, robot (T, 3), agents (T, N, 2), radii."""
        times, robot, agents = zip(*self.history)
        return {'times': list(times), 'robot': np.round(robot, 3).tolist(),
                'agents': np.round(agents, 3).tolist(),
                'agent_radius': self.episode.radius.tolist(),
                'agent_walks': (self.episode.speed > 0.0).tolist(),
                'radius': float(self.episode.robot.radius),
                'start': np.round(self.episode.robot.pose, 3).tolist(),
                'goal': np.asarray(self.goal, dtype=float).tolist()}

    def _step_crowd(self):
        if self._steps and self.outcome == RUNNING:
            self._record()
        speed, heading = self.velocity[0], self.pose[2]
        self._before = self._crowd.agents()
        self._after = self._crowd.step(
            self.pose[:2], (speed * np.cos(heading), speed * np.sin(heading)))
        self._steps += 1

    def _record(self):
        self.history.append((round(self.time, 3), self.pose.copy(), self.agents().position))

    def _drive(self, command, duration):
        base = self.base
        limits = np.array([base.max_speed, base.max_turn_rate])
        change = np.array([base.acceleration, base.turn_acceleration]) * duration
        wanted = np.clip(command, -limits, limits)
        self.velocity = self.velocity + np.clip(wanted - self.velocity, -change, change)
        self.pose = drive_unicycle(self.pose, *self.velocity, duration)
        scale, turn_scale, bend = self._errors
        speed, turn_rate = self.velocity
        self.measured = np.array([speed * (1.0 + scale),
                                  turn_rate * (1.0 + turn_scale) + bend * speed])
        self.odometry = drive_unicycle(self.odometry, *self.measured, duration)

    def _judge(self, pose_before, agents_before):
        robot, scenario = self.episode.robot, self.episode.scenario
        motion = self.pose[:2] - pose_before[:2]
        self.path_length += float(np.hypot(*motion))
        agents = self.agents()
        gap = closest_approach(pose_before[:2] - agents_before.position,
                               motion - (agents.position - agents_before.position))
        agent_gap = float((gap - agents.radius - robot.radius).min(initial=np.inf))
        wall_gap = float(scenario.walls.distance(self.pose[None, :2])[0] - robot.radius)
        self.min_gap_agent = min(self.min_gap_agent, agent_gap)
        self.min_gap_wall = min(self.min_gap_wall, wall_gap)
        if agent_gap <= 0.0:
            self.outcome = COLLISION
        elif wall_gap <= 0.0:
            self.outcome = WALL_COLLISION
        elif np.hypot(*(self.goal - self.pose[:2])) < GOAL_TOLERANCE:
            self.outcome = GOAL
        elif self.time >= scenario.time_limit - 1e-9:
            self.outcome = TIMEOUT
        if self.outcome != RUNNING:
            self._record()


def _finite(gap):
    return round(gap, 4) if np.isfinite(gap) else None
