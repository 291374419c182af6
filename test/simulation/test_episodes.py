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
Drawn episodes: the same from the same seed, to the byte, and nobody in anybody's way.

Paper section 1 and Table 1.
"""

from dataclasses import fields, replace
import hashlib
import subprocess
import sys

import numpy as np
import pytest

from wallnav_ros.simulation.episodes import (
    CLEARANCE, draw_episode, draw_with_room, Episode, GOAL_CLEARANCE)
from wallnav_ros.simulation.free_space import Passage
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.simulation.scenarios import load_scenario

CELLS = [(name, case) for name in ('curve_path', 'cross_path')
         for case in ('none', 'static', 'dynamic', 'mixed')]
ARRAYS = [entry.name for entry in fields(Episode) if entry.type is np.ndarray]


def fingerprint(episode):
    parts = [getattr(episode, name) for name in ARRAYS]
    parts += [np.asarray(part) for part in vars(episode.robot).values()]
    return hashlib.sha256(b''.join(part.tobytes() for part in parts)).hexdigest()


def drawn(name, case, seeds=range(12)):
    return [draw_episode(load_scenario(name), case, seed) for seed in seeds]


def gaps_between(points, radius):
    """Return the least gap between any two discs, inf where there are not two."""
    gap = np.linalg.norm(points[:, None] - points, axis=-1) - radius[:, None] - radius
    np.fill_diagonal(gap, np.inf)
    return gap.min(initial=np.inf)


def test_an_episode_has_an_array_of_each_kind():
    assert ARRAYS == ['start', 'goal', 'radius', 'speed', 'returns']


@pytest.mark.parametrize('name, case', CELLS)
def test_the_same_seed_gives_the_same_episode_to_the_byte(name, case):
    first, second = (list(map(fingerprint, drawn(name, case, range(4)))) for _ in range(2))

    assert first == second


def test_another_process_draws_the_same_episode():
    code = ('from wallnav_ros.simulation.episodes import draw_episode\n'
            'from wallnav_ros.simulation.scenarios import load_scenario\n'
            'episode = draw_episode(load_scenario("cross_path"), "mixed", 7)\n'
            'print(episode.start.tobytes().hex())')

    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          check=True)

    assert done.stdout.strip() == drawn('cross_path', 'mixed', [7])[0].start.tobytes().hex()


@pytest.mark.parametrize('name', ['curve_path', 'cross_path'])
def test_other_seeds_give_other_episodes(name):
    assert len({fingerprint(episode) for episode in drawn(name, 'mixed', range(50))}) == 50


def test_the_cases_and_scenarios_of_one_seed_are_drawn_apart():
    starts = [drawn(name, case, [3])[0].start[0] for name, case in CELLS if case != 'none']

    assert len(np.unique(np.round(starts, 9), axis=0)) == len(starts)


def test_an_episode_does_not_depend_on_what_was_drawn_before():
    scenario = load_scenario('cross_path')
    alone = fingerprint(draw_episode(scenario, 'mixed', 5))

    for case in scenario.cases:
        draw_episode(scenario, case, 5)

    assert fingerprint(draw_episode(scenario, 'mixed', 5)) == alone


def test_a_case_does_not_depend_on_which_others_there_are():
    scenario = load_scenario('cross_path')
    fewer = replace(scenario, cases={'mixed': scenario.cases['mixed']})

    assert (fingerprint(draw_episode(fewer, 'mixed', 5))
            == fingerprint(draw_episode(scenario, 'mixed', 5)))


@pytest.mark.parametrize('name, case', CELLS)
def test_counts_sizes_and_speeds_are_those_of_the_case(name, case):
    static, dynamic = load_scenario(name).counts(case)

    for episode in drawn(name, case):
        assert len(episode.radius) == static + dynamic
        assert (episode.speed == 0.0).sum() == static
        walking = episode.speed[episode.speed > 0.0]
        assert ((walking >= 0.3) & (walking <= 1.5)).all()
        assert ((episode.radius >= 0.1) & (episode.radius <= 0.5)).all()


@pytest.mark.parametrize('name, case', CELLS)
def test_nobody_starts_in_a_wall_in_another_agent_or_in_the_robot(name, case):
    for episode in drawn(name, case):
        robot = episode.robot
        room = episode.scenario.walls.distance(episode.start) - episode.radius
        to_robot = (np.linalg.norm(episode.start - robot.position, axis=1) - episode.radius
                    - robot.radius)

        assert (room >= CLEARANCE).all()
        assert (to_robot >= CLEARANCE).all()
        assert gaps_between(episode.start, episode.radius) >= CLEARANCE


@pytest.mark.parametrize('name', ['curve_path', 'cross_path'])
def test_nobody_who_walks_could_reach_the_robot_within_half_a_second(name):
    # Seed 4152 of the curve would have held somebody who is at the robot after two steps.
    for episode in drawn(name, 'dynamic', [*range(40), 4152]):
        way = np.linalg.norm(episode.start - episode.robot.position, axis=1)
        gap = way - episode.radius - episode.robot.radius
        assert (gap >= 0.5 * episode.speed).all()


@pytest.mark.parametrize('name', ['curve_path', 'cross_path'])
def test_who_stands_for_good_leaves_the_robots_goal_free(name):
    """Standing agents, and those that walk to a goal and stay there."""
    for episode in drawn(name, 'mixed'):
        stays = ~episode.returns
        gap = (np.linalg.norm(episode.goal - episode.robot.goal, axis=1) - episode.radius
               - episode.robot.radius)

        assert (gap[stays] >= GOAL_CLEARANCE).all()


def test_standing_agents_leave_the_robot_a_way():
    scenario = load_scenario('cross_path')
    for seed in range(20):
        episode = draw_episode(scenario, 'static', seed)
        # An exact search on discs: the way is open where the robot's centre may pass.
        points = scenario.free
        clear = np.linalg.norm(points[:, None] - episode.start, axis=2) - episode.radius
        room = np.minimum(clear.min(axis=1), scenario.walls.distance(points))
        passage = Passage(points[room > 0.2], scenario.field, scenario.start[:2], scenario.goal,
                          0.0)
        assert passage.admits(np.array([99.0, 99.0]), 0.0)


@pytest.mark.parametrize('name', ['curve_path', 'cross_path'])
def test_static_agents_stay_and_walking_ones_have_somewhere_to_go(name):
    for episode in drawn(name, 'mixed'):
        length = np.linalg.norm(episode.goal - episode.start, axis=1)

        assert (length[episode.speed == 0.0] == 0.0).all()
        assert (length[episode.speed > 0.0] >= 4.0).all()
        assert not episode.returns[episode.speed == 0.0].any()


def test_all_three_motion_patterns_occur():
    episodes = drawn('curve_path', 'mixed')
    walking = np.concatenate([episode.speed > 0.0 for episode in episodes])
    returns = np.concatenate([episode.returns for episode in episodes])

    assert (~walking).any()                    # static
    assert (walking & ~returns).any()          # walks to its goal, then stands
    assert (walking & returns).any()           # turns round, for ever


def test_walking_agents_of_the_cross_go_from_arm_to_arm():
    def arm(points):
        axis = np.abs(points).argmax(axis=1)
        return axis, np.sign(points[np.arange(len(points)), axis])

    for episode in drawn('cross_path', 'dynamic'):
        # Spawn regions start 4 m out; a point is drawn within half a cell of theirs.
        for points in (episode.start, episode.goal):
            assert (np.abs(points).max(axis=1) >= 3.95).all()
        start, goal = arm(episode.start), arm(episode.goal)
        assert ((start[0] != goal[0]) | (start[1] != goal[1])).all()


def test_goals_in_sight_can_be_walked_to_in_a_straight_line():
    scenario = load_scenario('curve_path')
    scenario = replace(scenario, agents={**scenario.agents, 'goal': 'visible'})

    for seed in range(5):
        episode = draw_episode(scenario, 'dynamic', seed)
        for start, goal, radius in zip(episode.start, episode.goal, episode.radius):
            along = np.linspace(start, goal, 200)
            assert scenario.walls.distance(along).min() > radius - 0.02


def test_the_robot_is_the_scenarios_unless_another_is_asked_for():
    scenario = load_scenario('curve_path')

    own = draw_episode(scenario, 'mixed', 1).robot
    other = draw_episode(scenario, 'mixed', 1, radius=0.24, preferred_speed=0.5).robot

    assert own.pose.tolist() == scenario.start.tolist()
    assert (float(own.radius), float(own.preferred_speed)) == (0.2, 0.8)
    assert (float(other.radius), float(other.preferred_speed)) == (0.24, 0.5)


def test_a_crowd_that_does_not_fit_is_refused_in_one_line():
    scenario = load_scenario('cross_path')
    crammed = replace(scenario, cases={'mixed': {'static': 500}})

    with pytest.raises(ScenarioError, match=r'cross_path.yaml: cases: no room for agent \d+ '
                                            r'after \d+ attempts; ask for fewer or smaller'):
        draw_episode(crammed, 'mixed', 0)


def too_small_for(worlds):
    """Return a draw that refuses `worlds`, and returns any other."""
    def draw(world):
        if world in worlds:
            raise ScenarioError('no room')
        return world
    return draw


def test_another_world_is_drawn_where_one_is_too_small_for_its_crowd():
    family = load_scenario('family')
    small = [family.at(1), family.at(2)]

    assert draw_with_room(family, iter((1, 2, 3)).__next__, too_small_for(small)) is family.at(3)
    with pytest.raises(ScenarioError, match='no room'):
        draw_with_room(family, lambda: 2, too_small_for(small))


def test_an_episode_of_a_family_takes_the_next_world_where_its_own_is_too_small():
    roomy = load_scenario('cross_path')
    crammed = replace(roomy, cases={'mixed': {'static': 500}})

    class Family:

        def at(self, seed):
            return crammed if seed == 5 else roomy

    assert draw_episode(Family(), 'mixed', 4).scenario is roomy
    instead = draw_episode(Family(), 'mixed', 5)
    assert instead.scenario is roomy
    assert fingerprint(instead) == fingerprint(draw_episode(roomy, 'mixed', 5))


def test_a_world_that_is_the_only_one_is_asked_once():
    scenario, seeds = load_scenario('cross_path'), iter(range(10))

    with pytest.raises(ScenarioError, match='no room'):
        draw_with_room(scenario, seeds.__next__, too_small_for([scenario]))
    assert next(seeds) == 1


def test_an_unknown_case_is_refused():
    with pytest.raises(ScenarioError, match="no case 'full'"):
        draw_episode(load_scenario('cross_path'), 'full', 0)
