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
Checkpoints: all of a run comes back, no code in one is run, and the last whole one stays.

That a resumed run ends as if never interrupted is tested with the trainer.
"""

import numpy as np
import pytest

from wallnav_ros.learning.settings import TrainSettings

torch = pytest.importorskip('torch')

from wallnav_ros.learning import checkpoints  # noqa: E402, I100
from wallnav_ros.learning.trainer import Trainer  # noqa: E402
from wallnav_ros.policy.features import AGENT, Features, ROBOT, WALL_RAYS  # noqa: E402

pytestmark = pytest.mark.extras
TINY = TrainSettings(
    scenarios={'cross_path': 1}, memory=8, batch_size=2,
    network={'mlp1': [8, 6], 'mlp2': [6, 4], 'attention': [5, 1], 'mlp3': [8, 1]})


def states(rng, count):
    """Return Features (count,) of states with one agent."""
    return Features(rng.normal(size=(count, len(ROBOT))).astype(np.float32),
                    rng.normal(size=(count, WALL_RAYS)).astype(np.float32),
                    rng.normal(size=(count, 1, len(AGENT))).astype(np.float32),
                    np.ones((count, 1), dtype=bool))


@pytest.fixture
def trainer(tmp_path, rng):
    """Return a Trainer in the midst of a run."""
    trainer = Trainer(TINY, tmp_path)
    # More than the memory holds: where the ring goes on counts too.
    for _ in range(2):
        trainer.memory.add(states(rng, 6), rng.normal(size=6))
    trainer._update(3)
    trainer.counts.update(imitated=7, episodes=5, seconds=1.5, best=0.25)
    trainer.rows['log'].append({'episodes': 5, 'loss': 0.125})
    checkpoints.save_checkpoint(trainer)
    return trainer


def test_a_run_goes_on_with_all_it_had(trainer, tmp_path, rng):
    other = Trainer(TINY, tmp_path)
    checkpoints.load_checkpoint(other)

    assert (other.counts, other.rows) == (trainer.counts, trainer.rows)
    for run in (trainer, other):
        run.memory.add(states(np.random.default_rng(1), 1), np.ones(1))
        # It takes the networks, the optimiser, the memory and the random state.
        run.loss = run._update(2)
    assert other.loss == trainer.loss
    for name in ('network', 'target'):
        pairs = zip(getattr(other, name).parameters(), getattr(trainer, name).parameters())
        assert all(torch.equal(*pair) for pair in pairs)


class Intruder:
    """Creates a file when it is unpickled."""

    def __init__(self, path):
        self.path = str(path)

    def __reduce__(self):
        return open, (self.path, 'w')


def test_code_in_a_checkpoint_is_not_run(trainer, tmp_path):
    torch.save({'network': Intruder(tmp_path / 'intruded')}, tmp_path / checkpoints.FILE)

    with pytest.raises(checkpoints.CheckpointError, match='damaged, or written under'):
        checkpoints.load_checkpoint(trainer)
    assert not (tmp_path / 'intruded').exists()


def test_a_checkpoint_that_cannot_be_written_leaves_the_one_before(
        trainer, tmp_path, monkeypatch):
    before = (tmp_path / checkpoints.FILE).read_bytes()

    def fail(state, stream):
        stream.write(b'half of it')
        raise OSError('No space left on device')
    monkeypatch.setattr(torch, 'save', fail)
    with pytest.raises(OSError, match='No space left'):
        checkpoints.save_checkpoint(trainer)

    assert (tmp_path / checkpoints.FILE).read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == [checkpoints.FILE]
