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
The replay memory: a ring that forgets the oldest, and mirrors half of what it hands out.

Paper algorithm 1 (memory E).
"""

import numpy as np
import pytest

from wallnav_ros.learning.memory import mirror, MOST_AGENTS, ReplayMemory
from wallnav_ros.learning.sight import WallSight
from wallnav_ros.policy.features import AGENT, Features, ROBOT, WALL_RAYS


def states(targets, agents=2):
    """Return one state for each target, recognisable by it, with one agent of two present."""
    targets = np.asarray(targets, dtype=np.float32)
    count = len(targets)
    present = np.zeros((count, agents), dtype=bool)
    present[:, :1] = True
    return Features(np.tile(targets[:, None], len(ROBOT)), np.tile(targets[:, None], WALL_RAYS),
                    np.tile(targets[:, None, None], (agents, len(AGENT))), present), targets


def held(memory):
    return sorted(memory.target[:len(memory)].tolist())


def test_what_is_added_is_held():
    memory = ReplayMemory(10, WallSight())

    memory.add(*states([1, 2, 3]))

    assert len(memory) == 3
    assert held(memory) == [1, 2, 3]


def test_the_oldest_is_forgotten_first():
    memory = ReplayMemory(5, WallSight())

    for target in range(8):
        memory.add(*states([target]))

    assert len(memory) == 5
    assert held(memory) == [3, 4, 5, 6, 7]


def test_more_than_fits_at_once_keeps_the_newest():
    memory = ReplayMemory(4, WallSight())

    memory.add(*states(range(10)))

    assert held(memory) == [6, 7, 8, 9]


def test_a_smaller_crowd_leaves_nothing_of_the_larger_one_it_replaces():
    memory = ReplayMemory(1, WallSight())
    memory.add(*states([7], agents=5))

    memory.add(*states([8], agents=1))

    assert (memory.agents[0, 1:] == 0.0).all()
    assert memory.present[0].tolist() == [True] + [False] * (MOST_AGENTS - 1)


def test_a_sample_is_of_states_with_their_own_targets(rng):
    memory = ReplayMemory(50, WallSight())
    memory.add(*states(range(1, 31)))

    own, agents, present, target = memory.sample(rng, 200)

    assert own.shape == (200, len(ROBOT) + WALL_RAYS)
    assert agents.shape == (200, MOST_AGENTS, len(AGENT))
    assert (own[:, 0] == target).all()
    assert (agents[:, 0, AGENT.index('radius')] == target).all()
    assert present.sum(axis=1).tolist() == [1] * 200
    assert len(np.unique(target)) == 30


def test_half_of_a_sample_is_mirrored(rng):
    memory = ReplayMemory(10, WallSight())
    memory.add(*states([1, 2]))

    own, agents, _, _ = memory.sample(rng, 40)

    signs = np.sign(agents[:, 0, AGENT.index('y')])
    assert (signs == -1).sum() == 20
    assert (np.sign(own[:, ROBOT.index('heading_sin')]) == signs).all()


def test_sampling_does_not_change_what_is_held(rng):
    memory = ReplayMemory(10, WallSight())
    memory.add(*states([1, 2, 3]))
    before = {name: array.copy() for name, array in memory.state().items()}

    memory.sample(rng, 64)

    assert all((array == before[name]).all() for name, array in memory.state().items())


@pytest.mark.parametrize('count', [3, 8, 13])
def test_a_memory_goes_on_from_its_state(rng, count):
    """Before the ring is full, as it fills, and after it has gone round."""
    memory, twin = ReplayMemory(8, WallSight()), ReplayMemory(8, WallSight())
    memory.add(*states(range(count)))
    twin.restore(memory.state())

    for one in (memory, twin):
        one.add(*states([100, 101]))

    for name, array in memory.state().items():
        assert (twin.state()[name] == array).all(), name


def test_a_crowd_larger_than_the_memory_is_wide_is_refused():
    with pytest.raises(ValueError, match=f'{MOST_AGENTS + 1} agents at once, the memory holds'):
        ReplayMemory(4, WallSight()).add(*states([1], agents=MOST_AGENTS + 1))


def test_mirroring_twice_is_doing_nothing(rng):
    own = rng.normal(size=(5, len(ROBOT) + WALL_RAYS)).astype(np.float32)
    agents = rng.normal(size=(5, 3, len(AGENT))).astype(np.float32)
    twice = own.copy(), agents.copy()

    mirror(*twice)
    assert (twice[0] != own).any()
    mirror(*twice)

    assert (twice[0] == own).all()
    assert (twice[1] == agents).all()


def test_the_ray_to_the_goal_and_the_one_behind_stay_and_the_others_swap_sides():
    own = np.arange(len(ROBOT) + WALL_RAYS, dtype=np.float32)[None]

    mirror(own, np.zeros((1, 0, len(AGENT)), np.float32))

    rays = (own[0, len(ROBOT):] - len(ROBOT)).tolist()
    assert rays == [0, *range(15, 0, -1)]
    assert rays[8] == 8
