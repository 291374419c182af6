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
The network's forward pass in NumPy, and weight files that nothing is taken on trust from.

Paper section 3; every refusal is one line that names file, fault and fix.
"""

import io
import json
import zipfile

import numpy as np
import pytest
from refusals import refusal_of

from wallnav_ros.policy import features as feature_set
from wallnav_ros.policy.features import Features
from wallnav_ros.policy.value_function import (
    FORMAT, layer_shapes, load_value_function, ValueFunction, WeightsError)
from wallnav_ros.policy.weight_files import MAX_BYTES

SIZES = {'mlp1': [12, 10], 'mlp2': [9, 7], 'attention': [8, 1], 'mlp3': [11, 6, 1]}


def metadata_of(**changes):
    return {'format': FORMAT, 'network': {'kind': 'three_mlp', 'sizes': SIZES},
            'features': feature_set.describe(), 'actions': {'max_turn_rate': 1.8},
            'reward': 'R4', 'decision': {'horizons': [1], 'caution': 0.0}, 'time_step': 0.25,
            'discount': 0.9, 'training': {}, **changes}


@pytest.fixture
def value_function(rng):
    """Return an untrained network with small random weights."""
    tensors = {name: rng.normal(0.0, 0.4, shape).astype(np.float32)
               for name, shape in layer_shapes(SIZES).items()}
    return ValueFunction(metadata_of(), tensors)


@pytest.fixture
def path(tmp_path, value_function):
    """Return a sound weight file."""
    value_function.save(tmp_path / 'sound.npz')
    return tmp_path / 'sound.npz'


def random_features(rng, *leading, agents=4, presence=0.5):
    def normal(*shape):
        return rng.normal(0.0, 1.0, (*leading, *shape)).astype(np.float32)
    return Features(normal(len(feature_set.ROBOT)), normal(feature_set.WALL_RAYS),
                    normal(agents, len(feature_set.AGENT)),
                    rng.random((*leading, agents)) < presence)


def rows(features, index):
    return Features(*(part[index] for part in vars(features).values()))


def write(path, metadata=None, **tensors):
    """Write a weight file by hand; `metadata` None leaves it out."""
    if metadata is not None:
        tensors['metadata'] = np.array(json.dumps(metadata))
    np.savez_compressed(path, **tensors)
    return path


def refusal(path):
    """Return the line with which `path` is refused, having checked that it is one."""
    return refusal_of(WeightsError, load_value_function, path)


def reference(value_function, own, agents):
    """Return one state's value by the paper's equations, in float64 and without tricks."""
    def stack(name, x, last_relu=False):
        for number in range(len(SIZES[name])):
            x = (x @ value_function.tensors[f'{name}.{number}.weight'].astype(float)
                 + value_function.tensors[f'{name}.{number}.bias'])
            if number < len(SIZES[name]) - 1 or last_relu:
                x = np.maximum(x, 0.0)
        return x
    crowd = np.zeros(SIZES['mlp2'][-1])
    if len(agents):
        hidden = stack('mlp1', np.hstack((np.tile(own, (len(agents), 1)), agents)), True)
        mean = np.tile(hidden.mean(axis=0), (len(agents), 1))
        score = np.exp(stack('attention', np.hstack((hidden, mean))))
        crowd = (score / score.sum() * stack('mlp2', hidden, True)).sum(axis=0)
    return float(stack('mlp3', np.hstack((own, crowd)))[0])


def test_the_value_is_that_of_the_three_mlps(value_function, rng):
    features = random_features(rng, 20)
    features.present[0] = False

    values = value_function(features)

    for row in range(20):
        own = np.concatenate((features.robot[row], features.walls[row])).astype(float)
        agents = features.agents[row][features.present[row]].astype(float)
        assert values[row] == pytest.approx(reference(value_function, own, agents), abs=1e-4)


@pytest.mark.extras
@pytest.mark.parametrize('agents, presence', [(4, 0.5), (1, 1.0), (15, 0.9), (6, 0.0), (0, 0.0)])
def test_numpy_and_torch_agree(rng, agents, presence):
    from wallnav_ros.learning.networks import NetworkValue, ValueNetwork
    network = ValueNetwork(SIZES)
    twin = ValueFunction(metadata_of(), network.tensors())
    features = random_features(rng, 64, agents=agents, presence=presence)

    assert twin(features) == pytest.approx(NetworkValue(network)(features), abs=1e-5)


def test_a_state_without_agents_is_valued_like_one_with_absent_agents(value_function, rng):
    padded = random_features(rng, 6, presence=0.0)
    empty = Features(padded.robot, padded.walls, padded.agents[:, :0], padded.present[:, :0])

    assert (value_function(padded) == value_function(empty)).all()
    assert np.isfinite(value_function(empty)).all()


def test_the_order_of_agents_does_not_matter(value_function, rng):
    features, order = random_features(rng, 8, agents=6), rng.permutation(6)
    shuffled = Features(features.robot, features.walls, features.agents[:, order],
                        features.present[:, order])

    assert value_function(shuffled) == pytest.approx(value_function(features), abs=1e-5)


def test_absent_agents_do_not_matter_whatever_they_hold(value_function, rng):
    features = random_features(rng, 8)
    rubbish = np.where(features.present[..., None], features.agents, np.float32(np.nan))

    assert (value_function(Features(features.robot, features.walls, rubbish, features.present))
            == value_function(features)).all()


def test_agents_matter(value_function, rng):
    features = random_features(rng, 8, presence=1.0)
    nobody = Features(features.robot, features.walls, features.agents,
                      np.zeros_like(features.present))

    assert (value_function(features) != value_function(nobody)).all()


def test_leading_axes_are_kept(value_function, rng):
    features = random_features(rng, 3, 5)

    values = value_function(features)

    assert values.shape == (3, 5)
    assert values[1] == pytest.approx(value_function(rows(features, 1)), abs=1e-6)


def test_huge_scores_do_not_overflow_the_attention(value_function, rng):
    value_function.tensors['attention.1.weight'] *= 1e4

    with np.errstate(over='raise', invalid='raise'):
        assert np.isfinite(value_function(random_features(rng, 16))).all()


def test_what_is_saved_is_what_is_loaded(path, value_function, rng):
    loaded = load_value_function(path)
    features = random_features(rng, 10)

    assert loaded.metadata == value_function.metadata
    assert set(loaded.tensors) == set(value_function.tensors)
    assert (loaded(features) == value_function(features)).all()


def test_a_weight_file_holds_no_pickle(path):
    with zipfile.ZipFile(path) as archive:
        headers = [archive.read(name)[:200] for name in archive.namelist()]

    assert headers
    assert not any(b"'descr': '|O'" in header for header in headers)


def test_a_missing_file_is_refused(tmp_path):
    assert refusal(tmp_path / 'none.npz') == 'no such weight file'


@pytest.mark.parametrize('share', [0.0, 0.01, 0.3, 0.7, 0.95, 0.999])
def test_a_truncated_file_is_refused(path, share):
    whole = path.read_bytes()
    path.write_bytes(whole[:int(share * len(whole))])

    assert 'not a readable .npz weight file' in refusal(path)


def test_every_single_flipped_bit_is_refused_or_harmless(path, rng, value_function):
    """The archive's checksums cover the tensors; a flip elsewhere must not change a weight."""
    whole = path.read_bytes()
    for position in rng.integers(len(whole), size=60):
        damaged = bytearray(whole)
        damaged[position] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            loaded = load_value_function(path)
        except WeightsError as error:
            assert '\n' not in str(error)
        else:
            assert all((loaded.tensors[name] == tensor).all()
                       for name, tensor in value_function.tensors.items())


