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
    errors, fit, mirrored, negative_log_likelihood, train_motion, watch)
from wallnav_ros.policy import motion
from wallnav_ros.policy.motion_weights import load_motion, save_motion
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.simulation.scenarios import load_scenario


@pytest.fixture(scope='module')
def watched():
    return watch([load_scenario('cross_path')], 6, np.random.default_rng(0))


def test_crowds_are_watched_the_same_from_the_same_seed(watched):
    again = watch([load_scenario('cross_path')], 6, np.random.default_rng(0))

    assert (again[0] == watched[0]).all()
    assert (again[1] == watched[1]).all()


def test_what_followed_is_finite_and_mostly_as_the_velocity_said(watched):
    inputs, offsets = watched

    assert inputs.shape[1] == motion.INPUTS
    assert np.isfinite(inputs).all() and np.isfinite(offsets).all()
    assert np.median(np.hypot(*offsets[:, 0].T)) < 0.01
    # Nobody is faster than 1.5 m/s, so nobody is off by more than twice that.
    assert np.hypot(offsets[..., 0], offsets[..., 1]).max() < 2.0 * 1.5 * 1.5


def test_reflected_twice_is_unchanged(watched):
    once = mirrored(*watched)
    twice = mirrored(*once)

    assert not np.array_equal(once[0], watched[0])
    assert (twice[0] == watched[0]).all()
    assert (twice[1] == watched[1]).all()


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
