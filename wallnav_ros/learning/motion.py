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
Train the motion model: watch simulated crowds and learn where their members go next.

The likelihood of a mixture of trajectories, as in `policy.motion`; the robot is not in them.
"""

import math

import numpy as np
import torch
from tqdm import tqdm
from wallnav_ros.evaluation.worker_pool import work_off
from wallnav_ros.learning.export import commit
from wallnav_ros.learning.networks import mlp
from wallnav_ros.learning.trainer import TrainingDiverged
from wallnav_ros.policy import motion
from wallnav_ros.simulation.crowd import Crowd
from wallnav_ros.simulation.episodes import draw_episode, draw_with_room
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.geometry import rotate
from wallnav_ros.world.state import Agents

TIME_STEP = 0.25       # s
STEPS = 120            # that a crowd is watched for
MOMENTS = 24           # of them that are learnt from
CASES = ('dynamic', 'mixed')
NEWCOMERS = 0.2        # share of agents that are shown as if just come into sight
LATECOMERS = 0.2       # share of those seen for some time, not from the beginning
SIZES = (384, 256)
CHUNK = 50             # crowds drawn from one seed, so that results do not depend on workers
BATCH = 4096
SHARPNESS = 3.0        # weight of a step's likelihood beside the choice of a way
LEARNING_RATE = 1e-3
SIDEWAYS = ('y', 'vy', 'ahead_y', 'behind_y')       # inputs that change sign in a mirror


def watch(names, count, seed, workers=1):
    """
    Watch `count` crowds of the scenarios called `names`, on `workers` processes.

    Returns inputs (S, INPUTS) and what followed (S, H, 2): the offset in metres from keeping the
    velocity, in each agent's own frame. The same seed gives the same, whatever the workers.
    """
    jobs = [(names, min(CHUNK, count - start), (seed, start)) for start in range(0, count, CHUNK)]
    parts = [None] * len(jobs)
    done = work_off(_watch_chunk, jobs, workers) if workers > 1 else enumerate(
        map(_watch_chunk, jobs))
    with tqdm(total=count, desc='watching crowds', unit='crowd') as bar:
        for number, part in done:
            parts[number] = part
            bar.update(jobs[number][1])
    return tuple(np.concatenate(arrays) for arrays in zip(*parts))


def _watch_chunk(job):
    names, count, seed = job
    rng = np.random.default_rng(seed)
    scenarios = [load_scenario(name) for name in names]

    def fresh():
        return int(rng.integers(2 ** 40, 2 ** 62))

    def draw(world):
        return draw_episode(world, CASES[rng.integers(len(CASES))], fresh())
    parts = [_moments(draw_with_room(scenarios[rng.integers(len(scenarios))], fresh, draw), rng)
             for _ in range(count)]
    return tuple(np.concatenate(arrays) for arrays in zip(*parts))


def _moments(episode, rng):
    """Return the inputs and offsets of some moments of one crowd, of those who walk."""
    crowd = Crowd(episode, TIME_STEP)
    positions = [crowd.position.copy()]
    for _ in range(STEPS):
        # A visible robot would be part of the crowd: this one stands far away.
        positions.append(crowd.step((1e4, 1e4), (0.0, 0.0)).position)
    position = np.stack(positions, axis=1)                                       # (N, T, 2)
    walks = episode.speed > 0.0
    when = np.sort(rng.choice(STEPS - motion.STEPS, MOMENTS, replace=False))
    ago = when[:, None] - np.arange(1, motion.HISTORY + 1)
    visible = (ago >= 0)[:, None] & (
        np.arange(motion.HISTORY) < _known(rng, (MOMENTS, len(walks)))[..., None])
    trail = np.where(visible[..., None], position[:, np.maximum(ago, 0)].swapaxes(0, 1), np.nan)
    now = position[:, when].swapaxes(0, 1)
    velocity = (now - position[:, np.maximum(when - 1, 0)].swapaxes(0, 1)) / TIME_STEP
    radius = np.broadcast_to(episode.radius, now.shape[:2])
    agents = Agents(now, velocity, radius, np.ones(radius.shape, dtype=bool), trail)
    seen = motion.look(agents, episode.scenario.field, TIME_STEP)
    foreseen = motion.constant_velocity(agents, motion.STEPS, TIME_STEP).position[:, :, 0]
    after = position[:, when[:, None] + np.arange(1, motion.STEPS + 1)].swapaxes(0, 1)
    offset = rotate(after - foreseen, -seen.heading[..., None])
    return seen.inputs[:, walks].reshape(-1, motion.INPUTS), offset[:, walks].reshape(
        -1, motion.STEPS, 2).astype(np.float32)


def _known(rng, shape):
    """Return for how many steps (shape) each agent is shown to have been in sight."""
    chance = rng.random(shape)
    known = np.full(shape, motion.HISTORY)
    known = np.where(chance < NEWCOMERS + LATECOMERS, rng.integers(0, STEPS, shape), known)
    return np.where(chance < NEWCOMERS, rng.integers(0, motion.PAST, shape), known)


def reflection():
    """
    Return the columns (INPUTS,) and signs (INPUTS,) that reflect inputs left to right.

    People have no preferred side: a state and its mirror image are as likely.
    """
    names = ([*motion.OWN] + ['x', 'y'] * len(motion.LAGS) + [*motion.HAUNTS]
             + ['ray'] * motion.RAYS + [*motion.NEIGHBOUR] * motion.NEIGHBOURS)
    sign = np.array([-1.0 if name in SIDEWAYS else 1.0 for name in names], dtype=np.float32)
    order = np.arange(len(names))
    first = names.index('ray') + 1
    order[first:first + motion.RAYS - 1] = order[first:first + motion.RAYS - 1][::-1].copy()
    return order, sign


def negative_log_likelihood(outputs, offsets):
    """Return the mean loss of `outputs` (S, OUTPUTS) given what followed, `offsets` (S, H, 2)."""
    chance = torch.log_softmax(outputs[:, :motion.MODES], dim=-1)
    ways = outputs[:, motion.MODES:].reshape(-1, motion.MODES, motion.STEPS, 3)
    log_spread = ways[..., 2].clamp(*motion.LOG_SPREAD)
    miss = ((offsets[:, None] - ways[..., :2]) ** 2).sum(dim=-1)
    likelihood = (-0.5 * miss * torch.exp(-2.0 * log_spread) - 2.0 * log_spread
                  - math.log(2.0 * math.pi)).mean(dim=-1)
    return -torch.logsumexp(chance + SHARPNESS * likelihood, dim=-1).mean()


def fit(inputs, offsets, epochs, seed, device='cpu'):
    """Return the torch network fitted to `inputs` and `offsets`, and its last epoch's loss."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    network = mlp(motion.INPUTS, [*SIZES, motion.OUTPUTS]).to(device)
    inputs, offsets = (torch.from_numpy(part).to(device) for part in (inputs, offsets))
    order, sign = (torch.from_numpy(part).to(device) for part in reflection())
    across = torch.tensor([1.0, -1.0], device=device)
    optimizer = torch.optim.Adam(network.parameters(), LEARNING_RATE)
    batches = max(1, len(inputs) // BATCH)
    decay = torch.optim.lr_scheduler.CosineAnnealingLR(
        optimizer, epochs * batches, 0.02 * LEARNING_RATE)
    bar = tqdm(range(epochs), desc='fitting', unit='epoch')
    for _ in bar:
        losses = []
        for number, rows in enumerate(np.array_split(rng.permutation(len(inputs)), batches)):
            rows = torch.from_numpy(rows).to(device)
            seen, followed = inputs[rows], offsets[rows]
            if number % 2:
                seen, followed = seen[:, order] * sign, followed * across
            loss = negative_log_likelihood(network(seen), followed)
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
            decay.step()
            losses.append(loss.detach())
        mean = float(torch.stack(losses).mean())
        if not np.isfinite(mean):
            raise TrainingDiverged('the loss is no longer a number: lower LEARNING_RATE')
        bar.set_postfix(loss=f'{mean:.3f}')
    return network.cpu(), mean


def train_motion(names, crowds, epochs, seed, workers=1, device='cpu'):
    """Return the MotionModel learnt from `crowds` crowds of the scenarios called `names`."""
    for name in names:
        load_scenario(name)            # a name that is none should not cost any watching
    unseen = watch(names, max(1, crowds // 10), seed + 1, workers)
    inputs, offsets = watch(names, crowds, seed, workers)
    network, loss = fit(inputs, offsets, epochs, seed, device)
    linear = [layer for layer in network if isinstance(layer, torch.nn.Linear)]
    layers = [(layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy().copy())
              for layer in linear]
    model = motion.MotionModel(layers, {})
    return motion.MotionModel(layers, {
        'scenarios': list(names), 'crowds': crowds, 'states': len(inputs), 'epochs': epochs,
        'seed': seed, 'loss': loss, 'commit': commit(), 'unseen': errors(model, *unseen)})


def errors(model, inputs, offsets):
    """
    Return how far a MotionModel is off at its last step, in metres, root mean square.

    likeliest: its likeliest way; best: the best of its ways; constant_velocity: the paper's.
    """
    chance, ways, _ = motion.read(model.outputs(inputs))
    miss = ((offsets[:, None] - ways) ** 2).sum(axis=-1)[..., -1]
    likeliest = miss[np.arange(len(miss)), chance.argmax(axis=-1)]
    kept = (offsets[:, -1] ** 2).sum(axis=-1)
    return {name: round(float(np.sqrt(square.mean())), 4) for name, square in (
        ('likeliest', likeliest), ('best', miss.min(axis=-1)), ('constant_velocity', kept))}
