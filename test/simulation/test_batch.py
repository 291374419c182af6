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
Episodes side by side: each outcome by construction, gaps and times exact by hand.

Paper section 1: steps of 0.25 s, the goal within 0.2 m, a limit of 45 s.
"""

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.simulation.batch import (
    COLLISION, EpisodeBatch, GOAL, RUNNING, TIMEOUT, WALL_COLLISION)
from wallnav_ros.simulation.episodes import draw_episode, Episode
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.walls import Walls

pytestmark = pytest.mark.extras

AHEAD = (0.8, 0.0)
STAND = (0.0, 0.0)
# One wall across the way, 1 m ahead of a robot at the origin.
WALL = Walls(np.array([[[1.0, -9.0], [1.0, 9.0]]]))


def episode_of(goal=(5.0, 0.0), agents=(), walls=None, pose=(0.0, 0.0, 0.0), **scenario):
    """Return an episode of a 0.2 m robot at `pose`; `agents` are (start, goal, radius, speed)."""
    base = draw_episode(load_scenario('cross_path'), 'none', 0)
    walls = Walls.from_polylines([]) if walls is None else walls
    scenario = replace(base.scenario, walls=walls, polygons=(),
                       goal=np.array(goal, dtype=float), **scenario)
    robot = replace(base.robot, pose=np.array(pose, dtype=float),
                    goal=np.array(goal, dtype=float))
    start, to, radius, speed = zip(*agents) if agents else ((),) * 4
    return Episode(scenario, 'none', 0, robot, np.array(start, float).reshape(-1, 2),
                   np.array(to, float).reshape(-1, 2), np.array(radius, float),
                   np.array(speed, float), np.zeros(len(radius), dtype=bool))


def drive(episode, *commands):
    """Return a batch of `episode` alone after `commands`, and the facts of the last step."""
    batch = EpisodeBatch([episode])
    for command in commands:
        facts = batch.step(np.array([command]))
    return batch, facts


def test_a_step_drives_the_robot_and_says_what_happened():
    batch, facts = drive(episode_of(), AHEAD)

    assert batch.robot([0]).pose.tolist() == [[0.2, 0.0, 0.0]]
    assert batch.robot([0]).velocity.tolist() == [[0.8, 0.0]]
    assert facts.progress == pytest.approx([0.2])
    assert facts.moved == pytest.approx([0.2])
    assert facts.agent_gap.tolist() == [np.inf]
    assert facts.wall_gap.tolist() == [np.inf]
    assert (batch.outcome[0], batch.time[0]) == (RUNNING, 0.25)
    assert batch.path_length == pytest.approx([0.2])


def test_within_a_fifth_of_a_metre_the_goal_is_reached():
    # 0.55 m away: 0.35 m after one step, 0.15 m after two.
    batch, facts = drive(episode_of(goal=(0.55, 0.0)), AHEAD)
    assert (batch.outcome[0], bool(facts.reached[0]), bool(facts.ended[0])) == (
        RUNNING, False, False)

    batch, facts = drive(episode_of(goal=(0.55, 0.0)), AHEAD, AHEAD)
    assert (batch.outcome[0], bool(facts.reached[0]), bool(facts.ended[0])) == (GOAL, True, True)


def test_touching_an_agent_is_a_collision():
    # 0.8 m apart less radii of 0.2 and 0.3: 0.3 m of room, 0.1 m after one step.
    someone = ((0.8, 0.0), (0.8, 0.0), 0.3, 0.0)

    batch, facts = drive(episode_of(agents=[someone]), AHEAD)
    assert batch.outcome[0] == RUNNING
    assert facts.agent_gap == pytest.approx([0.1])

    batch, facts = drive(episode_of(agents=[someone]), AHEAD, AHEAD)
    assert batch.outcome[0] == COLLISION
    assert facts.agent_gap == pytest.approx([-0.1])
    assert batch.min_gap_agent == pytest.approx([-0.1])


def test_an_agent_that_runs_into_the_standing_robot_is_a_collision_too():
    runner = ((1.5, 0.0), (-3.0, 0.0), 0.3, 1.0)

    batch, _ = drive(episode_of(agents=[runner]), *[STAND] * 5)

    assert batch.outcome[0] == COLLISION
    # 1 m of room at 0.25 m a step: touched at the end of the fourth.
    assert batch.time[0] == 1.0


def test_a_collision_between_the_ends_of_a_step_counts():
    """A small agent at 8 m/s crosses the robot's way within one step."""
    bolt = ((0.1, -1.0), (0.1, 9.0), 0.1, 8.0)

    batch, facts = drive(episode_of(agents=[bolt]), AHEAD)

    assert np.linalg.norm(batch.robot([0]).position - batch.agents([0]).position[:, 0]) > 0.9
    assert batch.outcome[0] == COLLISION
    assert facts.agent_gap[0] < -0.2


