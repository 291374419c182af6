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
One picture of a replay: the place, the people's ways, the robot's way and the commands.

After the trajectory figures of the paper (Figs. 5 and 6), on recorded scans.
"""

from dataclasses import dataclass

from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
import numpy as np

from wallnav_ros.evaluation.replay import Replay, Stage
from wallnav_ros.evaluation.survey import CELL, Survey
from wallnav_ros.world.files import atomic_write
from wallnav_ros.world.geometry import to_parent
from wallnav_ros.world.tracks import HUMAN

ROBOT, COMMAND, MAP, OBSTACLES, TRUTH = '#111111', '#0b62a4', '#1f4e9c', '#b9893c', '#c4007a'
PEOPLE = ('#e41a1c', '#2ca02c', '#ff7f00', '#8e44ad', '#00a2a8', '#b5472b', '#d45fb0', '#6a8f00')
# More names than this would hide what they name: the longest ways get theirs.
_MOST_LABELS = 25
_SHORTEST_LIFE = 1.0
# The robot's way is marked every so many seconds, where it moved so many metres since.
_EVERY, _APART = 10, 1.0


@dataclass(frozen=True)
class Way:
    """
    One track from birth to death.

    number: its id. human: whether it was ever labelled so. stamp: (K,) seconds; position:
    (K, 2) metres; radius: metres, the mean.
    """

    number: int
    human: bool
    stamp: np.ndarray
    position: np.ndarray
    radius: float

    @property
    def extent(self):
        """Return how many metres across the way is."""
        return float(np.hypot(*np.ptp(self.position, axis=0)))


def ways_of(tracks):
    """Return the Way of every id in a sequence of Tracks, in order of id."""
    stamp = np.concatenate([np.full(len(each), each.stamp) for each in tracks])
    owner, position, radius, label = (
        np.concatenate([getattr(each, name) for each in tracks])
        for name in ('id', 'position', 'radius', 'label'))
    order = np.argsort(owner, kind='stable')
    starts = np.flatnonzero(np.diff(owner[order], prepend=-1))
    return [Way(int(owner[rows[0]]), bool((label[rows] == HUMAN).any()), stamp[rows],
                position[rows], float(radius[rows].mean()))
            for rows in np.split(order, starts[1:]) if len(rows)]


def draw_replay(path, title, replay: Replay, survey: Survey, stage: Stage, walls=None,
                truth=None):
    """
    Write the picture of a Replay to `path` (PNG).

    walls: Walls of the map in the stage's frame; truth: (N, 2) annotated positions there.
    """
    ways = ways_of(replay.tracks) if replay.tracks else []
    points = to_parent(stage.from_odom, survey.points)
    low, high = _view(points, survey.hits, replay, ways, stage.goal)
    figure, place, key, strips = _lay_out(*(high - low))
    _draw_place(place, points, survey.hits, low, high, walls)
    _draw_obstacles(place, ways)
    _draw_robot(place, replay, stage)
    _draw_people(place, ways, low, high)
    if truth is not None:
        place.plot(*truth.T, 'x', color=TRUTH, ms=4, mew=0.9, zorder=6)
    place.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]),
              xlabel=f'x in {stage.frame} [m]', ylabel=f'y in {stage.frame} [m]')
    place.set_aspect('equal', anchor='N')
    key.axis('off')
    key.legend(handles=_legend(walls, truth), fontsize=10, frameon=False, loc='center left',
               ncol=1 if key.get_position().width < 0.5 else 3)
    figure.suptitle(title, x=0.01, ha='left', fontsize=11)
    _draw_strips(strips, replay, survey)
    with atomic_write(path, 'wb') as stream:
        figure.savefig(stream, format='png', dpi=100)


def _lay_out(width, height):
    """Return a figure and its axes: the place, as wide as it is, the key and three strips."""
    if height > 0.6 * width:
        across = np.clip(10.0 * width / height, 5.5, 11.0)
        figure = Figure(figsize=(across + 5.5, 10.6), layout='constrained')
        grid = figure.add_gridspec(4, 2, width_ratios=(across, 5.0), height_ratios=(3, 4, 4, 4))
        cells = [grid[:, 0], *(grid[row, 1] for row in range(4))]
    else:
        down = np.clip(14.0 * height / width, 4.5, 9.0)
        figure = Figure(figsize=(15.0, down + 6.0), layout='constrained')
        grid = figure.add_gridspec(5, 1, height_ratios=(down, 0.7, 1.5, 1.5, 1.5))
        cells = [grid[row] for row in range(5)]
    place, key, *strips = (figure.add_subplot(cell) for cell in cells)
    return figure, place, key, strips


def _view(points, hits, replay, ways, goal):
    """Return the corners low, high (2,) that hold all but the stray beams, with a margin."""
    inner = np.repeat(points, np.minimum(hits, 5), axis=0)
    held = [np.percentile(inner, (0.5, 99.5), axis=0)] if len(inner) else []
    held += [replay.robot_poses[:, :2], goal[None]]
    held += [way.position for way in ways if way.human]
    held = np.concatenate(held)
    low, high = held.min(axis=0) - 1.0, held.max(axis=0) + 1.0
    # Never so slim that the picture becomes a stripe.
    room = np.maximum(0.35 * (high - low).max() - (high - low), 0.0) / 2.0
    return low - room, high + room


def _draw_place(axes, points, hits, low, high, walls):
    """Draw where beams ended, darker the more of them did, and the mapped walls."""
    # Cells no smaller than a pixel of the picture: thinner walls would fade away.
    size = max(CELL, (high - low).max() / 800.0)
    shape = np.ceil((high - low) / size).astype(int)
    cell = np.floor((points - low) / size).astype(int)
    inside = ((cell >= 0) & (cell < shape)).all(axis=1)
    count = np.zeros(shape[::-1])
    np.add.at(count, (cell[inside, 1], cell[inside, 0]), hits[inside])
    full = np.log1p(max(np.percentile(count[count > 0], 80), 3.0)) if inside.any() else 1.0
    shade = np.clip(np.log1p(count) / full, 0.0, 1.0)
    axes.imshow(1.0 - 0.75 * shade, cmap='gray', vmin=0.0, vmax=1.0, origin='lower',
                extent=(low[0], low[0] + shape[0] * size, low[1], low[1] + shape[1] * size),
                interpolation='nearest', zorder=0)
    if walls is not None:
        axes.add_collection(LineCollection(walls.segments, colors=MAP, linewidths=0.9,
                                           alpha=0.75, zorder=2))
    axes.grid(color='#dddddd', lw=0.5, zorder=1)
    axes.set_axisbelow(False)


def _draw_obstacles(axes, ways):
    """Draw what stood still for a second or more, as discs of its size."""
    still = [way for way in ways if not way.human and np.ptp(way.stamp) >= _SHORTEST_LIFE]
    if not still:
        return
    size = [2.0 * way.radius for way in still]
    axes.add_collection(EllipseCollection(
        size, size, np.zeros(len(still)), units='xy', facecolors='none', edgecolors=OBSTACLES,
        linewidths=0.7, alpha=0.45, offsets=[np.median(way.position, axis=0) for way in still],
        offset_transform=axes.transData, zorder=3))


def _draw_people(axes, ways, low, high):
    """Draw the way of each human: a dot where it starts, an arrow and its id where it ends."""
    people = sorted((way for way in ways if way.human), key=lambda way: -way.extent)
    for rank, way in enumerate(people):
        color = PEOPLE[way.number % len(PEOPLE)]
        axes.plot(*way.position.T, color=color, lw=1.8, alpha=0.9, zorder=5,
                  solid_capstyle='round')
        axes.plot(*way.position[0], 'o', color=color, ms=3.5, zorder=5)
        _draw_arrow(axes, way.position, color, 0.012 * (high - low).max())
        if rank < _MOST_LABELS:
            axes.annotate(str(way.number), way.position[-1], xytext=(5, 4),
                          textcoords='offset points', fontsize=8, zorder=8,
                          color=[0.7 * part for part in to_rgb(color)],
                          bbox={'boxstyle': 'round,pad=0.1', 'fc': 'white', 'ec': 'none',
                                'alpha': 0.7})


def _draw_arrow(axes, positions, color, reach, zorder=6):
    """Draw an arrow head at the last of `positions` (K, 2), along the last `reach` metres."""
    gap = np.hypot(*(positions - positions[-1]).T)
    far = np.flatnonzero(gap >= reach)
    if len(far):
        axes.annotate('', positions[-1], positions[far[-1]], zorder=zorder,
                      arrowprops={'arrowstyle': '-|>', 'color': color, 'lw': 1.8,
                                  'mutation_scale': 13, 'shrinkA': 0, 'shrinkB': 0})


def _draw_robot(axes, replay, stage):
    """Draw the way of the robot, the seconds since the start along it, and the goal."""
    way = replay.robot_poses[:, :2]
    elapsed = np.array([tracks.stamp - replay.tracks[0].stamp for tracks in replay.tracks])
    axes.plot(*way.T, color=ROBOT, lw=2.4, zorder=4)
    axes.plot(*way[0], 's', color=ROBOT, ms=8, zorder=7)
    _draw_arrow(axes, way, ROBOT, 0.3, zorder=7)
    last = way[0]
    for second in range(_EVERY, int(elapsed[-1]) + 1, _EVERY):
        at = way[np.searchsorted(elapsed, second)]
        if np.hypot(*(at - last)) > _APART:
            axes.plot(*at, 'o', color='white', mec=ROBOT, ms=5, zorder=7)
            axes.annotate(f'{second} s', at, xytext=(6, -11), textcoords='offset points',
                          fontsize=8, color=ROBOT, zorder=8,
                          bbox={'boxstyle': 'round,pad=0.1', 'fc': 'white', 'ec': 'none',
                                'alpha': 0.7})
            last = at
    axes.plot(*stage.goal, '*', color='gold', mec='black', ms=17, zorder=7)


def _legend(walls, truth):
    def line(color, **style):
        return Line2D([], [], color=color, **style)
    handles = [
        (line('#555555', marker='s', ls='', ms=6), 'where beams ended (walls, furniture)'),
        (line(PEOPLE[0], lw=1.8, marker='o', ms=4), 'a person, from dot to arrow, with track id'),
        (line(OBSTACLES, marker='o', ls='', mfc='none', ms=7), 'a still thing (obstacle track)'),
        (line(ROBOT, lw=2.4, marker='s', ms=6), 'the robot, from square to arrow, with seconds'),
        (line('gold', marker='*', ls='', mec='black', ms=13), 'goal given to the policy')]
    if walls is not None:
        handles.insert(1, (line(MAP, lw=1.2), 'walls of the map'))
    if truth is not None:
        handles.append((line(TRUTH, marker='x', ls='', ms=6), 'annotated person'))
    for handle, text in handles:
        handle.set_label(text)
    return [handle for handle, _ in handles]


def _draw_strips(panels, replay, survey):
    """Draw commanded and recorded speeds, and the number of people, over time."""
    speed, turn, people = panels
    stamps = np.array([tracks.stamp for tracks in replay.tracks])
    zero = stamps[0] if len(stamps) else 0.0
    for axes, column, recorded, name in ((speed, 0, 0, 'forward [m/s]'),
                                         (turn, 1, 2, 'turn [rad/s]')):
        if survey.odom_frame is not None:
            axes.plot(survey.stamps - zero, survey.twists[:, recorded], color='#999999', lw=1.0,
                      label='driven (odometry)')
        axes.step(replay.stamps - zero, replay.commands[:, column], where='post',
                  color=COMMAND, lw=1.1, label="policy's command")
        axes.set_ylabel(name)
        axes.tick_params(labelbottom=False)
    halted = [stamp - zero for stamp, decision in zip(replay.stamps, replay.decisions)
              if decision not in ('driving', 'waiting', 'goal_reached')]
    if halted:
        speed.plot(halted, np.zeros(len(halted)), 'x', color=PEOPLE[0], ms=6,
                   label='told to stand')
    speed.legend(loc='lower left', bbox_to_anchor=(0.0, 1.0), ncol=3, fontsize=9, frameon=False,
                 borderaxespad=0.1)
    count = [(tracks.label == HUMAN).sum() for tracks in replay.tracks]
    people.step(stamps - zero, count, where='post', color=PEOPLE[1], lw=1.1)
    people.set(ylabel='people tracked', xlabel='time since the first scan [s]',
               ylim=(0.0, max([1, *count]) + 0.5))
    people.yaxis.set_major_locator(MaxNLocator(integer=True))
    for axes in panels:
        axes.grid(color='#dddddd', lw=0.5)
        if axes is not people:
            axes.sharex(people)
    if len(stamps):
        people.set_xlim(0.0, max(stamps.max() - zero, 1.0))
