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
Worlds drawn from a seed: what every one of them must offer a robot.

The kinds are corridors, bends, curves, junctions, doors and halls.
"""

import numpy as np
import pytest
from refusals import refusal_of

from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.family import draw_world, KINDS, MOST_AGENTS
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.simulation.scenarios import load_scenario

pytestmark = pytest.mark.extras


def write(folder, text):
    path = folder / 'some.yaml'
    path.write_text(text)
    return path


@pytest.mark.parametrize('kind', KINDS)
def test_every_world_can_be_crossed_and_peopled(tmp_path, kind):
    family = load_scenario(write(tmp_path, f'name: some\nfamily: {{kinds: [{kind}]}}\n'))
    for seed in range(15):
        for case in family.cases:
            # Building a scenario checks that the robot fits and that a way leads to its goal.
            episode = draw_episode(family, case, seed)
            assert 2.0 < np.linalg.norm(episode.robot.goal - episode.robot.position) < 20.0
            assert len(episode.radius) <= MOST_AGENTS


def test_a_world_follows_from_its_seed_alone():
    family = load_scenario('family')

    first, again = (draw_episode(family, 'mixed', 5) for _ in range(2))
    other = draw_episode(family, 'mixed', 6)

    assert first.scenario.walls.segments.tobytes() == again.scenario.walls.segments.tobytes()
    assert first.start.tobytes() == again.start.tobytes()
    assert first.scenario.walls.segments.shape != other.scenario.walls.segments.shape or (
        first.scenario.walls.segments != other.scenario.walls.segments).any()


def test_cases_of_one_seed_share_their_world():
    family = load_scenario('family')

    worlds = [draw_episode(family, case, 3).scenario for case in family.cases]

    assert all(world.walls.segments.tobytes() == worlds[0].walls.segments.tobytes()
               for world in worlds)


def test_a_corridor_is_as_wide_as_asked(rng):
    for _ in range(10):
        (ring,) = draw_world(('corridor',), (1.5, 1.5), rng)['walls']
        sides = np.linalg.norm(np.diff(ring + ring[:1], axis=0), axis=1)
        assert sides.min() == pytest.approx(1.5, abs=1e-3)


def test_the_shipped_halves_share_no_kind():
    assert not set(load_scenario('family').kinds) & set(load_scenario('family_unseen').kinds)


@pytest.mark.parametrize('text, complaint', [
    ('family: {kinds: [maze]}', 'family.kinds: choose some of corridor'),
    ('family: {kinds: []}', 'family.kinds'),
    ('family: {width: [0.2, 3]}', 'family.width: expected [low, high]'),
    ('family: {height: 3}', 'family.height: unknown'),
    ('family: {}\nwalls: []', 'walls: unknown'),
    ('family: {}\nrobot: {start: [0, 0, 0]}', 'robot.start: unknown'),
])
def test_a_family_that_cannot_be_drawn_is_refused_in_one_line(tmp_path, text, complaint):
    path = write(tmp_path, text)

    assert refusal_of(ScenarioError, load_scenario, path).startswith(complaint)


def test_an_unknown_case_lists_the_cases():
    with pytest.raises(ScenarioError, match="no case 'full', choose one of none, static, dyn"):
        load_scenario('family').counts('full')


def test_no_world_has_more_agents_than_the_family_says():
    family = load_scenario('family')
    for case in family.cases:
        most = family.counts(case)
        for seed in range(25):
            counts = family.at(seed).counts(case)
            assert counts[0] <= most[0] and counts[1] <= most[1]
