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
The simulator as a Gymnasium environment, alone and vectorised.

Paper sections 1 (world, actions), 2 (state) and 5 (rewards); needs the gymnasium package.
"""

import gymnasium
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
import numpy as np

from wallnav_ros.policy import features
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.rewards import reward_terms, REWARDS, total
from wallnav_ros.simulation.batch import EpisodeBatch, OUTCOMES, RUNNING, TIMEOUT
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.picture import draw_scene
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.state import Agents, Robot

ID = 'wallnav_ros/Corridor-v0'
EPISODES = 2 ** 31     # numbers that episodes without a given seed are drawn from
LIMIT = 100.0          # bound of every feature


class _World:
    """What both environments share: spaces, how episodes are drawn and how they are seen."""

    def __init__(self, scenario, case, reward, time_step):
        self.scenario = load_scenario(scenario)
        self.cases = list(self.scenario.cases) if case == 'all' else [case]
        for name in self.cases:
            self.scenario.counts(name)
        if reward not in REWARDS:
            raise ValueError(f'unknown reward {reward!r}, choose one of {", ".join(REWARDS)}')
        self.reward = reward
        self.time_step = time_step
        self.actions = make_actions()
        # One width for every case, so that a policy trained on one may be tried on another.
        self.room = max(1, *(sum(self.scenario.counts(name)) for name in self.scenario.cases))
        self.action_space = spaces.Discrete(len(self.actions.speed))

        def box(*shape):
            return spaces.Box(-LIMIT, LIMIT, shape, np.float32)

        self.observation_space = spaces.Dict({
            'robot': box(len(features.ROBOT)), 'walls': box(features.WALL_RAYS),
            'agents': box(self.room, len(features.AGENT)),
            'present': spaces.MultiBinary(self.room)})

    def draw(self, rng, seed):
        """Return episode `seed`, or where that is None the next that `rng` gives."""
        case = self.cases[int(rng.integers(len(self.cases)))]
        number = int(rng.integers(EPISODES)) if seed is None else seed
        return draw_episode(self.scenario, case, number)

    def begin(self, episodes):
        """Return an EpisodeBatch of `episodes`."""
        return EpisodeBatch(episodes, self.time_step, self.room)

    def observe(self, batch):
        """Return the observation of every row, with leading axis (B,)."""
        every = np.arange(len(batch.episodes))
        seen = {name: np.zeros((len(every), *space.shape), space.dtype)
                for name, space in self.observation_space.items()}
        for rows, field in batch.groups(every):
            agents = batch.agents(rows)
            state = features.extract(batch.guided(rows), agents,
                                     features.agent_clearance(agents, field), field)
            for name in seen:
                seen[name][rows] = getattr(state, name)
        return seen

    def step(self, batch, actions):
        """Drive every row by its action; returns the named reward terms, each (B,)."""
        every = np.arange(len(batch.episodes))
        commands = self.actions.commands(batch.robot(every).preferred_speed)
        return reward_terms(self.reward, batch.step(commands[every, actions]))


class CorridorEnv(gymnasium.Env):
    """
    One robot crosses a scenario among its crowd.

    scenario: file or short name. case: one of its cases, or `all` to draw one each episode.
    reward: R1 to R4. time_step: s. An action is an index into `policy.actions`; an observation
    is that of `policy.features`. `reset(seed=n)` begins the very episode n of `evaluate`.
    Raises ScenarioError, FileNotFoundError or ValueError on what does not exist.
    """

    metadata = {'render_modes': ['rgb_array'], 'render_fps': 4}

    def __init__(self, scenario='cross_path', case='mixed', reward='R4', time_step=0.25,
                 render_mode=None):
        self._world = _World(scenario, case, reward, time_step)
        self.observation_space = self._world.observation_space
        self.action_space = self._world.action_space
        self.render_mode = render_mode
        self._batch = None

    def reset(self, *, seed=None, options=None):
        """Begin an episode: number `seed`, or one drawn from the environment's own randomness."""
        super().reset(seed=seed)
        self._batch = self._world.begin([self._world.draw(self.np_random, seed)])
        return self._observation(), _facts(self._batch, 0)

    def step(self, action):
        """Drive for one time step; returns observation, reward, terminated, truncated, info."""
        if self._batch is None or self._batch.outcome[0] != RUNNING:
            raise gymnasium.error.ResetNeeded('the episode has ended: call reset() first')
        terms = self._world.step(self._batch, np.array([action]))
        outcome = self._batch.outcome[0]
        info = _facts(self._batch, 0)
        info['reward_terms'] = {name: float(value[0]) for name, value in terms.items()}
        truncated = bool(outcome == TIMEOUT)
        terminated = bool(outcome != RUNNING) and not truncated
        return self._observation(), float(total(terms)[0]), terminated, truncated, info

    def render(self):
        """Return the scene as an (H, W, 3) RGB image, or None without a render mode."""
        if self.render_mode is None or self._batch is None:
            return None
        row = np.array([0])
        robot, agents = self._batch.robot(row), self._batch.agents(row)
        return draw_scene(self._batch.episodes[0].scenario.walls,
                          Robot(*(part[0] for part in vars(robot).values())),
                          Agents(*(part[0] for part in vars(agents).values())))

    def _observation(self):
        return {name: part[0] for name, part in self._world.observe(self._batch).items()}


