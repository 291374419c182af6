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
"""A picture of an episode: it is drawn whatever the episode, and never half written."""

import cv2
import numpy as np
import pytest

from wallnav_ros.evaluation.trajectory_figures import draw_cell, draw_grid, draw_trajectories
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.orca import OrcaPolicy
from wallnav_ros.simulation.rollout import run_episodes
from wallnav_ros.simulation.scenarios import load_scenario

pytestmark = pytest.mark.extras

WALLS = np.array([[[0.0, 0.0], [4.0, 0.0]]])


def episode(people, moments):
    return {'times': (0.25 * np.arange(moments)).tolist(),
            'robot': np.linspace([1.0, 1.0, 0.0], [3.0, 1.0, 0.0], moments).tolist(),
            'agents': np.ones((moments, people, 2)).tolist(),
            'agent_radius': [0.3] * people, 'agent_walks': [n % 2 == 0 for n in range(people)],
            'radius': 0.2, 'start': [1.0, 1.0, 0.0], 'goal': [3.0, 1.0]}


@pytest.mark.parametrize('people, moments', [(0, 1), (0, 40), (1, 2), (15, 180)])
def test_every_episode_gives_a_picture(tmp_path, people, moments):
    draw_trajectories(tmp_path / 'run.png', WALLS, episode(people, moments), 'goal')
    picture = cv2.imread(str(tmp_path / 'run.png'))
    assert picture.shape[0] > 500 and picture.std() > 5.0


def test_the_robot_is_drawn_where_it_was(tmp_path):
    draw_trajectories(tmp_path / 'near.png', WALLS, episode(0, 20), 'goal')
    picture = cv2.imread(str(tmp_path / 'near.png')).astype(int)
    blue = (picture[..., 0] > picture[..., 2] + 60)
    column = np.flatnonzero(blue.any(axis=0))
    # Its way of 2 m and two radii lies within a view of 4 m and two margins of 0.5 m.
    assert 0.35 < (column[-1] - column[0]) / picture.shape[1] < 0.6


def test_a_world_without_walls_is_drawn_too(tmp_path):
    draw_trajectories(tmp_path / 'open.png', np.empty((0, 2, 2)), episode(2, 9), 'timeout')
    assert (tmp_path / 'open.png').is_file()


@pytest.mark.parametrize('count, rows', [(1, 1), (3, 1), (4, 2), (6, 2)])
def test_a_grid_has_a_panel_for_every_episode_three_a_row(tmp_path, count, rows):
    panels = [(WALLS, episode(2, 9), f'seed {number}') for number in range(count)]

    draw_grid(tmp_path / 'cell.png', panels, 'a cell')

    picture = cv2.imread(str(tmp_path / 'cell.png'))
    assert picture.shape[:2] == pytest.approx((90 * (4.4 * rows + 0.6),
                                               90 * 4.2 * min(3, count)), abs=2)


def test_a_cell_is_drawn_from_its_results(tmp_path):
    scenario = load_scenario('cross_path')
    episodes = [draw_episode(scenario, 'none', seed) for seed in range(2)]
    results = run_episodes(episodes, OrcaPolicy(make_actions()), watched=2)

    draw_cell(tmp_path / 'cell.png', episodes, results, 'orca')

    picture = cv2.imread(str(tmp_path / 'cell.png')).astype(int)
    blue = picture[..., 0] > picture[..., 2] + 60
    # A way of 8 m of the 13 m that are shown, in each panel.
    for panel in np.split(blue[:, :2 * (blue.shape[1] // 2)], 2, axis=1):
        column = np.flatnonzero(panel.any(axis=1))
        assert (column[-1] - column[0]) / len(panel) > 0.4
