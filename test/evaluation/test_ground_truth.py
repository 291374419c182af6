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
"""Annotated people: the CSV's columns, its faults, and which scan a row belongs to."""

import numpy as np
import pytest

rosbags = pytest.importorskip('rosbags')

from wallnav_ros.evaluation.ground_truth import COLUMNS, load_ground_truth  # noqa: E402
from wallnav_ros.evaluation.recordings import Recording, RecordingError, ScanRecord  # noqa: E402

pytestmark = pytest.mark.extras

HEADER = ','.join(COLUMNS)


def write(path, *rows, header=HEADER):
    """Write a CSV file and return its path."""
    path.write_text('\n'.join((header, *rows)) + '\n')
    return path


def test_rows_are_read_in_order_and_frames_lose_their_slash(tmp_path):
    truth = load_ground_truth(write(
        tmp_path / 'truth.csv', '12.5,0.5,3,1.0,-2.0,/laser', '13.5,1.5,4,0.5,0.25,odom'))

    assert len(truth) == 2
    np.testing.assert_allclose(truth.bag_time, (12.5, 13.5))
    np.testing.assert_array_equal(truth.person, (3, 4))
    np.testing.assert_allclose(truth.position, ((1.0, -2.0), (0.5, 0.25)))
    assert truth.frame.tolist() == ['laser', 'odom']


def test_a_row_belongs_to_the_last_scan_at_or_before_it(tmp_path):
    truth = load_ground_truth(write(
        tmp_path / 'truth.csv', *(f'{time},0,1,0,0,laser' for time in (0.9, 1.0, 1.99, 2.0, 9.0))))

    assert truth.scan_index([1.0, 2.0, 3.0]).tolist() == [-1, 0, 0, 1, 2]


@pytest.mark.parametrize('rows, header, told', [
    (['1,2,3,4,5,laser'], 'time,x,y', "line 1: header is 'time,x,y'"),
    (['1,2,3,4,laser'], HEADER, 'line 2: 5 columns, needs 6'),
    (['1,2,3,4,5,laser', 'soon,2,3,4,5,laser'], HEADER, "line 3: bag_time_s: 'soon' is not a num"),
    (['1,2,3.5,4,5,laser'], HEADER, "line 2: person_id: '3.5' is not a whole number"),
    (['1,2,3,nan,5,laser'], HEADER, 'line 2: x_m: must be finite'),
    (['1,2,3,1e300,5,laser'], HEADER, 'line 2: x_m: must be finite and below 1e18'),
    (['1,2,' + 50 * '9' + ',4,5,laser'], HEADER, 'line 2: person_id: must be finite and below'),
    ([], HEADER, 'holds no annotated position'),
])
def test_a_fault_is_named_with_its_line_and_column(tmp_path, rows, header, told):
    path = write(tmp_path / 'truth.csv', *rows, header=header)

    with pytest.raises(RecordingError) as caught:
        load_ground_truth(path)

    assert str(caught.value).startswith(f'{path}: {told}')


def test_a_file_that_is_missing_or_binary_is_refused(tmp_path):
    (tmp_path / 'binary.csv').write_bytes(b'\xff\xfe\x00\x80')
    for name in ('missing.csv', 'binary.csv'):
        with pytest.raises(RecordingError, match='cannot be read as CSV'):
            load_ground_truth(tmp_path / name)


def test_every_annotation_of_the_moving_wheelchair_has_a_beam_beside_it(shared_data):
    folder = shared_data / 'scans/leg_tracker_bench_moving_1'
    truth = load_ground_truth(folder / 'ground_truth_people.csv')
    scans = [record for record in Recording(folder / 'rosbag2').records()
             if isinstance(record, ScanRecord)]
    index = truth.scan_index([record.bag_time for record in scans])

    gaps = []
    for position, number in zip(truth.position, index):
        scan = scans[number].scan
        ends = scan.ranges[scan.hits, None] * np.stack(
            (np.cos(scan.angles), np.sin(scan.angles)), axis=1)[scan.hits]
        gaps.append(np.hypot(*(ends - position).T).min())

    assert len(truth) == 153
    assert set(truth.frame) == {scans[0].frame}
    assert max(gaps) < 0.3
