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
"""Recorded bags: what is read, which topics are chosen, and how a bad bag is refused."""

import math

import numpy as np
import pytest

rosbags = pytest.importorskip('rosbags')

from recorded_bags import Bag, laser_scan, odometry, transform  # noqa: E402
from refusals import refusal_of  # noqa: E402
from wallnav_ros.evaluation import recordings  # noqa: E402
from wallnav_ros.evaluation.recordings import (  # noqa: E402
    OdometryRecord, Recording, RecordingError, ScanRecord)

pytestmark = pytest.mark.extras

RANGES = [1.0, 2.0, math.inf, math.nan]


def small_bag():
    """Return a bag of two scans around one odometry message, with odd times and frames."""
    bag = Bag()
    bag.add(100.0, '/scan', laser_scan(50.0, RANGES, frame='/laser'))
    bag.add(100.1, '/odom', odometry(50.05, (1.0, 2.0, 0.5), (0.7, 0.1, -0.2), '/odom', '/base'))
    bag.add(100.2, '/scan', laser_scan(50.1, RANGES, frame='/laser'))
    return bag


@pytest.mark.parametrize('mcap', [False, True])
@pytest.mark.parametrize('zstd', [False, True])
def test_scans_and_odometry_come_in_the_order_they_were_received(tmp_path, mcap, zstd):
    recording = Recording(small_bag().write(tmp_path / 'bag', mcap, zstd))

    first, between, last = recording.records()

    assert (type(first), type(between), type(last)) == (ScanRecord, OdometryRecord, ScanRecord)
    assert (first.bag_time, first.scan.stamp) == pytest.approx((100.0, 50.0))
    assert (last.bag_time, last.scan.stamp) == pytest.approx((100.2, 50.1))
    np.testing.assert_array_equal(first.scan.ranges, RANGES)
    assert first.scan.angle_increment == pytest.approx(math.pi / 2)
    np.testing.assert_allclose(between.pose, (1.0, 2.0, 0.5))
    np.testing.assert_allclose(between.twist, (0.7, 0.1, -0.2))


@pytest.mark.parametrize('most_kept', [0, 4, 8], ids=['none', 'one scan of two', 'all'])
def test_a_second_look_shows_the_same_whether_it_was_kept_or_is_read_again(
        tmp_path, monkeypatch, most_kept):
    monkeypatch.setattr(recordings, '_MOST_KEPT', most_kept)
    bag = small_bag()
    bag.add(100.3, '/odom', odometry(50.3, (0.0, 0.0, 0.0), scale=2.0))
    recording = Recording(bag.write(tmp_path / 'bag'))

    first, rejected = list(recording.records()), recording.rejected
    second = list(recording.records())

    assert [record.bag_time for record in second] == [record.bag_time for record in first]
    np.testing.assert_array_equal(second[2].scan.ranges, first[2].scan.ranges)
    np.testing.assert_array_equal(second[1].pose, first[1].pose)
    assert recording.rejected == rejected and sum(rejected.values()) == 1
    assert (second[0] is first[0]) == (most_kept == 8)


def test_frames_lose_the_leading_slash_of_ros_1(tmp_path):
    first, between, _ = Recording(small_bag().write(tmp_path / 'bag')).records()

    assert (first.frame, between.frame, between.child_frame) == ('laser', 'odom', 'base')


def test_a_bag_can_be_read_twice_with_the_same_result(tmp_path):
    recording = Recording(small_bag().write(tmp_path / 'bag'))

    times = [[record.bag_time for record in recording.records()] for _ in range(2)]

    assert times[0] == times[1] == pytest.approx([100.0, 100.1, 100.2])


def test_a_topic_may_be_named_with_or_without_its_leading_slash(tmp_path):
    path = small_bag().write(tmp_path / 'bag')

    assert Recording(path, scan_topic='scan', odom_topic='/odom').scan_topic == '/scan'


def test_a_bag_without_odometry_is_fine(tmp_path):
    bag = Bag()
    bag.add(0.0, '/scan', laser_scan(0.0, RANGES))
    recording = Recording(bag.write(tmp_path / 'bag'))

    assert recording.odom_topic is None
    assert [type(record) for record in recording.records()] == [ScanRecord]


