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
A training run in small: it learns, writes what it should, and goes on as if never stopped.

Paper algorithm 1.
"""

import csv
from dataclasses import replace
import json

import numpy as np
import pytest

from wallnav_ros.learning.settings import SettingsError, TrainSettings
from wallnav_ros.policy.value_function import load_value_function
from wallnav_ros.simulation.scenario import ScenarioError

torch = pytest.importorskip('torch')
trainer_module = pytest.importorskip('wallnav_ros.learning.trainer')
checkpoints = pytest.importorskip('wallnav_ros.learning.checkpoints')

pytestmark = pytest.mark.extras

# A hall with a pillar beside the way, and five seconds to cross it.
HALL = """
walls: [[[-2, -4], [4, -4], [4, -4.2], [-2, -4.2]], [[1, 2], [2, 2], [2, 3], [1, 3]]]
robot: {start: [0, 0, 0], goal: [2.5, 0]}
time_limit: 5.0
cases: {none: {}, static: {static: 3}}
agents: {radius: [0.1, 0.3]}
"""
TINY = TrainSettings(
    name='tiny', cases={'none': 1, 'static': 1},
    network={'mlp1': [8, 6], 'mlp2': [6, 4], 'attention': [5, 1], 'mlp3': [8, 1]},
    horizons=(1,), decision_horizons=(1,), imitation_episodes=3, imitation_updates=4,
    episodes=8, parallel=2, updates=3, batch_size=16, memory=400, evaluate_every=4,
    evaluation_episodes=2)
# Two cells, measured after 4 and after 8 episodes.
CELLS = 2
TERMS = ('R_g', 'R_c', 'R_d', 'R_hg', 'R_s', 'R_pf', 'R_wc', 'R_wmin', 'R_wmax')


@pytest.fixture(scope='module', autouse=True)
def one_thread():
    """Train as the command does; more threads wait for each other where cores are shared."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope='module')
def tiny(tmp_path_factory):
    """Return the settings of a run of seconds."""
    path = tmp_path_factory.mktemp('scenario') / 'hall.yaml'
    path.write_text(HALL)
    return replace(TINY, scenarios={str(path): 1})


@pytest.fixture(scope='module')
def finished(tmp_path_factory, tiny):
    """Return a tiny run that was never interrupted."""
    trainer = trainer_module.Trainer(tiny, tmp_path_factory.mktemp('run'))
    assert trainer.run() == trainer.out / 'tiny.npz'
    return trainer


def rows_of(path):
    with open(path, newline='') as stream:
        return list(csv.DictReader(stream))


def same_weights(one, other):
    return all((tensor == other[name]).all() for name, tensor in one.items())


def test_a_run_leaves_weights_logs_settings_and_a_checkpoint(finished):
    assert {path.name for path in finished.out.iterdir()} >= {
        'tiny.npz', 'last.npz', 'checkpoint.pt', 'log.csv', 'evaluation.csv', 'settings.json'}
    assert json.loads((finished.out / 'settings.json').read_text())['name'] == 'tiny'


def test_the_log_has_a_row_a_round(finished):
    rows = rows_of(finished.out / 'log.csv')

    assert [int(row['episodes']) for row in rows] == [2, 4, 6, 8]
    for row in rows:
        assert np.isfinite(float(row['loss']))
        assert sum(float(row[name]) for name in ('goal', 'collision', 'wall_collision',
                                                 'timeout')) == pytest.approx(1.0)
        assert 0.0 < float(row['time']) <= 5.0 and float(row['path_length']) > 0.0
        assert float(row['total_reward']) == pytest.approx(
            sum(float(row[name]) for name in TERMS))
        assert float(row['R_g']) == pytest.approx(10.0 * float(row['goal']))
    # From 0.3 towards 0.03 over the first 2000 episodes; 2 of them are done in the first row.
    assert float(rows[0]['epsilon']) == pytest.approx(0.3 - 0.27 * 2 / 2000, abs=1e-4)


def test_every_cell_is_evaluated_greedily_at_intervals(finished):
    rows = rows_of(finished.out / 'evaluation.csv')

    assert [(row['episodes'], row['case']) for row in rows] == [
        ('4', 'none'), ('4', 'static'), ('8', 'none'), ('8', 'static')]
    for row in rows:
        assert {*TERMS, 'time', 'path_length', 'total_reward'} <= set(row)
        assert float(row['R_g']) == pytest.approx(10.0 * float(row['goal']))


def test_exported_weights_say_how_they_came_about(finished, tiny):
    last = load_value_function(finished.out / 'last.npz')

    assert last.metadata['name'] == 'tiny'
    assert last.metadata['network'] == {'kind': 'three_mlp', 'sizes': tiny.network}
    assert last.metadata['decision'] == {
        'horizons': [1], 'turns': [1], 'caution': 0.15, 'aversion': 0.0}
    assert last.metadata['training']['episodes'] == 8
    assert last.metadata['training']['settings']['seed'] == 0
    assert last.metadata['training']['commit']
    assert same_weights(last.tensors, finished.target.tensors())


