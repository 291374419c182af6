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
"""Tracks: what perception reports, and what the policy makes of it."""

import numpy as np

from wallnav_ros.world.tracks import HUMAN, OBSTACLE, Tracks


def test_no_tracks_are_a_set_of_tracks_too():
    tracks = Tracks.none(12.5)

    assert tracks.stamp == 12.5
    assert len(tracks) == 0
    assert tracks.agents().position.shape == (0, 2)


def test_humans_and_obstacles_alike_are_agents_to_keep_clear_of():
    tracks = Tracks(1.0, np.array([3, 7], np.uint32), np.array([[1.0, 2.0], [3.0, 4.0]]),
                    np.array([[0.5, 0.0], [0.0, 0.0]]), np.array([0.3, 0.2]),
                    np.array([HUMAN, OBSTACLE], np.uint8))

    agents = tracks.agents()

    assert len(tracks) == 2
    assert agents.position.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert agents.velocity.tolist() == [[0.5, 0.0], [0.0, 0.0]]
    assert agents.radius.tolist() == [0.3, 0.2]
    assert agents.present.all()
