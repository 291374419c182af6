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
"""Files of motion models: read without trust, refused with one line that says why."""

import json

import numpy as np
import pytest

from wallnav_ros.policy.motion import INPUTS, MotionModel, OUTPUTS
from wallnav_ros.policy.motion_weights import load_motion, save_motion
from wallnav_ros.policy.weight_files import WeightsError


@pytest.fixture
def model():
    rng = np.random.default_rng(0)
    return MotionModel([(rng.normal(size=(INPUTS, 8)).astype(np.float32),
                         np.zeros(8, np.float32)),
                        (rng.normal(size=(8, OUTPUTS)).astype(np.float32),
                         np.zeros(OUTPUTS, np.float32))], {'crowds': 5})


def changed(model, path, arrays=None, about=None):
    """Write `model` to `path` with some arrays and metadata replaced."""
    save_motion(model, path)
    with np.load(path) as archive:
        parts = dict(archive)
    metadata = json.loads(str(parts.pop('metadata')))
    metadata['motion'].update(about or {})
    parts.update(arrays or {})
    np.savez(path, metadata=np.array(json.dumps(metadata)), **parts)
    return path


def test_a_model_comes_back_as_it_was(model, tmp_path):
    save_motion(model, tmp_path / 'm.npz')
    loaded = load_motion(tmp_path / 'm.npz')

    for (weight, bias), (other, second) in zip(model.layers, loaded.layers):
        assert (weight == other).all()
        assert (bias == second).all()
    assert loaded.training == {'crowds': 5}


@pytest.mark.parametrize(('arrays', 'about', 'reason'), [
    (None, {'version': 0}, 'metadata.motion.version: 0 is not 2'),
    (None, {'sizes': [8]}, 'metadata.motion.sizes'),
    (None, {'sizes': 'many'}, 'metadata.motion.sizes'),
    ({'motion.0.bias': np.zeros(9, np.float32)}, None, 'motion.0.bias: expected float32'),
    ({'motion.0.bias': np.full(8, np.nan, np.float32)}, None, 'motion.0.bias: holds NaN'),
])
def test_a_file_that_does_not_fit_is_refused(model, tmp_path, arrays, about, reason):
    path = changed(model, tmp_path / 'm.npz', arrays, about)

    with pytest.raises(WeightsError, match=reason) as error:
        load_motion(path)
    assert str(path) in str(error.value)
    assert len(str(error.value).splitlines()) == 1


def test_a_file_of_something_else_is_refused(tmp_path):
    path = tmp_path / 'm.npz'
    np.savez(path, metadata=np.array('{}'))

    with pytest.raises(WeightsError, match='this is no motion model'):
        load_motion(path)
    path.write_bytes(b'PK nonsense')
    with pytest.raises(WeightsError, match='not a readable .npz'):
        load_motion(path)
