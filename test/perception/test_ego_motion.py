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
"""Where the laser is: odometry corrected by the scans, or the scans alone."""

import numpy as np
import pytest

from wallnav_ros.perception.ego_motion import EgoMotion
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.world.geometry import compose, invert, to_child, to_parent, wrap_angle
from wallnav_ros.world.walls import Walls

BEAMS = 360
BEARINGS = -np.pi + 2.0 * np.pi / BEAMS * np.arange(BEAMS)
# A room with a niche and a partition, so that no place in it looks like another.
ROOM = Walls.from_polylines([
    [[-4, -3], [5, -3], [5, 1], [6, 1], [6, 3], [-4, 3], [-4, -3]], [[1, -3], [1, -1.5]]])
CORRIDOR = Walls.from_polylines([[[-50, -1], [50, -1]], [[-50, 1], [50, 1]]])
NOBODY = np.empty((0, 2))
PERIOD = 0.1


def see(pose, walls=ROOM, noise=None):
    """Return the beam ends (P, 2) of a scan from `pose`, in the laser's frame, in beam order."""
    ranges = np.minimum(walls.raycast(np.asarray(pose[:2]), BEARINGS + pose[2], 12.0), 12.0)
    hit = ranges < 11.9
    if noise is not None:
        ranges = ranges + noise.normal(0.0, 0.01, BEAMS)
    return (ranges[:, None] * np.stack((np.cos(BEARINGS), np.sin(BEARINGS)), axis=1))[hit]


def path(count, step=(0.05, 0.0, 0.03), start=(-2.0, -1.0, 0.3)):
    """Return `count` poses (3,), each one `step` further, in the frame of the one before."""
    poses = [np.array(start)]
    while len(poses) < count:
        poses.append(compose(poses[-1], np.array(step)))
    return poses


def error(pose, truth):
    """Return how far (m) and how much turned (rad) `pose` is from `truth`."""
    gap = np.asarray(pose) - truth
    return np.hypot(gap[0], gap[1]), abs(wrap_angle(gap[2]))


def test_a_prediction_with_odometry_is_what_odometry_says():
    given = np.array([1.0, 2.0, 0.5])
    np.testing.assert_allclose(EgoMotion(TrackerSettings()).predict(given, True, 0.1), given)


def test_a_prediction_without_odometry_goes_on_as_before():
    motion = EgoMotion(TrackerSettings())
    motion.rate = np.array([0.5, 0.0, 0.2])
    mount = np.array([0.3, 0.0, np.pi])
    np.testing.assert_allclose(motion.predict(mount, False, 2.0),
                               compose(np.array([1.0, 0.0, 0.4]), mount))


def test_the_first_scan_is_where_it_is_said_to_be():
    given = np.array([1.0, -2.0, 0.5])
    motion = EgoMotion(TrackerSettings())
    np.testing.assert_allclose(
        motion.locate(see(given), NOBODY, given, True, 0.0, 0.0, 'scan'), given)


def follow(given, truth, noise, known=True, people=NOBODY, scene=see):
    """Return the EgoMotion after all scans and the pose it gave for each."""
    motion, poses = EgoMotion(TrackerSettings()), []
    for number, (told, pose) in enumerate(zip(given, truth)):
        poses.append(motion.locate(scene(pose, noise=noise), people, told, known,
                                   *2 * (PERIOD * (number > 0),), 'scan'))
    return motion, poses


def test_odometry_that_is_right_is_believed(rng):
    truth = path(60)
    motion, poses = follow(truth, truth, rng)
    assert max(error(*pair)[0] for pair in zip(poses, truth)) < 0.02
    assert max(error(*pair)[1] for pair in zip(poses, truth)) < 0.01
    assert motion.certain


def test_odometry_that_slips_is_put_right_by_the_scans(rng):
    # The wheels tell a fifth more than was driven, and turned: 0.6 m over the way.
    truth = path(60)
    given = path(60, step=(0.06, 0.0, 0.036))
    motion, poses = follow(given, truth, rng)
    assert error(given[-1], truth[-1])[0] > 0.5
    assert error(poses[-1], truth[-1])[0] < 0.05
    assert error(poses[-1], truth[-1])[1] < 0.02


def test_the_correction_takes_the_callers_frame_into_the_one_where_things_stand(rng):
    truth, given = path(40), path(40, step=(0.06, 0.0, 0.036))
    motion, poses = follow(given, truth, rng)
    np.testing.assert_allclose(compose(motion.correction, given[-1]), poses[-1], atol=1e-9)
    # The velocity is that over ground of the caller's robot, by its own odometry.
    np.testing.assert_allclose(motion.rate, np.array([0.06, 0.0, 0.036]) / PERIOD, atol=1e-9)


def test_a_robot_that_stands_by_its_odometry_is_not_moved_by_noise(rng):
    truth = [np.array([-2.0, -1.0, 0.3])] * 20
    _, poses = follow(truth, truth, rng)
    np.testing.assert_allclose(poses, truth, atol=1e-9)