@pytest.mark.parametrize('length', [1, 22, 5000])
def test_random_bytes_are_refused(tmp_path, rng, length):
    (tmp_path / 'noise.npz').write_bytes(rng.bytes(length))

    assert 'not a readable .npz weight file' in refusal(tmp_path / 'noise.npz')


def test_a_bare_array_is_refused(tmp_path):
    np.save(tmp_path / 'array.npy', np.zeros(3))

    assert 'not a readable .npz weight file' in refusal(tmp_path / 'array.npy')


def test_a_missing_tensor_is_refused_by_name(path, value_function):
    del value_function.tensors['mlp2.1.bias']
    value_function.save(path)

    assert refusal(path) == 'mlp2.1.bias: tensor missing; export the weights again'


@pytest.mark.parametrize('tensor, found', [
    (np.zeros((3, 2), np.float32), 'float32 (3, 2)'), (np.zeros(11), 'float64 (11,)')])
def test_a_tensor_of_another_shape_or_type_is_refused(path, value_function, tensor, found):
    value_function.tensors['mlp3.0.bias'] = tensor
    value_function.save(path)

    assert refusal(path) == f'mlp3.0.bias: expected float32 (11,), found {found}'


@pytest.mark.parametrize('rubbish', [np.nan, np.inf])
def test_a_diverged_tensor_is_refused(path, value_function, rubbish):
    value_function.tensors['mlp1.0.weight'][2, 3] = rubbish
    value_function.save(path)

    assert refusal(path) == 'mlp1.0.weight: holds NaN or infinity; training diverged'


def test_a_pickled_tensor_is_refused_and_not_run(tmp_path):
    class Trap:

        def __reduce__(self):
            return open, (str(tmp_path / 'sprung'), 'w')
    path = tmp_path / 'trap.npz'
    np.savez(path, metadata=np.array([Trap()], dtype=object))

    assert 'not a readable .npz weight file' in refusal(path)
    assert not (tmp_path / 'sprung').exists()


def test_weights_of_other_features_are_refused(path, value_function):
    older = {**feature_set.describe(), 'version': 0}
    ValueFunction(metadata_of(features=older), value_function.tensors).save(path)

    assert refusal(path).startswith(
        'features: trained on other features than this version computes (version 0, here ')


