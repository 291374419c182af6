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
"""Several scanners in one tracker: each thing once, whoever sees it."""

import discs as discs_seen
import numpy as np
import pytest

from wallnav_ros.perception.scan import Scan
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.world.geometry import compose, distances
from wallnav_ros.world.tracks import HUMAN
from wallnav_ros.world.walls import Walls

BEAMS = 270
FIRST, STEP = -0.75 * np.pi, 1.5 * np.pi / (BEAMS - 1)
ANGLES = FIRST + STEP * np.arange(BEAMS)
ROOM = Walls.from_polylines([[[-5, -4], [5, -4], [5, 4], [-5, 4]]], closed=True)
MOUNTS = {'front': np.array([0.3, 0.0, 0.0]), 'rear': np.array([-0.3, 0.0, np.pi])}
PERIOD = 0.1


def look(discs, pose, stamp, rng):
    """Return a scan over 270 degrees from `pose` of the room and discs (x, y, radius)."""
    ranges = ROOM.raycast(pose[:2], ANGLES + pose[2], 12.0)
    ranges = discs_seen.before(ranges, ANGLES, pose, discs)
    return Scan(stamp, ranges + rng.normal(0.0, 0.01, BEAMS), FIRST, STEP, 0.1, 11.0)


def follow(discs_at, count, lag=0.01, robot_at=None, odometry=True, mounts=MOUNTS):
    """Return the Tracks after each scan; the rear scanner follows the front one by `lag` s."""
    tracker, rng, results = Tracker(), np.random.default_rng(11), []
    for number in range(count):
        for offset, (name, mount) in enumerate(mounts.items()):
            time = PERIOD * number + lag * offset
            robot = np.zeros(3) if robot_at is None else robot_at(time)
            pose = compose(robot, mount)
            results.append(tracker.update(
                look(discs_at(time), pose, time, rng), pose if odometry else mount,
                odometry=odometry, sensor=name))
    return results


def near(tracks, point, within=0.3):
    """Return how many tracks are within `within` metres of `point`."""
    return int((np.linalg.norm(tracks.position - point, axis=1) < within).sum())


@pytest.mark.parametrize('lag', [0.0, 0.01, 0.05, 0.09])
@pytest.mark.parametrize('odometry', [True, False])
def test_what_only_one_scanner_sees_is_known_as_soon_and_for_as_long(lag, odometry):
    # The rear scanner cannot see what is straight ahead, nor the front one what is behind.
    pillars = [(3.0, 0.5, 0.2), (-3.0, 0.5, 0.2)]
    results = follow(lambda time: pillars, 40, lag, odometry=odometry)
    for x, y, _ in pillars:
        counts = [near(tracks, (x, y)) for tracks in results]
        assert 1 in counts[:10]
        assert counts[10:] == [1] * 70
    # Nothing is born twice, scan after scan.
    assert max(tracks.id.max(initial=0) for tracks in results) < 20


def test_a_walker_passes_from_one_scanner_to_the_other():
    def walker(time):
        return [(-2.5 + time, 1.5, 0.25)]
    results = follow(walker, 50)
    humans = [tracks.id[tracks.label == HUMAN].tolist() for tracks in results]
    assert humans[20] and all(found == humans[20] for found in humans[20:])
    assert near(results[-1], (-2.5 + 4.9, 1.5)) == 1
    speed = results[-1].velocity[results[-1].label == HUMAN]
    np.testing.assert_allclose(speed, [[1.0, 0.0]], atol=0.15)


def test_evidence_does_not_count_twice_because_two_scanners_look():
    """A person to the side, in both views, is named human no sooner than by one scanner."""
    def walker(time):
        return [(-0.8 + 0.8 * time, 1.5, 0.25)]

    def named(mounts):
        results = follow(walker, 25, lag=0.05, mounts=mounts)
        return next(tracks.stamp for tracks in results if (tracks.label == HUMAN).any())
    one = named({'front': MOUNTS['front']})
    assert one - 0.11 <= named(MOUNTS) <= one + 0.11


def test_nothing_that_stands_walks_when_the_robot_drives():
    pillars = [(3.0, 1.0, 0.15), (-3.0, -1.0, 0.1), (2.0, -2.0, 0.2), (-2.0, 2.0, 0.15)]
    results = follow(lambda time: pillars, 40,
                     robot_at=lambda time: np.array([-1.0 + 0.5 * time, 0.0, 0.3 * time]))
    assert not any((tracks.label == HUMAN).any() for tracks in results)


@pytest.mark.extras
def test_two_real_scanners_follow_one_person_all_around_the_robot(shared_data):
    """The mounts are those of the recording's own demo; the robot stands still."""
    recordings = pytest.importorskip('wallnav_ros.evaluation.recordings')
    bag = shared_data / 'scans/obstacle_detector_two_scanners/rosbag2'
    mounts = {'/front_scan': np.array([0.2357, -0.0005, 0.0]),
              '/rear_scan': np.array([-0.2383, 0.0054, np.pi])}
    scans = {topic: [(record.bag_time, topic, record.scan)
                     for record in recordings.Recording(bag, topic).records()]
             for topic in mounts}

    def track(*topics):
        tracker, results = Tracker(), []
        received = sorted((each for topic in topics for each in scans[topic]),
                          key=lambda each: each[0])
        for _, source, scan in received:
            results.append(tracker.update(scan, mounts[source], sensor=source))
        return results

    both, front, rear = track(*mounts), track('/front_scan'), track('/rear_scan')
    begin, places = both[0].stamp, {}
    for tracks in both:
        for number in np.flatnonzero(tracks.label == HUMAN):
            places.setdefault(tracks.id[number], []).append(
                (tracks.stamp - begin, *tracks.position[number]))
    walkers = [np.array(way) for way in places.values()
               if np.ptp(np.array(way)[:, 1:], axis=0).max() > 2.0]
    # One person walks, before and behind the robot, and is one track from 10 s to the end.
    assert len(walkers) == 1
    walker = walkers[0]
    assert walker[0, 0] < 10.5 and walker[-1, 0] > 32.5
    assert len(walker) > 0.95 * sum(tracks.stamp - begin > walker[0, 0] for tracks in both)
    assert walker[:, 1].max() > 0.5 and walker[:, 1].min() < -2.3
    # What either scanner alone tracks at the end, both together do too.
    for alone in (front[-1], rear[-1]):
        assert (distances(alone.position, both[-1].position).min(axis=1) < 0.3).mean() > 0.85
    assert len(both[-1]) < len(front[-1]) + len(rear[-1])
