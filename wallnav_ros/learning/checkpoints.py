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
Checkpoints: everything a run needs to go on as if it had never stopped.

One file, replaced atomically between two rounds; read back with weights_only.
"""

import json

import torch

from wallnav_ros.world.files import atomic_write

FILE = 'checkpoint.pt'


class CheckpointError(ValueError):
    """A checkpoint that cannot be taken up; one line naming file, fault and fix."""


def save_checkpoint(trainer):
    """Write the trainer's networks, optimiser, memory, random state and logs."""
    memory = {name: torch.from_numpy(array.copy())
              for name, array in trainer.memory.state().items()}
    state = {
        'network': trainer.network.state_dict(), 'target': trainer.target.state_dict(),
        'optimizer': trainer.optimizer.state_dict(), 'memory': memory,
        'rng': json.dumps(trainer.rng.bit_generator.state), 'counts': dict(trainer.counts),
        'rows': json.dumps(trainer.rows, default=float),
    }
    with atomic_write(trainer.out / FILE, 'wb') as stream:
        torch.save(state, stream)


def load_checkpoint(trainer):
    """
    Take up the checkpoint in the trainer's folder.

    Raises FileNotFoundError where there is none, CheckpointError where it does not fit.
    """
    path = trainer.out / FILE
    if not path.is_file():
        raise FileNotFoundError(f'{path}: no checkpoint to resume from; start without --resume')
    try:
        state = torch.load(path, map_location=trainer.device, weights_only=True)
        trainer.network.load_state_dict(state['network'])
        trainer.target.load_state_dict(state['target'])
        trainer.optimizer.load_state_dict(state['optimizer'])
        trainer.memory.restore({name: tensor.cpu().numpy()
                                for name, tensor in state['memory'].items()})
        trainer.rng.bit_generator.state = json.loads(state['rng'])
        trainer.counts.update(state['counts'])
        trainer.rows.update(json.loads(state['rows']))
    except Exception as error:     # a damaged file may raise nearly anything on the way
        raise CheckpointError(
            f'{path}: damaged, or written under other settings '
            f'({" ".join(str(error).split())[:200]}); start without --resume') from None
