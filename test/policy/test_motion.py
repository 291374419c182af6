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
"""The motion model: what it sees, what it may not depend on, and what a forecast means."""

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.policy import motion
from wallnav_ros.policy.motion import constant_velocity, Forecast, look, MotionModel
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import rotate
from wallnav_ros.world.state import Agents
from wallnav_ros.world.walls import Walls

DT = 0.25
OPEN = DistanceField.empty()


def walkers(*rows, known=motion.PAST):
    """Return Agents (1, N) that have walked straight: rows of (x, y, vx, vy, radius)."""
    rows = np.array(rows, dtype=float)
    ago = DT * np.arange(1, motion.PAST + 1)[:, None]
    trail = rows[:, None, :2] - ago * rows[:, None, 2:4]
    trail[:, known:] = np.nan
    return Agents(rows[None, :, :2], rows[None, :, 2:4], rows[None, :, 4],
                  np.ones((1, len(rows)), dtype=bool), trail[None])


def random_model(seed=0):
    rng = np.random.default_rng(seed)
    sizes = [motion.INPUTS, 24, motion.OUTPUTS]
    return MotionModel([(rng.normal(0.0, 0.2, pair).astype(np.float32),
                         rng.normal(0.0, 0.2, pair[1]).astype(np.float32))
                        for pair in zip(sizes[:-1], sizes[1:])], {})


def crowd(rng, count=6):
    """Return Agents (1, count) that have wandered at random."""
    steps = rng.normal(0.0, 0.15, (count, motion.PAST + 1, 2))
    places = rng.uniform(-3.0, 3.0, (count, 1, 2)) + np.cumsum(steps, axis=1)
    velocity = (places[:, 0] - places[:, 1]) / DT
    return Agents(places[None, :, 0], velocity[None], rng.uniform(0.2, 0.4, (1, count)),
                  np.ones((1, count), dtype=bool), places[None, :, 1:])


def test_a_walker_is_seen_in_the_frame_of_its_own_motion():
    seen = look(walkers((1.0, 2.0, 0.0, 0.8, 0.3)), OPEN, DT)
    inputs = seen.inputs[0, 0]

    assert seen.heading[0, 0] == pytest.approx(np.pi / 2.0)
    assert inputs[:4] == pytest.approx([0.8, 0.8, 1.0, 0.3])
    velocities = inputs[4:4 + 2 * len(motion.LAGS)].reshape(-1, 2)
    assert velocities == pytest.approx(np.tile([0.8, 0.0], (len(motion.LAGS), 1)), abs=1e-6)


