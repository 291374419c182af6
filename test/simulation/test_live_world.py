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
"""One episode in continuous time: the crowd of `evaluate`, a base with limits, an outcome."""

from crowds import run_crowd
import numpy as np
import pytest

from wallnav_ros.simulation.batch import (
    COLLISION, GOAL, RUNNING, TIMEOUT, WALL_COLLISION)
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.live_world import Base, CROWD_STEP, LiveWorld, Schedule, TICK
from wallnav_ros.simulation.scenarios import load_scenario

pytestmark = pytest.mark.extras
AHEAD, STILL = np.array([0.8, 0.0]), np.zeros(2)


def world_of(case='none', seed=3, **base):
    episode = draw_episode(load_scenario('cross_path'), case, seed)
    return LiveWorld(episode, Base(**base), np.random.default_rng(0))


def advance(world, command, duration):
    for _ in range(round(duration / TICK)):
        world.advance(command, TICK)


def test_people_walk_as_in_evaluation_with_the_same_seed():
    world = world_of('mixed')
    position, _ = run_crowd(world.episode, 12, CROWD_STEP)
    for step in range(1, 13):
        advance(world, STILL, CROWD_STEP)
        np.testing.assert_allclose(world.agents().position, position[step], atol=1e-9)


def test_between_two_steps_people_are_on_the_line_between_them():
    world = world_of('dynamic')
    position, _ = run_crowd(world.episode, 2, CROWD_STEP)
    advance(world, STILL, 1.5 * CROWD_STEP)
    np.testing.assert_allclose(world.agents().position, position[1:3].mean(axis=0), atol=1e-9)
    np.testing.assert_allclose(
        world.agents().velocity, (position[2] - position[1]) / CROWD_STEP, atol=1e-9)


def test_the_base_gains_speed_no_faster_than_it_can():
    world = world_of(acceleration=1.0)
    advance(world, AHEAD, 0.5)
    np.testing.assert_allclose(world.velocity, [0.5, 0.0])
    advance(world, np.array([9.0, 0.0]), 2.0)
    np.testing.assert_allclose(world.velocity, [world.base.max_speed, 0.0])


def test_odometry_starts_at_zero_and_agrees_with_the_robot_when_it_does_not_drift():
    world = world_of()
    advance(world, np.array([0.8, 0.2]), 2.0)
    start = world.episode.robot.pose
    travelled = world.pose[:2] - start[:2]
    turned = np.array([[0.0, 1.0], [-1.0, 0.0]]) @ travelled      # the robot starts facing north
    np.testing.assert_allclose(world.odometry[:2], turned, atol=1e-5)


def test_odometry_that_drifts_is_off_by_about_what_was_asked_for():
    errors = []
    for seed in range(60):
        world = world_of()
        world = LiveWorld(world.episode, Base(drift=0.02), np.random.default_rng(seed))
        advance(world, AHEAD, 2.0)
        errors.append(np.hypot(*world.odometry[:2]) / world.path_length - 1.0)
    assert np.std(errors) == pytest.approx(0.02, rel=0.35)


def test_a_localisation_is_off_by_about_its_noise():
    world = world_of(fix_noise=0.05, fix_turn_noise=0.02)
    errors = np.array([world.fix() - world.pose for _ in range(4000)])
    np.testing.assert_allclose(errors.std(axis=0), [0.05, 0.05, 0.02], rtol=0.25)


def test_a_localisation_speaks_again_once_the_robot_has_moved():
    world = world_of()
    assert world.next_fix() is not None and world.next_fix() is None
    # A turn by less than AMCL waits for, the shorter way round.
    world.pose = world.pose - (0.05, 0.0, 2.0 * np.pi + 0.05)
    assert world.next_fix() is None
    world.pose = world.pose - (0.06, 0.0, 0.0)
    np.testing.assert_allclose(world.next_fix()[:2], world.pose[:2])
    world.pose = world.pose - (0.0, 0.0, 0.11)
    assert world.next_fix() is not None


def test_what_is_due_at_a_rate_that_is_no_whole_number_of_ticks_keeps_it():
    schedule, times = Schedule(), TICK * np.arange(8000)
    due = {rate: sum(schedule.is_due(rate, rate, now) for now in times) for rate in (7.0, 40.0)}
    assert due == {7.0: 700, 40.0: 4000}


def test_the_robot_reaches_the_goal_and_the_episode_ends():
    world = world_of()
    advance(world, AHEAD, 12.0)
    assert world.outcome == GOAL
    # 8 m less the tolerance of 0.2 m, at 0.8 m/s, and the time to get there.
    assert world.time == pytest.approx(7.8 / 0.8 + 0.5 * 0.8 / world.base.acceleration, abs=0.03)
    assert world.path_length == pytest.approx(7.8, abs=0.02)
    assert not world.velocity.any()
    assert world.summary()['min_gap_agent'] is None


def test_driving_into_a_wall_ends_it():
    world = world_of()
    world.pose = np.array([0.0, -4.0, 0.0])
    advance(world, AHEAD, 5.0)
    assert world.outcome == WALL_COLLISION
    # The wall is at x = 2 and the robot 0.2 m in radius.
    assert world.pose[0] == pytest.approx(1.8, abs=0.02)


def test_touching_a_person_ends_it():
    world = world_of('static')
    person = world.episode.start[0]
    world.pose = np.array([*(person - (world.episode.radius[0] + 0.5, 0.0)), 0.0])
    advance(world, AHEAD, 2.0)
    assert world.outcome == COLLISION
    assert world.min_gap_agent <= 0.0


def test_standing_still_runs_out_of_time():
    world = world_of()
    assert world.outcome == RUNNING
    advance(world, STILL, 45.0)
    assert world.outcome == TIMEOUT and world.time == pytest.approx(45.0)


def test_trajectories_are_recorded_once_a_crowd_step():
    world = world_of('mixed')
    advance(world, STILL, 1.0)
    found = world.trajectories()
    np.testing.assert_allclose(found['times'], [0.0, 0.25, 0.5, 0.75])
    assert np.shape(found['agents']) == (4, 15, 2) and np.shape(found['robot']) == (4, 3)
