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
Where each agent may be in the next 2.5 s: a few likely ways, each with its spread.

A mixture of trajectories from a small network, in the manner of Chai et al. ("MultiPath",
2019); it sees what a robot can see: how an agent has moved, its neighbours and the walls.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr
from wallnav_ros.world.geometry import rotate

VERSION = 2            # raised when an input changes meaning: older weights are then refused
MODES = 5              # ways an agent may go on
STEPS = 10             # time steps that are foreseen
PAST = 17              # time steps that a motion is looked back at
HISTORY = 160          # time steps that places are remembered for: people walk to and fro
LAGS = np.array([0, 1, 2, 3, 4, 6, 8, 12, 16])   # steps ago that a velocity is looked at
RAYS = 12              # wall distances around an agent, the first along its motion
RANGE = 5.0            # m, of rays and of neighbours
RAY_STEPS = 5          # sphere-tracing steps
NEIGHBOURS = 5         # the nearest so many count
WALKING = 0.15         # m/s, above which motion has a direction
UNKNOWN_SPEED = 0.7    # m/s along each axis: people of 0.3 to 1.5 m/s, root mean square
UNKNOWN_STAYS = 0.5    # chance that one who is new and stands will stay
LOG_SPREAD = (-4.6, 1.0)   # bounds of ln(metres)
FARTHEST = 8.0         # standard deviations, beyond which nothing is touched: 1 in 10 ** 15
LEAST_SPREAD = 0.05    # m, however sure the network is: positions are measured
OWN = ('speed', 'top_speed', 'known', 'radius')
HAUNTS = ('ahead_x', 'ahead_y', 'ahead_ago', 'behind_x', 'behind_y', 'behind_ago', 'seen')
NEIGHBOUR = ('x', 'y', 'vx', 'vy', 'reach', 'cpa_time', 'cpa_gap', 'is_there')
INPUTS = len(OWN) + 2 * len(LAGS) + len(HAUNTS) + RAYS + len(NEIGHBOUR) * NEIGHBOURS
OUTPUTS = MODES * (1 + 3 * STEPS)


@dataclass(frozen=True)
class Forecast:
    """
    Where agents (..., N) will be, in the state frame.

    chance: (..., N, K), of each way, summing to 1. position: (..., N, K, H, 2) metres at the
    end of each step. spread: (..., N, K, H) metres, standard deviation along each axis; 0 where
    a position is taken for certain.
    """

    chance: np.ndarray
    position: np.ndarray
    spread: np.ndarray

    def hit(self, gap):
        """Return the chance (..., H, N, A) of contact from gaps (..., H, N, K, A) in metres."""
        spread = np.moveaxis(self.spread, -1, -3)[..., None].astype(gap.dtype)
        short = gap / -np.maximum(spread, LEAST_SPREAD)
        # Most are too far off to be touched: to look for the others takes half the time.
        near = short > -FARTHEST
        touches = np.zeros(short.shape, short.dtype)
        touches[near] = ndtr(short[near])
        touches = np.where(spread > 0.0, touches, gap <= 0.0)
        return np.einsum('...ka,...k->...a', touches,
                         self.chance[..., None, :, :].astype(gap.dtype))


def constant_velocity(agents, steps, time_step):
    """Return the Forecast that everyone keeps their velocity: the paper's prediction."""
    ahead = time_step * np.arange(1, steps + 1)[:, None]
    position = agents.position[..., None, None, :] + ahead * agents.velocity[..., None, None, :]
    return Forecast(np.ones(agents.radius.shape + (1,)), position, np.zeros(position.shape[:-1]))


