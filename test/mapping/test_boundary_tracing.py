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
"""Tracing: the loops are the edges between True cells and the rest, each once."""

import cv2
import numpy as np
import pytest

from wallnav_ros.mapping.boundary_tracing import trace_boundary


def loops(mask):
    corners, starts = trace_boundary(np.array(mask, dtype=bool))
    return [corners[first:last].tolist() for first, last in zip(starts[:-1], starts[1:])]


def unit_edges(loop):
    """Return the unit edges that a loop of corners runs along, as a list of sorted pairs."""
    edges = []
    for (x, y), (to_x, to_y) in zip(loop, loop[1:] + loop[:1]):
        assert (x == to_x) != (y == to_y)
        while (x, y) != (to_x, to_y):
            step = (x + np.sign(to_x - x), y + np.sign(to_y - y))
            edges.append(tuple(sorted([(x, y), step])))
            x, y = step
    return edges


def test_nothing_has_no_boundary():
    assert loops(np.zeros((3, 4))) == []


def test_one_cell_is_a_unit_square():
    assert loops([[1]]) == [[[0, 0], [1, 0], [1, 1], [0, 1]]]


def test_x_counts_columns_and_y_counts_rows():
    assert loops([[0, 0, 0], [0, 1, 1]]) == [[[1, 1], [3, 1], [3, 2], [1, 2]]]


def test_a_hole_is_a_loop_of_its_own():
    ring = np.ones((3, 3))
    ring[1, 1] = 0

    assert loops(ring) == [[[0, 0], [3, 0], [3, 3], [0, 3]], [[1, 1], [2, 1], [2, 2], [1, 2]]]


@pytest.mark.parametrize('mask', [[[1, 0], [0, 1]], [[0, 1], [1, 0]]])
def test_cells_that_touch_at_a_corner_are_one_region(mask):
    loop, = loops(mask)

    assert len(loop) == 8
    assert loop.count([1, 1]) == 2


@pytest.mark.parametrize('share', [0.05, 0.3, 0.5, 0.7, 0.95])
def test_every_edge_between_true_and_false_is_run_along_once(rng, share):
    for _ in range(30):
        mask = rng.random(rng.integers(1, 14, 2)) < share
        around = np.pad(mask, 1)

        traced = loops(mask)

        edges = [edge for loop in traced for edge in unit_edges(loop)]
        assert len(edges) == len(set(edges))
        assert len(edges) == (around[1:] != around[:-1]).sum() + (
            around[:, 1:] != around[:, :-1]).sum()
        # One loop a region (cells joined by corners too) and one a hole (joined by edges alone).
        regions = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)[0] - 1
        holes = cv2.connectedComponents((~around).astype(np.uint8), connectivity=4)[0] - 2
        assert len(traced) == regions + holes
