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
What a training run leaves for people: its curves and the model card.

Paper section 7 (Figs. 4 and 7): rates and rewards over the episodes trained.
"""

from matplotlib.figure import Figure
import numpy as np

from wallnav_ros.learning.kinds import KINDS
from wallnav_ros.simulation.batch import OUTCOMES
from wallnav_ros.world.files import atomic_write

OURS = ('Not for people who run, nor for floors that are not flat: it has met neither. It assumes '
        'that everything within 5 m is seen by the laser or is in the map.')
BASELINE = ('It sees no walls: for comparison in the simulator, never for a robot.')
LINES = ('-', '--', ':', '-.')     # of the scenarios; a case has the same colour in each
SMOOTHING = 10      # rounds that a training curve is averaged over


def draw_curves(rows, path):
    """Draw the training log and every cell's greedy success and reward to `path` (.png)."""
    log, cells = rows['log'], rows['evaluation']
    figure = Figure(figsize=(10, 11), layout='constrained')
    training, greedy, reward = figure.subplots(3, 1, sharex=True)
    episodes = [row['episodes'] for row in log]
    for name, colour in (('goal', 'tab:green'), ('collision', 'tab:red'),
                         ('wall_collision', 'tab:brown'), ('timeout', 'tab:gray')):
        training.plot(episodes, _smooth([row[name] for row in log]), color=colour,
                      label=name.replace('_', ' '))
    training.set(ylabel='share of training episodes', ylim=(0.0, 1.0))
    training.set_title('Training, exploring as it goes', loc='left')
    loss = training.twinx()
    loss.plot(episodes, _smooth([row['loss'] for row in log]), color='tab:blue', alpha=0.4,
              label='loss')
    loss.set(ylabel='loss', ylim=(0.0, None))
    # Beside the title: within the axes it would hide some run or other.
    handles = [*training.get_lines(), *loss.get_lines()]
    training.legend(handles=handles, loc='lower right', bbox_to_anchor=(1.0, 1.0), ncols=5,
                    fontsize='small', frameon=False, borderaxespad=0.2)
    for axes, column in ((greedy, 'goal'), (reward, 'total_reward')):
        _draw_cells(axes, cells, column)
    greedy.set(ylabel='greedy success', ylim=(None, 1.02))
    greedy.set_title('Greedy, every cell apart', loc='left')
    reward.set(xlabel='episodes', ylabel='total reward of an episode')
    reward.legend(ncols=4, fontsize='small', frameon=False, loc='upper center',
                  bbox_to_anchor=(0.5, -0.15))
    with atomic_write(path, 'wb') as stream:
        figure.savefig(stream, format='png', dpi=100)


def _draw_cells(axes, cells, column):
    """Draw `column` of the greedy evaluations, each cell and their mean."""
    scenarios, cases = (list(dict.fromkeys(row[key] for row in cells))
                        for key in ('scenario', 'case'))
    for name in dict.fromkeys((row['scenario'], row['case']) for row in cells):
        own = [row for row in cells if (row['scenario'], row['case']) == name]
        axes.plot([row['episodes'] for row in own], [row[column] for row in own], marker='.',
                  linewidth=1.2, alpha=0.8, label=' '.join(name),
                  color=f'C{cases.index(name[1]) % 10}',
                  linestyle=LINES[scenarios.index(name[0]) % len(LINES)])
    when = sorted({row['episodes'] for row in cells})
    axes.plot(when, [np.mean([row[column] for row in cells if row['episodes'] == moment])
                     for moment in when], color='black', linewidth=2.5, marker='o', label='mean')
    axes.grid(alpha=0.3)


def write_card(metadata, cells, path):
    """
    Write the model card to `path` (.md).

    metadata: of the exported weights. cells: the rows of the greedy evaluation it was kept for.
    """
    training, network = metadata['training'], metadata['network']
    settings = training['settings']
    lines = [
        f'# {metadata["name"]}', '',
        'A value network for a wheeled robot among people and walls: '
        f'{KINDS[network["kind"]].title}, layer widths {network["sizes"]}.', '',
        f'- Trained for {training["episodes"]} episodes ({training["seconds"] / 60.0:.0f} min) '
        f'from seed {settings["seed"]} at commit {training["commit"]}, after '
        f'{settings["imitation_episodes"]} demonstrations by ORCA.',
        f'- Worlds: {", ".join(settings["scenarios"])}; {_robots(settings)}; the crowd does not '
        'see the robot.',
        f'- Reward {metadata["reward"]}, discount {metadata["discount"]}, time step '
        f'{metadata["time_step"]} s.',
        f'- Decides by looking {metadata["decision"]["horizons"]} steps ahead, turning for '
        f'{metadata["decision"].get("turns", [1])} of them, with a caution of '
        f'{metadata["decision"]["caution"]} s; people are foreseen {_foreseen(metadata)}.',
        '', 'Greedy success when it was kept, over '
        f'{settings["evaluation_episodes"]} episodes a cell that training never saw:', '',
        '| scenario | case | success | collision | wall | timeout | time s |',
        '|---|---|---|---|---|---|---|']
    for row in cells:
        rates = ' | '.join(f'{row[name]:.1%}' for name in OUTCOMES[1:])
        lines.append(f'| {row["scenario"]} | {row["case"]} | {rates} | {row["time"]:.2f} |')
    lines += ['', OURS if network['kind'] == 'three_mlp' else BASELINE, '']
    with atomic_write(path) as stream:
        stream.write('\n'.join(lines))


def _robots(settings):
    if settings['own_robot'] == 1.0:
        return 'the robot of each'
    return ('robots of {} to {} m radius'.format(*settings['radius'])
            + ' that prefer {} to {} m/s'.format(*settings['preferred_speed']))


def _smooth(values):
    """Return the running mean of `values` over the last SMOOTHING entries."""
    sums = np.cumsum(np.asarray(values, dtype=float))
    width = np.minimum(np.arange(1, len(values) + 1), SMOOTHING)
    before = np.concatenate((np.zeros(SMOOTHING), sums))[:len(values)]
    return (sums - before) / width


def _foreseen(metadata):
    """Return in words what a policy expects people to do."""
    motion = metadata['training']['settings'].get('motion')
    if not motion:
        return 'to keep their velocity'
    return (f'by the motion model {motion}, a contact costing '
            f'{metadata["decision"]["aversion"]:g} times its chance')
