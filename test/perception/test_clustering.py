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
"""Where one cluster of beam ends stops and the next begins."""

import numpy as np
from numpy.testing import assert_allclose

from wallnav_ros.perception.clustering import describe, split_runs

STEP = np.radians(1.0)


def polar(points):
    return np.arctan2(points[:, 1], points[:, 0]), np.hypot(*points.T)


def test_a_jump_in_range_parts_clusters():
    angles = STEP * np.arange(6)
    owner = split_runs(angles, np.array([2.0, 2.0, 2.0, 3.0, 3.0, 3.0]), STEP)
    assert owner.tolist() == [0, 0, 0, 1, 1, 1]


def test_what_is_one_surface_far_away_is_two_things_near_by():
    angles = np.array([0.0, 3.0 * STEP])
    assert len(set(split_runs(angles, np.full(2, 8.0), STEP))) == 1
    assert len(set(split_runs(np.array([0.0, 8.0 * STEP]), np.full(2, 2.0), STEP))) == 2


def test_a_cluster_across_the_seam_of_a_full_circle_is_one():
    angles = -np.pi + STEP * np.array([0, 1, 180, 358, 359])
    ranges = np.full(5, 2.0)
    closed = split_runs(angles, ranges, STEP, closed=True)
    assert closed[0] == closed[-1] and closed[2] != closed[0]
    assert sorted(set(closed)) == [0, 1]
    assert len(set(split_runs(angles, ranges, STEP))) == 3


def test_a_surface_is_described_by_its_centre_and_extent():
    points = np.column_stack((np.full(5, 4.0), np.linspace(-0.2, 0.2, 5)))
    clusters = describe(points, np.zeros(2), np.zeros(5, dtype=int), STEP)
    assert_allclose(clusters.centroid, [[4.0, 0.0]], atol=1e-12)
    assert_allclose(clusters.width, 0.4 + 4.0 * STEP)
    assert_allclose(clusters.depth, 0.0, atol=1e-12)


def test_no_points_are_no_clusters():
    owner = split_runs(np.empty(0), np.empty(0), STEP)
    assert len(describe(np.empty((0, 2)), np.zeros(2), owner, STEP)) == 0
