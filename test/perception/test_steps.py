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
"""Feet that come down where nothing was, one after the other: steps of one walker."""

import numpy as np
import pytest
from track_tables import make_detections, make_table

from wallnav_ros.perception.association import Association
from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.steps import appear, take_steps
from wallnav_ros.perception.visibility import make_view

SETTINGS = TrackerSettings(arrival_odds=0.8, arrival_share=0.6, step_time=0.7, step_length=1.0,
                           leg_width=0.25, thin_radius=0.035, trail_spacing=0.1)
FOOT = {'radius': 0.06, 'leg': True, 'apart': True, 'fresh': 1.0, 'count': 4}
LIFTED = {'radius': 0.06, 'motion': 0.8, 'seen': 9.7}
OLD, NEW = [3.0, 0.0], [3.6, 0.0]


def step(table, seen, wall=8.0):
    """Return the Association after steps at 10 s; every beam ends on a round wall."""
    scan = Scan(10.0, np.full(360, wall), -np.pi, 2.0 * np.pi / 360, 0.1, 10.0)
    match = Association(np.full(len(table), -1), np.full(len(table), -1),
                        np.zeros(len(seen), dtype=bool))
    return take_steps(table, seen, match, make_view(scan, np.zeros(3), 7.0), scan, SETTINGS)


def test_a_foot_comes_down_a_step_from_where_it_was_lifted():
    table = make_table([OLD], **LIFTED)
    match = step(table, make_detections([NEW], **FOOT))
    assert match.first.tolist() == [0] and match.used.tolist() == [True]
    np.testing.assert_allclose(table.position, [NEW])
    np.testing.assert_allclose(table.velocity, [[1.0, 0.0]])      # 0.6 m in 0.6 s
    assert table.motion[0] == pytest.approx(1.6) and table.score[0] == 1.0


@pytest.mark.parametrize('track, foot, place, wall', [
    ({'motion': -0.1}, {}, NEW, 8.0),            # what seems to stand does not step
    ({'radius': 0.2}, {}, NEW, 8.0),             # nor does what is no leg
    ({'seen': 9.2}, {}, NEW, 8.0),               # nobody holds a foot up for so long
    ({}, {'fresh': 0.5}, NEW, 8.0),              # something stood here before
    ({}, {'leg': False}, NEW, 8.0),
    ({}, {'count': 2}, NEW, 8.0),
    ({}, {}, [4.1, 0.0], 8.0),                   # too far for a step
    ({}, {}, NEW, 3.0)])                         # something still stands at the old place
def test_nothing_else_is_a_step(track, foot, place, wall):
    table = make_table([OLD], **{**LIFTED, **track})
    match = step(table, make_detections([place], **{**FOOT, **foot}), wall)
    assert match.first.tolist() == [-1] and match.used.tolist() == [False]
    np.testing.assert_allclose(table.position, [OLD])


def test_two_walkers_take_the_steps_that_are_shortest_together():
    table = make_table([OLD, [3.0, 0.8]], **LIFTED)
    match = step(table, make_detections([[3.5, 0.7], NEW], **FOOT))
    assert match.first.tolist() == [1, 0]


@pytest.mark.parametrize('foot, odds', [
    ({}, 0.8), ({'fresh': 0.7}, 0.56), ({'fresh': 0.5}, 0.0), ({'apart': False}, 0.0),
    ({'leg': False}, 0.0), ({'radius': 0.03}, 0.0)])
def test_a_leg_that_appears_where_nothing_was_is_worth_its_share(foot, odds):
    assert appear(make_detections([NEW], **{**FOOT, **foot}), SETTINGS)[0] == pytest.approx(odds)