def test_walls_are_felt_along_its_motion_first():
    wall = distance_field(Walls.from_polylines([[(-5.0, 2.0), (5.0, 2.0)]]))
    seen = look(walkers((0.0, 0.0, 0.0, 0.8, 0.3)), wall, DT)
    rays = seen.inputs[0, 0, 4 + 2 * len(motion.LAGS) + len(motion.HAUNTS):][:motion.RAYS]

    assert rays[0] * motion.RANGE == pytest.approx(2.0, abs=0.06)
    assert rays[motion.RAYS // 2] == 1.0


def test_the_nearest_neighbour_comes_first_and_an_absent_one_is_zero():
    seen = look(walkers((0.0, 0.0, 1.0, 0.0, 0.3), (3.0, 0.0, -1.0, 0.0, 0.3),
                        (0.0, 1.0, 1.0, 0.0, 0.2)), OPEN, DT)
    rows = seen.inputs[0, 0, -motion.NEIGHBOURS * len(motion.NEIGHBOUR):].reshape(
        motion.NEIGHBOURS, -1)

    # x/5, y/5, vx, vy, reach, time to the closest approach/5, gap then, there.
    assert rows[0] == pytest.approx([0.0, 0.2, 1.0, 0.0, 0.5, 0.0, 0.5, 1.0], abs=1e-6)
    assert rows[1] == pytest.approx([0.6, 0.0, -1.0, 0.0, 0.6, 0.3, -0.6, 1.0], abs=1e-6)
    assert (rows[2:] == 0.0).all()


def test_a_newcomer_is_seen_without_a_past():
    seen = look(walkers((0.0, 0.0, 1.0, 0.0, 0.3), known=0), OPEN, DT)
    velocities = seen.inputs[0, 0, 4:4 + 2 * len(motion.LAGS)].reshape(-1, 2)

    assert seen.walks.all()
    assert velocities[0].tolist() == [1.0, 0.0]
    assert (velocities[1:] == 0.0).all()
    assert np.isfinite(seen.inputs).all()


def haunts_of(agents):
    start = 4 + 2 * len(motion.LAGS)
    return look(agents, OPEN, DT).inputs[0, 0, start:start + len(motion.HAUNTS)]


def test_who_walks_back_is_seen_with_the_place_it_came_from_ahead():
    # From the origin 2 m along x in 8 steps, and 1 m of the way back in 4.
    x = np.concatenate((np.linspace(1.0, 2.0, 5)[1:], np.linspace(1.75, 0.0, 8)))
    trail = np.stack((x, np.zeros(12)), axis=-1)
    agents = Agents(np.array([[[1.0, 0.0]]]), np.array([[[-1.0, 0.0]]]), np.array([[0.3]]),
                    np.ones((1, 1), dtype=bool), trail[None, None])

    # 1 m ahead, 12 steps of 0.25 s ago, lies where it set out; 1 m behind, 4 steps ago, where it
    # turned; it has been in sight for 3 s.
    assert haunts_of(agents) == pytest.approx([0.2, 0.0, 0.3, -0.2, 0.0, 0.1, 0.3], abs=1e-6)


def test_who_goes_straight_on_has_been_nowhere_ahead():
    # 17 steps at 0.8 m/s: 3.4 m behind, 4.25 s ago.
    assert haunts_of(walkers((1.0, 2.0, 0.0, 0.8, 0.3))) == pytest.approx(
        [0.0, 0.0, 0.0, -0.68, 0.0, 0.425, 0.425], abs=1e-6)


def test_a_newcomer_has_been_nowhere():
    assert haunts_of(walkers((0.0, 0.0, 1.0, 0.0, 0.3), known=0)).tolist() == [0.0] * 7


def test_a_newcomer_who_stands_may_stay_or_go_anywhere():
    forecast = random_model().forecast(walkers((1.0, 2.0, 0.0, 0.0, 0.3), known=0), OPEN, 4, DT)

    assert (forecast.position == np.array([1.0, 2.0])).all()
    assert forecast.chance[0, 0].sum() == pytest.approx(1.0)
    assert forecast.chance[0, 0, 0] == 0.5
    # 0.7 m/s along each axis: 0.175 m a step.
    assert forecast.spread[0, 0, 0].tolist() == [0.0] * 4
    assert forecast.spread[0, 0, 1] == pytest.approx([0.175, 0.35, 0.525, 0.7])


def test_who_never_walked_is_foreseen_to_stay():
    forecast = random_model().forecast(walkers((1.0, 2.0, 0.0, 0.0, 0.3)), OPEN, 4, DT)

    assert (forecast.position == np.array([1.0, 2.0])).all()
    assert (forecast.spread == 0.0).all()


def test_the_frame_does_not_matter():
    agents, turn = crowd(np.random.default_rng(3)), 0.7
    moved = replace(agents, position=rotate(agents.position, turn) + 5.0,
                    velocity=rotate(agents.velocity, turn), trail=rotate(agents.trail, turn) + 5.0)
    here = random_model().forecast(agents, OPEN, motion.STEPS, DT)
    there = random_model().forecast(moved, OPEN, motion.STEPS, DT)

    assert there.position == pytest.approx(rotate(here.position, turn) + 5.0, abs=1e-4)
    assert there.spread == pytest.approx(here.spread, rel=1e-3)
    assert there.chance == pytest.approx(here.chance, abs=1e-4)


def test_the_order_of_agents_and_padding_do_not_matter():
    agents = crowd(np.random.default_rng(4))
    order = np.array([3, 1, 5, 0, 2, 4])
    shuffled = Agents(*(part[:, order] for part in vars(agents).values()))
    padded = Agents(*(np.concatenate((part, np.zeros_like(part[:, :2])), axis=1)
                      for part in vars(agents).values()))
    model = random_model()
    alone = model.forecast(agents, OPEN, motion.STEPS, DT).position

    assert model.forecast(shuffled, OPEN, motion.STEPS, DT).position == pytest.approx(
        alone[:, order], abs=1e-5)
    assert model.forecast(padded, OPEN, motion.STEPS, DT).position[:, :6] == pytest.approx(
        alone, abs=1e-5)


def test_many_states_are_foreseen_as_each_alone():
    rng = np.random.default_rng(5)
    parts = [crowd(rng) for _ in range(4)]
    together = Agents(*(np.concatenate(pieces) for pieces in zip(
        *(vars(part).values() for part in parts))))
    model = random_model()
    forecast = model.forecast(together, OPEN, motion.STEPS, DT)

    for row, part in enumerate(parts):
        assert forecast.position[row] == pytest.approx(
            model.forecast(part, OPEN, motion.STEPS, DT).position[0], abs=1e-4)


def test_beyond_what_it_was_trained_for_everybody_goes_straight_on():
    agents = crowd(np.random.default_rng(6))
    near = random_model().forecast(agents, OPEN, motion.STEPS, DT)
    far = random_model().forecast(agents, OPEN, motion.STEPS + 2, DT)

    assert (far.position[..., :motion.STEPS, :] == near.position).all()
    stride = near.position[..., -1, :] - near.position[..., -2, :]
    assert far.position[..., -1, :] == pytest.approx(near.position[..., -1, :] + 2.0 * stride)


def test_the_papers_forecast_is_one_sure_way():
    forecast = constant_velocity(walkers((1.0, 0.0, 0.4, -0.8, 0.3)), 3, DT)

    assert forecast.chance.tolist() == [[[1.0]]]
    assert forecast.position[0, 0, 0] == pytest.approx(
        np.array([[1.1, -0.2], [1.2, -0.4], [1.3, -0.6]]))
    gap = np.array([0.01, 0.0, -0.01]).reshape(1, 3, 1, 1, 1)
    assert forecast.hit(gap).ravel().tolist() == [0.0, 1.0, 1.0]


def test_the_chance_of_contact_adds_up_over_the_ways():
    # Sure to be missed one way; on the other the edge is as likely touched as not.
    forecast = Forecast(np.array([[[0.6, 0.4]]]), np.zeros((1, 1, 2, 1, 2)),
                        np.array([[[[0.0], [0.3]]]]))
    gap = np.array([2.0, 0.0]).reshape(1, 1, 1, 2, 1)

    assert forecast.hit(gap).item() == pytest.approx(0.4 * 0.5)
    # One standard deviation to spare: 15.9 %.
    gap = np.array([2.0, 0.3]).reshape(1, 1, 1, 2, 1)
    assert forecast.hit(gap).item() == pytest.approx(0.4 * 0.1587, abs=1e-4)
