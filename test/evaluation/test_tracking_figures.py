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
"""Pictures of tracks: what is drawn lies where it was, in one frame."""

import cv2
import numpy as np
import pytest

from wallnav_ros.evaluation.ground_truth import GroundTruth
from wallnav_ros.evaluation.tracking import TrackedScan
from wallnav_ros.evaluation.tracking_figures import (
    annotated_places, draw_tracks, human_trails, wall_cells)
from wallnav_ros.evaluation.tracking_report import Row
from wallnav_ros.world.tracks import HUMAN, OBSTACLE

pytestmark = pytest.mark.extras

# A scanner that drives 1 m along x and looks along y: a human stands at (2, 1), a thing at (3, 1).
POSES = [(0.1 * turn, 0.0, np.pi / 2.0) for turn in range(11)]


def look(turn):
    pose = np.array(POSES[turn])
    position = np.array([[1.0, pose[0] - 2.0], [1.0, pose[0] - 3.0]])
    return TrackedScan(0.1 * turn, 0.1 * turn, pose, position, np.array([4, 7]),
                       np.array([HUMAN, OBSTACLE]), position)


TRACKED = [look(turn) for turn in range(len(POSES))]
TRUTH = GroundTruth(np.array([-1.0, 0.55]), np.array([1, 1]), np.array([[9.0, 9.0], [1.0, -1.5]]),
                    np.array(['laser', 'laser']))


def test_only_humans_leave_trails_in_the_frame_of_the_picture():
    trails = human_trails(TRACKED)
    assert len(trails) == 1
    np.testing.assert_allclose(trails[0], np.tile([2.0, 1.0], (11, 1)), atol=1e-9)


def test_annotations_lie_where_the_scanner_was_then_and_older_ones_are_left_out():
    np.testing.assert_allclose(annotated_places(TRACKED, TRUTH), [[2.0, 1.0]], atol=1e-9)


def test_walls_are_where_beams_end_often():
    cells = wall_cells([np.array([[0.01, 0.01], [1.01, -0.02]]), np.array([[0.02, 0.03]])], 2)
    np.testing.assert_allclose(cells, [[0.025, 0.025]])


@pytest.mark.parametrize('tracked, truth', [
    (TRACKED, TRUTH), (TRACKED, None), (TRACKED[:1], None)])
def test_every_recording_gives_a_picture(tmp_path, tracked, truth):
    draw_tracks(tmp_path / 'tracks.png', Row('somewhere', tracked, truth, None))
    picture = cv2.imread(str(tmp_path / 'tracks.png')).astype(int)
    red = (picture[..., 2] > picture[..., 1] + 80) & (picture[..., 2] > picture[..., 0] + 80)
    assert picture.shape[0] > 500 and picture.std() > 5.0
    # Annotated positions, and their key below, are the only red things.
    assert red.any() == (truth is not None)
