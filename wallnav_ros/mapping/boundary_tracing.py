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
The boundary of a mask of cells as closed loops along the cells' edges, exactly.

Corners of a rectilinear region, sorted along a row or a column, are joined pair by pair.
"""

import numpy as np


def trace_boundary(mask):
    """
    Return the loops that separate the True cells of `mask` (H, W) from all others.

    Returns corners (N, 2) int32, x (columns) and y (rows) in cells, one loop after the other,
    and starts (L + 1,), where loop k is corners[starts[k]:starts[k + 1]], its last corner
    joined to its first. Consecutive corners differ in x or y alone. Beyond the mask nothing
    is True. Cells that touch at a corner belong to one region.
    """
    column, row, saddle_kind = _corners(np.asarray(mask, dtype=bool))
    across, along = _mates(column, row, saddle_kind)
    order, starts = _walk(across, along)
    return np.stack((column[order], row[order]), axis=1).astype(np.int32), starts


def _corners(mask):
    """
    Return column, row and saddle kind (N,) of the boundary's corners, in row-major order.

    Where four cells alternate, two corners lie on one spot: it is listed twice, with kind 1
    where the lower left cell is True, else 2; other corners have kind 0.
    """
    around = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), np.uint8)
    around[1:-1, 1:-1] = mask
    low_left, low_right = around[:-1, :-1], around[:-1, 1:]
    high_left, high_right = around[1:, :-1], around[1:, 1:]
    odd = low_left ^ low_right ^ high_left ^ high_right
    saddle = (low_left == high_right) & (low_right == high_left) & (low_left != low_right)
    kind = saddle * (2 - low_left)
    spot = np.flatnonzero(odd | saddle)
    kind = kind.ravel()[spot]
    spot, kind = np.repeat(spot, 1 + (kind > 0)), np.repeat(kind, 1 + (kind > 0))
    row, column = np.divmod(spot, mask.shape[1] + 1)
    return column, row, kind


def _mates(column, row, saddle_kind):
    """
    Return, for every corner, the corner (N,) joined to it across its row and along its column.

    Of the two corners on one spot, the first ends the edge from the left, the second begins
    the edge to the right; which of them meets the edge from below follows from their kind.
    """
    number = np.arange(len(column))
    across = number ^ 1
    second = np.zeros(len(column), bool)
    second[1:] = (saddle_kind[1:] > 0) & (column[1:] == column[:-1]) & (row[1:] == row[:-1])
    upper = np.where(saddle_kind == 1, ~second, second) & (saddle_kind > 0)
    by_column = np.lexsort((upper, row, column))
    along = np.empty_like(number)
    along[by_column[0::2]] = by_column[1::2]
    along[by_column[1::2]] = by_column[0::2]
    return across, along


def _walk(across, along):
    """Return the corners in the order of the loops, and where each loop starts (L + 1,)."""
    across, along = across.tolist(), along.tolist()
    seen = bytearray(len(across))
    order, starts = [], [0]
    for first in range(len(across)):
        corner = first
        while not seen[corner]:
            mate = across[corner]
            seen[corner] = seen[mate] = 1
            order += corner, mate
            corner = along[mate]
        if len(order) > starts[-1]:
            starts.append(len(order))
    return np.array(order, dtype=np.intp), np.array(starts)
