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
What a baseline is told: the joint state in the robot's frame, its history, and no walls.

Paper section 3; numbers worked by hand.
"""

import numpy as np
import pytest
from wallnav_ros.evaluation.joint_state import (
    AGENT, FollowedAgents, joint_state, JointSight, ROBOT)
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.outcomes import Rule
from wallnav_ros.simulation.batch import EpisodeBatch
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.state import Agents, Robot

pytestmark = pytest.mark.extras


def robots(*poses, goal=(0.0, 10.0), speed=0.5):
    count = len(poses)
    return Robot(np.array(poses, dtype=float), np.tile([speed, 0.0], (count, 1)),
                 np.tile(np.array(goal, dtype=float), (count, 1)), np.full(count, 0.2),
                 np.full(count, 0.8))


def test_columns_of_robot_and_agent_worked_by_hand():
    """The goal lies 10 m to the left of the map's x axis; the agent 3 m ahead and 4 m right."""
    frames = np.array([[[[4.0, 3.0, 0.0, -1.0]]]])

    seen = joint_state(robots((0.0, 0.0, np.pi / 2)), frames, np.array([[0.3]]),
                       np.array([[True]]))

    assert dict(zip(ROBOT, seen.robot[0])) == pytest.approx({
        'goal_distance': 1.0, 'preferred_speed': 0.8, 'radius': 0.2, 'heading_cos': 1.0,
        'heading_sin': 0.0, 'speed': 0.5}, abs=1e-6)
    assert dict(zip(AGENT, seen.agents[0, 0])) == pytest.approx({
        'x': 0.6, 'y': -0.8, 'vx': -1.0, 'vy': 0.0, 'radius': 0.3, 'reach': 0.5, 'gap': 0.9},
        abs=1e-6)


def test_earlier_frames_are_in_the_frame_of_the_present():
    """The robot is at (1, 0), wherever it was when the agent was at (3, 0)."""
    frames = np.array([[[[2.0, 0.0, -1.0, 0.0]], [[3.0, 0.0, -1.0, 0.0]]]])

    seen = joint_state(robots((1.0, 0.0, 0.0), goal=(5.0, 0.0)), frames, np.array([[0.3]]),
                       np.array([[True]]))

    now, earlier = seen.agents[0, 0].reshape(2, len(AGENT))
    assert now[AGENT.index('x')] == pytest.approx(1.0 / 5.0)
    assert earlier[AGENT.index('x')] == pytest.approx(2.0 / 5.0)


@pytest.mark.parametrize('frames', [1, 4])
def test_the_state_does_not_depend_on_where_the_map_begins(rng, frames):
    way = rng.normal(size=(1, frames, 3, 4))
    turn, shift = 0.7, np.array([30.0, -20.0])
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = np.concatenate((way[..., :2] @ rotation.T + shift, way[..., 2:] @ rotation.T), axis=-1)
    radius, present = np.full((1, 3), 0.2), np.ones((1, 3), dtype=bool)

    here = joint_state(robots((1.0, 2.0, 0.3), goal=(4.0, -1.0)), way, radius, present)
    there = joint_state(
        robots((*(rotation @ [1.0, 2.0] + shift), 0.3 + turn),
               goal=rotation @ [4.0, -1.0] + shift), moved, radius, present)

    assert there.robot == pytest.approx(here.robot, abs=1e-5)
    assert there.agents == pytest.approx(here.agents, abs=1e-5)


@pytest.fixture(scope='module')
def batch():
    """Return four episodes, with and without agents, five steps after their start."""
    scenario = load_scenario('cross_path')
    batch = EpisodeBatch([draw_episode(scenario, case, 3)
                          for case in ('mixed', 'none', 'static', 'dynamic')])
    for _ in range(5):
        batch.step(np.zeros((4, 2)))
    return batch


@pytest.mark.parametrize('frames', [1, 4])
@pytest.mark.parametrize('rows', [[0, 1, 2, 3], [1]])
def test_a_batch_is_seen_as_wide_as_the_sight_says(batch, frames, rows):
    sight = JointSight(frames)
    view, rows = sight.view(batch), np.array(rows)

    seen = sight.features(view.robot(rows), view.agents(rows), None)

    assert seen.robot.shape == (len(rows), sight.own)
    assert seen.agents.shape == (len(rows), 15, sight.agent)
    assert seen.walls.shape == (len(rows), 0)
    assert (seen.agents[~seen.present] == 0.0).all()


