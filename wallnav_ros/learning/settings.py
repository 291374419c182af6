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
Training settings: what a configuration file may say, checked before any work starts.

Paper section 6 (Table 1, algorithm 1); docs/learning.md explains every departure from it.
"""

from dataclasses import dataclass, field, fields
import math
import reprlib

from wallnav_ros.learning.ablation import ABLATIONS
from wallnav_ros.learning.kinds import KINDS
from wallnav_ros.learning.networks import SIZES
from wallnav_ros.policy.rewards import REWARDS
from wallnav_ros.policy.value_function import expected_sizes, FARTHEST, sizes_fit
import yaml


MOST = 10 ** 9         # of anything that is counted
WORDS = {int: 'a whole number', float: 'a number', str: 'text', tuple: 'a list',
         dict: 'a mapping'}


class SettingsError(ValueError):
    """A configuration that cannot be used; one line naming file, field and fix."""


@dataclass(frozen=True)
class TrainSettings:
    """One training run; every field may be set in the YAML file."""

    name: str = 'wallnav'
    # Everything random follows from this.
    seed: int = 0
    # Scenarios to draw episodes from, and how often each of them and each case comes up.
    scenarios: dict = field(default_factory=lambda: {'curve_path': 2, 'cross_path': 2,
                                                     'family': 3})
    cases: dict = field(default_factory=lambda: {'none': 1, 'static': 2, 'dynamic': 4,
                                                 'mixed': 3})
    # Share of episodes that keep the scenario's robot; the rest draw from the ranges below.
    own_robot: float = 0.5
    radius: tuple = (0.15, 0.35)
    preferred_speed: tuple = (0.3, 1.0)
    reward: str = 'R4'
    time_step: float = 0.25
    discount: float = 0.9
    max_turn_rate: float = 1.8
    # Steps ahead at which training decides (one of them, drawn each round), and at which the
    # shipped policy decides (the mean of all of them).
    horizons: tuple = (2, 4, 6)
    decision_horizons: tuple = (2, 4, 6)
    # Steps for which a way may turn before it keeps its heading; the best of them counts.
    turns: tuple = (1,)
    # Seconds: how widely the policy passes walking agents, per m/s of their speed.
    caution: float = 0.15
    # A model, by file or short name, of where people go (train_motion); none: they keep their
    # velocity. And what a contact it foresees costs, times its chance.
    motion: str = ''
    aversion: float = 0.0
    # lambda of the returns: 1 pays what really happened, 0 what the network expects.
    trace: float = 0.9
    # The kind of network, one of learning.kinds, its layer widths, and what is taken out of it
    # to see what that is worth: walls, attention.
    kind: str = 'three_mlp'
    without: tuple = ()
    network: dict = field(default_factory=lambda: dict(SIZES))
    imitation_episodes: int = 1000
    imitation_updates: int = 2000
    episodes: int = 8000
    # Episodes run side by side between two rounds of updates, and the updates of a round.
    parallel: int = 32
    updates: int = 150
    batch_size: int = 256
    learning_rate: float = 1e-3
    final_learning_rate: float = 1e-4
    memory: int = 80000
    epsilon_start: float = 0.3
    epsilon_end: float = 0.03
    epsilon_episodes: int = 2000
    # The target network follows the trained one by 1 - this much per update; it also acts,
    # is evaluated and is what gets exported.
    target_average: float = 0.995
    evaluate_every: int = 1000
    evaluation_episodes: int = 40
    evaluation_seed: int = 1000000


def load_settings(path, changes=()):
    """
    Read TrainSettings from a YAML file; SettingsError names file, field and fix.

    changes: texts KEY=VALUE, the value in YAML, which replace what the file says.
    """
    try:
        with open(path) as stream:
            document = yaml.safe_load(stream) or {}
    except OSError as error:
        raise SettingsError(f'{path}: {error.strerror}: give an existing YAML file') from None
    # ValueError: not UTF-8, or a date such as 2026-13-01; RecursionError: nested too deeply.
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise SettingsError(f'{path}: not valid YAML: {" ".join(str(error).split())}') from None
    if not isinstance(document, dict):
        raise SettingsError(f'{path}: expected a mapping of settings')
    for change in changes:
        key, sign, value = change.partition('=')
        if not sign:
            raise SettingsError(f'--set {change}: expected KEY=VALUE')
        try:
            document[key] = yaml.safe_load(value)
        except (yaml.YAMLError, ValueError, RecursionError):
            raise SettingsError(f'--set {change}: the value is not valid YAML') from None
    known = {entry.name: entry.type for entry in fields(TrainSettings)}
    values = {}
    for key, value in document.items():
        if key not in known:
            raise SettingsError(f'{path}: {key}: unknown; known are {", ".join(known)}')
        values[key] = _converted(path, key, value, known[key])
    kind = values.get('kind', TrainSettings.kind)
    if kind not in KINDS:
        raise SettingsError(f'{path}: kind: expected one of {", ".join(KINDS)}, got {kind!r}')
    settings = TrainSettings(**{'network': dict(KINDS[kind].sizes), **values})
    for key, holds, expected in _expectations(settings):
        if not holds:
            raise SettingsError(f'{path}: {key}: expected {expected}, '
                                f'got {reprlib.repr(getattr(settings, key))}')
    return settings


def _converted(path, key, value, kind):
    if kind is tuple and isinstance(value, list):
        return tuple(value)
    if kind is float and type(value) is int:
        # More than a float holds is refused as infinity is.
        return float(value) if _number(value) else math.inf
    if type(value) is kind:
        return value
    raise SettingsError(f'{path}: {key}: expected {WORDS[kind]}, got {reprlib.repr(value)}')


def _expectations(settings):
    """Yield (key, whether it holds, what is expected) of every setting."""
    yield 'name', settings.name and '/' not in settings.name, 'a file name without folders'
    for key in ('scenarios', 'cases'):
        value = getattr(settings, key)
        yield key, all(type(name) is str and _number(weight) and weight >= 0.0
                       for name, weight in value.items()) and any(value.values()), (
            '{name: weight}, weights 0 or more and not all 0')
    for key in ('radius', 'preferred_speed'):
        value = getattr(settings, key)
        yield key, len(value) == 2 and all(map(_number, value)) and 0.0 < value[0] <= value[1], (
            '[low, high] with 0 < low <= high')
    yield 'reward', settings.reward in REWARDS, f'one of {", ".join(REWARDS)}'
    for key in ('horizons', 'decision_horizons', 'turns'):
        yield key, _counts(getattr(settings, key)), (
            f'a list of steps, each 1 or more, at most {FARTHEST}')
    yield 'without', all(part in ABLATIONS for part in settings.without) and (
        settings.kind == 'three_mlp' or not settings.without), (
        f'some of {", ".join(ABLATIONS)}, and kind three_mlp')
    yield 'network', sizes_fit(settings.network, KINDS[settings.kind].layers), (
        expected_sizes(KINDS[settings.kind].layers))
    for key in ('time_step', 'max_turn_rate', 'learning_rate', 'final_learning_rate'):
        yield key, 0.0 < getattr(settings, key) < math.inf, 'a number above 0'
    for key in ('parallel', 'updates', 'batch_size', 'memory', 'evaluate_every',
                'evaluation_episodes', 'imitation_updates', 'episodes'):
        yield key, getattr(settings, key) >= 1, 'a whole number above 0'
        yield key, getattr(settings, key) <= MOST, f'at most {MOST}'
    yield 'aversion', 0.0 <= settings.aversion < math.inf, 'a number, 0 or more'
    yield 'caution', 0.0 <= settings.caution < math.inf, 'a number, 0 or more'
    for key in ('seed', 'imitation_episodes', 'epsilon_episodes', 'evaluation_seed'):
        yield key, getattr(settings, key) >= 0, 'a whole number, 0 or more'
    for key in ('own_robot', 'discount', 'trace', 'epsilon_start', 'epsilon_end',
                'target_average'):
        yield key, 0.0 <= getattr(settings, key) <= 1.0, 'a number from 0 to 1'


def _number(value):
    # Compared, not converted: a whole number may be more than a float holds.
    return type(value) in (int, float) and -1e300 < value < 1e300


def _counts(values):
    return len(values) > 0 and all(type(value) is int and 0 < value <= FARTHEST
                                   for value in values)
