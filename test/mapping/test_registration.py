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
"""A rough pose is corrected by what is seen of the walls, as far as they can tell."""

import numpy as np
import pytest

from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.registration import FEWEST, register
from wallnav_ros.world.geometry import to_child
from wallnav_ros.world.walls import Walls

COVARIANCE = np.diag((0.06, 0.06, 0.04)) ** 2
BEARINGS = np.radians(np.arange(0.0, 360.0, 2.0))
ROOM = Walls.from_polylines([[(0, 0), (6, 0), (6, 4), (3, 4), (3, 3), (0, 3), (0, 0)]])
CORRIDOR = Walls.from_polylines([[(-50, 0), (50, 0)], [(-50, 2), (50, 2)]])


def seen(walls, pose, rng, noise=0.01):
    """Return the beam ends (K, 2) of a scanner at `pose` (3,), in its own frame."""
    ranges = walls.raycast(pose[:2], BEARINGS + pose[2], 12.0)
    hit = np.flatnonzero(ranges < 12.0)
    ranges = ranges[hit] + rng.normal(0.0, noise, len(hit))
    return ranges[:, None] * np.stack((np.cos(BEARINGS[hit]), np.sin(BEARINGS[hit])), axis=1)


@pytest.mark.parametrize('pose', [(1.0, 1.5, 0.0), (4.5, 2.0, 2.0), (2.5, 2.6, -1.0)])
def test_a_pose_in_a_room_is_found_to_a_centimetre(pose, rng):
    field, pose = distance_field(ROOM), np.array(pose)
    for _ in range(20):
        known = pose + rng.normal(size=3) * (0.05, 0.05, 0.035)
        found = register(seen(ROOM, pose, rng), known, known, COVARIANCE, field)
        off = np.abs(found.pose - pose)
        assert np.hypot(*off[:2]) < 0.02 and off[2] < 0.01


def test_what_a_corridor_does_not_tell_stays_as_it_was_known(rng):
    field, pose = distance_field(CORRIDOR), np.array([0.0, 1.2, 0.1])
    known = pose + (0.08, -0.06, 0.03)
    found = register(seen(CORRIDOR, pose, rng), known, known, COVARIANCE, field)
    np.testing.assert_allclose(found.pose, (0.08, 1.2, 0.1), atol=0.01)
    along, across = np.sqrt(np.diag(found.covariance))[:2]
    # Nothing is known of the way along but what was known before.
    assert 0.05 < along < 0.062 and across < 0.01


def test_people_before_the_walls_do_not_move_it(rng):
    field, pose = distance_field(ROOM), np.array([1.0, 1.5, 0.0])
    points = seen(ROOM, pose, rng)
    # A fifth of the beams end on somebody who stands half way to the wall.
    points[20:56] *= 0.5
    known = pose + (0.05, 0.05, 0.0)
    found = register(points, known, known, COVARIANCE, field)
    np.testing.assert_allclose(found.pose, pose, atol=0.015)


def test_a_few_beams_on_walls_tell_nothing(rng):
    field, pose = distance_field(ROOM), np.array([1.0, 1.5, 0.0])
    points = seen(ROOM, pose, rng)[:FEWEST - 1]
    assert register(points, pose, pose, COVARIANCE, field) is None
    away = to_child(pose, np.tile([3.0, 1.5], (100, 1)))
    assert register(away, pose, pose, COVARIANCE, field) is None


def test_the_search_may_begin_elsewhere_than_at_what_is_known(rng):
    # Two faces of one wall 0.2 m thick: what is known is nearer to the wrong one.
    walls = Walls.from_polylines([[(0, 0), (4, 0), (4, 3), (0, 3), (0, 0)],
                                  [(4.2, 0), (4.2, 3)]])
    field, pose = distance_field(walls), np.array([3.0, 1.5, 0.0])
    points = seen(walls, pose, rng)
    points = points[np.abs(points[:, 1]) < 1.4]
    known = pose + (0.13, 0.0, 0.0)
    found = register(points, pose + (0.01, 0.0, 0.0), known, COVARIANCE, field)
    np.testing.assert_allclose(found.pose, pose, atol=0.02)
