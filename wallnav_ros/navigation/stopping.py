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
Which actions a base with inertia can still stop after, clear of everything that is known.

Stopping trajectories as in the dynamic window approach (Fox, Burgard and Thrun 1997).
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.world.geometry import drive_unicycle

STEP = 0.05            # s between two moments that are checked
MOVING = 1e-3          # m/s and rad/s, below which the base counts as standing


@dataclass(frozen=True)
class BaseLimits:
    """
    What the base can do, and how late it does it.

    acceleration, turn_acceleration: m/s^2 and rad/s^2, of speeding up and of braking alike.
    latency: s from what the sensors saw until a command takes effect.
    clearance: m kept from everything, on top of the radius.
    """

    acceleration: float = 2.5
    turn_acceleration: float = 5.0
    latency: float = 0.1
    clearance: float = 0.03


def stoppable(observation, commands, duration, limits):
    """
    Return which of `commands` (A, 2) the robot may be given for `duration` s: (A,) bool.

    After `limits.latency` at its present velocity the robot turns to the command as fast as its
    base can, holds it and then brakes. On all that way it must keep the clearance to walls, and
    to agents that keep their velocity; a robot that is closer already must not come closer.
    What an agent does to a robot that stands is not the robot's doing.
    """
    robot, agents = observation.robot, observation.agents
    positions, moves = _stopping_paths(robot, commands, duration, limits)
    now = robot.position[None]
    least = min(limits.clearance, float(observation.walls.at(now)[0] - robot.radius) - 1e-3)
    allowed = (observation.walls.at(positions) - robot.radius >= least).all(axis=0)
    if agents.radius.size:
        times = STEP * np.arange(1, len(positions) + 1)
        there = agents.position + times[:, None, None] * agents.velocity
        reach = agents.radius + robot.radius
        gaps = np.linalg.norm(positions[:, :, None] - there[:, None], axis=-1) - reach
        present = np.linalg.norm(now - agents.position, axis=-1) - reach
        least = np.minimum(limits.clearance, present - 1e-3)
        allowed &= ((gaps >= least).all(axis=-1) | ~moves).all(axis=0)
    return allowed


def _stopping_paths(robot, commands, duration, limits):
    """Return positions (S, A, 2) at every STEP until all stand, and whether each moves (S, A)."""
    change = np.array([limits.acceleration, limits.turn_acceleration]) * STEP
    velocity = np.broadcast_to(np.asarray(robot.velocity, dtype=float), commands.shape)
    pose = np.broadcast_to(robot.pose, (len(commands), 3))
    brakes_at = limits.latency + duration
    elapsed, positions, moves = 0.0, [], []
    while elapsed < brakes_at - 1e-9 or np.abs(velocity).max() > MOVING:
        if elapsed >= limits.latency - 1e-9:
            wanted = commands if elapsed < brakes_at - 1e-9 else 0.0
            velocity = velocity + np.clip(wanted - velocity, -change, change)
        pose = drive_unicycle(pose, velocity[:, 0], velocity[:, 1], STEP)
        positions.append(pose[:, :2])
        moves.append((np.abs(velocity) > MOVING).any(axis=1))
        elapsed += STEP
    return np.stack(positions), np.stack(moves)
