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
Many episodes side by side: robots as arrays, one crowd each, rewards as named terms.

Paper section 1 (dynamics, outcomes) and section 5 (what a step is paid for).
"""

from collections import deque
from dataclasses import replace

import numpy as np

from wallnav_ros.policy.motion import HISTORY
from wallnav_ros.policy.outcomes import GOAL_TOLERANCE
from wallnav_ros.policy.rewards import someone_passing, StepFacts, warning_radius
from wallnav_ros.simulation.crowd import Crowd
from wallnav_ros.simulation.detours import Detours
from wallnav_ros.world.geometry import closest_approach, drive_unicycle, lengths
from wallnav_ros.world.state import Agents, Robot

RUNNING, GOAL, COLLISION, WALL_COLLISION, TIMEOUT = range(5)
OUTCOMES = ('running', 'goal', 'collision', 'wall_collision', 'timeout')
STOPPED = 1e-6     # m/s, below which a command is a stop
TRAIL = 8          # steps of the past that are kept, for policies that look back


class EpisodeBatch:
    """
    B episodes that advance together; those that have ended stay as they ended.

    outcome: (B,) index into OUTCOMES. time: (B,) s. path_length: (B,) m.
    min_gap_agent, min_gap_wall: (B,) m, least so far (inf before anything was near).
    room: how many agents a row has room for, if the largest crowd to come is not among the first.
    """

    def __init__(self, episodes, time_step=0.25, room=0):
        self.episodes = list(episodes)
        self.time_step = time_step
        self._crowds = [Crowd(episode, time_step) for episode in episodes]
        self._robot = Robot(*(np.stack([np.asarray(getattr(episode.robot, name), dtype=float)
                                        for episode in episodes])
                              for name in Robot.__dataclass_fields__))
        count = len(episodes)
        most = max(room, *(len(episode.radius) for episode in episodes))
        self._agents = Agents(np.zeros((count, most, 2)), np.zeros((count, most, 2)),
                              np.zeros((count, most)), np.zeros((count, most), dtype=bool),
                              np.full((count, most, HISTORY, 2), np.nan))
        for row, episode in enumerate(episodes):
            _place(self._agents, row, episode)
        self._trail = deque([self._agents], maxlen=TRAIL)
        self._routes = [episode.scenario.route(float(episode.robot.radius))
                        for episode in episodes]
        self._detours = Detours(count)
        self._time_limit = np.array([episode.scenario.time_limit for episode in episodes])
        self.outcome = np.full(count, RUNNING)
        self.time = np.zeros(count)
        self.path_length = np.zeros(count)
        self.min_gap_agent = np.full(count, np.inf)
        self.min_gap_wall = np.full(count, np.inf)

    def restart(self, row, episode):
        """Begin `episode` in place of the one in `row`."""
        self.episodes[row] = episode
        self._crowds[row] = Crowd(episode, self.time_step)
        self._routes[row] = episode.scenario.route(float(episode.robot.radius))
        self._detours.restart(row)
        parts = {name: part.copy() for name, part in vars(self._robot).items()}
        for name, part in parts.items():
            part[row] = getattr(episode.robot, name)
        self._robot = Robot(**parts)
        self._trail = deque((Agents(*(part.copy() for part in vars(agents).values()))
                             for agents in self._trail), maxlen=TRAIL)
        for agents in self._trail:
            _place(agents, row, episode)
        self._agents = self._trail[-1]
        self._time_limit[row] = episode.scenario.time_limit
        self.outcome[row], self.time[row], self.path_length[row] = RUNNING, 0.0, 0.0
        self.min_gap_agent[row] = self.min_gap_wall[row] = np.inf

    def groups(self, rows=None):
        """Yield (rows, DistanceField) of `rows`, by default the running, that share a world."""
        for shared, scenario in self._worlds(rows):
            yield shared, scenario.field

    def _worlds(self, rows=None):
        """Yield (rows, Scenario) of `rows`, by default the running, that share it."""
        rows = np.flatnonzero(self.outcome == RUNNING) if rows is None else rows
        rows_of = {}
        for row in rows.tolist():
            rows_of.setdefault(id(self.episodes[row].scenario), []).append(row)
        for rows in rows_of.values():
            yield np.array(rows), self.episodes[rows[0]].scenario

    def robot(self, rows):
        """Return the Robot with leading axis (len(rows),)."""
        return Robot(*(part[rows] for part in vars(self._robot).values()))

    def guided(self, rows):
        """Return `robot(rows)` with the next sub-goal of the way as its goal."""
        robot = self.robot(rows)
        goal, beyond = robot.goal.copy(), np.zeros(len(rows))
        routes = [self._routes[row] for row in rows]
        for route in {id(route): route for route in routes if route is not None}.values():
            own = np.array([other is route for other in routes])
            goal[own], beyond[own] = route.guide(robot.position[own])
        return replace(robot, goal=goal, beyond=beyond)

    def agents(self, rows):
        """Return the Agents (len(rows), N), padded to the largest crowd."""
        return Agents(*(part[rows] for part in vars(self._agents).values()))

    def past(self, rows, steps):
        """Return the Agents (len(rows), N) of `steps` (below TRAIL) ago, at most of the start."""
        then = self._trail[max(0, len(self._trail) - 1 - steps)]
        return Agents(*(part[rows] for part in vars(then).values()))

    def step(self, commands):
        """
        Drive every running robot by `commands` (B, 2), m/s and rad/s, for one time step.

        Returns the StepFacts (B,); those of ended episodes mean nothing.
        """
        running = self.outcome == RUNNING
        commands = np.where(running[:, None], commands, 0.0)
        before, agents_before = self._robot, self._agents
        passing = someone_passing(before, agents_before)
        pose = drive_unicycle(before.pose, commands[:, 0], commands[:, 1], self.time_step)
        self._robot = replace(before, pose=pose, velocity=commands)
        self._agents = self._walk(running, before)
        self._trail.append(self._agents)
        self._go_round()
        facts = self._facts(before, agents_before, passing & (commands[:, 0] < STOPPED))
        self._settle(running, facts)
        return StepFacts(**{**vars(facts), 'ended': self.outcome != RUNNING})

    def _go_round(self):
        """Plan other ways for robots that have people standing about them."""
        for row in np.flatnonzero(self._detours.due() & (self.outcome == RUNNING)):
            own = np.array([row])
            route = self._detours.seek(
                row, self.episodes[row].scenario.field,
                Robot(*(part[0] for part in vars(self.robot(own)).values())),
                Agents(*(part[0] for part in vars(self.agents(own)).values())),
                self._routes[row])
            self._routes[row] = route or self._routes[row]

    def _walk(self, running, robot):
        """Return the agents after a step in which a visible `robot` is where they see it now."""
        position, velocity = self._agents.position.copy(), self._agents.velocity.copy()
        for row in np.flatnonzero(running):
            pose, (speed, _) = robot.pose[row], robot.velocity[row]
            crowd = self._crowds[row]
            crowd.step(pose[:2], (speed * np.cos(pose[2]), speed * np.sin(pose[2])))
            position[row, :len(crowd.position)] = crowd.position
            velocity[row, :len(crowd.position)] = crowd.velocity
        trail = np.concatenate((self._agents.position[:, :, None], self._agents.trail[:, :, :-1]),
                               axis=2)
        return Agents(position, velocity, self._agents.radius, self._agents.present, trail)

    def _facts(self, before, agents_before, yielding):
        robot, agents = self._robot, self._agents
        motion = robot.position - before.position
        offset = before.position[:, None] - agents_before.position
        relative = motion[:, None] - (agents.position - agents_before.position)
        reach = agents.radius + robot.radius[:, None]
        gap = np.where(agents.present, closest_approach(offset, relative) - reach, np.inf)
        agent_gap = gap.min(axis=1, initial=np.inf)
        speed = lengths(agents.velocity)
        depth = lengths(offset + relative) - warning_radius(speed) - agents.radius
        depth = np.where(agents.present & (speed > 0.0), depth, np.inf)
        nearest, farthest = self._wall_distances(before.position, robot.position)
        distance = lengths(robot.goal - robot.position)
        came_from = lengths(robot.goal - before.position)
        wall_gap = nearest - robot.radius
        return StepFacts(
            reached=(distance < GOAL_TOLERANCE) & (agent_gap > 0.0) & (wall_gap > 0.0),
            agent_gap=agent_gap, progress=came_from - distance,
            moved=lengths(motion), yielding=yielding, wall_gap=wall_gap,
            farthest_wall=farthest, warning_depth=depth.min(axis=1, initial=np.inf))

    def _wall_distances(self, before, after):
        """Return the exact distances (B,) to the nearest wall on the way and to the farthest."""
        nearest, farthest = np.full(len(after), np.inf), np.zeros(len(after))
        half_way = 0.5 * (before + after)
        for rows, scenario in self._worlds():
            if len(scenario.walls):
                way = np.concatenate((after[rows], half_way[rows]))
                near, far = scenario.wall_distances(way)
                nearest[rows] = np.minimum(near[:len(rows)], near[len(rows):])
                farthest[rows] = far[:len(rows)]
        return nearest, farthest

    def _settle(self, running, facts):
        self.time = self.time + np.where(running, self.time_step, 0.0)
        self.path_length = self.path_length + np.where(running, facts.moved, 0.0)
        self.min_gap_agent = np.where(running, np.minimum(self.min_gap_agent, facts.agent_gap),
                                      self.min_gap_agent)
        self.min_gap_wall = np.where(running, np.minimum(self.min_gap_wall, facts.wall_gap),
                                     self.min_gap_wall)
        # The last that applies counts: a collision before all.
        outcome = np.where(self.time >= self._time_limit - 1e-9, TIMEOUT, RUNNING)
        outcome[facts.reached] = GOAL
        outcome[facts.wall_gap <= 0.0] = WALL_COLLISION
        outcome[facts.agent_gap <= 0.0] = COLLISION
        self.outcome = np.where(running, outcome, self.outcome)


def _place(agents, row, episode):
    """Put the crowd of `episode` where it starts into `row` of `agents`."""
    size = len(episode.radius)
    agents.position[row], agents.velocity[row], agents.trail[row] = 0.0, 0.0, np.nan
    agents.radius[row], agents.present[row] = 0.0, False
    agents.position[row, :size] = episode.start
    agents.radius[row, :size] = episode.radius
    agents.present[row, :size] = True
