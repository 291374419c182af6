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
"""A first look through small bags: cells and beams, mounts and odometry, worked by hand."""

from math import degrees, inf, nan, pi, radians, sqrt

import numpy as np
import pytest

rosbags = pytest.importorskip('rosbags')

from recorded_bags import Bag, laser_scan, odometry, transform  # noqa: E402
from wallnav_ros.evaluation import survey as survey_module  # noqa: E402
from wallnav_ros.evaluation.recordings import Mount, Recording, RecordingError  # noqa: E402
from wallnav_ros.evaluation.survey import survey_recording, upright  # noqa: E402
from wallnav_ros.perception.scan import Scan  # noqa: E402

pytestmark = pytest.mark.extras

ODOMETRY = 'nav_msgs/msg/Odometry'


@pytest.fixture
def survey(tmp_path):
    """Return a function that writes a bag of (topic, message) pairs, a second apart, and looks."""
    def look(*pairs, laser_pose=(0.0, 0.0, 0.0), topics=None):
        bag = Bag()
        for number, (topic, message) in enumerate(pairs):
            bag.add(100.0 + number, topic, message)
        path = bag.write(tmp_path / 'bag', mcap=True, topics=topics)
        return survey_recording(Recording(path), laser_pose)

    return look


def beam(stamp, length, frame='laser'):
    """Return a scan of one beam, straight ahead."""
    return '/scan', laser_scan(stamp, [length], frame=frame, angle_min=0.0)


def moved(stamp, x, y, yaw, twist=(0.0, 0.0, 0.0), child='base_link'):
    """Return the odometry of a robot at x, y, yaw."""
    return '/odom', odometry(stamp, (x, y, yaw), twist, child=child)


def test_beams_that_end_in_one_cell_are_one_point_and_a_count(survey):
    # Cells reach from 1.00 to 1.05 m and from 1.05 to 1.10 m.
    found = survey(beam(1.0, 1.01), beam(2.0, 1.04), beam(3.0, 1.06), laser_pose=(0.0, 0.02, 0.0))

    np.testing.assert_allclose(found.points, [[1.01, 0.02], [1.06, 0.02]], atol=1e-6)
    assert found.hits.tolist() == [2, 1]


def test_cells_on_either_side_of_zero_are_two(survey):
    found = survey(beam(1.0, 0.99), beam(2.0, 1.01), laser_pose=(-1.0, 0.02, 0.0))

    np.testing.assert_allclose(found.points, [[-0.01, 0.02], [0.01, 0.02]], atol=1e-6)
    assert found.hits.tolist() == [1, 1]


def test_points_that_share_a_row_or_a_column_are_told_apart(survey):
    # Four beams from (0.02, 0.02): back, right, ahead, left.
    found = survey(('/scan', laser_scan(1.0, [1.0, 2.0, 3.0, 4.0])), laser_pose=(0.02, 0.02, 0.0))

    np.testing.assert_allclose(
        found.points, [[-0.98, 0.02], [0.02, -1.98], [0.02, 4.02], [3.02, 0.02]], atol=1e-5)
    np.testing.assert_allclose(found.origins, np.full((4, 2), 0.02))


def test_beams_that_met_nothing_leave_no_point(survey):
    # The scanner measures up to 12 m.
    found = survey(('/scan', laser_scan(1.0, [inf, nan, 12.5, 2.0])))

    np.testing.assert_allclose(found.points, [[0.0, 2.0]], atol=1e-5)


def test_an_open_field_has_no_points_but_scans(survey):
    found = survey(beam(1.0, inf), beam(2.0, inf))

    assert (found.points.shape, found.origins.shape, found.hits.shape) == ((0, 2), (0, 2), (0,))
    assert len(found.scan_times) == 2


@pytest.mark.parametrize('batch', [1, 5, 400_000])
def test_it_makes_no_difference_how_many_points_are_boiled_down_at_once(
        survey, monkeypatch, batch):
    monkeypatch.setattr(survey_module, '_BATCH', batch)

    found = survey(*(beam(number, 1.02 + 0.005 * number) for number in range(5)),
                   *(beam(number, 2.02) for number in range(5, 8)))

    # 1.02 to 1.04 m lie in one cell, whose point is the first of them.
    np.testing.assert_allclose(found.points, [[1.02, 0.0], [2.02, 0.0]], atol=1e-6)
    assert found.hits.tolist() == [5, 3]
    assert found.hits.dtype == np.int64


def test_of_a_long_recording_every_nth_scan_gives_points_and_all_give_times(survey, monkeypatch):
    monkeypatch.setattr(survey_module, '_MOST_SCANS', 2)

    found = survey(*(beam(number, 1.02 + number) for number in range(5)))

    # 5 scans are two times 2 and more: every third.
    np.testing.assert_allclose(found.points[:, 0], [1.02, 4.02], atol=1e-6)
    assert found.scan_times.tolist() == [100.0, 101.0, 102.0, 103.0, 104.0]


def test_the_laser_is_where_odometry_has_the_robot_between_two_messages(survey):
    # Three quarters of the way from (0, 0) at 0 degrees to (4, 0) at 120 degrees.
    found = survey(moved(10.0, 0, 0, 0), beam(13.0, 2.0), moved(14.0, 4, 0, radians(120)),
                   laser_pose=(1.0, 0.0, 0.0))

    np.testing.assert_allclose(found.origins, [[3.0, 1.0]], atol=1e-9)
    np.testing.assert_allclose(found.points, [[3.0, 3.0]], atol=1e-6)