def test_training_changes_the_network_and_the_target_follows(finished, tiny):
    fresh = trainer_module.Trainer(tiny, finished.out)

    assert not same_weights(fresh.target.tensors(), finished.target.tensors())
    assert not same_weights(finished.network.tensors(), finished.target.tensors())


def test_the_same_seed_trains_the_same_network(finished, tmp_path, tiny):
    again = trainer_module.Trainer(tiny, tmp_path)
    again.run()

    assert same_weights(again.target.tensors(), finished.target.tensors())
    assert rows_of(tmp_path / 'evaluation.csv') == rows_of(finished.out / 'evaluation.csv')


def test_another_seed_trains_another(finished, tmp_path, tiny):
    other = trainer_module.Trainer(replace(tiny, seed=1), tmp_path)
    other.run()

    assert not same_weights(other.target.tensors(), finished.target.tensors())


@pytest.mark.parametrize('stop', [{'imitated': 2}, {'episodes': 2}, {'episodes': 6}])
def test_a_resumed_run_ends_as_if_never_interrupted(finished, tmp_path, monkeypatch, stop, tiny):
    monkeypatch.setattr(trainer_module, 'CHECKPOINT_SECONDS', 0.0)

    class Killed(trainer_module.Trainer):

        def _draw(self, count):
            if all(self.counts[name] >= count for name, count in stop.items()):
                raise KeyboardInterrupt
            return super()._draw(count)
    with pytest.raises(KeyboardInterrupt):
        Killed(tiny, tmp_path).run()
    resumed = trainer_module.Trainer(tiny, tmp_path)
    resumed.run(resume=True)

    assert same_weights(resumed.target.tensors(), finished.target.tensors())
    assert same_weights(resumed.network.tensors(), finished.network.tensors())
    assert (resumed.memory.target == finished.memory.target).all()
    assert rows_of(tmp_path / 'evaluation.csv') == rows_of(finished.out / 'evaluation.csv')
    for one, other in zip(rows_of(tmp_path / 'log.csv'), rows_of(finished.out / 'log.csv')):
        assert {**one, 'seconds': ''} == {**other, 'seconds': ''}


def test_a_run_killed_while_it_evaluates_evaluates_when_resumed(finished, tmp_path, tiny):
    class Killed(trainer_module.Trainer):

        def evaluate(self):
            raise KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        Killed(tiny, tmp_path).run()
    resumed = trainer_module.Trainer(tiny, tmp_path)
    resumed.run(resume=True)

    assert resumed.counts['episodes'] == 8
    assert rows_of(tmp_path / 'evaluation.csv') == rows_of(finished.out / 'evaluation.csv')


def test_resuming_a_finished_run_changes_nothing(tmp_path, finished, tiny):
    (tmp_path / 'checkpoint.pt').write_bytes((finished.out / 'checkpoint.pt').read_bytes())

    resumed = trainer_module.Trainer(tiny, tmp_path)
    resumed.run(resume=True)

    assert same_weights(resumed.target.tensors(), finished.target.tensors())
    assert len(resumed.rows['evaluation']) == 2 * CELLS


def test_a_run_that_ends_between_evaluations_is_evaluated_and_exported(tmp_path, tiny):
    trainer = trainer_module.Trainer(replace(tiny, episodes=2, evaluate_every=1000), tmp_path)

    path = trainer.run()

    assert load_value_function(path).metadata['training']['episodes'] == 2
    assert [row['episodes'] for row in trainer.rows['evaluation']] == [2] * CELLS


def test_the_best_weights_are_those_best_at_their_worst_cell(tmp_path, monkeypatch, tiny):
    trainer = trainer_module.Trainer(tiny, tmp_path)
    success = iter([(1.0, 0.5), (0.6, 0.6), (1.0, 0.5)])

    def fake_results(episodes, *_):
        goals = round(next(rates) * 10)
        result = replace(real(episodes[:1], *_)[0], outcome='goal')
        return [result] * goals + [replace(result, outcome='timeout')] * (10 - goals)
    real = trainer_module.run_episodes
    monkeypatch.setattr(trainer_module, 'run_episodes', fake_results)
    best = []
    for number in range(3):
        rates = iter(next(success))
        trainer.counts['episodes'] = number
        trainer.evaluate()
        best.append(load_value_function(tmp_path / 'tiny.npz').metadata['training']['episodes'])

    assert best == [0, 1, 1]


def test_there_is_nothing_to_resume_in_an_empty_folder(tmp_path, tiny):
    with pytest.raises(FileNotFoundError, match='checkpoint.pt: no checkpoint to resume from'):
        trainer_module.Trainer(tiny, tmp_path).run(resume=True)


