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
"""A recorded drive through survey, stage and navigator: where things are, and what is said."""

from dataclasses import replace

import numpy as np
import pytest

rosbags = pytest.importorskip('rosbags')
motmetrics = pytest.importorskip('motmetrics')

from recorded_bags import (  # noqa: E402
    Bag, FIRST_STAMP, HALL, laser_scan, MOUNT, odometry, simulate_drive, START, transform)
from wallnav_ros.evaluation.ground_truth import GroundTruth  # noqa: E402
from wallnav_ros.evaluation.recordings import Recording, RecordingError  # noqa: E402
from wallnav_ros.evaluation.replay import replay_recording  # noqa: E402
from wallnav_ros.evaluation.replay_scores import score_replay  # noqa: E402
from wallnav_ros.evaluation.replay_stage import set_stage  # noqa: E402
from wallnav_ros.evaluation.survey import survey_recording  # noqa: E402
from wallnav_ros.perception.tracking import Tracker  # noqa: E402
from wallnav_ros.policy.lookahead import Lookahead  # noqa: E402
from wallnav_ros.policy.value_function import load_value_function  # noqa: E402
from wallnav_ros.world.files import find_asset  # noqa: E402
from wallnav_ros.world.geometry import compose, to_child, to_parent  # noqa: E402
from wallnav_ros.world.tracks import HUMAN  # noqa: E402

pytestmark = pytest.mark.extras


@pytest.fixture(scope='module')
def drive():
    """Return the simulated Drive that most tests replay."""
    return simulate_drive()


@pytest.fixture(scope='module')
def recording(drive, tmp_path_factory):
    """Return that Drive as a Recording."""
    return Recording(drive.bag.write(tmp_path_factory.mktemp('drive') / 'bag', mcap=True))


def run(recording, stage):
    """Return the Replay of a Recording on a Stage, with the shipped weights."""
    weights = load_value_function(find_asset('models', 'wallnav', '.npz'))
    return replay_recording(recording, stage, Tracker(), Lookahead.from_weights(weights))


def walker_error(replay, drive, from_odom=np.zeros(3)):
    """Return how far (K,) the nearest human track is from the walker, where there is one."""
    truth = {round(stamp, 3): walker for stamp, walker in zip(drive.stamps, drive.walker)}
    errors = []
    for tracks in replay.tracks:
        people = tracks.position[tracks.label == HUMAN]
        if len(people):
            walker = to_parent(from_odom, truth[round(tracks.stamp, 3)])
            errors.append(np.hypot(*(people - walker).T).min())
    return np.array(errors)


def test_the_survey_lays_beams_on_the_walls(recording):
    survey = survey_recording(recording, MOUNT)

    steady = survey.hits >= 5
    gap = HALL.distance(to_parent(START, survey.points[steady]))
    assert steady.sum() > 500
    assert np.median(gap) < 0.02
    # Whatever is far from a wall was seen on the line that the walker takes.
    assert (np.abs(survey.points[steady][gap > 0.1, 1] - 0.7) < 0.3).all()
    assert survey.hits.sum() > 70 * 200


