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
The way to a goal past the next corner: shortest paths with clearance, and sub-goals on them.

Dijkstra's algorithm (scipy) from the goal outwards, so one plan serves every position.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from wallnav_ros.world.distance_field import DistanceField

CELL = 0.1             # m, spacing of the grid that ways are sought on
COMFORT = 0.3          # m of room to each side of the robot, below which a way costs more
NARROWNESS = 1.0       # times more per metre where there is no room to spare
SIGHT = 6.0            # m along the way that a sub-goal is at most ahead
PROBE = 0.1            # m between the points at which a line of sight is probed
# Steps of a grid path: to the 8 cells around and a knight's move away, as (row, column).
MOVES = np.array([(0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1)])
NOWHERE = -1


class RouteError(ValueError):
    """No way leads to the goal; one line that says why."""


@dataclass(frozen=True)
class Route:
    """
    Ways to one goal from wherever the robot may be.

    walls: DistanceField of the frame everything is in. goal: (2,) m. radius: of the robot, m.
    low: (2,) m, centre of cell (0, 0). length: (H, W) float32, m to go along the way, inf
    where no way leads to the goal. following: (H * W,) the cell (flat) that a way enters next.
    """

    walls: DistanceField
    goal: np.ndarray
    radius: float
    low: np.ndarray
    length: np.ndarray
    following: np.ndarray

    def to_go(self, position):
        """Return the metres (...) to go along the way from `position` (..., 2); inf: none."""
        return self.length.ravel()[self._cell(np.asarray(position, dtype=float))]

    def guide(self, position):
        """
        Return sub-goals (B, 2) for robots at `position` (B, 2), and the metres (B,) beyond them.

        A sub-goal is the farthest point of the way that is in a straight line, with room for
        the robot; the goal itself, with nothing beyond, where that is in sight.
        """
        position = np.asarray(position, dtype=float)
        goal = np.broadcast_to(self.goal, position.shape)
        free = self._sees(position, goal[:, None])[:, 0]
        # Where no way is known, straight ahead is the honest answer.
        beyond, lost = np.zeros(len(position)), ~np.isfinite(self.to_go(position))
        if (free | lost).all():
            return goal.copy(), beyond
        cells = self._way(position)
        way = self._centre(cells)
        seen = self._sees(position, way)
        # The last in sight; where that is its own cell, or none, the robot follows the way itself.
        last = way.shape[1] - 1 - seen[:, ::-1].argmax(axis=1)
        last = np.where(seen.any(axis=1), np.maximum(last, 1), 1)
        rows, direct = np.arange(len(position)), (free | lost)
        beyond = np.where(direct, 0.0, self.length.ravel()[cells[rows, last]])
        return np.where(direct[:, None], goal, way[rows, last]), beyond

    def path(self, position):
        """
        Return the way (K, 2) from `position` (2,) to the goal, straightened where there is room.

        Raises RouteError where there is none.
        """
        if not np.isfinite(self.to_go(position)):
            raise RouteError('no way leads to the goal from here')
        points = [np.asarray(position, dtype=float)]
        for _ in range(self.length.size):
            target, beyond = self.guide(points[-1][None])
            points.append(target[0])
            if not beyond[0]:
                break
        return np.array(points)

    def _cell(self, position):
        """Return the flat index (...) of the cell at, or nearest to, `position` (..., 2)."""
        height, width = self.length.shape
        cell = np.rint((position - self.low) / CELL).astype(np.intp)
        return np.clip(cell[..., 1], 0, height - 1) * width + np.clip(cell[..., 0], 0, width - 1)

    def _centre(self, cell):
        row, column = np.divmod(cell, self.length.shape[1])
        return self.low + CELL * np.stack((column, row), axis=-1)

    def _way(self, position):
        """Return the next cells (B, K) of the ways from `position`, SIGHT metres of them."""
        cells, steps = [self._cell(position)], int(SIGHT / CELL)
        for _ in range(steps):
            cells.append(self.following[cells[-1]])
        return np.stack(cells, axis=1)[:, ::2]

    def _sees(self, position, points):
        return in_sight(self.walls, self.radius, position, points)


def in_sight(walls, radius, position, points):
    """
    Return whether a robot fits along the lines from `position` (B, 2) to `points` (B, K, 2).

    walls: DistanceField of their frame; radius: m. The result is (B, K) bool.
    """
    offset = points - position[:, None]
    longest = np.sqrt(np.einsum('bki,bki->bk', offset, offset).max(initial=0.0))
    share = np.linspace(0.0, 1.0, 2 + int(longest / PROBE))[1:]
    probes = position[:, None, None] + share[:, None] * offset[:, :, None]
    return (walls.at(probes) > radius).all(axis=-1)


