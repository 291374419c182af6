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
What comes of actions, worked by hand: arcs, contacts and the ways people are foreseen to go.

Paper sections 4 and 5.
"""

from foreseen import TwoWays
import numpy as np
import pytest

from wallnav_ros.policy.actions import ActionSet
from wallnav_ros.policy.motion import constant_velocity, Forecast
from wallnav_ros.policy.outcomes import roll_out, Rule
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.state import Agents, Robot

# Stop, straight ahead, and an arc to each side.
FOUR = ActionSet(np.array([0.0, 1.0, 1.0, 1.0]), np.array([0.0, 0.0, 1.0, -1.0]))
BESIDE = Agents.of([[1.0, 5.0]], [[0.0, 0.0]], [0.3])    # far to the side, and standing


def outcomes(horizon, *crowds, motion=None):
    """Return the Rollout of FOUR for robots of 0.2 m and 0.8 m/s that face their goals."""
    robot = Robot(*(np.stack([part] * len(crowds)) for part in (
        np.zeros(3), np.zeros(2), np.array([4.0, 0.0]), np.float64(0.2), np.float64(0.8))))
    crowd = Agents(*map(np.stack, zip(*(vars(agents).values() for agents in crowds))))
    return roll_out(Rule((horizon,)), FOUR, motion, robot, crowd, DistanceField.empty())


def test_a_longer_look_turns_once_and_then_keeps_the_heading():
    turn = outcomes(4, Agents.none()).poses[0, 2]

    assert turn[:, 2] == pytest.approx([0.25] * 4)
    # The arc of 0.25 rad and 0.2 m ends at (0.8 sin 0.25, 0.8 (1 - cos 0.25)).
    assert turn[0, :2] == pytest.approx([0.197923, 0.024870], abs=1e-6)
    strides = np.diff(turn[:, :2], axis=0)
    assert strides == pytest.approx(np.tile([0.2 * np.cos(0.25), 0.2 * np.sin(0.25)], (3, 1)))


def test_one_contact_foreseen_over_several_steps_is_counted_once():
    survival = outcomes(3, BESIDE, motion=TwoWays(0.4, (0.6, 0.0))).survival[0]

    assert survival[1] == pytest.approx([0.6, 0.6, 0.6])
    # Who stays 0.1 m short of it does not meet it.
    assert survival[0] == pytest.approx([1.0, 1.0, 1.0])


def test_the_likeliest_way_is_what_collisions_are_judged_by():
    ahead = Agents.of([[0.55, 0.0]], [[0.0, 0.0]], [0.3])

    def collided(chance):
        return outcomes(1, ahead, motion=TwoWays(chance, (0.0, 5.0))).collided[0]

    # Most likely it stays where straight on leads; most likely it is gone.
    assert collided(0.4)[1]
    assert not collided(0.6)[1]


def test_the_crowd_is_where_everybody_most_likely_goes():
    walker = Agents.of([[2.0, 0.0]], [[-1.0, 0.0]], [0.3])

    def crowd(chance):
        return outcomes(2, walker, motion=TwoWays(chance, (2.5, 0.0))).crowd

    # On at 1 m/s for two quarters of a second, or to the place at once, and there it stays.
    assert crowd(0.4).position[0, :, 0] == pytest.approx(np.array([[1.75, 0.0], [1.5, 0.0]]))
    assert crowd(0.4).velocity[0, :, 0] == pytest.approx(np.array([[-1.0, 0.0]] * 2))
    assert crowd(0.6).position[0, :, 0] == pytest.approx(np.array([[2.5, 0.0]] * 2))
    assert crowd(0.6).velocity[0, :, 0] == pytest.approx(np.array([[2.0, 0.0], [0.0, 0.0]]))


def test_a_state_comes_out_the_same_beside_any_other():
    # In one state the first of two is near, in the other the second, in the third neither.
    near, far = [1.0, 0.3], [9.0, 0.0]
    crowds = [Agents.of([a, b], [[-0.5, 0.0]] * 2, [0.3] * 2)
              for a, b in ((near, far), (far, near), (far, far))]

    class Unsure:

        def forecast(self, agents, walls, steps, time_step):
            ways = constant_velocity(agents, steps, time_step)
            return Forecast(ways.chance, ways.position, np.full(ways.spread.shape, 0.4))
    together = outcomes(4, *crowds, motion=Unsure())

    assert (together.survival[:2] < 0.9).any() and (together.survival[2] == 1.0).all()
    for number, crowd in enumerate(crowds):
        alone = outcomes(4, crowd, motion=Unsure())
        assert (alone.survival[0] == together.survival[number]).all()
        assert (alone.rewards[0] == together.rewards[number]).all()
