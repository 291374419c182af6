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
What a training run leaves for people: curves that are a picture, a card with its figures.

The rows are those that the trainer logs.
"""

import cv2
import pytest

from wallnav_ros.learning.report import draw_curves, write_card

pytestmark = pytest.mark.extras

OUTCOMES = {'goal': 0.75, 'collision': 0.25, 'wall_collision': 0.0, 'timeout': 0.0}
LOG = [{'episodes': 32 * number, 'loss': 1.0 / number, **OUTCOMES} for number in range(1, 30)]
CELLS = [{'episodes': 100, 'scenario': 'curve_path', 'case': case, 'time': 14.25,
          'total_reward': 5.0, **OUTCOMES}
         for case in ('none', 'mixed')]


@pytest.mark.parametrize('cells', [[], CELLS])
def test_curves_are_drawn_before_and_after_the_first_evaluation(tmp_path, cells):
    draw_curves({'log': LOG, 'evaluation': cells}, tmp_path / 'curves.png')

    picture = cv2.imread(str(tmp_path / 'curves.png'))
    assert picture.shape == (1100, 1000, 3)
    assert picture.std() > 5.0


def test_the_card_says_how_the_weights_came_about_and_what_they_reach(tmp_path):
    settings = {'seed': 7, 'imitation_episodes': 10, 'scenarios': {'curve_path': 1},
                'own_robot': 0.5,
                'radius': (0.15, 0.35), 'preferred_speed': (0.3, 1.0), 'evaluation_episodes': 40}
    metadata = {'name': 'some', 'network': {'kind': 'three_mlp', 'sizes': {'mlp1': [8]}},
                'reward': 'R4',
                'discount': 0.9, 'time_step': 0.25, 'decision': {'horizons': [2], 'caution': 0.1},
                'training': {'settings': settings, 'episodes': 100, 'seconds': 120.0,
                             'commit': 'abc'}}

    write_card(metadata, CELLS, tmp_path / 'some.md')

    card = (tmp_path / 'some.md').read_text()
    assert card.startswith('# some')
    assert '100 episodes (2 min) from seed 7 at commit abc, after 10 demonstrations' in card
    assert '| curve_path | mixed | 75.0% | 25.0% | 0.0% | 0.0% | 14.25 |' in card


def test_the_card_of_a_baseline_says_that_it_is_for_comparison(tmp_path):
    settings = {'seed': 7, 'imitation_episodes': 10, 'scenarios': {'curve_path': 1},
                'own_robot': 1.0,
                'radius': (0.15, 0.35), 'preferred_speed': (0.3, 1.0), 'evaluation_episodes': 40}
    metadata = {'name': 'some', 'network': {'kind': 'cadrl', 'sizes': {'value': [8, 1]}},
                'reward': 'R4', 'discount': 0.9, 'time_step': 0.25,
                'decision': {'horizons': [1], 'caution': 0.0},
                'training': {'settings': settings, 'episodes': 100, 'seconds': 120.0,
                             'commit': 'abc'}}

    write_card(metadata, CELLS, tmp_path / 'some.md')

    text = (tmp_path / 'some.md').read_text()
    assert 'CADRL: the least value of any pair' in text
    assert '- Worlds: curve_path; the robot of each;' in text
    assert 'It sees no walls: for comparison in the simulator, never for a robot.' in text


@pytest.mark.parametrize(('settings', 'words'), [
    ({}, 'people are foreseen to keep their velocity.'),
    ({'motion': 'crowds'},
     'people are foreseen by the motion model crowds, a contact costing 5 times its chance.'),
])
def test_the_card_says_what_people_are_expected_to_do(tmp_path, settings, words):
    settings = {'seed': 3, 'imitation_episodes': 0, 'own_robot': 0.5,
                'scenarios': {'cross_path': 1},
                'radius': (0.15, 0.35), 'preferred_speed': (0.3, 1.0),
                'evaluation_episodes': 40} | settings
    metadata = {'name': 'some', 'network': {'kind': 'three_mlp', 'sizes': {'mlp1': [8]}},
                'reward': 'R4', 'discount': 0.9, 'time_step': 0.25,
                'decision': {'horizons': [2], 'caution': 0.0, 'aversion': 5.0},
                'training': {'settings': settings, 'episodes': 100, 'seconds': 120.0,
                             'commit': 'abc'}}

    write_card(metadata, CELLS, tmp_path / 'some.md')

    assert words in (tmp_path / 'some.md').read_text()