@pytest.mark.parametrize('mount', [(0.0, 0.0, 0.0), (0.3, 0.1, 2.0)])
def test_without_odometry_the_scans_tell_how_the_robot_moves(rng, mount):
    mount = np.array(mount)
    robot = path(60)
    motion, poses = follow([mount] * 60, [compose(pose, mount) for pose in robot], rng, False)
    # All that can be known is the way since the first scan, when the frames were the same.
    way = compose(invert(robot[0]), robot[-1])
    assert error(motion.correction, way)[0] < 0.1
    assert error(motion.correction, way)[1] < 0.03
    np.testing.assert_allclose(motion.rate, np.array([0.05, 0.0, 0.03]) / PERIOD,
                               atol=0.15)


def test_along_a_plain_corridor_odometry_alone_tells_the_way():
    truth = path(40, step=(0.05, 0.0, 0.0), start=(0.0, 0.2, 0.0))
    _, poses = follow(truth, truth, None, scene=lambda pose, noise: see(pose, CORRIDOR))
    np.testing.assert_allclose(poses, truth, atol=1e-6)


def test_noise_on_the_walls_of_a_corridor_does_not_hold_the_robot_back(rng):
    # Walls say nothing of the way along them; normals that are off by noise seem to.
    truth = path(60, step=(0.1, 0.0, 0.0), start=(0.0, 0.2, 0.0))
    _, poses = follow(truth, truth, rng, scene=lambda pose, noise: see(pose, CORRIDOR, noise))
    assert max(error(*pair)[0] for pair in zip(poses, truth)) < 0.05


@pytest.mark.parametrize('points', [np.empty((0, 2)), np.ones((3, 2)),
                                    np.array([[2.0, 0.01 * row] for row in range(30)])])
def test_too_little_to_match_leaves_the_prediction(points):
    motion = EgoMotion(TrackerSettings())
    for given in path(3):
        pose = motion.locate(points, NOBODY, given, True, PERIOD, PERIOD, 'scan')
        np.testing.assert_allclose(pose, given, atol=1e-12)
        assert not motion.certain


def test_a_scan_of_another_place_is_not_believed(rng):
    motion = EgoMotion(TrackerSettings())
    motion.locate(see(path(1)[0]), NOBODY, np.zeros(3), True, 0.0, 0.0, 'scan')
    given = np.array([0.1, 0.0, 0.0])
    elsewhere = rng.uniform(-5.0, 5.0, (200, 2))
    np.testing.assert_allclose(
        motion.locate(elsewhere, NOBODY, given, True, PERIOD, PERIOD, 'scan'), given, atol=1e-12)
    assert not motion.certain


def disc(pose, place, radius, beams=BEAMS):
    """Return the beam ends on a disc at `place`, in the frame of the laser at `pose`."""
    centre = to_child(np.asarray(pose), np.asarray(place))
    bearings = -np.pi + 2.0 * np.pi / beams * np.arange(beams)
    ahead = np.cos(bearings) * centre[0] + np.sin(bearings) * centre[1]
    depth = radius ** 2 - (centre @ centre - ahead ** 2)
    hit = (ahead > 0.0) & (depth > 0.0)
    ranges = ahead[hit] - np.sqrt(depth[hit])
    return ranges[:, None] * np.stack((np.cos(bearings[hit]), np.sin(bearings[hit])), axis=1)


def test_one_person_close_by_does_not_tell_how_the_robot_moves():
    # 0.5 m wide at 0.7 m: some hundred beams of a fine scanner, all within two half-metre cells.
    motion, poses = EgoMotion(TrackerSettings()), path(2, step=(0.0, 0.0, 0.0))
    place = to_parent(poses[0], np.array([0.7, 0.0]))
    motion.locate(disc(poses[0], place, 0.25, 1440), NOBODY, poses[0], True, 0.0, 0.0, 'scan')
    told = compose(poses[0], np.array([0.02, 0.0, 0.0]))
    seen = disc(poses[0], place, 0.25, 1440)
    assert len(seen) > 100
    pose = motion.locate(seen, NOBODY, told, True, PERIOD, PERIOD, 'scan')
    np.testing.assert_allclose(pose, told, atol=1e-12)
    assert not motion.certain


def test_fifty_beams_at_least_must_agree():
    motion, poses = EgoMotion(TrackerSettings()), path(2)
    few = [see(pose)[:200:5] for pose in poses]
    assert len(few[0]) == 40
    for points, given in zip(few, poses):
        pose = motion.locate(points, NOBODY, given, True, PERIOD, PERIOD, 'scan')
        np.testing.assert_allclose(pose, given, atol=1e-12)
    assert not motion.certain


