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
Which commands a base with inertia can still stop after, clear of everything that is known.

Stopping trajectories as in the dynamic window approach (Fox, Burgard and Thrun 1997).
"""

import numpy as np

STEP = 0.05            # s between two moments that are checked
MOVING = 1e-3          # m/s, below which the base counts as standing
TOLERANCE = 1e-3       # m by which a robot that is too close may come closer still


def stoppable(observation, commands, hold, limits, in_effect=None):
    """
    Return which of `commands` (..., A, 2) the robot may be given for `hold` s: (..., A) bool.

    observation: an Observation, its parts with the leading axes (...) and one common field.
    hold: s, or (A,) s of each command.
    in_effect: (..., K, 2), the commands that the base follows until a new one takes effect, one
    for each STEP of `limits.latency`; None: it keeps its velocity as long.

    After the latency the base turns to the command as fast as `limits` (BaseLimits) say, holds
    it and then brakes. On all that way the robot must keep the clearance to walls, and to agents
    that keep their velocity; a robot that is closer already must not come closer. What an agent
    does to a robot that stands is not the robot's doing.
    """
    robot, agents = observation.robot, observation.agents
    positions, moves = _stopping_paths(robot, commands, hold, limits, in_effect)
    radius, now = robot.radius[..., None, None], robot.position[..., None, None, :]
    present = observation.walls.at(now) - radius
    least = np.minimum(limits.clearance, present - TOLERANCE)
    allowed = (observation.walls.at(positions) - radius >= least).all(axis=-1)
    if agents.radius.shape[-1]:
        times = STEP * np.arange(1, positions.shape[-2] + 1)[:, None, None]
        crowd = agents.position[..., None, None, :, :]
        there = crowd + times * agents.velocity[..., None, None, :, :]
        reach = (agents.radius + robot.radius[..., None])[..., None, None, :]
        present = _distance(now[..., None, :], crowd) - reach
        least = np.minimum(limits.clearance, present - TOLERANCE)
        far = _distance(positions[..., None, :], there) - reach >= least
        far |= ~agents.present[..., None, None, :]
        allowed &= (far.all(axis=-1) | ~moves).all(axis=-1)
    return allowed


def _distance(first, second):
    offset = first - second
    return np.hypot(offset[..., 0], offset[..., 1])


def stopping_distance(speed, hold, limits):
    """Return the metres that a base at `speed` m/s needs to stop after a command held `hold` s."""
    return speed * (limits.latency + hold) + 0.5 * speed ** 2 / limits.acceleration


def steps_of(duration):
    """Return how many whole STEPs (...) it takes to cover `duration` (...) s."""
    # Seconds since 1970 are known to a quarter of a microsecond only.
    return np.ceil(np.asarray(duration) / STEP - 1e-3).astype(int)


def _stopping_paths(robot, commands, hold, limits, in_effect):
    """Return positions (..., A, S, 2) after every STEP, and whether each moves (..., A, S)."""
    start = np.asarray(robot.velocity, dtype=float)
    if in_effect is None:
        in_effect = np.broadcast_to(start[..., None, :],
                                    (*start.shape[:-1], steps_of(limits.latency), 2))
    before = [start[..., None, None, :]]
    for number in range(in_effect.shape[-2]):
        wanted = in_effect[..., None, None, number, :]
        before.append(_approach(before[-1], wanted, limits.rates * STEP))
    late = np.concatenate(before, axis=-2)
    late = np.broadcast_to(late, (*commands.shape[:-1], *late.shape[-2:]))
    change, wanted, before = limits.rates * STEP, commands[..., None, :], late[..., -1:, :]
    steps = np.broadcast_to(steps_of(hold), commands.shape[-2:-1])[:, None]
    last = _approach(before, wanted, change * steps[..., None])
    number = np.arange(1, 1 + steps.max() + steps_of((np.abs(last) / limits.rates).max()))
    held = _approach(before, wanted, change * number[:, None])
    braking = np.maximum(number - steps, 0)[..., None]
    velocity = np.where(braking == 0, held, _approach(last, 0.0, change * braking))
    velocity = np.concatenate((late, velocity), axis=-2)
    return _integrate(robot.pose, velocity), _either(np.abs(velocity[..., 0]) > MOVING)


def _approach(velocity, wanted, change):
    return velocity + np.clip(wanted - velocity, -change, change)


def _either(flags):
    return flags[..., 1:] | flags[..., :-1]


def _integrate(pose, velocity):
    """Return positions (..., A, S, 2) of driving through `velocity` (..., A, S + 1, 2)."""
    # The mean of both ends of a step is exact while the velocity changes at a constant rate.
    mean = 0.5 * (velocity[..., 1:, :] + velocity[..., :-1, :])
    turn = STEP * mean[..., 1]
    heading = pose[..., None, None, 2] + np.cumsum(turn, axis=-1) - 0.5 * turn
    chord = STEP * mean[..., 0] * np.sinc(turn / (2.0 * np.pi))
    moved = np.stack((chord * np.cos(heading), chord * np.sin(heading)), axis=-1)
    return pose[..., None, None, :2] + np.cumsum(moved, axis=-2)