def plan_route(walls, goal, radius, start=None, margin=2.0):
    """
    Return the Route to `goal` (2,) for a robot of `radius` metres.

    `walls` is the DistanceField of the goal's frame. The way is sought on its whole grid and
    `margin` metres around start and goal. Narrow places cost more, so that corners are not cut
    where there is room.

    Raises RouteError when the goal, or `start` (2,) if given, is too close to a wall or when
    walls part them.
    """
    goal = np.asarray(goal, dtype=float)
    points = goal[None] if start is None else np.vstack((goal, start))
    low, shape = _extent(walls, points, margin)
    grid = low + CELL * np.stack(np.meshgrid(np.arange(shape[1]), np.arange(shape[0])), axis=-1)
    gap = walls.at(grid) - radius
    route = Route(walls, goal, radius, low, np.empty(shape, dtype=np.float32), np.empty(0))
    for name, point in (('goal', goal), ('robot', start)):
        if point is not None and walls.at(np.asarray(point, dtype=float)) <= radius:
            raise RouteError(f'the {name} is too close to a wall for a robot of {radius:g} m '
                             f'radius: {float(walls.at(np.asarray(point, dtype=float))):.2f} m '
                             'from it')
    route = _search(route, gap, int(route._cell(goal)))
    if start is not None and not np.isfinite(route.to_go(np.asarray(start))):
        raise RouteError(f'no way that a robot of {radius:g} m radius fits through leads to '
                         'the goal')
    return route


def plan_round(walls, start, goal, radius, position, disc_radius):
    """
    Return the Route from `start` (2,) to `goal` (2,) that leaves room for discs that stand there.

    walls: DistanceField without them; position (K, 2), disc_radius (K,) m. A robot of `radius` m
    may already be closer to something than that. Raises RouteError where there is no way.
    """
    route = plan_route(walls.with_discs(position, disc_radius), goal, radius)
    if not np.isfinite(route.to_go(start)):
        raise RouteError('no way round who stands there')
    return route


def _extent(walls, points, margin):
    """Return the first cell's centre (2,) and the shape of a grid over `walls` and `points`."""
    height, width = np.array(walls.distance.shape) * walls.resolution
    cos, sin = np.cos(walls.pose[2]), np.sin(walls.pose[2])
    corners = np.array([(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)])
    corners = walls.pose[:2] + corners @ np.array([[cos, sin], [-sin, cos]])
    # An open world's field has no extent of its own: `points` give the grid one.
    corners = np.vstack((corners, points - margin, points + margin))
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = 1 + np.ceil((high - low) / CELL).astype(int)
    return low, (rows, columns)


def _search(route, gap, goal_cell):
    """Return `route` with every cell's length and following cell, `gap` (H, W) m to spare."""
    free = gap > 0.0
    free.ravel()[goal_cell] = True
    number = np.full(free.size, NOWHERE, dtype=np.int32)
    cells = np.flatnonzero(free)
    number[cells] = np.arange(len(cells))
    cost = 1.0 + NARROWNESS * np.clip(1.0 - gap.ravel() / COMFORT, 0.0, 1.0)
    tail, head, stride = _neighbours(free)
    weight = 0.5 * (cost[tail] + cost[head]) * stride
    graph = csr_matrix((weight, (number[tail], number[head])), shape=(len(cells),) * 2)
    total, following = dijkstra(graph, directed=False, indices=number[goal_cell],
                                return_predecessors=True)
    found = np.isfinite(total)
    onward = np.arange(free.size)
    onward[cells] = np.where(following >= 0, cells[np.maximum(following, 0)], cells)
    length = np.full(free.size, np.inf, dtype=np.float32)
    length[cells[found]] = _lengths(onward, free.shape[1])[cells[found]]
    return Route(route.walls, route.goal, route.radius, route.low,
                 length.reshape(free.shape), onward)


def _neighbours(free):
    """Return the flat cells (E,), (E,) that a step between free cells joins, and its metres."""
    height, width = free.shape
    index = np.arange(free.size, dtype=np.int32).reshape(free.shape)
    tails, heads, strides = [], [], []
    for rows, columns in MOVES:
        left, right = max(0, -columns), width - max(0, columns)
        here = np.s_[:height - rows, left:right]
        there = np.s_[rows:, left + columns:right + columns]
        both = free[here] & free[there]
        tails.append(index[here][both])
        heads.append(index[there][both])
        strides.append(np.full(len(heads[-1]), CELL * np.hypot(rows, columns)))
    return np.concatenate(tails), np.concatenate(heads), np.concatenate(strides)


def _stride(tail, head, width):
    """Return the distances (E,) in metres between flat cells."""
    row, column = np.divmod(head, width)
    row0, column0 = np.divmod(tail, width)
    return CELL * np.hypot(row - row0, column - column0)


def _lengths(onward, width):
    """Return each cell's metres to go by adding up doubled strides along `onward` (P,)."""
    length = _stride(np.arange(len(onward)), onward, width)
    while True:
        further = length[onward]
        if not further.any():
            return length
        length, onward = length + further, onward[onward]
