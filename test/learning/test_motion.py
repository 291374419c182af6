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
"""Training of the motion model: on real simulated crowds, and equal to what the robot runs."""

import numpy as np
import pytest
import torch

from wallnav_ros.learning.motion import (
    CHUNK, errors, fit, negative_log_likelihood, reflection, train_motion, watch)
from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.policy import motion
from wallnav_ros.policy.motion_weights import load_motion, save_motion
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.world.state import Agents
from wallnav_ros.world.walls import Walls


@pytest.fixture(scope='module')
def watched():
    return watch(['cross_path'], 6, seed=0)


def test_crowds_are_watched_the_same_from_the_same_seed(watched):
    again = watch(['cross_path'], 6, seed=0)

    assert (again[0] == watched[0]).all()
    assert (again[1] == watched[1]).all()


def test_what_followed_is_finite_and_mostly_as_the_velocity_said(watched):
    inputs, offsets = watched

    assert inputs.shape[1] == motion.INPUTS
    assert np.isfinite(inputs).all() and np.isfinite(offsets).all()
    assert np.median(np.hypot(*offsets[:, 0].T)) < 0.01
    # Nobody is faster than 1.5 m/s, so nobody is off by more than twice that.
    farthest = 2.0 * 1.5 * 0.25 * motion.STEPS
    assert np.hypot(offsets[..., 0], offsets[..., 1]).max() < farthest


def test_the_number_of_workers_does_not_matter():
    # More than one chunk, or there is nothing to share.
    alone, shared = (watch(['cross_path'], CHUNK + 1, seed=1, workers=count) for count in (1, 2))

    assert (alone[0] == shared[0]).all()
    assert (alone[1] == shared[1]).all()


def test_a_reflected_world_is_seen_as_its_reflection():
    rng = np.random.default_rng(2)
    place = rng.uniform(-2.0, 2.0, (1, 4, motion.HISTORY + 1, 2))
    wall = distance_field(Walls.from_polylines([[(-5.0, 2.0), (5.0, 2.0)]]))
    under = distance_field(Walls.from_polylines([[(-5.0, -2.0), (5.0, -2.0)]]))

    def seen(place, walls):
        velocity = (place[:, :, 0] - place[:, :, 1]) / 0.25
        agents = Agents(place[:, :, 0], velocity, np.full((1, 4), 0.3),
                        np.ones((1, 4), dtype=bool), place[:, :, 1:])
        return motion.look(agents, walls, 0.25).inputs
    order, sign = reflection()

    assert seen(place * [1.0, -1.0], under) == pytest.approx(
        seen(place, wall)[..., order] * sign, abs=2e-3)


def test_the_likelihood_of_one_sure_way_is_the_normal_density():
    outputs = torch.zeros(1, motion.OUTPUTS)
    outputs[0, 0] = 50.0                                     # the first way, spread 1 m
    offsets = torch.zeros(1, motion.STEPS, 2)
    offsets[..., 0] = 2.0

    # Three times ln(2 pi) + 2^2 / 2, the weight of the mean over steps.
    expected = 3.0 * (np.log(2.0 * np.pi) + 2.0)
    assert negative_log_likelihood(outputs, offsets).item() == pytest.approx(expected, rel=1e-5)


def test_fitting_makes_what_was_seen_likelier(watched):
    _, first = fit(*watched, epochs=1, seed=0)
    _, later = fit(*watched, epochs=30, seed=0)

    assert later < first - 1.0


def test_the_robots_forward_pass_is_torchs_and_survives_a_file(watched, tmp_path):
    network, _ = fit(*watched, epochs=1, seed=0)
    linear = [layer for layer in network if isinstance(layer, torch.nn.Linear)]
    model = motion.MotionModel([(layer.weight.detach().numpy().T.copy(),
                                 layer.bias.detach().numpy().copy())
                                for layer in linear], {'a': 1})
    save_motion(model, tmp_path / 'motion.npz')
    loaded = load_motion(tmp_path / 'motion.npz')

    with torch.no_grad():
        expected = network(torch.from_numpy(watched[0])).numpy()
    assert loaded.outputs(watched[0]) == pytest.approx(expected, abs=1e-4)
    assert loaded.training == {'a': 1}


def test_a_model_says_how_it_was_made_and_how_well_it_does():
    model = train_motion(['cross_path'], crowds=3, epochs=1, seed=1)

    assert model.training['crowds'] == 3
    assert set(model.training['unseen']) == {'likeliest', 'best', 'constant_velocity'}
    assert model.training['unseen']['best'] <= model.training['unseen']['likeliest']


def test_crowds_that_can_never_be_drawn_are_refused(tmp_path):
    path = tmp_path / 'empty.yaml'
    path.write_text('walls: []\nrobot: {start: [0, 0, 0], goal: [2, 0]}\ncases: {none: {}}\n')

    with pytest.raises(ScenarioError, match='cases: no case'):
        train_motion([str(path)], crowds=1, epochs=1, seed=0)


def test_a_model_that_changes_nothing_is_as_far_off_as_constant_velocity(watched):
    still = motion.MotionModel([(np.zeros((motion.INPUTS, motion.OUTPUTS), np.float32),
                                 np.zeros(motion.OUTPUTS, np.float32))], {})
    found = errors(still, *watched)

    assert found['likeliest'] == found['best'] == found['constant_velocity'] > 0.0
