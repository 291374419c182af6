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
"""Angles, frames, arcs and distances, against numbers worked by hand."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from wallnav_ros.world.geometry import (
    closest_approach, compose, distances, drive_unicycle, invert, lengths, nearest_on_segments,
    rotate, to_child, to_parent, wrap_angle, yaw_of)

METRES = st.floats(-100.0, 100.0)
ANGLES = st.floats(-20.0, 20.0)
POSES = st.tuples(METRES, METRES, ANGLES).map(np.array)
POINTS = st.tuples(METRES, METRES).map(np.array)
repeatably = settings(max_examples=100, deadline=None, derandomize=True)


@pytest.mark.parametrize('angle, wrapped', [
    (0.0, 0.0), (np.pi, -np.pi), (-np.pi, -np.pi), (1.5 * np.pi, -0.5 * np.pi),
    (-1.5 * np.pi, 0.5 * np.pi), (7.0, 7.0 - 2.0 * np.pi), (200.0 * np.pi, 0.0)])
def test_angles_are_wrapped_to_minus_pi_and_below_pi(angle, wrapped):
    assert wrap_angle(angle) == pytest.approx(wrapped, abs=1e-12)


@repeatably
@given(angle=st.floats(-1e6, 1e6))
def test_a_wrapped_angle_points_the_same_way(angle):
    wrapped = wrap_angle(angle)

    assert -np.pi <= wrapped < np.pi
    assert np.cos(wrapped - angle) == pytest.approx(1.0, abs=1e-9)


def test_rotation_is_counter_clockwise():
    np.testing.assert_allclose(rotate([1.0, 0.0], np.pi / 2), [0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(rotate([[1.0, 2.0], [1.0, 2.0]], [np.pi, -np.pi / 2]),
                               [[-1.0, -2.0], [2.0, -1.0]], atol=1e-12)


def test_a_point_ahead_of_a_robot_that_looks_along_y_lies_along_y():
    pose = np.array([2.0, 3.0, np.pi / 2])

    np.testing.assert_allclose(to_parent(pose, [1.0, 0.0]), [2.0, 4.0], atol=1e-12)
    np.testing.assert_allclose(to_parent(pose, [0.0, 1.0]), [1.0, 3.0], atol=1e-12)
    np.testing.assert_allclose(to_child(pose, [2.0, 4.0]), [1.0, 0.0], atol=1e-12)


@repeatably
@given(pose=POSES, point=POINTS)
def test_to_child_undoes_to_parent(pose, point):
    np.testing.assert_allclose(to_child(pose, to_parent(pose, point)), point, atol=1e-9)


def test_poses_are_composed_from_the_outside_in():
    # A laser 0.2 m ahead of a robot at (1, 1) that looks to the left, itself turned back by pi.
    np.testing.assert_allclose(compose([1.0, 1.0, np.pi / 2], [0.2, 0.0, np.pi]),
                               [1.0, 1.2, -np.pi / 2], atol=1e-12)


@repeatably
@given(first=POSES, second=POSES, point=POINTS)
def test_composed_poses_carry_points_like_one_after_the_other(first, second, point):
    np.testing.assert_allclose(to_parent(compose(first, second), point),
                               to_parent(first, to_parent(second, point)), atol=1e-8)


@repeatably
@given(pose=POSES)
def test_a_pose_and_its_inverse_cancel(pose):
    for identity in (compose(pose, invert(pose)), compose(invert(pose), pose)):
        np.testing.assert_allclose(identity[:2], 0.0, atol=1e-8)
        assert abs(wrap_angle(identity[2])) < 1e-8


@pytest.mark.parametrize('linear, angular, reached', [
    (1.0, 0.0, (2.0, 0.0, 0.0)),                            # straight on for 2 s
    (0.0, 0.5, (0.0, 0.0, 1.0)),                            # on the spot
    (np.pi / 2, np.pi / 2, (0.0, 2.0, -np.pi)),             # half a circle of radius 1 m
    (-np.pi / 4, np.pi / 4, (-1.0, -1.0, np.pi / 2)),       # backwards, a quarter of that
    (1.0, 1e-9, (2.0, 2e-9, 2e-9)),                         # all but straight
])
def test_a_unicycle_drives_along_its_arc(linear, angular, reached):
    np.testing.assert_allclose(drive_unicycle(np.zeros(3), linear, angular, 2.0), reached,
                               atol=1e-9)


@repeatably
@given(pose=POSES, linear=st.floats(-2.0, 2.0), angular=st.floats(-3.0, 3.0),
       duration=st.floats(0.0, 2.0))
def test_driving_in_two_halves_reaches_the_same_pose(pose, linear, angular, duration):
    whole = drive_unicycle(pose, linear, angular, duration)
    half = drive_unicycle(drive_unicycle(pose, linear, angular, duration / 2), linear, angular,
                          duration / 2)

    np.testing.assert_allclose(half[:2], whole[:2], atol=1e-9)
    assert abs(wrap_angle(half[2] - whole[2])) < 1e-9


@pytest.mark.parametrize('quaternion, yaw', [
    ((0.0, 0.0, 0.0, 1.0), 0.0),
    ((0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)), np.pi / 2),
    ((0.0, 0.0, -np.sqrt(0.5), -np.sqrt(0.5)), np.pi / 2),     # the same turn, other signs
    ((0.0, 0.0, -0.5, np.sqrt(0.75)), -np.pi / 3),
    ((0.0, np.sin(0.2), 0.0, np.cos(0.2)), 0.0)])              # pitch alone is no yaw
def test_the_yaw_of_a_quaternion(quaternion, yaw):
    assert yaw_of(*quaternion) == pytest.approx(yaw, abs=1e-12)
    assert yaw_of(*(1.01 * part for part in quaternion)) == pytest.approx(yaw, abs=1e-12)


@pytest.mark.parametrize('quaternion', [(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.1),
                                        (np.nan, 0.0, 0.0, 1.0)])
def test_what_is_no_rotation_has_no_yaw(quaternion):
    with pytest.raises(ValueError, match='not of unit length'):
        yaw_of(*quaternion)


def test_distances_of_each_point_to_each_other():
    points, others = np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[3.0, 4.0], [3.0, -1.0]])
    np.testing.assert_allclose(distances(points, others), [[5.0, np.sqrt(10.0)], [4.0, 1.0]])
    assert distances(points, np.empty((0, 2))).shape == (2, 0)


def test_poses_and_velocities_broadcast():
    poses = drive_unicycle(np.zeros((3, 1, 3)), np.array([0.0, 1.0]), 0.0, 1.0)

    assert poses.shape == (3, 2, 3)
    assert poses[2, 1].tolist() == [1.0, 0.0, 0.0]


def test_the_nearest_point_on_a_segment_is_its_foot_or_an_end():
    segments = np.array([[[0.0, 0.0], [4.0, 0.0]], [[1.0, 1.0], [1.0, 1.0]]])

    nearest = nearest_on_segments([[3.0, 2.0], [-1.0, -1.0], [9.0, 0.0]], segments)

    assert nearest[:, 0].tolist() == [[3.0, 0.0], [0.0, 0.0], [4.0, 0.0]]
    assert nearest[:, 1].tolist() == [[1.0, 1.0]] * 3


@pytest.mark.parametrize('offset, motion, distance', [
    ((2.0, 1.0), (-4.0, 0.0), 1.0),         # passes at 1 m half way
    ((2.0, 1.0), (4.0, 0.0), 5 ** 0.5),     # moves off: nearest at the start
    ((2.0, 0.0), (-1.0, 0.0), 1.0),         # still coming at the end
    ((3.0, 4.0), (0.0, 0.0), 5.0),          # stands
    ((1.0, 1.0), (-2.0, -2.0), 0.0)])       # goes through
def test_closest_approach_within_a_step(offset, motion, distance):
    assert closest_approach(np.array(offset), np.array(motion)) == pytest.approx(distance)


@repeatably
@given(offset=POINTS, motion=POINTS, time=st.floats(0.0, 1.0))
def test_no_moment_of_the_step_is_nearer_than_the_closest_approach(offset, motion, time):
    assert closest_approach(offset, motion) <= np.hypot(*(offset + time * motion)) + 1e-9


def test_lengths_are_those_of_vectors():
    assert lengths(np.array([[3.0, 4.0], [0.0, 0.0]])).tolist() == [5.0, 0.0]