@pytest.mark.parametrize('damage', [lambda whole: whole[:len(whole) // 2], lambda whole: b'',
                                    lambda whole: b'noise' * 100])
def test_a_damaged_checkpoint_is_refused_in_one_line(finished, tmp_path, damage, tiny):
    whole = (finished.out / 'checkpoint.pt').read_bytes()
    (tmp_path / 'checkpoint.pt').write_bytes(damage(whole))

    with pytest.raises(checkpoints.CheckpointError, match='damaged, or written under') as caught:
        trainer_module.Trainer(tiny, tmp_path).run(resume=True)

    assert '\n' not in str(caught.value)


def test_a_checkpoint_of_another_network_is_refused(finished, tmp_path, tiny):
    (tmp_path / 'checkpoint.pt').write_bytes((finished.out / 'checkpoint.pt').read_bytes())
    wider = replace(tiny, network={**tiny.network, 'mlp3': [9, 1]})

    with pytest.raises(checkpoints.CheckpointError, match='written under other settings'):
        trainer_module.Trainer(wider, tmp_path).run(resume=True)


def test_a_loss_that_is_no_number_stops_the_run_with_advice(tmp_path, tiny):
    trainer = trainer_module.Trainer(tiny, tmp_path)
    with torch.no_grad():
        trainer.network.mlp3[0].weight.fill_(float('nan'))

    advice = 'the loss became nan after 0 episodes: lower learning_rate'
    with pytest.raises(trainer_module.TrainingDiverged, match=advice) as caught:
        trainer.run()

    assert '\n' not in str(caught.value)
    assert not (tmp_path / 'tiny.npz').exists()


def test_a_crowd_too_large_to_train_on_is_refused_before_any_work(tmp_path, tiny):
    scenario = tmp_path / 'crowded.yaml'
    scenario.write_text('walls: []\nrobot: {start: [0, 0, 0], goal: [5, 0]}\n'
                        'cases: {none: {static: 10, dynamic: 10}}\n')

    with pytest.raises(SettingsError, match='crowded.yaml: cases.none: 20 agents, training '):
        trainer_module.Trainer(replace(tiny, scenarios={str(scenario): 1}, cases={'none': 1}),
                               tmp_path)


def test_robots_and_cases_are_drawn_as_the_settings_say(tmp_path, tiny):
    settings = replace(tiny, cases={'none': 1, 'static': 3}, own_robot=0.5)

    episodes = trainer_module.Trainer(settings, tmp_path)._draw(200)

    radius = np.array([episode.robot.radius for episode in episodes])
    speed = np.array([episode.robot.preferred_speed for episode in episodes])
    own = (radius == 0.2) & (speed == 0.8)
    assert 0.4 < own.mean() < 0.6
    assert ((radius[~own] > 0.15) & (radius[~own] < 0.35)).all()
    assert ((speed[~own] > 0.3) & (speed[~own] < 1.0)).all()
    assert 0.65 < np.mean([episode.case == 'static' for episode in episodes]) < 0.85
    # Apart from the seeds that anyone evaluates with.
    assert min(episode.seed for episode in episodes) >= 2 ** 32


def test_a_run_of_an_older_version_with_fewer_figures_a_round_goes_on(tmp_path, tiny, finished):
    older = trainer_module.Trainer(tiny, tmp_path)
    load = {'log': [{'episodes': 2, 'loss': 0.5, 'goal': 0.5, 'collision': 0.5,
                     'wall_collision': 0.0, 'timeout': 0.0}], 'evaluation': []}
    older.rows.update(load)
    older.counts.update(imitated=3, episodes=2)
    older.memory = finished.memory
    checkpoints.save_checkpoint(older)

    trainer_module.Trainer(tiny, tmp_path).run(resume=True)

    first, second, *_ = rows_of(tmp_path / 'log.csv')
    assert (first['goal'], first['R_g']) == ('0.5', '')
    assert second['R_g']


def test_a_drawn_world_too_small_for_its_crowd_is_drawn_anew(tmp_path, tiny, monkeypatch):
    trainer = trainer_module.Trainer(replace(tiny, scenarios={'family': 1}), tmp_path)
    small = iter([True, False, True, True, *[False] * 100])
    real, refused = trainer_module.draw_episode, []

    def draw(world, case, *more):
        if next(small):
            refused.append(world.name)
            raise ScenarioError('no room')
        return real(world, case, *more)
    monkeypatch.setattr(trainer_module, 'draw_episode', draw)

    assert len(trainer._draw(6)) == 6
    assert len(refused) == 3


def test_fitting_brings_the_loss_down(tmp_path, tiny):
    """The updates are descent: on the same memory, later batches are predicted better."""
    settings = replace(tiny, imitation_episodes=12, imitation_updates=1, learning_rate=0.003)
    trainer = trainer_module.Trainer(settings, tmp_path)
    trainer.imitate()

    first = trainer._update(10)
    for _ in range(5):
        last = trainer._update(40)

    assert last < 0.3 * first