def test_the_past_is_where_agents_were(batch):
    view, rows = JointSight(4).view(batch), np.array([0, 3])

    past = view.agents(rows).past

    for number in range(3):
        then = batch.past(rows, number + 1)
        assert (past[:, number, :, :2] == then.position).all()
        assert (past[:, number, :, 2:] == then.velocity).all()
    assert (past[:, 0, :, :2] != past[:, 1, :, :2]).any()


def test_before_its_start_an_episode_stood_still():
    batch = EpisodeBatch([draw_episode(load_scenario('cross_path'), 'dynamic', 3)])

    agents = JointSight(3).view(batch).agents(np.array([0]))

    assert (agents.past[0, :, :, :2] == agents.position[0]).all()


def test_a_way_around_walls_is_not_told(batch):
    rows = np.array([0, 1])

    guided = JointSight().view(batch).guided(rows)

    assert (guided.goal == batch.robot(rows).goal).all()


def test_mirroring_mirrors_every_frame():
    sight = JointSight(2)
    own = np.arange(sight.own, dtype=float)[None]
    agents = np.arange(1.0, 1.0 + sight.agent)[None, None]
    before = agents.copy()

    sight.mirror(own, agents)

    flipped = {AGENT.index('y'), AGENT.index('vy'), 7 + AGENT.index('y'), 7 + AGENT.index('vy')}
    assert {int(column) for column in np.flatnonzero(agents[0, 0] == -before[0, 0])} == flipped
    assert np.flatnonzero(own[0] < 0.0).tolist() == [ROBOT.index('heading_sin')]


def heard(frames, horizons):
    """Return the Features that a value function is asked about, one agent walking by."""
    asked = []

    def value(features):
        asked.append(features)
        return np.zeros(len(features.robot))

    past = np.array([[[[3.0 - 0.25 * step, 2.0, 1.0, 0.0]] for step in (1, 2, 3)]])
    agents = FollowedAgents(np.array([[[3.0, 2.0]]]), np.array([[[1.0, 0.0]]]),
                            np.array([[0.3]]), np.array([[True]]), past=past[:, :frames - 1])
    sight = JointSight(frames)
    sight.lookahead(value, make_actions(), Rule(horizons)).evaluate(
        robots((0.0, 0.0, 0.0), goal=(8.0, 0.0)), agents, None)
    return asked[0]


def test_what_is_foreseen_is_followed_by_what_was_seen():
    """One step ahead of a stop: the agent at 3.25 m, before that at 3, 2.75 and 2.5 m."""
    features = heard(frames=4, horizons=(1,))

    x = features.agents[0, 0].reshape(4, len(AGENT))[:, AGENT.index('x')]
    assert 5.0 * x == pytest.approx([3.25, 3.0, 2.75, 2.5])


def test_two_steps_ahead_the_step_between_is_foreseen_too():
    features = heard(frames=3, horizons=(2,))

    x = features.agents[0, 0].reshape(3, len(AGENT))[:, AGENT.index('x')]
    assert 5.0 * x == pytest.approx([3.5, 3.25, 3.0])


def test_no_wall_changes_a_decision():
    """Right before a wall, with and without it."""
    sight, actions = JointSight(), make_actions()
    lookahead = sight.lookahead(lambda features: features.robot[:, 0], actions, Rule())
    wall = load_scenario('curve_path').field
    robot = robots((-4.0, 1.0, np.pi), goal=(-8.0, 1.0))
    nobody = Agents(np.zeros((1, 0, 2)), np.zeros((1, 0, 2)), np.zeros((1, 0)),
                    np.zeros((1, 0), dtype=bool))
    nobody = FollowedAgents(**vars(nobody), past=np.zeros((1, 0, 0, 4)))

    scores, rollout = lookahead.evaluate(robot, nobody, wall)

    assert (scores == lookahead.evaluate(robot, nobody, None)[0]).all()
    assert not rollout.collided.any()