def test_a_file_that_unpacks_to_too_much_is_refused_before_it_is_unpacked(tmp_path):
    path = tmp_path / 'bomb.npz'
    with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as archive:
        archive.writestr('metadata.npy', bytes(MAX_BYTES + 1))

    assert path.stat().st_size < 1_000_000
    assert 'unpacks to more than 64 MiB' in refusal(path)


def test_a_header_that_promises_more_than_the_file_holds_is_refused(tmp_path):
    """An array of a terabyte, of which 100 bytes are there."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        stream, {'descr': '<f4', 'fortran_order': False, 'shape': (1 << 38,)})
    with zipfile.ZipFile(tmp_path / 'liar.npz', 'w') as archive:
        archive.writestr('metadata.npy', stream.getvalue() + bytes(100))

    assert 'not a readable .npz weight file' in refusal(tmp_path / 'liar.npz')


@pytest.mark.parametrize('text', [
    'not json', '[1, 2]', '"text"', '', '[' * 100_000], ids=lambda text: text[:8])
def test_metadata_that_is_not_a_json_mapping_is_refused(path, value_function, text):
    np.savez(path, metadata=np.array(text), **value_function.tensors)

    assert refusal(path) == 'metadata: missing or not JSON; export the weights again'


def test_tensors_alone_are_refused(path, value_function):
    write(path, **value_function.tensors)

    assert refusal(path) == 'metadata: missing or not JSON; export the weights again'


def test_the_shipped_motion_model_is_told_from_a_policy(repository):
    line = refusal(repository / 'models' / 'motion.npz')

    assert line == 'a motion model alone decides nothing: give the weights of a policy'


@pytest.mark.parametrize('key', sorted(metadata_of()))
def test_each_part_of_the_metadata_is_needed(path, value_function, key):
    metadata = metadata_of()
    del metadata[key]
    write(path, metadata, **value_function.tensors)

    assert refusal(path) == f'metadata.{key}: missing; export the weights again'


@pytest.mark.parametrize('changes, line', [
    ({'format': 2}, 'metadata.format: 2 is not 1, the format this version reads'),
    ({'actions': None}, 'metadata.actions: expected a mapping'),
    ({'actions': {}}, 'metadata.actions: expected a max_turn_rate above 0'),
    ({'actions': {'max_turn_rate': -1.0}}, 'metadata.actions: expected a max_turn_rate above 0'),
    ({'actions': {'max_turn_rate': 1.8, 'x': 1}}, 'metadata.actions: expected'),
    ({'decision': {}}, 'metadata.decision.horizons: expected a list of steps'),
    ({'decision': {'horizons': []}}, 'metadata.decision.horizons: expected a list of steps'),
    ({'decision': {'horizons': [0]}}, 'metadata.decision.horizons: expected a list of steps'),
    ({'decision': {'horizons': [101]}}, 'metadata.decision.horizons: expected a list of steps'),
    ({'decision': {'horizons': [1], 'turns': [0], 'caution': 0}},
     'metadata.decision.turns: expected a list of steps'),
    ({'decision': {'horizons': [1], 'caution': 10 ** 400}}, 'metadata.decision.caution: expected'),
    ({'decision': {'horizons': [1], 'caution': 0, 'aversion': 1e300}},
     'metadata.decision.aversion: expected a number, 0 or more'),
    ({'network': {'kind': ['three_mlp']}}, 'metadata.network.kind: expected text'),
    ({'time_step': float('nan')}, 'metadata.time_step: expected seconds above 0'),
    ({'time_step': '0.25'}, 'metadata.time_step: expected seconds above 0'),
    ({'discount': 1.5}, 'metadata.discount: expected a number above 0, at most 1'),
    ({'reward': 'R9'}, 'metadata.reward: expected one of R1, R2, R3, R4'),
    ({'reward': ['R4']}, 'metadata.reward: expected one of R1, R2, R3, R4'),
    ({'network': {}}, 'metadata.network.sizes: expected layer widths'),
    *(({'network': {'sizes': {**SIZES, name: sizes}}},
       'metadata.network.sizes: expected layer widths')
      for name, sizes in [('mlp1', []), ('mlp2', [9.0, 7.0]), ('attention', [1]),
                          ('attention', [8, 2]), ('mlp3', []), ('mlp3', [11, -6, 1]),
                          ('mlp3', '11'), ('mlp1', [10 ** 9])]),
])
def test_metadata_that_no_decision_could_be_taken_with_is_refused(
        path, value_function, changes, line):
    write(path, metadata_of(**changes), **value_function.tensors)

    assert refusal(path).startswith(line)


def test_a_failed_save_leaves_the_old_file_alone(path, value_function):
    before = path.read_bytes()
    broken = ValueFunction({'format': object()}, value_function.tensors)

    with pytest.raises(TypeError):
        broken.save(path)

    assert path.read_bytes() == before
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]