def test_touching_a_wall_is_a_wall_collision():
    batch, facts = drive(episode_of(walls=WALL), *[AHEAD] * 3)
    assert batch.outcome[0] == RUNNING
    assert facts.wall_gap == pytest.approx([0.2])

    batch, facts = drive(episode_of(walls=WALL), *[AHEAD] * 5)
    assert batch.outcome[0] == WALL_COLLISION
    assert batch.time[0] == 1.0      # 0.8 m of room less 0.2 m a step
    assert batch.min_gap_wall == pytest.approx([0.0], abs=1e-9)


def test_a_wall_between_the_ends_of_a_step_counts():
    # At 4.8 m/s a step is 1.2 m long: from 0.4 m before the wall to 0.8 m behind it.
    batch, facts = drive(episode_of(walls=WALL, pose=(0.4, 0.0, 0.0)), (4.8, 0.0))

    assert batch.outcome[0] == WALL_COLLISION
    assert facts.wall_gap[0] == pytest.approx(-0.2)


def test_a_collision_at_the_goal_is_a_collision():
    someone = ((0.5, 0.0), (0.5, 0.0), 0.25, 0.0)

    batch, facts = drive(episode_of(goal=(0.2, 0.0), agents=[someone]), AHEAD)

    assert batch.outcome[0] == COLLISION
    assert not facts.reached[0]


def test_who_has_not_arrived_by_the_limit_has_run_out_of_time():
    batch, facts = drive(episode_of(time_limit=1.0), *[STAND] * 3)
    assert (batch.outcome[0], bool(facts.ended[0])) == (RUNNING, False)

    batch, facts = drive(episode_of(time_limit=1.0), *[STAND] * 4)
    assert (batch.outcome[0], bool(facts.ended[0])) == (TIMEOUT, True)
    assert batch.time[0] == 1.0


def test_arriving_on_the_last_step_is_arriving():
    batch, _ = drive(episode_of(goal=(0.3, 0.0), time_limit=0.25), AHEAD)

    assert batch.outcome[0] == GOAL


def test_stopping_for_someone_who_comes_nearer_is_yielding_and_driving_on_is_not():
    walker = ((1.8, 1.0), (-3.0, 1.0), 0.3, 1.0)

    # In the first step the walker still stands: nobody has been seen to move yet.
    for command, yields in ((STAND, True), (AHEAD, False)):
        _, facts = drive(episode_of(agents=[walker]), STAND, command)
        assert facts.yielding.tolist() == [yields]
    _, facts = drive(episode_of(agents=[walker]), STAND)
    assert facts.yielding.tolist() == [False]


def test_the_warning_zone_is_that_of_moving_agents():
    walker = ((3.0, 1.0), (3.0, 9.0), 0.3, 1.0)
    stander = ((3.0, 0.0), (3.0, 0.0), 0.3, 0.0)

    _, moving = drive(episode_of(agents=[walker]), STAND)
    _, standing = drive(episode_of(agents=[stander]), STAND)

    # The walker is at (3, 1.25): d - (0.3 + 0.5 x 1.0) - 0.3.
    assert moving.warning_depth == pytest.approx([np.hypot(3.0, 1.25) - 0.8 - 0.3], abs=1e-5)
    assert standing.warning_depth.tolist() == [np.inf]


def test_the_farthest_wall_is_that_of_algorithm_2():
    base = load_scenario('cross_path')
    episode = draw_episode(base, 'none', 0)

    _, facts = drive(episode, STAND)

    assert facts.farthest_wall == pytest.approx([np.hypot(2.0, 6.0)])