def test_of_two_scan_topics_the_only_one_with_messages_is_taken(tmp_path):
    path = small_bag().write(
        tmp_path / 'bag', topics={'/a_silent_scan': 'sensor_msgs/msg/LaserScan'})

    assert Recording(path).scan_topic == '/scan'


def test_unusable_messages_are_counted_by_reason_and_left_out(tmp_path):
    bag = small_bag()
    bag.add(100.3, '/scan', laser_scan(50.2, []))
    bag.add(100.4, '/odom', odometry(50.2, (math.nan, 0.0, 0.0)))
    bag.add(100.5, '/odom', odometry(50.3, (0.0, 0.0, 0.0), scale=0.0))
    recording = Recording(bag.write(tmp_path / 'bag'))

    assert len(list(recording.records())) == 3
    assert sorted(recording.rejected.items()) == [
        ('odometry: not finite', 1), ('odometry: the quaternion is not of unit length', 1),
        ('ranges: no beams', 1)]


def refusal(path, **choice):
    """Return the one line with which a bag is refused, whether at once or while it is read."""
    return refusal_of(
        RecordingError, lambda path: list(Recording(path, **choice).records()), path)


def test_several_scan_topics_are_refused_with_their_names(tmp_path):
    bag = small_bag()
    bag.add(100.0, '/rear_scan', laser_scan(50.0, RANGES))

    line = refusal(bag.write(tmp_path / 'bag'))

    assert '--scan-topic' in line
    assert '/rear_scan, /scan' in line


def test_a_bag_without_scans_is_refused_with_what_it_holds(tmp_path):
    bag = Bag()
    bag.add(0.0, '/odom', odometry(0.0, (0.0, 0.0, 0.0)))

    assert 'no sensor_msgs/msg/LaserScan among them (/odom)' in refusal(bag.write(tmp_path / 'b'))


def test_a_silent_scan_topic_is_refused(tmp_path):
    path = Bag().write(tmp_path / 'bag', topics={'/scan': 'sensor_msgs/msg/LaserScan'})

    assert '/scan: holds no message' in refusal(path)


def test_a_topic_of_another_type_or_none_is_refused(tmp_path):
    path = small_bag().write(tmp_path / 'bag')

    assert 'is a nav_msgs/msg/Odometry, needs a sensor_msgs/msg/LaserScan' in refusal(
        path, scan_topic='/odom')
    assert '--odom-topic /wheels: not in the bag, which holds /odom, /scan' in refusal(
        path, odom_topic='/wheels')


def test_a_missing_folder_or_metadata_is_refused(tmp_path):
    assert 'no such folder' in refusal(tmp_path / 'nowhere')
    assert 'metadata.yaml: missing' in refusal(tmp_path)


@pytest.mark.parametrize('text', ['', '[1]', '{[', 'rosbag2_bagfile_information: {version: 99}',
                                  'rosbag2_bagfile_information: {}'])
def test_broken_metadata_is_refused(tmp_path, text):
    path = small_bag().write(tmp_path / 'bag')
    (path / 'metadata.yaml').write_text(text)

    assert 'cannot be read' in refusal(path)


@pytest.mark.parametrize('mcap', [False, True])
@pytest.mark.parametrize('share', [0.0, 0.01, 0.5, 0.9])
def test_a_truncated_recording_is_refused(tmp_path, mcap, share):
    bag = Bag()
    for number in range(200):
        bag.add(number, '/scan', laser_scan(number, np.full(300, 2.0)))
    path = bag.write(tmp_path / 'bag', mcap)
    stored, = path.glob('*.mcap' if mcap else '*.db3')
    whole = stored.read_bytes()
    stored.write_bytes(whole[:int(share * len(whole))])

    assert 'cannot be read' in refusal(path)