class CorridorVectorEnv(VectorEnv):
    """
    Many robots, each in an episode of its own, stepped side by side.

    As that many CorridorEnv; one that has ended begins its next episode in the following step
    (Gymnasium's NEXT_STEP). `reset(seed=n)` begins episodes n, n + 1, and so on.
    """

    metadata = {'autoreset_mode': AutoresetMode.NEXT_STEP, 'render_modes': []}

    def __init__(self, num_envs=1, scenario='cross_path', case='mixed', reward='R4',
                 time_step=0.25):
        self._world = _World(scenario, case, reward, time_step)
        self.num_envs = num_envs
        self.single_observation_space = self._world.observation_space
        self.single_action_space = self._world.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rngs = [None] * num_envs
        self._batch = None

    def reset(self, *, seed=None, options=None):
        """Begin an episode in every row; `seed` may be a number or one per row."""
        if seed is None or isinstance(seed, (int, np.integer)):
            seed = [None if seed is None else int(seed) + row for row in range(self.num_envs)]
        for row, number in enumerate(seed):
            if number is not None or self._rngs[row] is None:
                self._rngs[row], _ = seeding.np_random(number)
        self._batch = self._world.begin(
            [self._world.draw(rng, number) for rng, number in zip(self._rngs, seed)])
        return self._world.observe(self._batch), self._infos({})

    def step(self, actions):
        """Drive every row for one time step; rows that ended begin anew and are paid nothing."""
        batch = self._batch
        if batch is None:
            raise gymnasium.error.ResetNeeded('no episode has begun: call reset() first')
        ended = batch.outcome != RUNNING
        terms = self._world.step(batch, np.asarray(actions))
        for row in np.flatnonzero(ended):
            batch.restart(row, self._world.draw(self._rngs[row], None))
        terms = {name: np.where(ended, 0.0, value) for name, value in terms.items()}
        outcome = batch.outcome
        return (self._world.observe(batch), total(terms),
                (outcome != RUNNING) & (outcome != TIMEOUT), outcome == TIMEOUT,
                self._infos({'reward_terms': {**terms, **{f'_{name}': ~ended for name in terms}},
                             '_reward_terms': ~ended}))

    def _infos(self, infos):
        rows = [_facts(self._batch, row) for row in range(self.num_envs)]
        for name, value in rows[0].items():
            kind = object if isinstance(value, str) else type(value)
            infos[name] = np.array([row[name] for row in rows], dtype=kind)
            infos[f'_{name}'] = np.ones(self.num_envs, dtype=bool)
        return infos


def _facts(batch, row):
    """Return the info of one row that does not depend on the reward."""
    episode = batch.episodes[row]
    return {'case': episode.case, 'seed': episode.seed, 'outcome': OUTCOMES[batch.outcome[row]],
            **{name: float(getattr(batch, name)[row])
               for name in ('time', 'path_length', 'min_gap_agent', 'min_gap_wall')}}


gymnasium.register(
    ID, entry_point='wallnav_ros.simulation.environment:CorridorEnv',
    vector_entry_point='wallnav_ros.simulation.environment:CorridorVectorEnv')