def test_an_ended_episode_stays_as_it_ended_while_others_go_on():
    batch = EpisodeBatch([episode_of(goal=(0.3, 0.0)), episode_of()])
    for _ in range(4):
        batch.step(np.array([AHEAD, AHEAD]))

    assert batch.outcome.tolist() == [GOAL, RUNNING]
    assert batch.time.tolist() == [0.25, 1.0]
    assert batch.path_length == pytest.approx([0.2, 0.8])
    assert batch.robot([0, 1]).pose[:, 0] == pytest.approx([0.2, 0.8])


def test_episodes_do_not_touch_each_other(rng):
    """Side by side or alone: the same episode, to the last bit."""
    episodes = [draw_episode(load_scenario(name), case, seed)
                for name in ('curve_path', 'cross_path')
                for case, seed in (('mixed', 1), ('none', 2), ('dynamic', 3))]
    commands = np.stack((rng.uniform(0.0, 0.8, (20, 6)), rng.uniform(-1.0, 1.0, (20, 6))), -1)

    together = EpisodeBatch(episodes)
    for command in commands:
        together.step(command)

    for row, episode in enumerate(episodes):
        alone = EpisodeBatch([episode])
        for command in commands:
            alone.step(command[None, row])
        count = len(episode.radius)
        assert (alone.robot([0]).pose == together.robot([row]).pose).all()
        assert (alone.agents([0]).position[0] == together.agents([row]).position[0, :count]).all()
        for name in ('outcome', 'time', 'path_length', 'min_gap_agent', 'min_gap_wall'):
            assert getattr(alone, name)[0] == getattr(together, name)[row], name


def test_crowds_are_padded_to_the_largest():
    batch = EpisodeBatch([episode_of(), episode_of(agents=[((2, 2), (3, 3), 0.3, 1.0)] * 2)])

    agents = batch.agents([0, 1])

    assert agents.present.tolist() == [[False, False], [True, True]]


def test_groups_are_the_running_episodes_of_each_scenario():
    curve, cross = (load_scenario(name) for name in ('curve_path', 'cross_path'))
    batch = EpisodeBatch([draw_episode(scenario, 'none', seed)
                          for seed, scenario in enumerate((curve, cross, curve))])
    batch.outcome[2] = GOAL

    groups = [(rows.tolist(), field) for rows, field in batch.groups()]

    assert groups == [([0], curve.field), ([1], cross.field)]


def test_the_least_gaps_are_kept_over_the_episode():
    someone = ((1.0, 0.9), (1.0, 0.9), 0.3, 0.0)

    batch, facts = drive(episode_of(agents=[someone], walls=WALL, pose=(-1.0, 0, 0)),
                         *[AHEAD] * 8, *[(-0.8, 0.0)] * 3)

    # Nearest at (0.6, 0): sqrt(0.4^2 + 0.9^2) - 0.5, and 0.4 - 0.2 to the wall.
    assert batch.min_gap_agent == pytest.approx([np.hypot(0.4, 0.9) - 0.5])
    assert batch.min_gap_wall == pytest.approx([0.2])
    # Of the last step, from 0.2 back to 0.0, the gap half way.
    assert facts.wall_gap == pytest.approx([0.7])


def test_the_way_round_a_wall_has_a_sub_goal():
    # A goal straight behind a wall from y = -2 to 2, which a robot of 0.2 m goes round.
    walls = Walls(np.array([[[2.0, -2.0], [2.0, 2.0]]]))
    batch = EpisodeBatch([episode_of(goal=(4.0, 0.0), walls=walls,
                                     field=distance_field(walls))])
    guided, robot = batch.guided([0]), batch.robot([0])

    assert robot.goal.tolist() == [[4.0, 0.0]]
    assert robot.beyond.tolist() == [0.0]
    assert abs(guided.goal[0, 1]) > 2.0                      # past one end of the wall
    length = np.linalg.norm(guided.goal[0]) + guided.beyond[0]
    shortest = 2.0 * np.hypot(2.0, 2.2)
    assert shortest < length < 1.2 * shortest


def test_the_trail_says_where_agents_were_and_nothing_before_the_start():
    batch, _ = drive(episode_of(agents=[((0.0, 3.0), (4.0, 3.0), 0.3, 0.8)]), STAND, STAND)
    agents = batch.agents([0])
    trail = agents.trail[0, 0]

    # It has walked two steps of 0.2 m.
    assert agents.position[0, 0] == pytest.approx([0.4, 3.0])
    assert trail[:2] == pytest.approx(np.array([[0.2, 3.0], [0.0, 3.0]]))
    assert np.isnan(trail[2:]).all()
