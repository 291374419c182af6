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
Train the value network: imitation of ORCA, then epsilon-greedy value learning.

Paper algorithm 1; the loop reads from top to bottom.
"""

import copy
import csv
from dataclasses import asdict
import json
from pathlib import Path
import time

import numpy as np
import torch
from tqdm import tqdm

from wallnav_ros.learning.ablation import ablate
from wallnav_ros.learning.checkpoints import (
    CheckpointError, FILE, load_checkpoint, save_checkpoint)
from wallnav_ros.learning.experience import Demonstrator, Explorer, gather
from wallnav_ros.learning.export import export_weights
from wallnav_ros.learning.kinds import KINDS
from wallnav_ros.learning.memory import ReplayMemory
from wallnav_ros.learning.networks import NetworkValue
from wallnav_ros.learning.report import draw_curves, write_card
from wallnav_ros.learning.settings import SettingsError
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.lookahead import MOST_AGENTS
from wallnav_ros.policy.motion_weights import load_motion
from wallnav_ros.policy.outcomes import Rule
from wallnav_ros.simulation.batch import OUTCOMES
from wallnav_ros.simulation.episodes import draw_episode, draw_with_room
from wallnav_ros.simulation.orca import OrcaPolicy
from wallnav_ros.simulation.rollout import run_episodes
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.files import atomic_write, find_asset

CHECKPOINT_SECONDS = 45.0
WORLD_SHARE = 4        # episodes that share a world, because decisions in one world batch well


class TrainingDiverged(RuntimeError):
    """The loss is no longer a number."""


class Trainer:
    """One training run in the folder `out`; `run` starts or, with a checkpoint there, resumes."""

    def __init__(self, settings, out, device='cpu'):
        self.settings = settings
        self.out = Path(out)
        self.device = torch.device(device)
        self.scenarios = {name: load_scenario(name) for name in settings.scenarios}
        self._check_crowds()
        self.motion = (load_motion(find_asset('models', settings.motion, '.npz'))
                       if settings.motion else None)
        self.actions = make_actions(settings.max_turn_rate)
        self.rng = np.random.default_rng(settings.seed)
        torch.manual_seed(settings.seed)
        kind = KINDS[settings.kind]
        self.sight = kind.sight
        self.network = kind.build(settings.network).to(self.device)
        ablate(self.network, settings.without)
        self.target = copy.deepcopy(self.network)
        self.optimizer = torch.optim.Adam(self.network.parameters(), settings.learning_rate)
        self.memory = ReplayMemory(settings.memory, self.sight)
        self.counts = {'imitated': 0, 'episodes': 0, 'seconds': 0.0, 'best': -1.0}
        self.rows = {'log': [], 'evaluation': []}
        self._saved = time.monotonic()

    def run(self, resume=False):
        """Train to the end; returns the path of the best exported weights."""
        if resume:
            load_checkpoint(self)
        elif (self.out / FILE).is_file():
            raise CheckpointError(f'{self.out / FILE}: holds an earlier run; go on from it with '
                                  '--resume, or choose another --out')
        self.imitate()
        self.learn()
        if self._evaluated() < self.counts['episodes']:
            self.evaluate()
        self._save()
        return self.out / f'{self.settings.name}.npz'

    def imitate(self):
        """Fill the memory with ORCA demonstrations and fit the network to their returns."""
        settings = self.settings
        actor = Demonstrator(OrcaPolicy(self.actions, settings.time_step))
        bar = tqdm(total=settings.imitation_episodes, initial=self.counts['imitated'],
                   desc='imitation', unit='episode')
        while self.counts['imitated'] < settings.imitation_episodes:
            count = min(settings.parallel, settings.imitation_episodes - self.counts['imitated'])
            states, returns, _ = gather(self._draw(count), actor, self._rule((1,)), 1.0,
                                        self.sight)
            self.memory.add(states, returns)
            self.counts['imitated'] += count
            bar.update(count)
            self._save_when_due()
        bar.close()
        if settings.imitation_episodes and not self.counts['episodes']:
            self._update(settings.imitation_updates)
            self.target.load_state_dict(self.network.state_dict())

    def learn(self):
        """Alternate episodes under the target network with updates; evaluate and checkpoint."""
        settings = self.settings
        bar = tqdm(total=settings.episodes, initial=self.counts['episodes'], desc='learning',
                   unit='episode')
        while self.counts['episodes'] < settings.episodes:
            every = settings.evaluate_every
            if self.counts['episodes'] // every > self._evaluated() // every:
                self._save()
                self.evaluate()
            began = time.monotonic()
            count = min(settings.parallel, settings.episodes - self.counts['episodes'])
            # One horizon a round: the values then hold for every look the policy averages.
            rule = self._rule((int(self.rng.choice(settings.horizons)),))
            lookahead = self.sight.lookahead(NetworkValue(self.target), self.actions, rule,
                                             self.motion)
            explorer = Explorer(lookahead, self._epsilon(), self.rng)
            states, returns, drives = gather(self._draw(count), explorer, rule, settings.trace,
                                             self.sight)
            self.memory.add(states, returns)
            loss = self._update(settings.updates)
            self.counts['episodes'] += count
            self.counts['seconds'] += time.monotonic() - began
            self._log(loss, float(returns.mean()), drives)
            bar.update(count)
            bar.set_postfix(loss=f'{loss:.3f}', goal=f'{self.rows["log"][-1]["goal"]:.0%}')
            self._save_when_due()
        bar.close()

    def evaluate(self):
        """Measure every cell greedily; export the weights, and keep those best at their worst."""
        settings = self.settings
        rule = self._rule(settings.decision_horizons)
        policy = self.sight.policy(
            self.sight.lookahead(NetworkValue(self.target), self.actions, rule, self.motion))
        cells = {}
        for scenario in self.scenarios.values():
            for case in settings.cases:
                episodes = [draw_episode(scenario, case, settings.evaluation_seed + number)
                            for number in range(settings.evaluation_episodes)]
                results = run_episodes(episodes, policy, settings.time_step, settings.reward)
                self._log_cell(scenario.name, case, results)
                cells[f'{scenario.name}/{case}'] = np.mean(
                    [result.outcome == 'goal' for result in results])
        # The mean breaks ties among equally bad worst cells.
        rows = self.rows['evaluation'][-len(cells):]
        score = min(cells.values()) + 0.01 * float(np.mean(list(cells.values())))
        tqdm.write(f'{self.counts["episodes"]} episodes, greedy success: '
                   + ', '.join(f'{name} {rate:.0%}' for name, rate in cells.items()))
        export_weights(self, self.out / 'last.npz')
        if score >= self.counts['best']:
            self.counts['best'] = float(score)
            metadata = export_weights(self, self.out / f'{settings.name}.npz')
            write_card(metadata, rows, self.out / f'{settings.name}.md')
        draw_curves(self.rows, self.out / 'curves.png')
        self._write_logs()

    def _evaluated(self):
        """Return after how many episodes the last evaluation was."""
        return max((row['episodes'] for row in self.rows['evaluation']), default=0)

    def _save_when_due(self):
        if time.monotonic() - self._saved > CHECKPOINT_SECONDS:
            self._save()

    def _save(self):
        save_checkpoint(self)
        self._saved = time.monotonic()

    def _check_crowds(self):
        """Raise SettingsError now rather than when the first such crowd is drawn."""
        for scenario in self.scenarios.values():
            for case in self.settings.cases:
                crowd = sum(scenario.counts(case))
                if crowd > MOST_AGENTS:
                    raise SettingsError(
                        f'{scenario.path}: cases.{case}: {crowd} agents, training holds '
                        f'{MOST_AGENTS}; leave the case out of cases or make it smaller')

    def _draw(self, count):
        """Return `count` episodes of random scenario, case, robot and seed."""
        episodes = []
        while len(episodes) < count:
            share = min(WORLD_SHARE, count - len(episodes))
            source = self._pick(self.scenarios, self.settings.scenarios)
            episodes += draw_with_room(
                source, self._seed, lambda world, share=share: self._draw_in(world, share))
        return episodes

    def _draw_in(self, world, count):
        """Return `count` episodes of random case, robot and seed in one world."""
        settings, episodes = self.settings, []
        for _ in range(count):
            case = self._pick({name: name for name in settings.cases}, settings.cases)
            own = self.rng.random() < settings.own_robot
            radius, speed = self.rng.uniform(*np.transpose(
                [settings.radius, settings.preferred_speed]))
            episodes.append(draw_episode(world, case, self._seed(), None if own else radius,
                                         None if own else speed))
        return episodes

    def _seed(self):
        # Far above any seed that policies are evaluated with.
        return int(self.rng.integers(2 ** 32, 2 ** 62))

    def _pick(self, choices, weights):
        names = list(weights)
        weight = np.array([weights[name] for name in names], dtype=float)
        return choices[names[self.rng.choice(len(names), p=weight / weight.sum())]]

    def _update(self, count):
        """Fit the network to `count` batches from memory; returns the mean loss."""
        settings, losses = self.settings, []
        for group in self.optimizer.param_groups:
            group['lr'] = self._learning_rate()
        for _ in range(count):
            sample = self.memory.sample(self.rng, settings.batch_size)
            own, agents, present, target = (torch.from_numpy(part).to(self.device)
                                            for part in sample)
            loss = torch.nn.functional.mse_loss(self.network(own, agents, present), target)
            self.optimizer.zero_grad(set_to_none=True)
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self.network.parameters(), 10.0)
            self.optimizer.step()
            with torch.no_grad():
                for slow, fast in zip(self.target.parameters(), self.network.parameters()):
                    slow.lerp_(fast, 1.0 - settings.target_average)
            losses.append(loss.detach())
        mean = float(torch.stack(losses).mean())
        if not np.isfinite(mean):
            raise TrainingDiverged(
                f'the loss became {mean} after {self.counts["episodes"]} episodes: lower '
                'learning_rate, or resume from the checkpoint with another seed')
        return mean

    def _rule(self, horizons):
        settings = self.settings
        return Rule(tuple(horizons), settings.time_step, settings.discount, settings.reward,
                    settings.caution, settings.aversion, tuple(settings.turns))

    def _epsilon(self):
        settings = self.settings
        done = min(1.0, self.counts['episodes'] / max(1, settings.epsilon_episodes))
        return settings.epsilon_start + done * (settings.epsilon_end - settings.epsilon_start)

    def _learning_rate(self):
        settings = self.settings
        done = self.counts['episodes'] / max(1, settings.episodes)
        return settings.learning_rate * (
            settings.final_learning_rate / settings.learning_rate) ** done

    def _log(self, loss, mean_return, drives):
        self.rows['log'].append({
            'episodes': self.counts['episodes'], 'seconds': round(self.counts['seconds'], 1),
            'loss': loss, 'epsilon': round(self._epsilon(), 4), 'mean_return': mean_return,
            **_means(drives)})

    def _log_cell(self, scenario, case, results):
        self.rows['evaluation'].append({'episodes': self.counts['episodes'], 'scenario': scenario,
                                        'case': case, **_means(results)})

    def _write_logs(self):
        for name, rows in self.rows.items():
            if rows:
                with atomic_write(self.out / f'{name}.csv', newline='') as stream:
                    # The last row: a run resumed from an older version has fewer columns above.
                    writer = csv.DictWriter(stream, rows[-1])
                    writer.writeheader()
                    writer.writerows(rows)
        with atomic_write(self.out / 'settings.json') as stream:
            json.dump(asdict(self.settings), stream, indent=2)


def _means(drives):
    """Return the metrics of section 7, each the mean of `drives` (Drive or EpisodeResult)."""
    columns = {name: [drive.outcome == name for drive in drives] for name in OUTCOMES[1:]}
    columns['time'] = [drive.time for drive in drives]
    columns['path_length'] = [drive.path_length for drive in drives]
    columns['total_reward'] = [sum(drive.terms.values()) for drive in drives]
    columns.update({name: [drive.terms[name] for drive in drives] for name in drives[0].terms})
    return {name: float(np.mean(values)) for name, values in columns.items()}
