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
Time the hot stages: tracking, decision, wall extraction and the simulator's step.

Figures are p50 and p99 of single calls, in milliseconds of one core's time.
"""

from dataclasses import replace
from time import process_time, thread_time

import numpy as np

from wallnav_ros.evaluation.episodes import BATCH
from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.occupancy_map import from_occupancy_grid
from wallnav_ros.mapping.route import plan_route
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.simulation.batch import EpisodeBatch
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.lidar import Lidar
from wallnav_ros.simulation.rollout import run_episodes
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.state import Agents, Observation
from wallnav_ros.world.walls import Walls

PATHS = ('curve_path', 'cross_path')
WARM_UP = 5                       # calls that are not counted
BEAMS = (180, 360, 720, 1081, 1440)
THINGS = (0, 5, 20)
CROWDS = (0, 5, 15)
MAP_SHAPE = (1280, 2736)          # cells, the largest map the package promises to be quick on


def measure(call, arguments):
    """
    Time `call(argument)` for each of `arguments`; returns count, p50 and p99 in ms.

    It is the thread's own time: what other programs on the machine take does not count.
    """
    times = []
    for argument in arguments:
        began = thread_time()
        call(argument)
        times.append(1e3 * (thread_time() - began))
    times = times[WARM_UP:] or times
    p50, p99 = np.percentile(times, (50, 99))
    return {'calls': len(times), 'ms_p50': round(float(p50), 4), 'ms_p99': round(float(p99), 4)}


def time_tracking(beams, things, calls=200):
    """Time one update of the tracker with `things` discs walking round a robot in a hall."""
    walls = load_scenario('cross_path').walls
    lidar = Lidar(beams, -np.pi, 2.0 * np.pi / beams, noise=0.02)
    rng = np.random.default_rng(0)
    bearing = 2.0 * np.pi * np.arange(things) / max(things, 1)
    scans = []
    for number in range(calls):
        turned = bearing + 0.01 * number
        distance = np.where(np.arange(things) % 2, 1.8, 3.0)
        position = distance[:, None] * np.stack((np.cos(turned), np.sin(turned)), axis=1)
        crowd = Agents.of(position, np.zeros((things, 2)), np.full(things, 0.2))
        ranges = lidar.scan(np.zeros(3), walls, crowd, rng)
        scans.append(Scan(0.1 * number, ranges, lidar.angle_min, lidar.angle_increment,
                          lidar.range_min, lidar.range_max))
    tracker = Tracker()
    return measure(lambda scan: tracker.update(scan, np.zeros(3)), scans)


def time_decision(value_function, agents, calls=200):
    """Time one decision among `agents` walking agents on the cross path."""
    scenario = load_scenario('cross_path')
    episode = draw_episode(scenario, 'none', 0)
    lookahead = Lookahead.from_weights(value_function)
    rng = np.random.default_rng(0)
    observations = []
    for _ in range(calls):
        position = scenario.free[rng.integers(len(scenario.free), size=agents)]
        crowd = Agents.of(position, rng.uniform(-1.0, 1.0, (agents, 2)),
                          rng.uniform(0.1, 0.5, agents))
        observations.append(Observation(episode.robot, crowd, scenario.field))
    return measure(lookahead.decide, observations)


def time_wall_extraction(calls=7):
    """Time the extraction of walls from a floor of rooms, 2736 x 1280 cells of 2 cm."""
    cells = np.zeros(MAP_SHAPE, dtype=np.int8)
    rng = np.random.default_rng(0)
    for line in range(0, MAP_SHAPE[1], 200):
        cells[:, line:line + 5] = 100
    for line in range(0, MAP_SHAPE[0], 200):
        cells[line:line + 5] = 100
    cells[rng.random(MAP_SHAPE) < 5e-4] = 100
    grid = from_occupancy_grid(cells.ravel(), MAP_SHAPE[1], MAP_SHAPE[0], 0.02, np.zeros(3))
    return measure(extract_walls, [grid] * calls)


def time_route(calls=20):
    """Time the planning of a route across a floor of 60 m x 60 m with doors 1 m wide."""
    lines = np.arange(0.0, 61.0, 6.0)
    walls = [[(line, low + 1.0), (line, low + 6.0)] for line in lines for low in lines[:-1]]
    walls += [[(low + 1.0, line), (low + 6.0, line)] for line in lines for low in lines[:-1]]
    field = distance_field(Walls.from_polylines(walls))
    goals = np.random.default_rng(0).uniform(31.0, 35.0, (calls, 2))
    return measure(lambda goal: plan_route(field, goal, 0.25, np.array([9.0, 9.0])), goals)


def time_simulator(calls=150, episodes=1):
    """Time one step of each of `episodes` side by side, with 15 agents and walls."""
    drawn = [draw_episode(load_scenario('cross_path'), 'mixed', seed)
             for seed in range(episodes)]
    # Off the scene the robot meets nobody, so that no collision ends the episode.
    away = replace(drawn[0].robot, pose=np.array([50.0, 50.0, 0.0]))
    batch = EpisodeBatch([replace(episode, robot=away) for episode in drawn])
    figure = measure(batch.step, [np.zeros((episodes, 2))] * calls)
    return {name: round(value / episodes, 4) if name.startswith('ms') else value
            for name, value in figure.items()}


def evaluation_rate(policy, episodes=BATCH):
    """Return how many episodes of the paper's eight cells an hour of one core evaluates."""
    began, count = process_time(), 0
    for name in PATHS:
        scenario = load_scenario(name)
        for case in scenario.cases:
            count += len(run_episodes([draw_episode(scenario, case, seed)
                                       for seed in range(episodes)], policy))
    return 3600.0 * count / (process_time() - began)