def test_a_laser_that_looks_aside_sees_aside(survey):
    found = survey(moved(10.0, 0, 0, pi / 2), beam(10.0, 2.0), laser_pose=(1.0, 0.5, pi / 2))

    # 1 m ahead and 0.5 m to the left of a robot that faces up; from there 2 m backwards in x.
    np.testing.assert_allclose(found.origins, [[-0.5, 1.0]], atol=1e-9)
    np.testing.assert_allclose(found.points, [[-2.5, 1.0]], atol=1e-6)


def test_a_turn_past_half_a_circle_goes_the_short_way(survey):
    found = survey(moved(10.0, 0, 0, radians(170)), beam(11.0, 2.0),
                   moved(12.0, 0, 0, radians(-170)))

    np.testing.assert_allclose(found.points, [[-2.0, 0.0]], atol=1e-6)
    np.testing.assert_allclose([degrees(yaw) for yaw in found.path[:, 2]], [170.0, 190.0])


@pytest.mark.parametrize('stamp, x', [(5.0, 3.0), (10.0, 3.0), (11.0, 4.0), (60.0, 5.0)])
def test_before_and_after_odometry_the_robot_stands(survey, stamp, x):
    found = survey(moved(10.0, 3.0, 0, 0), beam(stamp, 1.0), moved(12.0, 5.0, 0, 0))

    np.testing.assert_allclose(found.origins, [[x, 0.0]], atol=1e-9)


def test_odometry_out_of_order_is_sorted_and_the_first_of_one_stamp_counts(survey):
    found = survey(moved(5.0, 0, 0, 0, (0.1, 0, 0)), moved(7.0, 2, 0, 0, (0.3, 0, -0.4)),
                   moved(6.0, 1, 0, 0, (0.2, 0.5, 0)), moved(7.0, 9, 9, 9, (9, 9, 9)),
                   beam(6.0, 1.0))

    assert found.stamps.tolist() == [5.0, 6.0, 7.0]
    np.testing.assert_allclose(found.path, [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    np.testing.assert_allclose(found.twists, [[0.1, 0, 0], [0.2, 0.5, 0], [0.3, 0, -0.4]])
    np.testing.assert_allclose(found.origins, [[1.0, 0.0]])


def test_without_odometry_there_is_one_pose_at_zero_and_no_frame_of_it(survey):
    found = survey(beam(1.0, 1.0, frame='/front_laser'))

    assert (found.odom_frame, found.base_frame, found.laser_frame) == (None, None, 'front_laser')
    assert found.path.tolist() == found.twists.tolist() == [[0.0, 0.0, 0.0]]


def test_only_usable_scans_have_times_and_latencies(survey):
    found = survey(beam(40.0, 1.0), ('/scan', laser_scan(41.0, [])), beam(103.5, 1.0))

    assert found.scan_times.tolist() == [100.0, 102.0]
    np.testing.assert_allclose(found.latencies, [60.0, -1.5])


@pytest.mark.parametrize('frames, pose, source', [
    (('cart', 'cart'), (0.0, 0.0, 0.0), 'scan is in cart'),
    (('cart', 'laser'), (1.0, 2.0, 0.5), 'tf cart -> laser'),
    ((None, 'laser'), (3.0, 4.0, -0.5), 'tf base_link -> laser'),
    (('cart', 'camera'), (0.0, 0.0, 0.0), 'unknown'),
])
def test_the_mount_is_looked_up_from_the_frame_that_odometry_moves(survey, frames, pose, source):
    base, laser = frames
    drive = [] if base is None else [moved(1.0, 0, 0, 0, child=base)]

    found = survey(*drive, beam(1.0, 1.0, frame=laser),
                   ('/tf_static', transform('cart', 'laser', 1.0, 2.0, 0.5)),
                   ('/tf_static', transform('base_link', 'laser', 3.0, 4.0, -0.5)),
                   laser_pose=None)

    np.testing.assert_allclose(found.mount.pose, pose, atol=1e-9)
    assert found.mount_source == source


def test_a_laser_upside_down_sees_on_the_right_what_it_has_on_its_left(survey):
    # A beam at 45 degrees to its left; the scanner hangs 1 m ahead of the robot.
    found = survey(moved(1.0, 0, 0, 0),
                   ('/scan', laser_scan(1.0, [2.0], angle_min=pi / 4)),
                   ('/tf_static', transform('base_link', 'laser', 1.0, 0.0, 0.0, roll=pi)),
                   laser_pose=None)

    np.testing.assert_allclose(found.points, [[1.0 + sqrt(2.0), -sqrt(2.0)]], atol=1e-6)


def test_upright_mirrors_a_scan_only_where_the_laser_hangs_upside_down():
    scan = Scan(stamp=1.0, ranges=np.array([1.0, 2.0, 3.0]), angle_min=-0.5, angle_increment=0.25,
                range_min=0.1, range_max=9.0, time_increment=0.01)

    turned = upright(scan, Mount(np.zeros(3), upside_down=True))

    np.testing.assert_allclose(turned.angles, [0.5, 0.25, 0.0])
    assert turned.ranges.tolist() == [1.0, 2.0, 3.0]
    assert (turned.stamp, turned.time_increment) == (1.0, 0.01)
    assert upright(scan, Mount(np.zeros(3))) is scan


@pytest.mark.parametrize('broken', [[], [('/scan', laser_scan(2.0, []))]])
def test_a_silent_odometry_is_refused_as_empty_whatever_the_scans(survey, broken):
    with pytest.raises(RecordingError, match=r'/odom: no message in it can be used \(it is empty'):
        survey(beam(1.0, 1.0), *broken, topics={'/odom': ODOMETRY})


def test_a_refusal_names_every_reason(survey):
    broken = laser_scan(1.0, [1.0], angle_min=nan)

    with pytest.raises(RecordingError, match='ranges: no beams; angle_min: not finite'):
        survey(('/scan', laser_scan(1.0, [])), ('/scan', broken))
