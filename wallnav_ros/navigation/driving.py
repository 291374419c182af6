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
From an observation to commands that the base can carry out and still stop after.

Paper section 4 for the decision; the filter under it is `stopping`, stated in docs/safety.md.
"""

from copy import copy

import numpy as np

from wallnav_ros.navigation.base import achievable, Ramp
from wallnav_ros.navigation.plans import Plan
from wallnav_ros.navigation.stopping import STEP, steps_of, stoppable, stopping_distance
from wallnav_ros.navigation.thawing import Thaw
from wallnav_ros.navigation.watchdogs import Stop
from wallnav_ros.policy.actions import STOP
from wallnav_ros.world.geometry import drive_unicycle

# Control periods after which braking must be safe: after each, since braking earlier than was
# counted on can end in somebody's way; the second one because a control step may be missed.
HELD_PERIODS = np.array([1, 2])
FEW = 6                        # actions looked at before all others are
BACKING_OFF = 0.25             # of the preferred speed
STANDSTILL = np.zeros(2)


class Driver:
    """
    Decides with a Lookahead, and leads the base from command to command.

    speed: m/s, what the robot drives at where nothing is in its way. time_step: s between two
    decisions. Times are seconds of the clock in use.
    """

    def __init__(self, lookahead, settings):
        self._policy, self._ramp, self._thaw = lookahead, Ramp(settings.base), Thaw()
        self.time_step = lookahead.rule.time_step
        self.set_settings(settings)

    def set_settings(self, settings):
        """Take NavigatorSettings; they hold from the next command on."""
        self._radius, self._base = settings.radius, settings.base
        self._ramp.limits = settings.base
        self._lookahead = self._policy
        actions = achievable(self._policy.actions, settings.base)
        if not np.array_equal(actions.turn_rate, self._policy.actions.turn_rate):
            self._lookahead = copy(self._policy)
            self._lookahead.actions = actions
        self.speed = min(settings.preferred_speed, settings.base.max_speed)

    def forget(self):
        """Forget the commands given, as after a jump of the clock."""
        self._ramp.forget()
        self._thaw = Thaw()

    def decide(self, observation, stamp, frame, now):
        """Return the Plan of the best action that the base can still stop after."""
        lookahead, robot, step = self._lookahead, observation.robot, self.time_step
        decision = lookahead.decide(observation)
        commands = lookahead.actions.commands(robot.preferred_speed)
        action = self._best_stoppable(observation, commands, decision.scores, now)
        command, stop = STANDSTILL, None
        if action is not None:
            command = commands[action]
        elif (back := self._way_back(observation, now)) is not None:
            command = back
        else:
            stop = _why_blocked(observation)
        helped = self._help(observation, now)
        if helped is not None:
            command, stop, action = helped, None, None
        path = decision.path
        if action != decision.action:
            path = np.stack((robot.pose, drive_unicycle(robot.pose, *command, step)))
        return Plan(stamp, command, stop, action == STOP, path, robot.goal, frame)

    def _best_stoppable(self, observation, commands, scores, now):
        """Return the index of the best command (A, 2) that the base can stop after, or None."""
        ranked = np.argsort(-scores, kind='stable')[:np.isfinite(scores).sum()]
        # Nearly always it is among the first few.
        for some in filter(len, (ranked[:FEW], ranked[FEW:])):
            allowed = self._stoppable(observation, commands[some], self.time_step, now)
            if allowed.any():
                return int(some[allowed.argmax()])
        return None

    def _help(self, observation, now):
        """Return a command (2,) for a policy that gets nowhere, or None."""
        offered = self._thaw.offer(observation, self._base, now)
        if offered is None:
            return None
        safe = self._stoppable(observation, offered, self.time_step, now)
        return offered[safe.argmax()] if safe.any() else None

    def _way_back(self, observation, now):
        """Return a command (2,) that backs off, None where that is not allowed or not safe."""
        if not self._base.reverse:
            return None
        command = np.array([-BACKING_OFF * self.speed, 0.0])
        safe = self._stoppable(observation, command[None], self.time_step, now)[0]
        return command if safe else None

    def reach(self, period):
        """Return how far off, in metres, things matter to a command due every `period` s."""
        return self._base.clearance + self._radius + stopping_distance(
            self._base.max_speed, HELD_PERIODS[-1] * period, self._base)

    def follow(self, plan, observation, now, period):
        """Return the next command (2,) towards that of a Plan, None where it cannot stop."""
        command = self._ramp.towards(plan.command, now, period)
        held = np.broadcast_to(command, (len(HELD_PERIODS), 2))
        if not self._stoppable(observation, held, HELD_PERIODS * period, now).all():
            return None
        return self._ramp.give(command, now)

    def halt(self, now):
        """Return the command (2,) to stand; the base brakes as hard as it can."""
        return self._ramp.give(STANDSTILL, now)

    def _stoppable(self, observation, commands, hold, now):
        delays = STEP * np.arange(steps_of(self._base.latency))
        return stoppable(observation, commands, hold, self._base,
                         self._ramp.in_effect(now, delays))


def _why_blocked(observation):
    """Return the Stop for a robot that no action takes out of its place."""
    robot, agents = observation.robot, observation.agents
    gap = float(observation.walls.at(robot.position) - robot.radius)
    reach = np.linalg.norm(agents.position - robot.position, axis=-1) - agents.radius
    gap = min(gap, float((reach - robot.radius).min(initial=np.inf)))
    if gap < 0.0:
        return Stop('in_contact', f'something is {-gap:.2f} m inside the robot: move it, '
                    'or let it back off with allow_reverse')
    return Stop('blocked', 'every action is predicted to collide')