@pytest.mark.parametrize('mcap', [False, True])
def test_damage_anywhere_is_refused_or_harmless_but_never_a_traceback(tmp_path, mcap, rng):
    bag = small_bag()
    path = bag.write(tmp_path / 'bag', mcap)
    stored, = path.glob('*.mcap' if mcap else '*.db3')
    whole = np.frombuffer(stored.read_bytes(), dtype=np.uint8)
    refused = 0
    for _ in range(60):
        damaged = whole.copy()
        damaged[rng.integers(len(whole), size=20)] = rng.integers(256, size=20)
        stored.write_bytes(damaged.tobytes())
        try:
            list(Recording(path).records())
        except RecordingError as error:
            assert str(error).startswith(str(path))
            refused += 1

    assert refused


def test_the_mount_follows_the_chain_of_transforms(tmp_path):
    bag = small_bag()
    bag.add(99.0, '/tf_static', transform('/base', 'plate', 1.0, 0.0, math.pi / 2))
    bag.add(99.0, '/tf_static', transform('plate', '/laser', 0.5, 0.0, math.pi / 4))
    mount = Recording(bag.write(tmp_path / 'bag')).mount('base', 'laser')

    # Half a metre ahead of a plate that looks left: half a metre to the left of (1, 0).
    np.testing.assert_allclose(mount.pose, (1.0, 0.5, 0.75 * math.pi), atol=1e-12)
    assert not mount.upside_down


def test_the_mount_is_found_from_child_to_parent_and_in_tf(tmp_path):
    bag = small_bag()
    bag.add(99.0, '/tf', transform('laser', 'base', 2.0, 0.0, math.pi))

    mount = Recording(bag.write(tmp_path / 'bag')).mount('base', 'laser')

    np.testing.assert_allclose(mount.pose[:2], (2.0, 0.0), atol=1e-12)
    assert abs(mount.pose[2]) == pytest.approx(math.pi)


def test_a_laser_that_hangs_upside_down_is_noticed(tmp_path):
    bag = small_bag()
    bag.add(99.0, '/tf_static', transform('base', 'laser', 0.1, 0.0, 0.3, roll=math.pi))

    mount = Recording(bag.write(tmp_path / 'bag')).mount('base', 'laser')

    assert mount.upside_down
    np.testing.assert_allclose(mount.pose, (0.1, 0.0, 0.3), atol=1e-9)


def test_without_a_chain_there_is_no_mount(tmp_path):
    bag = small_bag()
    bag.add(99.0, '/tf_static', transform('odom', 'base', 0.0, 0.0, 0.0))

    assert Recording(bag.write(tmp_path / 'bag')).mount('base', 'laser') is None


@pytest.mark.parametrize('folder, scan_topic, scans, frame, odometry_count', [
    ('leg_tracker_bench_moving_1/rosbag2', None, 873, 'left_laser', 11561),
    ('leg_tracker_training/rosbag2_negative_2', 'rear_scan', 435, 'rear_laser', 0),
    ('olin_mac_1st_floor_take_2', None, 357, 'rplidar_link', 920),
    ('tamu_people_2023/example4', None, 144, 'laser', 0),
    ('tamu_people_2024/07_replayed_mcap', None, 371, 'laser', 0),
    ('body_811beam/rosbag2_pos', '/scan', 409, 'laser', 0),
])
def test_real_recordings_are_read_whole(
        shared_data, folder, scan_topic, scans, frame, odometry_count):
    recording = Recording(shared_data / 'scans' / folder, scan_topic=scan_topic)
    records = list(recording.records())
    kinds = [type(record) for record in records]

    assert kinds.count(ScanRecord) == recording.scan_count == scans
    assert kinds.count(OdometryRecord) == odometry_count
    assert {record.frame for record in records if isinstance(record, ScanRecord)} == {frame}
    times = [record.bag_time for record in records]
    assert times == sorted(times)
    assert not recording.rejected


def test_the_mount_of_the_wheelchair_is_where_its_authors_say(shared_data):
    recording = Recording(shared_data / 'scans/leg_tracker_bench_moving_1/rosbag2')

    np.testing.assert_allclose(
        recording.mount('base_link', 'left_laser').pose, (0.85, 0.235, 0.7344), atol=1e-3)
