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
Tracks against the simulator's truth: what is seen, where it goes and what it is.

A robot drives through a scenario's crowd with noisy ranges and drifting odometry.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from wallnav_ros.evaluation.tracking import clear_mot, Scores
from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.simulation.batch import RUNNING
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.lidar import Lidar
from wallnav_ros.simulation.live_world import Base, LiveWorld
from wallnav_ros.world.geometry import compose, distances, invert, rotate, to_child
from wallnav_ros.world.tracks import HUMAN

PERIOD = 0.1          # s between scans
SEEN_BEAMS = 5        # beams that must end on an agent for it to count as visible
MATCH = 0.5           # m between an agent and a track of it
STEP = 0.5            # m to walk since a track's birth until it must show
SETTLED = 1.0         # s after birth, when a velocity has to be right
CRUISE = 0.6          # m/s of the robot
ROOM = 1.0            # m ahead that must be free for it to go on


@dataclass(frozen=True)
class SimulatedScores:
    """
    scores: the Scores of all tracks against all visible agents.

    velocity_rmse: m/s, of tracks SETTLED seconds old. label_accuracy: share of the matches;
    decided_accuracy: of those but the walkers who have not come STEP metres since their track's
    birth: nobody can tell those from things that stand.
    count_error: mean difference of the numbers of tracks and of visible agents.
    """

    scores: Scores
    velocity_rmse: float
    label_accuracy: float
    decided_accuracy: float
    count_error: float


def score_simulation(scenario, case, seeds, noise=0.02, drift=0.02, duration=20.0,
                     settings=None):
    """
    Return the SimulatedScores over the episodes `seeds` of a scenario's case.

    noise: m, of a range. drift: share, of the odometry. duration: s of each episode at most.
    """
    frames, velocity_errors, labels, counts = [], [], [], []
    for seed in seeds:
        born, way = {}, None
        for moment in _episode(scenario, case, seed, noise, drift, duration, settings):
            true, tracks, time = moment
            gone = PERIOD * np.hypot(*true.velocity.T)
            way = gone if way is None else way + gone
            for number in tracks.id.tolist():
                born.setdefault(number, (time, way))
            frames.append(_frame(true, tracks, seed))
            counts.append(abs(len(frames[-1][2]) - len(frames[-1][0])))
            errors, right = _compare(true, tracks, born, time, way)
            velocity_errors += errors
            labels += right
    right, decided = np.array(labels, dtype=bool).T
    return SimulatedScores(clear_mot(frames, MATCH),
                           float(np.sqrt(np.mean(np.square(velocity_errors)))),
                           float(right.mean()), float(right[decided].mean()),
                           float(np.mean(counts)))


@dataclass(frozen=True)
class _Truth:
    """The agents in the laser's frame: seen and walks are (N,) bool."""

    position: np.ndarray
    velocity: np.ndarray
    seen: np.ndarray
    walks: np.ndarray


def _episode(scenario, case, seed, noise, drift, duration, settings):
    """Yield (truth, tracks, time) of every scan, both in the laser's frame."""
    episode, rng = draw_episode(scenario, case, seed), np.random.default_rng(seed)
    world = LiveWorld(episode, Base(drift=drift), rng)
    lidar = replace(Lidar(), noise=noise)
    tracker = Tracker() if settings is None else Tracker(settings)
    while world.time < duration and world.outcome == RUNNING:
        pose, odometry, agents = world.pose.copy(), world.odometry.copy(), world.agents()
        ranges = lidar.scan(pose, scenario.walls, agents, rng)
        scan = Scan(world.time, ranges, lidar.angle_min, lidar.angle_increment,
                    lidar.range_min, lidar.range_max)
        from_map = compose(odometry, invert(pose))
        walls = replace(scenario.field, pose=compose(from_map, scenario.field.pose))
        tracks = tracker.update(scan, odometry, walls=walls)
        tracks = replace(tracks, position=to_child(odometry, tracks.position),
                         velocity=rotate(tracks.velocity, -odometry[2]))
        true = _Truth(to_child(pose, agents.position), rotate(agents.velocity, -pose[2]),
                      _seen(lidar, pose, ranges, agents), episode.speed > 0.0)
        yield true, tracks, world.time
        command = _cruise(world, agents)
        for _ in range(2):
            world.advance(command, PERIOD / 2.0)


def _cruise(world, agents):
    """Return a command (2,) towards the goal that waits for whoever is in the way."""
    x, y = to_child(world.pose, world.goal)
    ahead = to_child(world.pose, agents.position)
    gap = np.hypot(*ahead.T) - agents.radius
    blocked = ((gap < ROOM) & (ahead[:, 0] > 0.0)).any()
    return np.array([0.0 if blocked else CRUISE, np.clip(2.0 * np.arctan2(y, x), -1.0, 1.0)])


def _seen(lidar, pose, ranges, agents):
    """Return (N,) bool: at least SEEN_BEAMS beams end on the agent."""
    hits = np.flatnonzero(np.isfinite(ranges))
    bearings = lidar.angles()[hits] + pose[2]
    ends = pose[:2] + ranges[hits, None] * np.stack((np.cos(bearings), np.sin(bearings)), 1)
    gap = np.linalg.norm(ends[:, None] - agents.position[None], axis=2) - agents.radius
    return (np.abs(gap) < 4.0 * lidar.noise).sum(axis=0) >= SEEN_BEAMS


def _frame(true, tracks, seed):
    """Return a frame for `clear_mot`; tracks of agents out of sight are nobody's fault."""
    gap = np.linalg.norm(tracks.position[:, None] - true.position[None], axis=2)
    hidden = np.zeros(len(tracks), dtype=bool)
    if gap.size:
        hidden = ~true.seen[gap.argmin(axis=1)] & (gap.min(axis=1) < MATCH)
    agents = np.flatnonzero(true.seen)
    return (10_000 * seed + agents, true.position[agents],
            10_000_000 * (seed + 1) + tracks.id[~hidden].astype(np.int64),
            tracks.position[~hidden])


def _compare(true, tracks, born, time, way):
    """
    Return velocity errors in m/s of settled tracks and (label right, label decidable), by pairs.

    Pairs are one to one, as for `clear_mot`. born: {track: (s, way)} at birth; way: (N,) metres
    that the agents have walked so far.
    """
    errors, labels = [], []
    agents = np.flatnonzero(true.seen)
    gap = distances(true.position[agents], tracks.position)
    pairs = linear_sum_assignment(np.where(gap <= MATCH, gap, 1e3))
    for row, track in zip(*pairs):
        if gap[row, track] > MATCH:
            continue
        agent = agents[row]
        birth, before = born[int(tracks.id[track])]
        walks = bool(true.walks[agent])
        labels.append(((tracks.label[track] == HUMAN) == walks,
                       not walks or way[agent] - before[agent] >= STEP))
        if time - birth >= SETTLED:
            errors.append(np.linalg.norm(tracks.velocity[track] - true.velocity[agent]))
    return errors, labels
