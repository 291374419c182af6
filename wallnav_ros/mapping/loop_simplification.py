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
Staircase loops along cell edges to few straight pieces, never further off than a tolerance.

Ramer 1972, Douglas and Peucker 1973, all loops at once; a slanted wall is cut through the
middles of its steps instead of their corners, which needs half the tolerance.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class _Chains:
    """
    Loops laid out one after the other, each from its start point round to the same point again.

    points: (P, 2) corners and the middles of the edges between them, in turn.
    corner: (P,) bool.
    shift: (P,) where to cut for a corner that lies too far off: 0 there, -1 or 1 at the middle
        of the edge before or after it.
    first: (L + 1,) where each chain begins.
    """

    points: np.ndarray
    corner: np.ndarray
    shift: np.ndarray
    first: np.ndarray


def simplify_loops(corners, starts, tolerance):
    """
    Return the points (K, 2) that are kept of loops of cell edges, and where each loop begins.

    corners (N, 2) and starts (L + 1,) are those of `trace_boundary`; `tolerance` is in cells.
    The result is laid out likewise, with the first point of every loop repeated at its end.

    Every piece stays within `tolerance` of all the boundary it stands for, and starts and ends
    on it. So each point of the boundary has one of the result that near, and the reverse, for
    the boundary leads from one end of the piece to the other without leaving that strip.
    """
    if len(starts) < 2:
        return np.empty((0, 2)), np.zeros(1, dtype=np.intp)
    chains = _lay_out(corners.astype(float), starts, tolerance)
    kept = np.flatnonzero(_cut(chains, tolerance))
    return chains.points[kept], np.searchsorted(kept, chains.first)


def _lay_out(corners, starts, tolerance):
    """Return the loops as chains, each begun at the corner between its two longest edges."""
    size = np.diff(starts)
    loop = np.repeat(np.arange(len(size)), size)
    following = np.arange(len(corners)) + 1
    following[starts[1:] - 1] = starts[:-1]
    before = np.empty_like(following)
    before[following] = np.arange(len(corners))
    edge = corners[following] - corners
    length = np.abs(edge).sum(axis=1)
    # A step is an edge after which the wall goes on as before it, not back as round an end. Its
    # middle is half its length from either corner: that much must be tolerable.
    step = (np.sign(edge[before]) == np.sign(edge[following])).all(axis=1)
    step_length = np.where(step & (length <= 2.0 * tolerance), length, np.inf)
    shift = np.where(step_length[before] <= step_length, -1, 1)
    shift[np.isinf(np.minimum(step_length[before], step_length))] = 0
    shorter = np.minimum(length[before], length)

    both = np.stack((corners, 0.5 * (corners + corners[following])), axis=1).reshape(-1, 2)
    longest = np.flatnonzero(shorter == np.maximum.reduceat(shorter, starts[:-1])[loop])
    begin = longest[np.searchsorted(loop[longest], np.arange(len(size)))]
    begin = 2 * begin + shift[begin]
    count = 2 * size + 1
    first = np.concatenate(([0], np.cumsum(count)))
    owner = np.repeat(np.arange(len(size)), count)
    place = np.arange(first[-1]) - first[owner]
    turned = 2 * starts[owner] + (begin[owner] - 2 * starts[owner] + place) % (2 * size[owner])
    return _Chains(both[turned], turned % 2 == 0, shift[turned // 2], first)


def _cut(chains, tolerance):
    """Return which points (P,) bool of the chains are kept."""
    kept = np.zeros(len(chains.points), dtype=bool)
    begin, end = chains.first[:-1], chains.first[1:] - 1
    kept[begin] = kept[end] = True
    inner = np.flatnonzero(chains.corner & ~kept)
    owner = np.searchsorted(begin, inner, side='right') - 1
    # The first cut is always made: no loop, however small, shrinks to a point.
    limit = -1.0
    while len(inner):
        off = _squared_distance(chains.points, inner, begin[owner], end[owner])
        group = np.flatnonzero(np.diff(owner, prepend=-1))
        length = np.diff(group, append=len(inner))
        most = np.maximum.reduceat(off, group)
        worst = np.flatnonzero(off == np.repeat(most, length))
        worst = inner[worst[np.searchsorted(worst, group)]]

        bad = most > limit
        cut, low, high = worst[bad], begin[owner[group[bad]]], end[owner[group[bad]]]
        moved = cut + chains.shift[cut]
        cut = np.where((moved == low) | (moved == high), cut, moved)
        kept[cut] = True
        begin = np.stack((low, cut), axis=1).ravel()
        end = np.stack((cut, high), axis=1).ravel()
        inner = inner[np.repeat(bad, length)]
        half = np.repeat(np.arange(len(cut)), length[bad])
        owner = 2 * half + (inner > cut[half])
        owner, inner = owner[inner != cut[half]], inner[inner != cut[half]]
        # Cells make distances of exactly half a cell common: rounding must not decide them.
        limit = (tolerance + 1e-9) ** 2
    return kept


def _squared_distance(points, inner, begin, end):
    """Return the squared distance of points[inner] to the segments from `begin` to `end`."""
    along = points[end] - points[begin]
    to_point = points[inner] - points[begin]
    squared = along[:, 0] ** 2 + along[:, 1] ** 2
    fraction = (to_point[:, 0] * along[:, 0] + to_point[:, 1] * along[:, 1]) / np.where(
        squared > 0.0, squared, 1.0)
    gap = to_point - np.clip(fraction, 0.0, 1.0)[:, None] * along
    return gap[:, 0] ** 2 + gap[:, 1] ** 2
