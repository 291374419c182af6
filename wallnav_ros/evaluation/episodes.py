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
Evaluate a policy over seeds and cells, on any number of worker processes.

Paper section 7; the same seed gives the same results, whatever the number of workers.
"""

from dataclasses import dataclass
import os

from tqdm import tqdm

from wallnav_ros.evaluation.baselines import is_baseline, load_baseline
from wallnav_ros.evaluation.worker_pool import work_off
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.value_function import load_value_function
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.orca import OrcaPolicy
from wallnav_ros.simulation.rollout import GreedyPolicy, run_episodes
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.files import find_asset

# Episodes run side by side. Fixed, because a matrix product's last bit may depend on how many
# rows it has: the batches, and so the results, must not depend on the number of workers.
BATCH = 25


@dataclass(frozen=True)
class Campaign:
    """
    What to evaluate.

    model: weight file, its short name, or `orca`. scenario: file or short name.
    case: one of its cases. seeds: range. horizons, caution: None for the model's own rule.
    turns: of the decision rule, None for the model's own.
    constant_velocity: people are foreseen to keep theirs, whatever the model has learned.
    visible: whether people see the robot; None for what the scenario says. watched: how many
    of the first results say where the people were.
    """

    model: str
    scenario: str
    case: str
    seeds: range
    horizons: tuple = None
    caution: float = None
    visible: bool = None
    watched: int = 0
    constant_velocity: bool = False
    turns: tuple = None

    def episodes(self, seeds):
        """Return the drawn episodes of `seeds`."""
        scenario = load_scenario(self.scenario)
        if self.visible is not None:
            scenario = scenario.seen(self.visible)
        return [draw_episode(scenario, self.case, seed) for seed in seeds]


def load_policy(model, horizons=None, caution=None, constant_velocity=False, turns=None):
    """
    Return the policy called `model`.

    Raises FileNotFoundError or WeightsError with one line that says what to do.
    """
    if model == 'orca':
        return OrcaPolicy(make_actions())
    path = find_asset('models', model, '.npz')
    if is_baseline(path):
        return load_baseline(path, horizons, caution, turns)
    return GreedyPolicy(Lookahead.from_weights(
        load_value_function(path), horizons, caution, constant_velocity, turns))


def run_campaigns(campaigns, workers=1):
    """
    Return one list of EpisodeResult per campaign, in the order of its seeds.

    Raises WorkerDied where one of several worker processes was killed.
    """
    jobs = [(number, campaign.seeds[start:start + BATCH])
            for number, campaign in enumerate(campaigns)
            for start in range(0, len(campaign.seeds), BATCH)]
    batches = {}
    with tqdm(total=sum(len(campaign.seeds) for campaign in campaigns), desc='evaluating',
              unit='episode') as bar:
        for job, batch in _run_batches(
                [(campaigns[number], seeds) for number, seeds in jobs], workers):
            batches[job] = batch
            bar.update(len(batch))
    results = [[] for _ in campaigns]
    for job, (number, _) in enumerate(jobs):
        results[number].extend(batches[job])
    return results


def _run_batches(jobs, workers):
    """Yield (number, results) of every job, (campaign, seeds), as they are done."""
    if workers == 1:
        yield from enumerate(map(_run_batch, jobs))
        return
    # One BLAS thread a worker: more would fight over the same cores.
    os.environ.setdefault('OMP_NUM_THREADS', '1')
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    yield from work_off(_run_batch, jobs, workers)


def _run_batch(job):
    campaign, seeds = job
    policy = load_policy(campaign.model, campaign.horizons, campaign.caution,
                         campaign.constant_velocity, campaign.turns)
    watched = max(0, campaign.watched - (seeds.start - campaign.seeds.start))
    return run_episodes(campaign.episodes(seeds), policy, watched=watched)
