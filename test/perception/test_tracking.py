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
"""The tracker as its users see it: who is followed, named, forgotten and never invented."""

import discs as discs_seen
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

from wallnav_ros.perception.scan import Scan, ScanError
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import to_child
from wallnav_ros.world.tracks import HUMAN, OBSTACLE
from wallnav_ros.world.walls import Walls

BEAMS = 720
ANGLES = -np.pi + 2.0 * np.pi / BEAMS * np.arange(BEAMS)
ROOM = Walls.from_polylines([[[-4, -3], [6, -3], [6, 3], [-4, 3]]], closed=True)
PERIOD = 0.1


def look(discs, pose=(0.0, 0.0, 0.0), walls=ROOM, rng=None):
    """Return the ranges from `pose`; discs: rows of x, y, radius."""
    pose = np.asarray(pose, dtype=float)
    ranges = walls.raycast(pose[:2], ANGLES + pose[2], 12.0)
    ranges = discs_seen.before(ranges, ANGLES, pose, discs)
    if rng is not None:
        ranges = ranges + rng.normal(0.0, 0.01, BEAMS)
    return ranges


def scan_at(stamp, ranges):
    return Scan(stamp, ranges, -np.pi, 2.0 * np.pi / BEAMS, 0.1, 10.0)


def follow(tracker, discs_at, steps, start=0.0, pose_at=None, **more):
    """Run `steps` scans of what `discs_at(time)` returns; returns the Tracks of each."""
    rng = np.random.default_rng(5)
    results = []
    for step in range(steps):
        time = start + PERIOD * step
        pose = np.zeros(3) if pose_at is None else pose_at(time)
        results.append(tracker.update(
            scan_at(time, look(discs_at(time), pose, rng=rng)), pose, **more))
    return results


def near(tracks, point, within=0.3):
    """Return the index of the track within `within` metres of `point`, or None."""
    gap = np.linalg.norm(tracks.position - point, axis=1)
    return int(gap.argmin()) if len(gap) and gap.min() < within else None


def test_a_walker_is_one_human_with_its_speed():
    results = follow(Tracker(), lambda time: [(2.0, -1.5 + time, 0.25)], 30)
    index = near(results[-1], [2.0, 1.4])
    assert results[-1].label[index] == HUMAN
    np.testing.assert_allclose(results[-1].velocity[index], [0.0, 1.0], atol=0.15)
    assert results[-1].radius[index] == pytest.approx(0.25, abs=0.05)
    ids = {int(number) for tracks in results for number in tracks.id[tracks.label == HUMAN]}
    assert len(ids) == 1


def test_a_pillar_is_an_obstacle_that_stands():
    results = follow(Tracker(), lambda time: [(2.0, 0.5, 0.2)], 30)
    index = near(results[-1], [2.0, 0.5])
    assert results[-1].label[index] == OBSTACLE
    assert results[-1].velocity[index].tolist() == [0.0, 0.0]


def test_nothing_that_stands_walks_when_the_robot_drives():
    pillars = [(2.0, 1.0, 0.15), (3.0, -1.0, 0.1), (4.0, 0.5, 0.2)]
    results = follow(Tracker(), lambda time: pillars, 40,
                     pose_at=lambda time: np.array([-2.0 + 0.8 * time, 0.0, 0.5 * time]))
    assert not any((tracks.label == HUMAN).any() for tracks in results)


def test_one_who_has_walked_and_stands_stays_human():
    results = follow(Tracker(), lambda time: [(2.0, min(-1.5 + time, 0.5), 0.25)], 70)
    index = near(results[-1], [2.0, 0.5])
    assert results[-1].label[index] == HUMAN
    assert np.hypot(*results[-1].velocity[index]) < 0.2


@pytest.mark.parametrize('since, people', [(0.0, False), (2.0, True)])
def test_who_has_only_just_begun_to_look_believes_no_way_alone(since, people):
    # Somebody comes and goes 0.8 m within 0.8 s; no beam returns from anything else, so that
    # nothing but the way tells who it is.
    tracker, rng = Tracker(), np.random.default_rng(5)
    humans = []
    for time in PERIOD * np.arange(45):
        discs = [(1.9, min(time - since, 0.8), 0.15)] * bool(time >= since)
        ranges = discs_seen.before(np.full(BEAMS, np.inf), ANGLES, np.zeros(3), discs)
        ranges = np.where(np.isfinite(ranges), ranges, np.nan) + rng.normal(0.0, 0.01, BEAMS)
        humans.append((tracker.update(scan_at(time, ranges), np.zeros(3)).label == HUMAN).any())
    assert any(humans) is people


