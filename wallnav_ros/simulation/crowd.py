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
The crowd: agents that avoid each other and the walls by ORCA.

van den Berg et al., "Reciprocal n-body collision avoidance"; the RVO2 library by way of pyrvo.
"""

import numpy as np
import pyrvo

from wallnav_ros.world.state import Agents

NEIGHBOUR_DISTANCE = 10.0        # m
MAX_NEIGHBOURS = 10
TIME_HORIZON = 5.0               # s, over which agents keep clear of each other
OBSTACLE_TIME_HORIZON = 2.0      # s, over which agents keep clear of walls
ARRIVAL = 0.2                    # m, within which an agent counts its goal as reached
ROBOT_MAX_SPEED = 2.0            # m/s, bound for the robot when it is visible


def add_disc(simulator, position, radius, speed):
    """Add a disc at `position` (2,), of `radius` m and top `speed` m/s, to an RVO simulator."""
    simulator.add_agent(
        tuple(map(float, position)), NEIGHBOUR_DISTANCE, MAX_NEIGHBOURS, TIME_HORIZON,
        OBSTACLE_TIME_HORIZON, float(radius), float(speed))


def add_walls(simulator, walls):
    """Add `walls` to an RVO simulator, each segment an obstacle from both its sides."""
    for start, end in walls.segments.tolist():
        simulator.add_obstacle([tuple(start), tuple(end)])
    simulator.process_obstacles()


class Crowd:
    """
    The agents of one episode, stepped together.

    Where the scenario makes the robot visible it is one more disc for them to yield to.
    """

    def __init__(self, episode, time_step):
        self.episode = episode
        self.time_step = time_step
        self._count = len(episode.radius)
        self._goal = episode.goal.copy()
        self._other = episode.start.copy()
        self._simulator = pyrvo.RVOSimulator(
            time_step, NEIGHBOUR_DISTANCE, MAX_NEIGHBOURS, TIME_HORIZON, OBSTACLE_TIME_HORIZON,
            0.5, 1.0)
        for start, radius, speed in zip(episode.start, episode.radius, episode.speed):
            add_disc(self._simulator, start, radius, speed)
        if episode.scenario.visible:
            add_disc(self._simulator, episode.robot.position,
                     episode.robot.radius + episode.scenario.berth, ROBOT_MAX_SPEED)
        add_walls(self._simulator, episode.scenario.walls)
        self.position = episode.start.copy()
        self.velocity = np.zeros_like(self.position)
        # Whoever stands has a top speed of 0: its state never changes and is not read again.
        self._walkers = np.flatnonzero(episode.speed > 0.0)
        self._speed = episode.speed[self._walkers, None]
        self._anyone_returns = bool(episode.returns.any())

    def agents(self):
        """Return all (N,) as they are now."""
        return Agents.of(self.position.copy(), self.velocity.copy(), self.episode.radius)

    def step(self, robot_position=None, robot_velocity=None):
        """
        Advance by one time step and return the agents.

        A visible robot's position and velocity (2,), in metres and m/s, are needed each step.
        """
        if self._anyone_returns:
            self._turn_round()
        simulator, walkers = self._simulator, self._walkers.tolist()
        offset = self._goal[walkers] - self.position[walkers]
        length = np.sqrt(np.add.reduce(offset * offset, axis=1, keepdims=True))
        # Slow down for the last step, so that nobody oscillates about a goal.
        speed = np.minimum(self._speed, length / self.time_step)
        preferred = offset / np.maximum(length, 1e-9) * speed
        for number, velocity in zip(walkers, preferred.tolist()):
            simulator.set_agent_pref_velocity(number, tuple(velocity))
        if self.episode.scenario.visible:
            simulator.set_agent_position(self._count, tuple(map(float, robot_position)))
            simulator.set_agent_velocity(self._count, tuple(map(float, robot_velocity)))
            simulator.set_agent_pref_velocity(self._count, tuple(map(float, robot_velocity)))
        simulator.do_step()
        if walkers:
            self.position[walkers] = [simulator.get_agent_position(number).to_tuple()
                                      for number in walkers]
            self.velocity[walkers] = [simulator.get_agent_velocity(number).to_tuple()
                                      for number in walkers]
        return self.agents()

    def _turn_round(self):
        arrived = np.linalg.norm(self._goal - self.position, axis=1) < ARRIVAL
        turn = (arrived & self.episode.returns)[:, None]
        self._goal, self._other = (np.where(turn, self._other, self._goal),
                                   np.where(turn, self._goal, self._other))
