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
Draw an episode of a scenario from a seed: who stands where, who walks where to, how fast.

Paper section 1 and Table 1; the same seed gives the same episode, to the byte.
"""

from dataclasses import dataclass
from itertools import count
from zlib import crc32

import numpy as np

from wallnav_ros.simulation.free_space import CELL, Passage
from wallnav_ros.simulation.scenario import Scenario, ScenarioError
from wallnav_ros.world.state import Robot

CLEARANCE = 0.05       # m, kept free between a new agent and walls or other agents
REACTION = 0.5         # s, in which nobody who walks can reach the robot's start: two time steps
GOAL_CLEARANCE = 0.2   # m, kept free around the robot's goal, or nobody could reach it
PASSAGE = 0.1          # m, room to each side of the robot on the way that standing agents leave
MIN_WALK = 4.0         # m, a walking agent's goal is this far, or the farthest that was found
ATTEMPTS = 2000
GOAL_ATTEMPTS = 30
WORLDS = 100           # of a family that are drawn before one must have had room for its crowd
NEXT_WORLD = 1_000_003  # from the seed of one such world to that of the next: of no episode near


@dataclass(frozen=True, eq=False)
class Episode:
    """
    One drawn episode; N agents, everything in the scenario's frame.

    start, goal: (N, 2) metres; radius: (N,) metres; speed: (N,) m/s, 0 for static agents.
    returns: (N,) bool, True for agents that turn round at their goal and walk back.
    """

    scenario: Scenario
    case: str
    seed: int
    robot: Robot
    start: np.ndarray
    goal: np.ndarray
    radius: np.ndarray
    speed: np.ndarray
    returns: np.ndarray


def draw_episode(scenario, case, seed, radius=None, preferred_speed=None):
    """
    Draw episode `seed` of `case` of a Scenario or Family.

    `radius` and `preferred_speed` override the robot's. Where the world that a Family draws for
    this seed is too small for its crowd, the next that is not takes its place.

    Raises ScenarioError when the case does not fit in the free space.
    """
    worlds = count(int(seed), NEXT_WORLD)
    return draw_with_room(scenario, worlds.__next__, lambda world: _draw_in(
        world, case, seed, radius, preferred_speed))


def _draw_in(scenario, case, seed, radius, preferred_speed):
    rng = np.random.default_rng((int(seed), crc32(f'{scenario.name}/{case}'.encode())))
    static, dynamic = scenario.counts(case)
    robot = Robot(
        pose=scenario.start, velocity=np.zeros(2), goal=scenario.goal,
        radius=np.float64(scenario.radius if radius is None else radius),
        preferred_speed=np.float64(
            scenario.preferred_speed if preferred_speed is None else preferred_speed))
    crowd = _Draw(scenario, rng, robot)
    for number in range(static + dynamic):
        crowd.add(walks=number >= static)
    return Episode(scenario, case, int(seed), robot, *crowd.arrays())


def draw_with_room(source, seed, draw):
    """
    Return draw(world) for a world of `source`, a Scenario or Family; seed() gives its seed.

    A drawn world may be too small for the crowd drawn with it: another one is taken then. Raises
    ScenarioError where a Scenario, which is the only world of its own, has no room.
    """
    for _ in range(WORLDS):
        world = source.at(seed())
        try:
            return draw(world)
        except ScenarioError as error:
            if world is source:
                raise
            refusal = error
    raise refusal


class _Draw:
    """Places agents one by one, each clear of walls, of the others and of the robot's task."""

    def __init__(self, scenario, rng, robot):
        self.scenario = scenario
        self.rng = rng
        self.robot = robot
        self.rows = []
        # Whoever stands, now or for ever once at the goal, leaves the robot a way.
        self.passage = Passage(scenario.free, scenario.field, robot.position, robot.goal,
                               robot.radius + PASSAGE)

    def add(self, walks):
        """Place one more agent; ScenarioError after too many attempts."""
        options = self.scenario.agents
        radius = self.rng.uniform(*options['radius'])
        speed = self.rng.uniform(*options['speed']) if walks else 0.0
        returns = walks and (options['pattern'] == 'walk_back_and_forth'
                             or (options['pattern'] == 'either' and self.rng.random() < 0.5))
        for _ in range(ATTEMPTS):
            region = self._region() if walks else None
            start = self._sample(region)
            if not self._start_is_clear(start, radius, speed):
                continue
            goal = self._goal(start, radius, region, returns) if walks else start
            if goal is None or not (returns or self.passage.admits(goal, radius)):
                continue
            if not returns:
                self.passage.block(goal, radius)
            self.rows.append((start, goal, radius, speed, returns))
            return
        raise ScenarioError(
            f'{self.scenario.path}: cases: no room for agent {len(self.rows) + 1} after '
            f'{ATTEMPTS} attempts; ask for fewer or smaller agents')

    def arrays(self):
        """Return start, goal (N, 2), radius, speed and returns (N,)."""
        start, goal, radius, speed, returns = zip(*self.rows) if self.rows else ((),) * 5
        return (np.array(start, dtype=float).reshape(-1, 2),
                np.array(goal, dtype=float).reshape(-1, 2),
                np.array(radius, dtype=float), np.array(speed, dtype=float),
                np.array(returns, dtype=bool))

    def _region(self, other_than=None):
        count = len(self.scenario.spawn)
        if count < 2 or other_than is None:
            return int(self.rng.integers(count)) if count else None
        return (other_than + int(self.rng.integers(1, count))) % count

    def _sample(self, region):
        points = self.scenario.free if region is None else self.scenario.spawn[region]
        return points[self.rng.integers(len(points))] + self.rng.uniform(-CELL / 2, CELL / 2, 2)

    def _clear_of_walls(self, points, gap):
        return bool((self.scenario.walls.distance(points) >= gap).all())

    def _clear_of_robot_goal(self, point, radius):
        gap = np.linalg.norm(point - self.robot.goal) - radius - self.robot.radius
        return gap >= GOAL_CLEARANCE

    def _start_is_clear(self, point, radius, speed):
        gap = np.linalg.norm(point - self.robot.position) - radius - self.robot.radius
        # At first all stand: nobody knows who will walk, nor where, before a step is done.
        if gap < max(CLEARANCE, REACTION * speed):
            return False
        if not self._clear_of_walls(point[None], radius + CLEARANCE):
            return False
        if not speed and not self._clear_of_robot_goal(point, radius):
            return False
        return all(np.linalg.norm(point - start) >= radius + other + CLEARANCE
                   for start, _, other, _, _ in self.rows)

    def _goal(self, start, radius, region, returns):
        farthest, best = 2.0 * radius, None
        for _ in range(GOAL_ATTEMPTS):
            goal = self._sample(self._region(other_than=region))
            length = np.linalg.norm(goal - start)
            if length <= farthest or not self._clear_of_walls(goal[None], radius + CLEARANCE):
                continue
            if not returns and not self._clear_of_robot_goal(goal, radius):
                continue
            if self.scenario.agents['goal'] == 'visible':
                along = np.linspace(start, goal, max(2, int(np.ceil(length / CELL))))
                if not self._clear_of_walls(along, radius):
                    continue
            if length >= MIN_WALK:
                return goal
            farthest, best = length, goal
        return best
