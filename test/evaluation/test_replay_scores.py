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
"""Scores against annotated people, worked by hand on a replay of a few scans."""

from collections import Counter
from dataclasses import replace
from math import pi

import numpy as np
import pytest

rosbags = pytest.importorskip('rosbags')
motmetrics = pytest.importorskip('motmetrics')

from wallnav_ros.evaluation.ground_truth import GroundTruth  # noqa: E402
from wallnav_ros.evaluation.recordings import Mount, RecordingError  # noqa: E402
from wallnav_ros.evaluation.replay import Replay, Stage  # noqa: E402
from wallnav_ros.evaluation.replay_scores import score_replay  # noqa: E402
from wallnav_ros.evaluation.survey import Survey  # noqa: E402
from wallnav_ros.navigation.navigator import NavigatorSettings  # noqa: E402
from wallnav_ros.world.tracks import HUMAN, OBSTACLE, Tracks  # noqa: E402

pytestmark = pytest.mark.extras

# Scans are received at 100, 101, ... s; the odometry's frame is that of the stage.
STAGE = Stage('odom', None, Mount(np.zeros(3)), None, np.zeros(2), 0.0, NavigatorSettings())


def tracks_of(people=None, obstacles=None):
    """Return Tracks of {id: (x, y)} of humans and of obstacles."""
    both = {**(people or {}), **(obstacles or {})}
    labels = [HUMAN] * len(people or {}) + [OBSTACLE] * len(obstacles or {})
    return Tracks(0.0, np.array(list(both), np.uint32),
                  np.array(list(both.values()), float).reshape(-1, 2), np.zeros((len(both), 2)),
                  np.full(len(both), 0.3), np.array(labels, np.uint8))


def replay_of(*tracks, bag_times=None, robot=(0.0, 0.0, 0.0), laser=(0.0, 0.0, 0.0)):
    """Return a Replay of a robot that stands, by default with a scan each second."""
    count = len(tracks)
    bag_times = 100.0 + np.arange(count) if bag_times is None else np.array(bag_times)
    return Replay(tracks, np.tile(robot, (count, 1)), np.tile(laser, (count, 1)), bag_times,
                  np.zeros(count), np.empty(0), np.empty((0, 2)), (), np.empty(0), Counter())


def survey_of(scans, odom='odom', base='base_link', laser='laser'):
    """Return a Survey of so many scans, a second apart."""
    nothing = np.empty((0, 2))
    return Survey(odom, base, laser, np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)),
                  100.0 + np.arange(scans), np.zeros(scans), STAGE.mount, 'given', nothing,
                  nothing, np.empty(0, int))


def annotated(*rows, frame='odom'):
    """Return GroundTruth of rows (bag time, person, x, y)."""
    time, person, x, y = zip(*rows)
    return GroundTruth(np.array(time), np.array(person), np.column_stack((x, y)).astype(float),
                       np.full(len(rows), frame))


def score(replay, truth, scans=None, stage=STAGE):
    """Return the figures and the places of a Replay whose every scan was usable by default."""
    return score_replay(replay, survey_of(scans or len(replay.tracks)), stage, truth)


def test_a_miss_a_switch_and_a_false_alarm_of_four_leave_a_quarter():
    # Person 1 has track 7, then 9: a switch. Person 2 has track 8, then none: a miss.
    # Nobody annotated track 4: a false alarm.
    replay = replay_of(tracks_of({7: (1.1, 0), 8: (5, 0.3)}),
                       tracks_of({9: (1.2, 0), 4: (9, 9)}))
    truth = annotated((100.5, 1, 1, 0), (100.5, 2, 5, 0), (101.5, 1, 1, 0), (101.5, 2, 5, 0))

    figures, places = score(replay, truth)

    # The matches are 0.1, 0.3 and 0.2 m off.
    assert figures == {'recall': 0.75, 'motp': 0.2, 'id_switches': 1, 'mota': 0.25, 'gate': 0.75,
                       'annotations': 4, 'annotated_scans': 2}
    assert places.tolist() == [[1, 0], [5, 0], [1, 0], [5, 0]]


def test_figures_have_four_decimals():
    replay = replay_of(tracks_of({1: (0.123456, 0), 2: (5, 0)}))

    figures, _ = score(replay, annotated((100, 1, 0, 0), (100, 2, 5, 9), (100, 3, 9, 9)))

    # Of three people one is found, and of two tracks one is of nobody.
    assert (figures['recall'], figures['motp'], figures['mota']) == (0.3333, 0.1235, 0.0)


def test_a_track_that_is_no_human_finds_nobody_and_alarms_nobody():
    replay = replay_of(tracks_of({3: (4, 0)}, obstacles={5: (1, 0), 6: (8, 8), 7: (9, 9)}))

    figures, _ = score(replay, annotated((100, 1, 1, 0), (100, 2, 4, 0)))

    # Were obstacles people, one would be person 1 and two false alarms: 1 and 0.
    assert (figures['recall'], figures['mota']) == (0.5, 0.5)


def test_scans_that_nobody_annotated_do_not_count():
    crowd = tracks_of({10: (3, 3), 11: (4, 4)})
    replay = replay_of(crowd, tracks_of({7: (1, 0)}), crowd)

    figures, _ = score(replay, annotated((101.2, 1, 1, 0)))

    assert (figures['recall'], figures['mota'], figures['annotated_scans']) == (1.0, 1.0, 1)


@pytest.mark.parametrize('gap, recall, mota', [(0.75, 1.0, 1.0), (0.76, 0.0, -1.0)])
def test_within_75_centimetres_a_track_is_of_the_person(gap, recall, mota):
    figures, _ = score(replay_of(tracks_of({1: (gap, 0)})), annotated((100, 1, 0, 0)))

    # Beyond, there are both a miss and a false alarm of one person.
    assert (figures['recall'], figures['mota']) == (recall, mota)


