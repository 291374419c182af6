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
The decision rule, worked by hand with a value function that anyone can follow.

Paper section 4: a* = argmax R(s, a) + gamma^(dt v_pref) V(s').
"""

from dataclasses import replace

from foreseen import TwoWays
import numpy as np
import pytest

from wallnav_ros.policy.actions import ActionSet, make_actions, STOP
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.outcomes import Rule
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.state import Agents, Observation, Robot

# Stop, straight ahead, and an arc to each side.
FOUR = ActionSet(np.array([0.0, 1.0, 1.0, 1.0]), np.array([0.0, 0.0, 1.0, -1.0]))
OPEN = DistanceField.empty()
# Walks away behind the robot: of no matter to it, but a reason why waiting may change something.
PASSER = Agents.of([[-4.0, 0.0]], [[-0.8, 0.0]], [0.3])


def nothing(features):
    """Value every state alike: only rewards decide."""
    return np.zeros(len(features.robot))


def nearness(features):
    """Value a state by how near the goal is: -1 for every metre."""
    return -10.0 * features.robot[:, 0].astype(float)


def robot_facing_goal(**changes):
    robot = Robot(np.zeros(3), np.zeros(2), np.array([4.0, 0.0]), np.float64(0.2),
                  np.float64(0.8))
    return replace(robot, **changes)


def observe(agents=None, walls=OPEN, **changes):
    return Observation(robot_facing_goal(**changes), agents or Agents.none(), walls)


def wall_ahead(x):
    """Return the exact field of a wall across the x axis: distance |x - wall|."""
    corner = np.array([-5.0, -5.0, 0.0])
    distance = np.abs(corner[0] + 0.05 * np.arange(300) - x)
    return DistanceField(np.tile(distance, (300, 1)).astype(np.float32), corner, 0.05)


def test_one_step_is_reward_plus_discounted_value():
    decision = Lookahead(nearness, FOUR, Rule()).decide(observe(PASSER))

    # Straight on gains 0.8 x 0.25 = 0.2 m: 0.01 x 0.2 progress + 0.01 push + 0.01 wall, and
    # 3.8 m are left. Standing still costs 0.01 for freezing. gamma^(dt v) = 0.9^0.2 = 0.979148.
    assert decision.scores[1] == pytest.approx(0.022 - 0.979148 * 3.8, abs=1e-5)
    assert decision.scores[0] == pytest.approx(0.0 - 0.979148 * 4.0, abs=1e-5)
    assert decision.action == 1
    assert decision.command.tolist() == [0.8, 0.0]
    assert decision.safe


def test_the_path_is_where_the_action_is_predicted_to_lead():
    lookahead = Lookahead(nearness, FOUR, Rule((2,)))

    decision = lookahead.decide(observe(pose=np.array([1.0, 0.0, 0.0])))

    assert decision.path == pytest.approx(np.array([[1.0, 0.0, 0.0], [1.2, 0.0, 0.0],
                                                    [1.4, 0.0, 0.0]]))


def test_the_discount_follows_from_time_and_preferred_speed():
    lookahead = Lookahead(lambda features: np.ones(len(features.robot)), FOUR,
                          Rule((3,), discount=0.5, reward='R1'))

    decision = lookahead.decide(observe(PASSER, preferred_speed=np.float64(0.4)))

    # 0.5^(0.25 x 0.4) a step; 0.1 m nearer a step at 0.01 a metre.
    step = 0.5 ** 0.1
    assert decision.scores[1] == pytest.approx(0.001 * (1 + step + step ** 2) + step ** 3)
    assert decision.scores[0] == pytest.approx(step ** 3)


def batched(observation, count=1):
    return (Robot(*(np.stack([part] * count) for part in vars(observation.robot).values())),
            Agents(*(np.stack([part] * count) for part in vars(observation.agents).values())),
            observation.walls)


def test_only_what_one_horizon_finds_among_the_best_is_looked_at_further():
    # Of 81 actions the 16 best at the middle horizon are averaged, the rest are out.
    observation = observe(Agents.of([[3.0, 1.0]], [[-0.5, 0.0]], [0.3]))
    middle, _ = Lookahead(nearness, make_actions(), Rule((3,))).evaluate(*batched(observation))

    scores = Lookahead(nearness, make_actions(), Rule((1, 3, 5))).decide(observation).scores

    # A turn to the left and the same to the right tie.
    assert (np.isfinite(scores) == (middle[0] >= np.sort(middle[0])[-16])).all()
    assert 16 <= np.isfinite(scores).sum() <= 17


def test_scores_of_several_horizons_are_averaged():
    observation = observe(Agents.of([[3.0, 1.0]], [[-0.5, 0.0]], [0.3]), walls=wall_ahead(5.0))

    alone = [Lookahead(nearness, FOUR, Rule((horizon,))).evaluate(*batched(observation))[0]
             for horizon in (1, 3, 5)]
    together, _ = Lookahead(nearness, FOUR, Rule((1, 3, 5))).evaluate(*batched(observation))

    assert together == pytest.approx(np.mean(alone, axis=0))


def test_the_goal_ends_a_rollout_and_is_worth_ten():
    def high(features):
        return np.full(len(features.robot), 1000.0)
    observation = observe(PASSER, goal=np.array([0.5, 0.0]))

    scores, rollout = Lookahead(high, FOUR, Rule((4,))).evaluate(*batched(observation))

    # 0.2, then 0.4 m: within 0.2 m of the goal. Nothing after it counts, least of all a value.
    step = 0.9 ** 0.2
    assert rollout.over[0, 1].tolist() == [False, True, True, True]
    assert rollout.rewards[0, 1, 2:].tolist() == [0.0, 0.0]
    assert scores[0, 1] == pytest.approx(0.022 + step * 10.022)
    assert scores[0, STOP] > 900.0


def test_a_predicted_collision_excludes_an_action_however_high_its_value():
    def ahead(features):
        return 1000.0 * -features.robot[:, 0].astype(float)
    # 0.15 m of room straight ahead, 0.2 m to go; turning does not help, standing does.
    agents = Agents.of([[0.65, 0.0], [-4.0, 0.0]], [[0.0, 0.0], [-0.8, 0.0]], [0.3, 0.3])

    decision = Lookahead(ahead, FOUR).decide(observe(agents))

    assert np.isinf(decision.scores[1])
    assert decision.action == STOP
    assert decision.safe


def test_an_agent_that_will_have_gone_is_not_collided_with():
    """Between the steps' ends positions are interpolated: relative motion decides."""
    # A disc in the way now, leaving as fast as the robot comes.
    leaving = Agents.of([[0.55, 0.0]], [[0.8, 0.0]], [0.3])

    assert Lookahead(nearness, FOUR).decide(observe(leaving)).action == 1


def test_a_collision_half_way_through_a_step_is_seen():
    """A small fast agent that crosses between two steps' ends."""
    crossing = Agents.of([[0.1, -1.0]], [[0.0, 8.0]], [0.1])

    decision = Lookahead(nearness, FOUR).decide(observe(crossing))

    assert np.isinf(decision.scores).all()


def test_walls_are_felt_half_way_too():
    """A thin wall in the middle of a step of 0.8 m at 3.2 m/s: the ends are 0.4 m clear of it."""
    scores = Lookahead(nearness, FOUR).decide(
        observe(PASSER, walls=wall_ahead(0.4), preferred_speed=np.float64(3.2))).scores

    assert np.isinf(scores[1])
    assert np.isfinite(scores[STOP])


def test_where_every_action_collides_the_robot_stops_and_says_so():
    agents = Agents.of([[0.3, 0.0]], [[0.0, 0.0]], [0.3])

    decision = Lookahead(nearness, FOUR).decide(observe(agents))

    assert not decision.safe
    assert decision.action == STOP
    assert decision.command.tolist() == [0.0, 0.0]
    assert np.isinf(decision.scores).all()


def test_a_collision_later_on_costs_but_does_not_exclude():
    agents = Agents.of([[0.75, 0.0]], [[0.0, 0.0]], [0.2])

    scores, rollout = Lookahead(nothing, FOUR, Rule((3,), reward='R1')).evaluate(
        *batched(observe(agents)))

    # 0.35 m of room: a step of 0.2 m (gap 0.15: discomfort 0.5 x 0.05), then a collision.
    assert not rollout.collided[0, 1]
    assert rollout.over[0, 1].tolist() == [False, True, True]
    assert scores[0, 1] == pytest.approx(-0.025 - 0.5 * 0.9 ** 0.2)


def test_brushing_past_a_walking_agent_costs_and_past_a_standing_one_does_not():
    # Side by side, 0.1 m apart and equally fast: the gap stays 0.1 m while driving straight on.
    walking = Agents.of([[0.0, 0.5]], [[0.8, 0.0]], [0.2])
    standing = Agents.of([[0.2, 0.5]], [[0.0, 0.0]], [0.2])

    def straight_on(agents, caution):
        return Lookahead(nothing, FOUR, Rule(caution=caution)).decide(observe(agents)).scores[1]

    # A caution of 0.25 s asks for 0.2 m at 0.8 m/s: half of it is missing.
    assert straight_on(walking, 0.0) - straight_on(walking, 0.25) == pytest.approx(0.5)
    assert straight_on(standing, 0.0) == straight_on(standing, 0.25)


def test_standing_still_for_someone_who_comes_nearer_is_paid():
    agents = Agents.of([[1.5, 0.5]], [[-0.5, 0.0]], [0.3])

    _, rollout = Lookahead(nothing, FOUR, Rule(reward='R2')).evaluate(*batched(observe(agents)))

    assert rollout.rewards[0, STOP] == pytest.approx(0.02)
    assert rollout.rewards[0, 1] == pytest.approx(0.002)


def test_the_value_is_asked_of_agents_where_they_will_be():
    seen = []

    def record(features):
        seen.append(features)
        return np.zeros(len(features.robot))
    agents = Agents.of([[3.0, 0.0]], [[0.0, 1.0]], [0.3])

    Lookahead(record, FOUR, Rule((2,))).decide(observe(agents))

    # After half a second: the robot at (0.4, 0), the agent at (3, 0.5), in units of 5 m.
    straight = seen[0].agents[1, 0]
    assert straight[:4] == pytest.approx([2.6 / 5.0, 0.5 / 5.0, 0.0, 1.0], abs=1e-6)


def test_of_a_great_crowd_the_nearest_decide(rng):
    # Sixteen in a ring of 2 m about the robot, and a multitude beyond them.
    bearing = 2.0 * np.pi * np.arange(16) / 16.0
    ring = 2.0 * np.stack((np.cos(bearing), np.sin(bearing)), axis=1)
    far = ring[rng.integers(16, size=60)] * rng.uniform(2.0, 6.0, (60, 1))
    near = Agents.of(ring, np.zeros((16, 2)), np.full(16, 0.1))
    crowd = Agents.of(np.vstack((far, ring)), np.zeros((76, 2)), np.full(76, 0.1))
    seen = []
    lookahead = Lookahead(lambda state: seen.append(state) or nearness(state), FOUR)

    among_all, among_near = (lookahead.decide(observe(agents)) for agents in (crowd, near))

    assert seen[0].present.shape == (4, 16)
    assert among_all.scores == pytest.approx(among_near.scores)


def test_absent_agents_change_nothing(rng):
    agents = Agents.of(rng.uniform(-2.0, 2.0, (4, 2)) + [2.5, 0.0], rng.normal(0.0, 0.5, (4, 2)),
                       np.full(4, 0.3))
    present = np.array([True, False, True, False])
    padded = replace(agents, present=present,
                     position=np.where(present[:, None], agents.position, 0.0))
    without = Agents(*(part[present] for part in vars(agents).values()))
    lookahead = Lookahead(nearness, make_actions(), Rule((1, 3)))

    assert (lookahead.decide(observe(padded)).scores
            == lookahead.decide(observe(without)).scores).all()


@pytest.mark.parametrize('horizons', [(1,), (2, 4)])
def test_a_batch_is_decided_state_by_state(rng, horizons):
    count = 6
    robots = Robot(rng.uniform(-3.0, 3.0, (count, 3)), np.zeros((count, 2)),
                   rng.uniform(-3.0, 3.0, (count, 2)), rng.uniform(0.15, 0.35, count),
                   rng.uniform(0.3, 1.0, count))
    agents = Agents.of(rng.uniform(-3.0, 3.0, (count, 5, 2)), rng.normal(0.0, 0.7, (count, 5, 2)),
                       rng.uniform(0.1, 0.5, (count, 5)))
    lookahead, walls = Lookahead(nearness, make_actions(), Rule(horizons)), wall_ahead(4.0)

    together, rollout = lookahead.evaluate(robots, agents, walls)

    for row in range(count):
        alone = lookahead.decide(Observation(
            Robot(*(part[row] for part in vars(robots).values())),
            Agents(*(part[row] for part in vars(agents).values())), walls))
        expected = np.where(rollout.collided[row], -np.inf, together[row])
        assert alone.scores == pytest.approx(expected)
        assert alone.action == expected.argmax() or not alone.safe


@pytest.mark.parametrize('bearing, turn_rate', [(0.0, 0.0), (0.6, 1.575), (-0.6, -1.8)])
def test_with_nothing_in_the_way_the_robot_turns_towards_its_goal(bearing, turn_rate):
    goal = 4.0 * np.array([np.cos(bearing), np.sin(bearing)])

    decision = Lookahead(nearness, make_actions()).decide(observe(goal=goal))

    assert decision.command == pytest.approx([0.8, turn_rate])


def test_the_rule_comes_with_the_weights_unless_overridden():
    class Weights:
        motion = None
        metadata = {'decision': {'horizons': [2, 4], 'caution': 0.1}, 'time_step': 0.2,
                    'discount': 0.95, 'reward': 'R2', 'actions': {'max_turn_rate': 1.0}}

    lookahead = Lookahead.from_weights(Weights())

    assert lookahead.rule == Rule((2, 4), 0.2, 0.95, 'R2', 0.1)
    assert np.abs(lookahead.actions.turn_rate).max() == 1.0
    assert Lookahead.from_weights(Weights(), [1]).rule.horizons == (1,)


def test_a_turn_that_is_held_leads_out_where_one_step_of_it_does_not():
    # A person comes head on; a step of the turn leaves the robot on their way, three do not.
    left = ActionSet(np.array([0.0, 1.0]), np.array([0.0, 1.6]))
    crowd = Agents.of([[2.3, 0.0]], [[-1.0, 0.0]], [0.4])
    once, held = (Lookahead(nothing, left, Rule((6,), aversion=1.0, turns=turns)).evaluate(
        *batched(observe(crowd))) for turns in ((1,), (1, 4)))

    assert once[1].survival[0, 1].tolist()[-1] == 0.0
    assert held[1].survival[0, 1].tolist() == [1.0] * 6
    # Four steps of 0.4 rad, then straight on.
    assert held[1].poses[0, 1, :, 2] == pytest.approx([0.4, 0.8, 1.2, 1.6, 1.6, 1.6])
    assert held[0].shape == (1, 2)
    assert held[0][0, 1] > once[0][0, 1]


@pytest.mark.parametrize('horizons', [(4,), (2, 4, 6)])
def test_where_every_way_is_clear_no_turn_is_held(horizons):
    # All values are below 0: a way that nobody has looked at must not pass for worth nothing.
    once, held = (Lookahead(nearness, make_actions(), Rule(horizons, turns=turns)).decide(
        observe(PASSER)) for turns in ((1,), (1, 3)))

    assert (held.scores == once.scores).all()
    assert held.path == pytest.approx(once.path)


def test_every_action_keeps_its_place_however_many_ways_begin_with_it():
    lookahead = Lookahead(nothing, make_actions(), Rule((2,), reward='R2', turns=(1, 2)))

    decision = lookahead.decide(observe(PASSER, goal=np.array([-4.0, 0.0])))
    _, rollout = lookahead.evaluate(*batched(observe(PASSER)))

    assert len(decision.scores) == 81
    assert rollout.poses.shape == (1, 81, 2, 3)
    assert rollout.action.tolist() == list(range(81))


BESIDE = Agents.of([[1.0, 5.0]], [[0.0, 0.0]], [0.3])    # far to the side, and standing


def test_a_contact_that_may_happen_costs_its_chance_of_what_would_be_lost():
    # One step ahead the other way stands in the robot's: 0.4 of all that follows is lost.
    rule = Rule((1,), reward='R1', aversion=2.0)
    lookahead = Lookahead(lambda features: np.ones(len(features.robot)), FOUR, rule,
                          TwoWays(0.4, (0.6, 0.0)))

    decision = lookahead.decide(observe(BESIDE))

    # 0.2 m nearer at 0.01 a metre is paid before; gamma^(dt v) = 0.9^0.2.
    assert decision.scores[1] == pytest.approx(0.002 - 2.0 * 0.4 + 0.6 * 0.9 ** 0.2)


def test_whom_the_robot_cannot_come_near_to_changes_nothing():
    far = Agents.of([[9.0, 0.0]], [[1.0, 0.0]], [0.3])
    lookahead = Lookahead(nothing, FOUR, Rule((3,)), TwoWays(0.4, (9.0, 0.0), 0.1))

    alone = lookahead.decide(observe()).scores
    assert lookahead.decide(observe(far)).scores == pytest.approx(alone)


@pytest.mark.parametrize('chance, ahead, speed', [(0.6, 2.2, 0.0), (0.4, 2.1, 1.0)])
def test_the_network_is_shown_people_where_they_most_likely_will_be(chance, ahead, speed):
    walker = Agents.of([[2.6, 0.0]], [[-1.0, 0.0]], [0.3])
    shown = []

    def value(features):
        shown.append(features)
        return nothing(features)
    lookahead = Lookahead(value, FOUR, Rule((2,)), TwoWays(chance, (2.2, 0.0)))
    lookahead.decide(observe(walker))

    # Half a second later, seen from where the robot stood; columns: x / 5 m, and the speed.
    still = np.flatnonzero(shown[0].robot[:, 5] == 0.0)[0]
    assert shown[0].agents[still, 0, 0] * 5.0 == pytest.approx(ahead)
    assert shown[0].agents[still, 0, 7] == pytest.approx(speed)


def test_a_sub_goal_is_not_the_goal():
    near = observe(goal=np.array([0.3, 0.0]))
    lookahead = Lookahead(nothing, FOUR, Rule((1,)))

    assert lookahead.decide(near).scores[1] > 9.0
    assert lookahead.decide(replace(near, robot=replace(
        near.robot, beyond=np.float64(2.0)))).scores[1] < 1.0


def test_the_warning_zone_of_r3_is_felt_where_the_step_ends():
    # Walking away at 1 m/s: the zone reaches 0.3 + 0.5 x 1 m beyond its 0.3 m. It goes from 1.2
    # to 1.45 m, the robot from 0 to 0.2 m: 1.25 m apart, 0.15 m outside. Standing still it is
    # 1.45 m away; one that comes nearer, at 0.95 m, is 0.15 m or 0.35 m inside.
    def score(agents, action):
        lookahead = Lookahead(nothing, FOUR, Rule((1,), reward='R3'))
        return lookahead.decide(observe(Agents.of(*agents))).scores[action]

    away = ([[1.2, 0.0]], [[1.0, 0.0]], [0.3])
    towards = ([[1.2, 0.0]], [[-1.0, 0.0]], [0.3])
    assert score(away, 1) == pytest.approx(0.002)
    assert score(towards, 0) == pytest.approx(0.2 * (np.exp(-0.15) - 0.3))
    assert score(towards, 1) == pytest.approx(0.2 * (np.exp(-0.35) - 0.3))


def test_where_nobody_walks_waiting_is_no_choice():
    # Standing would be worth most; nothing would ever change.
    def still(features):
        return -100.0 * features.robot[:, 5].astype(float)        # the robot's speed
    stands = Agents.of([[1.5, 1.0]], [[0.0, 0.0]], [0.3])

    assert Lookahead(still, FOUR).decide(observe(PASSER)).action == STOP
    for agents in (None, stands):
        decision = Lookahead(still, FOUR).decide(observe(agents))
        assert decision.action != STOP
        assert decision.safe
