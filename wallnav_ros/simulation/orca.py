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
The robot driven by ORCA: the demonstrator of imitation learning and the `orca` baseline.

Paper algorithm 1; the holonomic ORCA velocity is followed by the nearest unicycle action.
"""

from weakref import WeakKeyDictionary

import numpy as np
import pyrvo

from wallnav_ros.simulation import crowd
from wallnav_ros.world.geometry import drive_unicycle

MARGIN = 0.1     # m, kept around the robot: agents do not yield to it, as ORCA assumes


class OrcaPolicy:
    """Drives every robot of an EpisodeBatch by ORCA, as if the agents yielded half way."""

    def __init__(self, actions, time_step=0.25):
        self.actions = actions
        self.time_step = time_step
        self._simulators = WeakKeyDictionary()

    def __call__(self, batch, rows, field):
        """Return the index (len(rows),) of the action for each of `rows` of `batch`."""
        robot, agents = batch.guided(rows), batch.agents(rows)
        wanted = np.stack([self._velocity(batch.episodes[row], robot, agents, number)
                           for number, row in enumerate(rows)])
        commands = self.actions.commands(robot.preferred_speed)
        pose = drive_unicycle(robot.pose[:, None], commands[..., 0], commands[..., 1],
                              self.time_step)
        target = robot.position + wanted * self.time_step
        miss = np.linalg.norm(pose[..., :2] - target[:, None], axis=-1)
        # Among actions that end alike, the one that faces where ORCA wants to go next.
        bearing = np.arctan2(wanted[:, 1], wanted[:, 0])[:, None]
        facing = np.linalg.norm(wanted, axis=1)[:, None] * (1.0 - np.cos(pose[..., 2] - bearing))
        return (miss + 0.1 * facing).argmin(axis=1)

    def _velocity(self, episode, robot, agents, number):
        """Return the ORCA velocity (2,) in m/s of robot `number`."""
        simulator = self._simulator(episode, robot, number)
        present = agents.present[number]
        count = int(present.sum())
        for agent in range(count):
            simulator.set_agent_position(agent + 1, tuple(agents.position[number, agent].tolist()))
            velocity = tuple(agents.velocity[number, agent].tolist())
            simulator.set_agent_velocity(agent + 1, velocity)
            simulator.set_agent_pref_velocity(agent + 1, velocity)
        offset = robot.goal[number] - robot.position[number]
        length = max(float(np.linalg.norm(offset)), 1e-9)
        speed = min(float(robot.preferred_speed[number]),
                    (length + robot.beyond[number]) / self.time_step)
        pose, (linear, _) = robot.pose[number], robot.velocity[number]
        simulator.set_agent_position(0, tuple(pose[:2].tolist()))
        simulator.set_agent_velocity(
            0, (float(linear * np.cos(pose[2])), float(linear * np.sin(pose[2]))))
        simulator.set_agent_pref_velocity(0, tuple((offset / length * speed).tolist()))
        simulator.do_step()
        velocity = simulator.get_agent_velocity(0)
        return np.array([velocity.x, velocity.y])

    def _simulator(self, episode, robot, number):
        if episode not in self._simulators:
            simulator = pyrvo.RVOSimulator(
                self.time_step, crowd.NEIGHBOUR_DISTANCE, crowd.MAX_NEIGHBOURS,
                crowd.TIME_HORIZON, crowd.OBSTACLE_TIME_HORIZON, 0.5, 1.0)
            discs = [(robot.position[number], robot.radius[number] + MARGIN,
                      robot.preferred_speed[number]),
                     *zip(episode.start, episode.radius, episode.speed)]
            for position, radius, speed in discs:
                crowd.add_disc(simulator, position, radius, speed)
            crowd.add_walls(simulator, episode.scenario.walls)
            self._simulators[episode] = simulator
        return self._simulators[episode]