@dataclass(frozen=True)
class MotionModel:
    """
    A trained network and what it was trained with.

    layers: a list of (weight (inputs, outputs), bias), ReLU between. training: for people.
    """

    layers: list
    training: dict

    def forecast(self, agents, walls, steps, time_step):
        """
        Return the Forecast of Agents (B, N) among `walls`, their DistanceField.

        Who has not been seen to walk is foreseen to stay; beyond STEPS everyone keeps the
        velocity of their last step.
        """
        seen = look(agents, walls, time_step)
        chance, offset, spread = read(self.outputs(seen.inputs))
        walks = seen.walks[..., None, None]
        ahead = time_step * np.arange(1, STEPS + 1)
        unknown = (~seen.walks & ~seen.known & agents.present)[..., None, None]
        offset = rotate(offset, seen.heading[..., None, None])
        certain = constant_velocity(agents, STEPS, time_step)
        position = certain.position + np.where(walks[..., None], offset, 0.0)
        spread = np.where(walks, spread, 0.0)
        # Nobody knows where somebody goes who has only just come into sight, if anywhere.
        spread[..., 1:, :] = np.where(unknown, UNKNOWN_SPEED * ahead, spread[..., 1:, :])
        stays = np.full(MODES, (1.0 - UNKNOWN_STAYS) / (MODES - 1))
        stays[0] = UNKNOWN_STAYS
        chance = np.where(unknown[..., 0], stays, chance)
        if steps > STEPS:
            last = position[..., -1:, :] - position[..., -2:-1, :]
            further = np.arange(1, steps - STEPS + 1)[:, None]
            position = np.concatenate((position, position[..., -1:, :] + further * last), axis=-2)
            spread = np.concatenate((spread, np.repeat(spread[..., -1:], steps - STEPS, -1)), -1)
        return Forecast(chance, position[..., :steps, :], spread[..., :steps])

    def outputs(self, x):
        """Return (..., OUTPUTS) that `read` understands for inputs (..., INPUTS)."""
        for number, (weight, bias) in enumerate(self.layers):
            x = x @ weight + bias
            if number < len(self.layers) - 1:
                np.maximum(x, 0.0, out=x)
        return x


@dataclass(frozen=True)
class Sight:
    """
    What the network sees of agents (B, N).

    inputs: (B, N, INPUTS), each in the agent's own frame. heading: (B, N) rad, of its motion,
    the x axis of that frame. walks: (B, N) bool, whether it has been seen to. known: (B, N)
    bool, whether it was in sight a step ago.
    """

    inputs: np.ndarray
    heading: np.ndarray
    walks: np.ndarray
    known: np.ndarray


def look(agents, walls, time_step):
    """Return the Sight of Agents (B, N) with their trails, among `walls`."""
    velocity, known = _velocities(agents, time_step)
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    walking = speed > WALKING
    walks = walking.any(axis=-1) & agents.present
    latest = np.take_along_axis(velocity, walking.argmax(axis=-1)[..., None, None], axis=2)
    heading = np.where(walks, np.arctan2(latest[:, :, 0, 1], latest[:, :, 0, 0]), 0.0)
    own = np.stack((speed[..., 0], speed.max(axis=-1), known.sum(axis=-1) / PAST,
                    agents.radius), axis=-1)
    trail = rotate(velocity[:, :, LAGS], -heading[..., None])
    rays = heading[..., None] + 2.0 * np.pi / RAYS * np.arange(RAYS)
    reach = walls.raycast(agents.position[..., None, :], rays, RANGE, RAY_STEPS) / RANGE
    beside = _neighbours(agents, velocity[:, :, 0], heading)
    flat = agents.radius.shape + (-1,)
    inputs = np.concatenate((own, trail.reshape(flat), _haunts(agents, heading, time_step), reach,
                             beside.reshape(flat)), axis=-1)
    return Sight(inputs.astype(np.float32), heading, walks, known[..., 0])


def read(outputs):
    """
    Return what the network's `outputs` (..., OUTPUTS) say.

    chance (..., K); offset (..., K, H, 2) metres from keeping the velocity, in the agent's own
    frame; spread (..., K, H) metres.
    """
    chance = np.exp(outputs[..., :MODES] - outputs[..., :MODES].max(axis=-1, keepdims=True))
    chance /= chance.sum(axis=-1, keepdims=True)
    ways = outputs[..., MODES:].reshape(outputs.shape[:-1] + (MODES, STEPS, 3))
    return chance, ways[..., :2], np.exp(np.clip(ways[..., 2], *LOG_SPREAD))


