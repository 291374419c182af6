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
Trajectories of one episode as a picture: who was where, when, and how it ended.

After Figs. 5 and 6 of the paper; time runs from light to dark.
"""

from textwrap import fill

from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle
import numpy as np

from wallnav_ros.world.files import atomic_write

TICK = 2.0             # s between two discs that show where everybody was
MARGIN = 0.5           # m around everything that is shown
LABEL_ROOM = 0.6       # m between the places of two labels
LEGEND = ('blue: the robot, bound for the star; grey: standing people; other colours: walking '
          f'people;\na disc every {TICK:g} s, light to dark')
ROBOT, GOAL, STANDING = '#1650b0', '#1a8f3c', '#8a8a8a'
# Matplotlib's tableau colours but blue and grey, which mean the robot and standing people.
WALKERS = ('#ff7f0e', '#2ca02c', '#d62728', '#9467bd', '#8c564b', '#e377c2', '#bcbd22', '#17becf')


def draw_trajectories(path, walls, trajectories, title):
    """
    Write a picture of an episode to `path` (PNG).

    walls: (M, 2, 2) segments in metres. trajectories: a mapping with times (T), robot
    (T, 3), agents (T, N, 2), agent_radius (N), agent_walks (N), radius, start (3) and goal (2),
    all in metres and seconds, as in the results of `drive`. title: what happened, in words.
    """
    width, height = np.subtract(*_view(walls, trajectories)[::-1])
    figure = Figure(figsize=(8.0, np.clip(8.0 * height / width, 4.0, 10.0) + 0.9),
                    layout='constrained')
    axes = figure.add_subplot()
    _draw_episode(axes, walls, trajectories)
    axes.set_title(title.replace('; ', '\n'), fontsize=11)
    axes.set(xlabel='x (m)', ylabel='y (m)')
    figure.supxlabel(LEGEND, fontsize=9)
    _write(figure, path, dpi=110)


def draw_cell(path, episodes, results, title):
    """
    Write a picture of the first episodes of a cell to `path` (PNG).

    episodes, results: drawn Episodes and their EpisodeResults, which say where the crowd was.
    """
    draw_grid(path, [
        (episode.scenario.walls.segments, _trajectories(episode, result),
         f'seed {result.seed}: {result.outcome.replace("_", " ")} after {result.time:.1f} s')
        for episode, result in zip(episodes, results)], title)


def _trajectories(episode, result):
    robot = episode.robot
    return {'times': np.linspace(0.0, result.time, len(result.path)), 'robot': result.path,
            'agents': result.crowd, 'agent_radius': episode.radius,
            'agent_walks': episode.speed > 0.0, 'radius': robot.radius, 'start': robot.pose,
            'goal': robot.goal}


def draw_grid(path, panels, title):
    """
    Write a picture of several episodes side by side to `path` (PNG).

    panels: (walls, trajectories, title) of each, as for `draw_trajectories`.
    """
    columns = min(3, len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(4.2 * columns, 4.4 * rows + 0.6), layout='constrained')
    for number, (walls, trajectories, caption) in enumerate(panels):
        axes = figure.add_subplot(rows, columns, number + 1)
        _draw_episode(axes, walls, trajectories)
        axes.set_title(caption, fontsize=10)
        axes.tick_params(labelsize=7)
    figure.suptitle(title, fontsize=12)
    figure.supxlabel(fill(f'x and y in m; {LEGEND}', 55 * columns), fontsize=9)
    _write(figure, path, dpi=90)


def _draw_episode(axes, walls, trajectories):
    axes.add_collection(LineCollection(np.asarray(walls), colors='black', linewidths=2.0))
    times = np.asarray(trajectories['times'])
    moments = _moments(times)
    _draw_agents(axes, trajectories, times, moments)
    _draw_robot(axes, trajectories, times, moments)
    _frame(axes, walls, trajectories)


def _write(figure, path, dpi):
    with atomic_write(path, 'wb') as stream:
        figure.savefig(stream, format='png', dpi=dpi)


def _moments(times):
    """Return the rows nearest to each multiple of TICK, and the last one."""
    wanted = np.arange(0.0, times[-1] + 1e-9, TICK)
    rows = np.abs(times[:, None] - wanted).argmin(axis=0)
    return np.unique(np.append(rows, len(times) - 1))


def _shade(time, end):
    return 0.2 + 0.6 * (time / end if end > 0.0 else 1.0)


def _draw_agents(axes, trajectories, times, moments):
    agents = np.asarray(trajectories['agents']).reshape(len(times), -1, 2)
    for number, (radius, walks) in enumerate(
            zip(trajectories['agent_radius'], trajectories['agent_walks'])):
        way = agents[:, number]
        if not walks:
            axes.add_patch(Circle(way[-1], radius, facecolor=STANDING, edgecolor='black', lw=0.5))
            continue
        colour = WALKERS[number % len(WALKERS)]
        axes.plot(*way.T, color=colour, linewidth=0.8, alpha=0.7)
        for row in moments:
            axes.add_patch(Circle(way[row], radius, facecolor=colour, edgecolor='none',
                                  alpha=0.6 * _shade(times[row], times[-1])))
        axes.add_patch(Circle(way[-1], radius, facecolor='none', edgecolor=colour, lw=1.2))


def _draw_robot(axes, trajectories, times, moments):
    robot = np.asarray(trajectories['robot'])
    axes.plot(*robot[:, :2].T, color=ROBOT, linewidth=2.2, zorder=5)
    for row in moments:
        axes.add_patch(Circle(robot[row, :2], trajectories['radius'], facecolor=ROBOT,
                              edgecolor='white', lw=0.6, zorder=6,
                              alpha=_shade(times[row], times[-1])))
    for row in _labelled(robot[:, :2], moments):
        last = row == moments[-1]
        axes.annotate(f'{times[row]:.1f} s' if last else f'{times[row]:.0f}', robot[row, :2],
                      xytext=(16, 8) if last else (7, 5), textcoords='offset points', fontsize=8,
                      color=ROBOT, zorder=8, bbox={'boxstyle': 'round,pad=0.1', 'fc': 'white',
                                                   'ec': 'none', 'alpha': 0.7})
    start = np.asarray(trajectories['start'])
    axes.annotate('', start[:2] + 0.5 * np.array([np.cos(start[2]), np.sin(start[2])]), start[:2],
                  arrowprops={'arrowstyle': '->', 'color': ROBOT, 'lw': 1.5}, zorder=7)
    axes.plot(*trajectories['goal'], marker='*', markersize=18, color=GOAL,
              markeredgecolor='black', markeredgewidth=0.5, linestyle='none', zorder=4)


def _labelled(way, moments):
    """Return those of `moments` whose labels leave each other room, the last before all."""
    kept = [moments[-1]]
    for row in moments[:-1]:
        if np.linalg.norm(way[kept] - way[row], axis=1).min() > LABEL_ROOM:
            kept.append(row)
    return kept


def _view(walls, trajectories):
    """Return the corners low, high (2,) of what is shown, in metres."""
    points = [np.asarray(walls).reshape(-1, 2), np.asarray(trajectories['robot'])[:, :2],
              np.asarray(trajectories['goal'])[None],
              np.asarray(trajectories['agents'], dtype=float).reshape(-1, 2)]
    points = np.concatenate([part for part in points if len(part)])
    return points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN


def _frame(axes, walls, trajectories):
    low, high = _view(walls, trajectories)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect('equal')
    axes.grid(True, color='#dddddd', linewidth=0.5, zorder=0)
    axes.set_axisbelow(True)