def test_the_survey_knows_the_way_and_the_frames(recording, drive):
    survey = survey_recording(recording, MOUNT)

    assert (survey.odom_frame, survey.base_frame, survey.laser_frame) == (
        'odom', 'base_link', 'laser')
    np.testing.assert_allclose(survey.path[0], (0.0, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(survey.path[-1, :2], drive.base[-1, :2], atol=0.06)
    np.testing.assert_allclose(survey.twists[5], (0.5, 0.0, 0.05))
    np.testing.assert_allclose(survey.latencies, 0.02, atol=1e-6)
    assert len(survey.scan_times) == len(drive.stamps)


def test_the_mount_comes_from_the_caller_then_tf_then_nowhere(tmp_path):
    bag = simulate_drive(1.0).bag
    bare = Recording(bag.write(tmp_path / 'bare'))
    bag.add(FIRST_STAMP + 2.0, '/tf_static', transform('base_link', 'laser', *MOUNT))
    told = Recording(bag.write(tmp_path / 'told'))

    for recording, given, pose, source in (
            (told, (1.0, 2.0, 3.0), (1.0, 2.0, 3.0), 'given'),
            (told, None, MOUNT, 'tf base_link -> laser'),
            (bare, None, (0.0, 0.0, 0.0), 'unknown')):
        survey = survey_recording(recording, given)
        np.testing.assert_allclose(survey.mount.pose, pose, atol=1e-9)
        assert survey.mount_source == source
    assert any('--laser-pose' in doubt for doubt in set_stage(survey).warnings)


def test_a_person_is_followed_in_the_frame_of_odometry(recording, drive):
    stage = set_stage(survey_recording(recording, MOUNT)).stage

    replay = run(recording, stage)

    errors = walker_error(replay, drive)
    assert stage.frame == 'odom'
    assert len(errors) > 40
    assert np.median(errors) < 0.1


def test_with_a_map_the_robot_is_located_and_tracks_are_in_the_map(recording, drive):
    staging = set_stage(survey_recording(recording, MOUNT), walls=HALL)

    replay = run(recording, staging.stage)

    np.testing.assert_allclose(staging.stage.map_from_odom, START, atol=0.03)
    assert staging.stage.frame == 'map'
    assert staging.summary['map']['used']
    assert np.median(walker_error(replay, drive, START)) < 0.1
    np.testing.assert_allclose(replay.robot_poses[0], to_map(drive.base[0]), atol=0.05)


def to_map(pose):
    """Return a pose (3,), given in the odometry's frame, in the hall."""
    return np.array([*to_parent(START, pose[:2]), pose[2] + START[2]])


def test_an_initial_pose_is_believed_without_matching(recording):
    pose = np.array([5.0, 1.0, 0.7])

    staging = set_stage(survey_recording(recording, MOUNT), walls=HALL, initial_pose=pose)

    np.testing.assert_allclose(staging.stage.map_from_odom, pose)
    assert staging.summary['map']['from'] == 'initial pose'


def test_a_map_of_another_place_is_left_out_with_a_warning(recording):
    elsewhere = replace(HALL, segments=HALL.segments[:4] * 3.0)

    staging = set_stage(survey_recording(recording, MOUNT), walls=elsewhere)

    assert (staging.stage.frame, staging.stage.walls, staging.walls) == ('odom', None, None)
    assert not staging.summary['map']['used']
    assert any('--initial-pose' in warning for warning in staging.warnings)


def test_the_goal_is_where_the_robot_ended_unless_given(recording, drive):
    survey = survey_recording(recording, MOUNT)

    assert set_stage(survey, goal=(3.0, 1.0)).stage.goal.tolist() == [3.0, 1.0]
    np.testing.assert_allclose(set_stage(survey).stage.goal, survey.path[-1, :2])
    in_map = set_stage(survey, walls=HALL, initial_pose=START).stage.goal
    np.testing.assert_allclose(in_map, to_parent(START, survey.path[-1, :2]))


def test_a_robot_without_odometry_stands_and_looks_five_metres_ahead(tmp_path):
    drive = simulate_drive(4.0, with_odometry=False)
    recording = Recording(drive.bag.write(tmp_path / 'bag'))
    staging = set_stage(survey_recording(recording, MOUNT))

    replay = run(recording, staging.stage)

    assert any('stand still' in warning for warning in staging.warnings)
    assert staging.stage.goal.tolist() == [5.0, 0.0]
    assert not replay.robot_poses.any()
    assert 'driving' in replay.decisions
    assert np.median(walker_error(replay, drive)) < 0.1


def test_a_laser_that_hangs_upside_down_sees_the_same_world(tmp_path):
    drive = simulate_drive(4.0, mirrored=True)
    recording = Recording(drive.bag.write(tmp_path / 'bag'))
    survey = survey_recording(recording)

    replay = run(recording, set_stage(survey).stage)

    assert survey.mount.upside_down
    assert np.median(walker_error(replay, drive)) < 0.1
    steady = survey.hits >= 5
    assert np.median(HALL.distance(to_parent(START, survey.points[steady]))) < 0.02


def test_decisions_are_taken_at_the_rate_the_weights_were_trained_for(recording):
    replay = run(recording, set_stage(survey_recording(recording, MOUNT)).stage)

    # Until somebody comes too close to drive on, which calls for a decision out of turn.
    undisturbed = next(number for number, decision in enumerate(replay.decisions)
                       if decision not in ('driving', 'waiting'))
    assert undisturbed > 10
    interval = np.mean(np.diff(replay.stamps[:undisturbed]))
    assert interval == pytest.approx(0.25, abs=0.02)
    assert (replay.commands[:, 0] >= 0.0).all()
    assert replay.commands[:, 0].max() <= 0.8
    assert len(replay.decision_ms) >= undisturbed


def test_the_robot_is_told_to_stand_once_it_reached_the_goal(recording, drive):
    stage = set_stage(survey_recording(recording, MOUNT), goal=drive.base[40, :2]).stage

    replay = run(recording, stage)

    assert replay.decisions[-1] == 'goal_reached'
    assert replay.decisions.count('goal_reached') == 1
    assert not replay.commands[-1].any()
    assert abs(replay.stamps[-1] - drive.stamps[40]) < 0.5


@pytest.mark.parametrize('delay', [0.02, 130.0, -22.0, -3e7])
def test_the_clock_of_the_recorder_does_not_matter(tmp_path, recording, delay):
    expected = run(recording, set_stage(survey_recording(recording, MOUNT)).stage)
    other = Recording(simulate_drive(delay=delay).bag.write(tmp_path / 'bag'))

    replay = run(other, set_stage(survey_recording(other, MOUNT)).stage)

    assert len(replay.tracks) == len(expected.tracks)
    np.testing.assert_array_equal(replay.tracks[-1].position, expected.tracks[-1].position)
    # Milliseconds of prediction differ, and with them which of two near-equal actions is taken.
    assert len(replay.decisions) == pytest.approx(len(expected.decisions), abs=3)
    assert replay.decisions[-1] == expected.decisions[-1]


def test_scans_before_the_first_odometry_are_counted_and_left_out(tmp_path):
    bag = simulate_drive(3.0).bag
    early = [message for message in bag.messages
             if message[1] == '/scan' or message[0] > FIRST_STAMP + 1.0]
    recording = Recording(Bag(early).write(tmp_path / 'bag'))

    replay = run(recording, set_stage(survey_recording(recording, MOUNT)).stage)

    # Odometry starts at 1 s and is carried back by 0.3 s, but has not arrived before.
    assert replay.left_out['scan: no odometry at its stamp'] in (9, 10)
    assert len(replay.tracks) + sum(replay.left_out.values()) == recording.scan_count


def test_the_same_recording_gives_the_same_replay(recording):
    stage = set_stage(survey_recording(recording, MOUNT)).stage

    first, second = run(recording, stage), run(recording, stage)

    np.testing.assert_array_equal(first.commands, second.commands)
    assert first.decisions == second.decisions
    for one, other in zip(first.tracks, second.tracks):
        for name in ('stamp', 'id', 'position', 'velocity', 'radius', 'label'):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_recording_of_unusable_messages_only_is_refused(tmp_path):
    bag = Bag()
    bag.add(1.0, '/scan', laser_scan(1.0, []))
    with pytest.raises(RecordingError, match=r'/scan: no scan in it can be used \(ranges: no'):
        survey_recording(Recording(bag.write(tmp_path / 'scans')))

    bag = Bag()
    bag.add(1.0, '/scan', laser_scan(1.0, [1.0, 2.0]))
    bag.add(1.0, '/odom', odometry(1.0, (np.nan, 0.0, 0.0)))
    with pytest.raises(RecordingError, match='/odom: no message in it can be used'):
        survey_recording(Recording(bag.write(tmp_path / 'odometry')))


def annotate(drive, every, frame, place):
    """Return GroundTruth of the walker on every n-th scan, placed by `place(index)`."""
    rows = np.arange(0, len(drive.stamps), every)
    # Annotations are stamped between the scan they belong to and the next.
    return GroundTruth(drive.stamps[rows] + 0.02 + 0.05, np.full(len(rows), 7),
                       np.array([place(row) for row in rows]), np.full(len(rows), frame))


@pytest.mark.parametrize('frame', ['laser', 'base_link', 'odom', 'map'])
def test_annotations_may_be_in_any_frame_the_replay_knows(recording, drive, frame):
    survey = survey_recording(recording, MOUNT)
    stage = set_stage(survey, walls=HALL, initial_pose=START).stage
    replay = run(recording, stage)
    truth = annotate(drive, 5, frame, {
        'laser': lambda row: to_child(compose(drive.base[row], MOUNT), drive.walker[row]),
        'base_link': lambda row: to_child(drive.base[row], drive.walker[row]),
        'odom': lambda row: drive.walker[row],
        'map': lambda row: to_parent(START, drive.walker[row])}[frame])

    figures, places = score_replay(replay, survey, stage, truth)

    np.testing.assert_allclose(places, to_parent(START, drive.walker[::5]), atol=0.03)
    assert figures['annotations'] == figures['annotated_scans'] == len(truth)
    assert figures['recall'] > 0.7
    assert figures['motp'] < 0.1
    assert figures['id_switches'] == 0
    assert figures['gate'] == 0.75


def test_annotations_far_from_every_track_are_all_missed(recording, drive):
    survey = survey_recording(recording, MOUNT)
    stage = set_stage(survey).stage
    truth = annotate(drive, 5, 'odom', lambda row: drive.walker[row] + 3.0)

    figures, _ = score_replay(run(recording, stage), survey, stage, truth)

    assert figures['recall'] == 0.0
    assert figures['motp'] is None


def test_people_on_scans_that_were_left_out_are_missed(tmp_path, drive):
    bag = Bag([message for message in drive.bag.messages
               if message[1] == '/scan' or message[0] > FIRST_STAMP + 4.0])
    recording = Recording(bag.write(tmp_path / 'bag'))
    survey = survey_recording(recording, MOUNT)
    stage = set_stage(survey).stage
    truth = annotate(drive, 5, 'odom', lambda row: drive.walker[row])

    figures, places = score_replay(run(recording, stage), survey, stage, truth)

    assert figures['annotations'] == len(truth)
    assert len(places) < 0.6 * len(truth)
    assert figures['recall'] < 0.6


def test_annotations_of_another_recording_are_refused(recording, drive):
    survey = survey_recording(recording, MOUNT)
    stage = set_stage(survey).stage
    replay = run(recording, stage)
    elsewhere = annotate(drive, 5, 'camera', lambda row: drive.walker[row])
    before = annotate(drive, 5, 'odom', lambda row: drive.walker[row])
    before = replace(before, bag_time=before.bag_time - 1e6)

    with pytest.raises(RecordingError, match='camera is not known here: use one of laser, base_l'):
        score_replay(replay, survey, stage, elsewhere)
    with pytest.raises(RecordingError, match='before the first scan'):
        score_replay(replay, survey, stage, before)
