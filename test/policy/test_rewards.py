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
The rewards R1 to R4 against numbers worked by hand from the paper's section 5.

Each test states one rule of the table; the total is the sum of the named terms.
"""

from dataclasses import replace
import math

import numpy as np
import pytest

from wallnav_ros.policy.rewards import (
    Gains, reward_terms, REWARDS, someone_passing, StepFacts, total, warning_radius)
from wallnav_ros.world.state import Agents, Robot

# A quiet step: 0.2 m straight towards the goal, nobody near, the wall a metre away.
QUIET = StepFacts(reached=np.array(False), agent_gap=np.array(np.inf), progress=np.array(0.2),
                  moved=np.array(0.2), yielding=np.array(False), wall_gap=np.array(1.0))


def terms_of(name, **changes):
    facts = replace(QUIET, **{key: np.array(value) for key, value in changes.items()})
    return {key: float(value) for key, value in reward_terms(name, facts).items()}


@pytest.mark.parametrize('name, terms', [
    ('R1', {'R_g', 'R_c', 'R_d', 'R_hg'}),
    ('R2', {'R_g', 'R_c', 'R_d', 'R_hg', 'R_s'}),
    ('R3', {'R_g', 'R_c', 'R_d', 'R_wz', 'R_hg'}),
    ('R4', {'R_g', 'R_c', 'R_d', 'R_hg', 'R_s', 'R_pf', 'R_wc', 'R_wmin', 'R_wmax'}),
])
def test_each_reward_has_the_terms_of_its_equation(name, terms):
    assert set(terms_of(name)) == terms


@pytest.mark.parametrize('name, expected', [
    # 0.01 x 0.2 m of progress; R4 adds 0.01 for moving and 0.01 for a clear wall.
    ('R1', 0.002), ('R2', 0.002), ('R3', 0.002), ('R4', 0.022),
])
def test_a_quiet_step_is_paid_for_its_progress(name, expected):
    assert sum(terms_of(name).values()) == pytest.approx(expected)


@pytest.mark.parametrize('name', REWARDS)
def test_the_goal_pays_ten(name):
    assert terms_of(name, reached=True)['R_g'] == 10.0


@pytest.mark.parametrize('name, expected', [('R1', -0.5), ('R2', -0.5), ('R3', -0.1),
                                            ('R4', -0.5)])
@pytest.mark.parametrize('gap', [0.0, -0.05])
def test_touching_an_agent_is_a_collision(name, expected, gap):
    terms = terms_of(name, agent_gap=gap)

    assert terms['R_c'] == expected
    assert terms['R_d'] == 0.0


@pytest.mark.parametrize('name, expected', [
    # 0.5 x (0.05 - 0.2); R3 weighs it by 0.25.
    ('R1', -0.075), ('R2', -0.075), ('R3', -0.0375), ('R4', -0.075)])
def test_passing_closer_than_is_comfortable_costs_by_the_missing_distance(name, expected):
    assert terms_of(name, agent_gap=0.05)['R_d'] == pytest.approx(expected)


@pytest.mark.parametrize('name', REWARDS)
def test_the_comfortable_distance_itself_costs_nothing(name):
    assert terms_of(name, agent_gap=0.2)['R_d'] == 0.0
    assert terms_of(name, agent_gap=0.2)['R_c'] == 0.0


@pytest.mark.parametrize('name', REWARDS)
def test_going_away_from_the_goal_costs_what_going_there_pays(name):
    assert terms_of(name, progress=-0.2)['R_hg'] == pytest.approx(-0.002)


@pytest.mark.parametrize('changes, only', [
    ({'reached': True, 'agent_gap': -0.1}, 'R_g'),
    ({'agent_gap': -0.1, 'warning_depth': -0.4}, 'R_c'),
    ({'agent_gap': 0.1, 'warning_depth': -0.4}, 'R_d'),
    ({'warning_depth': -0.4}, 'R_wz'),
    ({}, 'R_hg'),
])
def test_of_r3_only_the_first_term_that_applies_counts(changes, only):
    terms = terms_of('R3', **changes)

    assert {name for name, value in terms.items() if value} == {only}


@pytest.mark.parametrize('changes, only', [
    ({'reached': True, 'agent_gap': 0.1}, 'R_g'), ({'agent_gap': -0.1}, 'R_c'),
    ({'agent_gap': 0.1}, 'R_d'), ({'warning_depth': -0.4}, 'R_hg')])
def test_of_r1_only_the_first_term_that_applies_counts(changes, only):
    assert {name for name, value in terms_of('R1', **changes).items() if value} == {only}


def test_r2_and_r4_add_what_applies_together():
    terms = terms_of('R2', reached=True, agent_gap=0.1, yielding=True)

    # 10 for the goal, 0.5 x (0.1 - 0.2), 0.002 of progress, 0.02 for stopping.
    assert sum(terms.values()) == pytest.approx(10.0 - 0.05 + 0.002 + 0.02)


@pytest.mark.parametrize('name', ['R2', 'R4'])
def test_stopping_to_let_an_agent_pass_pays(name):
    assert terms_of(name, yielding=True)['R_s'] == 0.02
    assert terms_of(name)['R_s'] == 0.0


@pytest.mark.parametrize('depth, expected', [
    # 0.2 x (exp(depth) - 0.3): 0.2 x (0.670320 - 0.3), 0.2 x (0.135335 - 0.3).
    (-0.4, 0.074064), (-2.0, -0.032933)])
def test_the_warning_zone_pays_by_how_deep_the_robot_is_in_it(depth, expected):
    assert terms_of('R3', warning_depth=depth)['R_wz'] == pytest.approx(expected, abs=1e-6)


def test_outside_the_warning_zone_progress_counts():
    terms = terms_of('R3', warning_depth=0.0)

    assert (terms['R_wz'], terms['R_hg']) == (0.0, pytest.approx(0.002))


def test_the_warning_zone_grows_with_an_agents_speed():
    assert warning_radius(np.array([0.0, 1.0, 1.5])) == pytest.approx([0.3, 0.8, 1.05])


@pytest.mark.parametrize('moved, expected', [(0.031, 0.01), (0.03, -0.01), (0.0, -0.01)])
def test_freezing_costs_and_moving_pays(moved, expected):
    assert terms_of('R4', moved=moved)['R_pf'] == expected


@pytest.mark.parametrize('gap, collision, near', [
    (0.1, 0.0, 0.01), (0.099, 0.0, -0.5), (1e-9, 0.0, -0.5), (0.0, -0.5, -0.5),
    (-0.2, -0.5, -0.5), (math.inf, 0.0, 0.01)])
def test_a_wall_costs_when_near_and_again_when_touched(gap, collision, near):
    terms = terms_of('R4', wall_gap=gap)

    assert (terms['R_wc'], terms['R_wmin']) == (collision, near)


@pytest.mark.parametrize('farthest, ended, expected', [
    (13.0, False, 0.0), (13.0, True, 0.1), (13.01, False, -0.05), (13.01, True, -0.05)])
def test_leaving_the_map_costs_and_staying_pays_once_at_the_end(farthest, ended, expected):
    assert terms_of('R4', farthest_wall=farthest, ended=ended)['R_wmax'] == expected


def test_gains_may_be_replaced():
    facts = replace(QUIET, reached=np.array(True))

    terms = reward_terms('R4', facts, Gains(goal=1.0, progress=0.1))

    assert float(terms['R_g']) == 1.0
    assert float(terms['R_hg']) == pytest.approx(0.02)


@pytest.mark.parametrize('name', REWARDS)
def test_arrays_of_steps_are_paid_one_by_one_and_are_never_nan(name):
    gaps = np.array([math.inf, 0.2, 0.1, 0.0, -math.inf])
    facts = replace(QUIET, agent_gap=gaps, wall_gap=gaps[::-1], warning_depth=gaps - 0.2,
                    reached=np.zeros(5, dtype=bool))

    with np.errstate(all='raise'):
        terms = reward_terms(name, facts)

    assert total(terms).shape == (5,)
    for row, gap in enumerate(gaps):
        alone = terms_of(name, agent_gap=gap, wall_gap=gaps[4 - row], warning_depth=gap - 0.2)
        assert {key: np.broadcast_to(value, 5)[row]
                for key, value in terms.items()} == pytest.approx(alone)
    assert np.isfinite(total(terms)).all()


def test_an_unknown_reward_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="unknown reward 'R5', choose one of R1, R2, R3, R4"):
        reward_terms('R5', QUIET)


def robot_at_origin():
    return Robot(np.zeros(3), np.zeros(2), np.array([5.0, 0.0]), np.array(0.2), np.array(0.8))


@pytest.mark.parametrize('position, velocity, passes', [
    ((2.0, 0.0), (-1.0, 0.0), True),        # straight on, 1.35 m away
    ((2.0, 0.0), (1.0, 0.0), False),        # walks away
    ((2.0, 0.0), (0.0, 1.0), False),        # comes no nearer
    ((2.0, 0.0), (-0.1, 0.0), False),       # as slow as standing
    ((2.6, 0.0), (-1.0, 0.0), True),        # 1.95 m away
    ((2.7, 0.0), (-1.0, 0.0), False),       # 2.05 m: too far to stop for
])
def test_someone_passes_who_is_near_and_comes_nearer(position, velocity, passes):
    agents = Agents.of([position], [velocity], [0.45])

    assert someone_passing(robot_at_origin(), agents) == passes


def test_nobody_passes_where_nobody_is():
    absent = replace(Agents.of([[1.0, 0.0]], [[-1.0, 0.0]], [0.3]), present=np.array([False]))

    assert not someone_passing(robot_at_origin(), Agents.none())
    assert not someone_passing(robot_at_origin(), absent)
