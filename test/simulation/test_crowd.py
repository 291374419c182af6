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
The ORCA crowd: agents walk to their goals, keep off walls and, as well as ORCA can, each other.

Paper section 1: motion patterns, and a robot that agents see only where the scenario says so.
"""

from dataclasses import replace

from crowds import run_crowd
import numpy as np
import pytest

from wallnav_ros.simulation.crowd import ARRIVAL, Crowd
from wallnav_ros.simulation.episodes import draw_episode, Episode
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.walls import Walls

pytestmark = pytest.mark.extras

STEP = 0.25


def episode_of(start, goal, radius=0.3, speed=1.0, returns=False, **scenario):
    """Return an episode of the cross path's scenario, without walls unless they are given."""
    start, goal = (np.asarray(points, dtype=float).reshape(-1, 2) for points in (start, goal))
    base = draw_episode(load_scenario('cross_path'), 'none', 0)
    scenario = {'walls': Walls.from_polylines([]), **scenario}
    return Episode(replace(base.scenario, **scenario), 'none', 0, base.robot, start, goal,
                   *(np.full(len(start), value) for value in (radius, speed, returns)))


def test_a_lone_agent_walks_straight_at_its_speed():
    crowd = Crowd(episode_of([0, 0], [5, 0], speed=0.8), STEP)

    for _ in range(4):
        agents = crowd.step()

    # RVO2 computes in single precision.
    assert agents.position[0] == pytest.approx([0.8, 0.0], abs=1e-5)
    assert agents.velocity[0] == pytest.approx([0.8, 0.0], abs=1e-5)


def test_who_walks_to_a_goal_stops_there():
    crowd = Crowd(episode_of([0, 0], [2, 0]), STEP)

    for _ in range(40):
        agents = crowd.step()

    assert np.linalg.norm(agents.position[0] - [2, 0]) < 0.01
    assert np.linalg.norm(agents.velocity[0]) < 0.01


def test_who_walks_back_and_forth_turns_round_at_both_ends():
    crowd = Crowd(episode_of([0, 0], [2, 0], returns=True), STEP)

    x = np.array([crowd.step().position[0, 0] for _ in range(80)])

    turns = np.flatnonzero(np.diff(np.sign(np.diff(x))))
    assert len(turns) >= 8
    # Turned within ARRIVAL of the ends, and never past them.
    assert (2.0 - ARRIVAL < x.max() <= 2.0 + 1e-5) and (-1e-5 <= x[20:].min() < ARRIVAL)


def test_a_static_agent_stands():
    crowd = Crowd(episode_of([[0, 0]], [[0, 0]], speed=0.0), STEP)

    for _ in range(20):
        crowd.step()

    assert (crowd.position == 0.0).all()
    assert (crowd.velocity == 0.0).all()


def test_two_who_meet_head_on_pass_each_other():
    crowd = Crowd(episode_of([[0, 0], [6, 0.1]], [[6, 0], [0, 0.1]]), STEP)

    gaps = []
    for _ in range(60):
        crowd.step()
        gaps.append(np.linalg.norm(crowd.position[0] - crowd.position[1]) - 0.6)

    assert min(gaps) > -0.01
    assert np.linalg.norm(crowd.position - [[6, 0], [0, 0.1]], axis=1).max() < 0.1


def test_a_wall_in_the_way_is_not_walked_through():
    wall = Walls(np.array([[[2.0, -20.0], [2.0, 20.0]]]))
    crowd = Crowd(episode_of([0, 0], [5, 0], walls=wall), STEP)

    x = [crowd.step().position[0, 0] for _ in range(60)]

    assert max(x) < 2.0 - 0.3 + 1e-3


@pytest.mark.parametrize('name', ['curve_path', 'cross_path'])
def test_the_papers_crowds_keep_off_walls_and_mostly_off_each_other(name):
    """ORCA gives way under pressure: in the crammed cross a squeeze now and then overlaps."""
    between = []
    for seed in range(6):
        episode = draw_episode(load_scenario(name), 'mixed', seed)
        position, _ = run_crowd(episode, 180, STEP)
        room = episode.scenario.walls.distance(position.reshape(-1, 2)).reshape(181, -1)
        assert (room - episode.radius).min() > -1e-3
        gap = np.linalg.norm(position[:, :, None] - position[:, None], axis=-1)
        gap -= episode.radius[:, None] + episode.radius
        between.append(gap[:, ~np.eye(len(episode.radius), dtype=bool)].min(axis=1))

    between = np.concatenate(between)
    assert np.mean(between < -0.02) < 0.02
    assert between.min() > -0.4


def test_nobody_walks_faster_than_they_can():
    episode = draw_episode(load_scenario('cross_path'), 'mixed', 1)

    _, velocity = run_crowd(episode, 180, STEP)

    assert (np.linalg.norm(velocity, axis=-1) <= episode.speed + 1e-5).all()


def test_the_papers_walkers_get_about():
    episode = draw_episode(load_scenario('curve_path'), 'dynamic', 2)

    position, _ = run_crowd(episode, 180, STEP)

    walked = np.linalg.norm(np.diff(position, axis=0), axis=-1).sum(axis=0)
    assert (walked > 2.0).all()


def drive_against(visible):
    """Return the least gap of an agent to a robot of 0.2 m that comes straight at it."""
    crowd = Crowd(episode_of([0, 0], [6, 0.0], visible=visible), STEP)
    gaps = []
    for step in range(24):
        robot = np.array([5.0 - 0.8 * STEP * step, 0.05])
        agents = crowd.step(robot, (-0.8, 0.0))
        gaps.append(np.linalg.norm(agents.position[0] - robot - [-0.8 * STEP, 0.0]) - 0.5)
    return min(gaps)


def test_a_visible_robot_is_made_way_for_and_an_invisible_one_is_not():
    assert drive_against(visible=True) > -0.02
    assert drive_against(visible=False) < -0.3


def test_agents_handed_out_do_not_move_when_the_crowd_does():
    crowd = Crowd(episode_of([0, 0], [5, 0]), STEP)

    before = crowd.agents()
    crowd.step()

    assert before.position.tolist() == [[0.0, 0.0]]


def test_an_empty_crowd_may_be_stepped():
    assert Crowd(episode_of([], []), STEP).step().position.shape == (0, 2)