def test_a_walker_keeps_its_identity_behind_a_pillar():
    results = follow(Tracker(), lambda time: [(2.5, -1.6 + time, 0.2), (1.2, 0.0, 0.15)], 33)
    before = results[8].id[near(results[8], [2.5, -0.8])]
    after = results[-1].id[near(results[-1], [2.5, 1.6])]
    assert before == after


def test_whoever_leaves_is_forgotten_within_a_second():
    tracker = Tracker()
    follow(tracker, lambda time: [(2.0, -1.0 + time, 0.25)], 20)
    results = follow(tracker, lambda time: [], 11, start=2.0)
    assert near(results[-1], [2.0, 1.5], within=1.5) is None


def mapped_room():
    """Return the DistanceField of the room's walls."""
    nodes = np.stack(np.meshgrid(np.arange(-5, 7.01, 0.1), np.arange(-4, 4.01, 0.1)), axis=-1)
    distance = ROOM.distance(nodes.reshape(-1, 2)).reshape(nodes.shape[:2]).astype(np.float32)
    return DistanceField(distance, np.array([-5.0, -4.0, 0.0]), 0.1)


def test_mapped_walls_are_no_tracks():
    results = follow(Tracker(), lambda time: [(2.0, 0.5, 0.2)], 10, walls=mapped_room())
    assert len(results[-1]) == 1


def test_legs_that_swing_are_one_person():
    def legs(time):
        swing = 0.2 * np.sin(2.0 * np.pi * time)
        return [(2.0 + swing, -1.5 + 0.8 * time, 0.06), (2.0 - swing, -1.3 + 0.8 * time, 0.06)]
    results = follow(Tracker(), legs, 30)
    assert (results[-1].label == HUMAN).sum() == 1
    assert near(results[-1], [2.0, 0.92]) is not None


@pytest.mark.parametrize('apart, people', [(0.4, 1), (0.7, 2)])
def test_two_that_go_closer_than_shoulders_allow_are_one_person(apart, people):
    def discs_at(time):
        return [(2.0, -1.5 + time, 0.14), (2.0, -1.5 + time - apart, 0.14)]
    results = follow(Tracker(), discs_at, 30)
    ids = {int(number) for tracks in results for number in tracks.id[tracks.label == HUMAN]}
    assert len(ids) == people


def test_a_known_body_is_where_it_is_though_a_pillar_hides_its_side():
    # 0.45 m wide either way at 2 m; the pillar at 1 m covers all beyond 0.1 m to its left.
    def discs_at(time):
        pillar = [(1.0, 0.25, 0.2)] if time > 0.95 else []
        return [(2.0, 0.0, 0.45), *pillar]
    tracks = follow(Tracker(), discs_at, 15)[-1]
    index = near(tracks, [2.0, 0.0])
    assert np.linalg.norm(tracks.position[index] - [2.0, 0.0]) < 0.05
    assert tracks.radius[index] == pytest.approx(0.45, abs=0.03)


def test_two_people_who_meet_and_touch_are_two():
    def discs_at(time):
        aside = 0.36 + max(0.0, 1.2 - 0.6 * time)
        return [(2.0, -aside, 0.35), (2.0, aside, 0.35)]
    before, after = (follow(Tracker(), discs_at, steps)[-1] for steps in (15, 40))
    for side in (-1.0, 1.0):
        met, parted = near(after, [2.0, 0.36 * side], 0.05), near(before, [2.0, 0.72 * side], 0.1)
        assert met is not None and after.id[met] == before.id[parted]


def test_in_a_mapped_room_a_body_is_known_to_walk_after_a_step_of_ten_centimetres():
    def discs_at(time):
        return [(2.0, -0.5 + 0.4 * time, 0.3), (1.0, 1.5, 0.3)]
    tracker, named = Tracker(), None
    for tracks in follow(tracker, discs_at, 12, walls=mapped_room()):
        walker = near(tracks, [2.0, -0.5 + 0.4 * tracks.stamp])
        if named is None and walker is not None and tracks.label[walker] == HUMAN:
            named = tracks.stamp
        standing = near(tracks, [1.0, 1.5])
        assert standing is None or tracks.label[standing] == OBSTACLE
    # 0.1 m take 0.25 s, the odds an eighth of a second, and a scan comes every tenth.
    assert named is not None and named < 0.65