def test_beams_on_people_do_not_count_as_things_that_stand():
    """A board walks along, half of all that is seen; the room must win, and wins if it is told."""
    start = np.array([-2.0, -1.0, 0.0])
    board = np.stack((np.linspace(1.0, 1.6, 300), np.full(300, 0.4)), axis=1)
    told = compose(start, np.array([0.06, 0.0, 0.0]))
    results = []
    for people in (to_parent(start, np.array([[1.15, 0.4], [1.5, 0.4]])), NOBODY):
        motion = EgoMotion(TrackerSettings())
        motion.locate(np.concatenate((board, see(start))), NOBODY, start, True, 0.0, 0.0, 'scan')
        # The robot stands, whatever its odometry says, and the board turns before it.
        turned = board + np.stack((np.zeros(300), 0.3 * (board[:, 0] - 1.0)), axis=1)
        points = np.concatenate((turned, see(start)))
        pose = motion.locate(points, people, told, True, PERIOD, PERIOD, 'scan')
        results.append(error(pose, start))
    (spared, spared_turn), (dragged, dragged_turn) = results
    assert spared < 0.01 and spared_turn < 0.005
    assert spared_turn < dragged_turn


def test_each_scanner_has_a_memory_of_its_own(rng):
    motion = EgoMotion(TrackerSettings())
    mounts = {'front': np.array([0.3, 0.0, 0.0]), 'rear': np.array([-0.3, 0.0, np.pi])}
    given = path(40, step=(0.06, 0.0, 0.036))
    for number, (pose, told) in enumerate(zip(path(40), given)):
        for name, mount in mounts.items():
            found = motion.locate(see(compose(pose, mount), noise=rng), NOBODY,
                                  compose(told, mount), True, *2 * (PERIOD * (number > 0),), name)
            assert error(found, compose(pose, mount))[0] < 0.05
    # A third one has nothing to be matched to: it goes by what the others found.
    third = compose(told, np.array([0.0, 0.3, 1.0]))
    np.testing.assert_allclose(
        motion.locate(see(compose(pose, [0.0, 0.3, 1.0]), noise=rng), NOBODY, third, True, 0.0,
                      0.0, 'third'), compose(motion.correction, third), atol=1e-12)


def test_without_odometry_a_second_scanner_makes_no_speed_of_noise(rng):
    """Two scanners 10 ms out of step: a few millimetres of noise in 10 ms are no speed."""
    motion, stamps = EgoMotion(TrackerSettings()), {}
    mounts = {'front': np.array([0.3, 0.0, 0.0]), 'rear': np.array([-0.3, 0.0, np.pi])}
    robot, rates, last = path(1)[0], [], 0.0
    for number in range(40):
        for offset, (name, mount) in zip((0.0, 0.01), mounts.items()):
            stamp = PERIOD * number + offset
            motion.locate(see(compose(robot, mount), noise=rng), NOBODY, mount, False,
                          stamp - last, stamp - stamps.get(name, stamp), name)
            last = stamps[name] = stamp
            rates.append(np.hypot(*motion.rate[:2]))
    assert np.mean(rates) < 0.03 and max(rates) < 0.1


def test_an_untracked_robot_that_sees_nothing_it_knows_stands():
    motion = EgoMotion(TrackerSettings())
    motion.rate = np.array([0.6, 0.0, 0.0])

    motion.locate(np.empty((0, 2)), NOBODY, np.zeros(3), False, PERIOD, PERIOD, 'scan')

    assert motion.correction == pytest.approx(np.zeros(3))
    assert not motion.certain


def pace_along(poses):
    """Return the pace after a scan of nothing at each of `poses` (3,), PERIOD apart."""
    motion = EgoMotion(TrackerSettings())
    for number, pose in enumerate(poses):
        elapsed = PERIOD * (number > 0)
        motion.locate(np.empty((0, 2)), NOBODY, np.asarray(pose), True, elapsed, elapsed, 'scan')
    return motion.pace


def test_a_pace_is_metres_and_radians_a_second():
    assert pace_along(path(20, step=(0.05, 0.0, 0.0))) == pytest.approx(0.5)
    assert pace_along(path(20, step=(0.0, 0.0, 0.03))) == pytest.approx(0.3)
    assert pace_along(path(2, step=(0.05, 0.0, 0.03))) == pytest.approx(0.5 + 0.3)


def test_scans_that_are_placed_to_and_fro_are_no_pace():
    # 0.3 m/s from each scan to the next, and nowhere in a second.
    to_and_fro = [np.array([0.03 * (step % 2), 0.0, 0.0]) for step in range(20)]
    assert pace_along(to_and_fro) < 0.01


def test_a_pace_is_over_a_second_after_the_robot_has_stopped():
    poses = path(20, step=(0.05, 0.0, 0.0))
    assert pace_along(poses + 5 * poses[-1:]) > 0.05
    assert pace_along(poses + 11 * poses[-1:]) == pytest.approx(0.0, abs=1e-9)
