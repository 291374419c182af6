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
"""What diagnostics and the log say of the navigation's health."""

from types import SimpleNamespace

import numpy as np
import pytest
from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.navigation.localisation import Localisation
from wallnav_ros.navigation.navigator import Navigator
from wallnav_ros.nodes.health import navigation_status, tell_reversal
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.policy.actions import make_actions
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.outcomes import Rule
from wallnav_ros.world.walls import Walls

START, GOAL = np.array([1.0, 2.0, 0.0]), np.array([11.0, 2.0])
HALL = Walls.from_polylines([[(0, 0), (12, 0), (12, 4), (0, 4)]], closed=True)


@pytest.fixture
def navigator():
    """Return a Navigator in a hall, on its way to GOAL."""
    navigator = Navigator(Lookahead(lambda features: -features.robot[..., 0], make_actions(),
                                    Rule()), Tracker(), localisation=Localisation(np.zeros(3)))
    navigator.set_walls(distance_field(HALL))
    navigator.take_odometry(1.0, START, np.zeros(2), 1.0)
    assert navigator.set_goal(GOAL, 'map') is None
    return navigator


def values(navigator):
    status = navigation_status('policy_node', navigator, navigator.update(1.1, 1.1), 1.1, {}, {})
    return {value.key: value.value for value in status.values}


def test_a_way_of_its_own_is_planned_around_people_too(navigator):
    before = values(navigator)
    assert (before['way'], before['detours']) == ('planned', '0')
    navigator.guide.go_round(navigator.localisation, 0.25, START[:2],
                             (np.array([[4.0, 2.0]]), np.array([0.3])))
    during = values(navigator)
    assert (during['way'], during['detours']) == ('planned', '1')
    assert float(during['to_go']) == pytest.approx(10.0, abs=0.5)


def test_a_way_from_a_plan_is_given(navigator):
    navigator.take_path(np.linspace(START[:2], GOAL, 50), 'map')
    assert values(navigator)['way'] == 'given'


def test_beams_found_reversed_are_told_once():
    told = []
    node = SimpleNamespace(get_logger=lambda: SimpleNamespace(warning=told.append))
    tracker = SimpleNamespace(reversed_sensors=['scan'])
    tell_reversal(node, 'scan', tracker, [])
    tell_reversal(node, 'scan', tracker, ['scan'])
    line, = told
    assert line.startswith('scan: its beams fit earlier scans only if taken in the order opposite')