@pytest.mark.parametrize('seed', range(6))
def test_a_walker_keeps_name_and_identity_in_falling_snow(seed):
    rng = np.random.default_rng(seed)

    def discs_at(time):
        swing, y = 0.2 * np.sin(2.0 * np.pi * time), -1.6 + 0.8 * time
        legs = [(2.0 + swing, y - 0.1, 0.07), (2.0 - swing, y + 0.1, 0.07)]
        flakes = rng.uniform([1.0, y - 1.0], [2.6, y + 1.0], (16, 2))
        return legs + [(*place, 0.008) for place in flakes]
    ids = []
    for tracks in follow(Tracker(), discs_at, 45)[15:]:
        gap = np.linalg.norm(tracks.position - [2.0, -1.6 + 0.8 * tracks.stamp], axis=1)
        person = np.flatnonzero((gap < 0.5) & (tracks.label == HUMAN))
        assert len(person) == 1
        ids.append(int(tracks.id[person[0]]))
    assert len(set(ids)) == 1


def test_a_clock_set_back_starts_anew_with_new_identities():
    tracker = Tracker()
    before = follow(tracker, lambda time: [(2.0, 0.5, 0.2)], 10, start=100.0)[-1]
    after = follow(tracker, lambda time: [(2.0, 0.5, 0.2)], 10, start=5.0)[-1]
    assert tracker.resets == 1
    assert not set(before.id.tolist()) & set(after.id.tolist())


def test_two_scanners_see_one_person():
    tracker, rng = Tracker(), np.random.default_rng(7)
    mounts = {'front': np.array([0.3, 0.0, 0.0]), 'rear': np.array([-0.3, 0.0, np.pi])}
    for step in range(30):
        for offset, (name, mount) in enumerate(mounts.items()):
            time = PERIOD * step + 0.03 * offset
            ranges = look([(2.0, -1.5 + time, 0.25)], mount, rng=rng)
            tracks = tracker.update(scan_at(time, ranges), mount, sensor=name)
    assert (tracks.label == HUMAN).sum() == 1
    assert near(tracks, [2.0, 1.43]) is not None


def test_without_odometry_a_driving_robot_invents_nobody():
    tracker, rng = Tracker(), np.random.default_rng(3)
    pillars = [(2.0, 1.0, 0.15), (3.0, -1.0, 0.1), (0.0, 1.5, 0.2)]
    for step in range(40):
        pose = np.array([-2.0 + 0.08 * step, 0.0, 0.03 * step])
        tracks = tracker.update(scan_at(PERIOD * step, look(pillars, pose, rng=rng)))
        assert not (tracks.label == HUMAN).any()
    place = to_child(pose, np.array([2.0, 1.0]))
    assert near(tracks, place) is not None


wild = st.floats(width=32, allow_nan=True, allow_infinity=True)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(
    st.lists(st.one_of(wild, st.floats(0.0625, 30.0, width=32)), max_size=60), wild, wild, wild,
    wild, wild, st.floats(-1.0, 3.0)), min_size=1, max_size=6))
def test_any_scan_gives_finite_tracks_or_is_refused(messages):
    tracker, stamp = Tracker(), 10.0
    for ranges, angle_min, increment, low, high, time_increment, elapsed in messages:
        stamp += elapsed
        try:
            scan = Scan(stamp, ranges, angle_min, increment, low, high, time_increment)
        except ScanError:
            continue
        tracks = tracker.update(scan)
        for values in (tracks.position, tracks.velocity, tracks.radius):
            assert np.isfinite(values).all()
        assert (tracks.radius >= 0.0).all()


@settings(max_examples=100, deadline=None)
@given(st.lists(st.lists(st.one_of(st.floats(0.05, 12.0), st.just(np.inf), st.just(np.nan)),
                         min_size=90, max_size=90), min_size=2, max_size=8),
       st.sampled_from([0.02, -0.02, 2 * np.pi / 90]))
def test_any_ranges_give_finite_tracks(sweeps, increment):
    tracker = Tracker()
    for number, ranges in enumerate(sweeps):
        tracks = tracker.update(Scan(0.1 * number, ranges, -1.0, increment, 0.1, 10.0, 1e-4))
        assert np.isfinite(tracks.position).all() and np.isfinite(tracks.velocity).all()
        assert len(set(tracks.id.tolist())) == len(tracks)