def test_without_a_match_there_is_no_mean_distance():
    figures, places = score(replay_of(tracks_of()), annotated((100, 1, 2, 3)))

    assert figures == {'recall': 0.0, 'motp': None, 'id_switches': 0, 'mota': 0.0, 'gate': 0.75,
                       'annotations': 1, 'annotated_scans': 1}
    assert places.tolist() == [[2.0, 3.0]]


def test_an_annotation_belongs_to_the_last_scan_at_or_before_it():
    replay = replay_of(*(tracks_of({1: (x, 0)}) for x in (0, 10, 20)))

    figures, _ = score(replay, annotated((100, 1, 0, 0), (100.99, 1, 0, 0)))
    assert figures['recall'] == 1.0 / 2.0     # two of one id in one scan: one of them is met
    for time, x in ((100.0, 0), (100.99, 0), (101.0, 10), (102.0, 20), (102.9, 20)):
        assert score(replay, annotated((time, 1, x, 0)))[0]['recall'] == 1.0


@pytest.mark.parametrize('time', [99.9, 103.1])
def test_annotations_of_another_recording_are_refused(time):
    replay = replay_of(*(tracks_of({1: (x, 0)}) for x in (0, 10, 20)))
    with pytest.raises(RecordingError, match='is it of this recording'):
        score(replay, annotated((time, 1, 20, 0)))


def test_annotations_from_before_the_first_scan_are_left_out():
    replay = replay_of(tracks_of({1: (0, 0)}))

    figures, places = score(replay, annotated((99.9, 2, 5, 5), (100, 1, 0, 0)))

    assert (figures['annotations'], figures['recall']) == (1, 1.0)
    assert places.tolist() == [[0.0, 0.0]]


def test_people_on_a_scan_that_was_left_out_are_missed_and_have_no_place():
    # Of three scans the second, at 101 s, could not be placed.
    replay = replay_of(tracks_of({1: (0, 0)}), tracks_of({1: (2, 0)}), bag_times=[100.0, 102.0])
    truth = annotated((100, 1, 0, 0), (101, 1, 1, 0), (101, 2, 0, 0), (102, 1, 2, 0))

    figures, places = score(replay, truth, scans=3)

    assert (figures['recall'], figures['annotations'], figures['annotated_scans']) == (0.5, 4, 3)
    assert figures['id_switches'] == 0
    assert places.tolist() == [[0.0, 0.0], [2.0, 0.0]]


def test_when_every_annotated_scan_was_left_out_all_are_missed():
    replay = replay_of(tracks_of({1: (0, 0)}), bag_times=[101.0])

    figures, places = score(replay, annotated((100, 1, 0, 0)), scans=2)

    assert (figures['recall'], figures['motp']) == (0.0, None)
    assert places.shape == (0, 2)


@pytest.mark.parametrize('frame, position, place', [
    # The laser is at (1, 2) in the map and faces up: 3 m ahead and 1 m left of it.
    ('laser', (3, 1), (0, 5)),
    # The base is at (1, 1) and faces left: 3 m ahead and 1 m left of it.
    ('base_link', (3, 1), (-2, 0)),
    # The origin of odom is at (10, 20) in the map, and its x points down.
    ('odom', (3, 1), (11, 17)),
    ('map', (3, 1), (3, 1)),
])
def test_annotations_are_placed_from_the_frame_they_are_in(frame, position, place):
    stage = replace(STAGE, frame='map', map_from_odom=np.array([10.0, 20.0, -pi / 2]))
    replay = replay_of(tracks_of(), tracks_of({1: place}), robot=(1, 1, pi), laser=(1, 2, pi / 2))

    figures, places = score(replay, annotated((101, 1, *position), frame=frame), stage=stage)

    np.testing.assert_allclose(places, [place], atol=1e-9)
    assert (figures['recall'], figures['motp']) == (1.0, 0.0)


def test_left_of_a_laser_upside_down_is_right_of_the_robot():
    stage = replace(STAGE, mount=Mount(np.zeros(3), upside_down=True))
    replay = replay_of(tracks_of(), laser=(1, 2, pi / 2))

    _, in_laser = score(replay, annotated((100, 1, 3, 1), frame='laser'), stage=stage)
    _, in_base = score(replay, annotated((100, 1, 3, 1), frame='base_link'), stage=stage)

    np.testing.assert_allclose(in_laser, [[2.0, 5.0]], atol=1e-9)
    np.testing.assert_allclose(in_base, [[3.0, 1.0]], atol=1e-9)


def test_annotations_on_one_scan_may_be_in_several_frames():
    truth = replace(annotated((100, 1, 1, 0), (100, 2, 1, 0)), frame=np.array(['odom', 'laser']))

    _, places = score(replay_of(tracks_of(), laser=(5, 5, 0)), truth)

    np.testing.assert_allclose(places, [[1.0, 0.0], [6.0, 5.0]])


def test_a_frame_that_is_not_known_is_refused_with_those_that_are():
    frames = np.array(['zoo', 'odom', 'camera', 'mast', 'arm'])
    truth = replace(annotated(*((100, person, 1, 0) for person in range(5))), frame=frames)

    with pytest.raises(RecordingError, match='frame_id: arm, camera, mast, zoo is not known here: '
                                             'use one of laser, base_link, odom$'):
        score(replay_of(tracks_of()), truth)


def test_without_odometry_only_the_laser_frame_is_known():
    survey = survey_of(1, odom=None, base=None)
    stage = replace(STAGE, frame='laser')

    with pytest.raises(RecordingError, match='odom is not known here: use one of laser$'):
        score_replay(replay_of(tracks_of()), survey, stage, annotated((100, 1, 0, 0)))