def _velocities(agents, time_step):
    """Return velocities (B, N, PAST, 2), latest first and 0 where unknown, and which are known."""
    trail = agents.trail[:, :, :PAST]
    lack = PAST - trail.shape[2]
    if lack:
        trail = np.concatenate((trail, np.full(trail.shape[:2] + (lack, 2), np.nan)), axis=2)
    before = np.concatenate((agents.position[:, :, None], trail[:, :, :-1]), axis=2)
    velocity = (before - trail) / time_step
    known = np.isfinite(velocity).all(axis=-1)
    velocity[~known] = 0.0
    # What is measured now counts more than what it is to be derived from.
    velocity[:, :, 0] = agents.velocity
    return velocity, known


def _haunts(agents, heading, time_step):
    """
    Return (B, N, 7): the places farthest ahead and behind where each agent has been.

    Whoever walks to and fro turns where they turned before, or where they set out. In metres / 5
    in the agent's own frame, with the seconds / 10 since then; last, those it has been seen for.
    """
    length = min(agents.trail.shape[2], HISTORY)
    trail = np.concatenate((agents.position[:, :, None], agents.trail[:, :, :length]), axis=2)
    offset = trail - agents.position[:, :, None]
    along = (offset[..., 0] * np.cos(heading)[..., None]
             + offset[..., 1] * np.sin(heading)[..., None])
    known = np.isfinite(along)
    rows = []
    for sign in (1.0, -1.0):
        index = np.where(known, sign * along, -np.inf).argmax(axis=-1)
        place = np.take_along_axis(offset, index[..., None, None], axis=2)[:, :, 0]
        place = np.clip(rotate(place, -heading) / RANGE, -2.0, 2.0)
        rows += [place, index[..., None] * (time_step / 10.0)]
    seen = (known.sum(axis=-1) - 1)[..., None] * (time_step / 10.0)
    return np.concatenate([*rows, seen], axis=-1)


def _neighbours(agents, velocity, heading):
    """Return the rows (B, N, NEIGHBOURS, 8) of those nearest to each agent, 0 where nobody is."""
    turn = -heading[..., None]
    offset = rotate(agents.position[:, None] - agents.position[:, :, None], turn)
    theirs = rotate(np.broadcast_to(velocity[:, None], offset.shape), turn)
    relative = theirs - rotate(velocity, -heading)[:, :, None]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    reach = agents.radius[:, None] + agents.radius[:, :, None]
    time = np.clip(-(offset * relative).sum(axis=-1)
                   / np.maximum((relative ** 2).sum(axis=-1), 1e-6), 0.0, 5.0)
    miss = offset + time[..., None] * relative
    others = agents.present[:, None] & ~np.eye(agents.radius.shape[1], dtype=bool)
    near = np.where(others, distance - reach, np.inf)
    rows = np.stack((offset[..., 0] / RANGE, offset[..., 1] / RANGE, theirs[..., 0],
                     theirs[..., 1], reach, time / 5.0,
                     np.clip(np.hypot(miss[..., 0], miss[..., 1]) - reach, -1.0, 2.0),
                     np.ones_like(distance)), axis=-1)
    rows = np.where((near < RANGE)[..., None], rows, 0.0)
    count = min(NEIGHBOURS, rows.shape[2])
    nearest = np.argsort(near, axis=-1, kind='stable')[..., :count]
    rows = np.take_along_axis(rows, nearest[..., None], axis=2)
    padding = np.zeros(rows.shape[:2] + (NEIGHBOURS - count, len(NEIGHBOUR)))
    return np.concatenate((rows, padding), axis=2)
