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
"""
A replay against annotated people: the figures of summary.json and where the people were.

CLEAR MOT (Bernardin and Stiefelhagen 2008), on the scans that somebody annotated.
"""

import numpy as np

from wallnav_ros.evaluation.ground_truth import GroundTruth
from wallnav_ros.evaluation.recordings import RecordingError
from wallnav_ros.evaluation.replay import Replay, Stage
from wallnav_ros.evaluation.survey import Survey
from wallnav_ros.evaluation.tracking import clear_mot, GATE
from wallnav_ros.world.geometry import to_parent
from wallnav_ros.world.tracks import HUMAN

LATEST = 1.0           # s after the last scan: an annotation later than that is of none


def score_replay(replay: Replay, survey: Survey, stage: Stage, truth: GroundTruth):
    """
    Return the scores of a Replay as a dictionary, and the annotated positions (N, 2).

    recall, motp (m), id_switches and mota compare tracks labelled human with the annotated
    people, over the annotated scans only, within `gate` metres. mota counts people whom
    nobody annotated as false alarms. Positions are in the stage's frame, annotations that
    belong to no scan left out. Raises RecordingError when a frame is not known.
    """
    _check_frames(survey, stage, truth)
    scans = truth.scan_index(survey.scan_times)
    scans[truth.bag_time > survey.scan_times[-1] + LATEST] = -1
    used = {time: number for number, time in enumerate(replay.bag_times)}
    frames, places = [], []
    for scan in np.unique(scans[scans >= 0]):
        rows = np.flatnonzero(scans == scan)
        number = used.get(survey.scan_times[scan])
        if number is None:
            # People on a scan that could not be used are people missed.
            frames.append((truth.person[rows], truth.position[rows], [], np.empty((0, 2))))
            continue
        place = np.array([_in_state_frame(truth, row, number, replay, survey, stage)
                          for row in rows])
        tracks = replay.tracks[number]
        human = tracks.label == HUMAN
        frames.append((truth.person[rows], place, tracks.id[human], tracks.position[human]))
        places.append(place)
    if not frames:
        raise RecordingError('ground truth: every annotation is from before the first scan '
                             'or after the last: is it of this recording?')
    scores = clear_mot(frames)
    figures = {'recall': round(scores.recall, 4), 'motp': round(scores.motp, 4),
               'id_switches': scores.switches, 'mota': round(scores.mota, 4), 'gate': GATE,
               'annotations': scores.objects, 'annotated_scans': len(frames)}
    # Without a single match there is no mean distance, and JSON has no word for that but null.
    figures = {name: None if value != value else value for name, value in figures.items()}
    return figures, np.concatenate(places) if places else np.empty((0, 2))


def _check_frames(survey, stage, truth):
    known = [frame for frame in (survey.laser_frame, survey.base_frame, survey.odom_frame,
                                 stage.frame) if frame]
    strange = sorted(set(truth.frame) - set(known))
    if strange:
        raise RecordingError(f'ground truth: frame_id: {", ".join(strange)} is not known here: '
                             f'use one of {", ".join(dict.fromkeys(known))}')


def _in_state_frame(truth, row, number, replay, survey, stage):
    """Return where (2,) annotation `row`, of scan `number` of the replay, is in the stage."""
    frame, position = truth.frame[row], truth.position[row]
    if frame == survey.laser_frame:
        mirror = -1.0 if stage.mount.upside_down else 1.0
        return to_parent(replay.laser_poses[number], position * [1.0, mirror])
    if frame == survey.base_frame:
        return to_parent(replay.robot_poses[number], position)
    if frame == survey.odom_frame:
        return to_parent(stage.from_odom, position)
    return position
