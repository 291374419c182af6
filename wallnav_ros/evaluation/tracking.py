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
How good tracks are against annotated recordings and against the simulator's truth.

CLEAR MOT (Bernardin and Stiefelhagen 2008) by `motmetrics`; people annotated now and then give
recall, precision of position and switches only, for nobody says who else was there.
"""

from dataclasses import dataclass

import motmetrics
import numpy as np

from wallnav_ros.evaluation.recordings import ScanRecord
from wallnav_ros.perception.detection import place_beams
from wallnav_ros.perception.odometry_buffer import PoseBuffer
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.world.geometry import compose, to_child
from wallnav_ros.world.tracks import HUMAN

GATE = 0.75       # m, as Leigh et al. 2015: a track further from a person is not of that person
STRAY = 0.5       # m from every beam end, and a track is where nothing was measured


@dataclass(frozen=True)
class TrackedScan:
    """
    One scan of a recording and the tracks after it, all in the laser's frame at its stamp.

    bag_time, stamp: s. pose: (3,) of the laser in the odometry's frame, zero without one.
    points: (P, 2) beam ends, straightened. ids, label: (N,). position: (N, 2) m.
    """

    bag_time: float
    stamp: float
    pose: np.ndarray
    points: np.ndarray
    ids: np.ndarray
    label: np.ndarray
    position: np.ndarray

    @property
    def human(self):
        """Return (N,) bool."""
        return self.label == HUMAN


@dataclass(frozen=True)
class Scores:
    """
    CLEAR MOT figures.

    recall, precision, mota: shares. motp: mean distance in m. switches: of identity.
    objects: true positions looked at.
    """

    recall: float
    precision: float
    mota: float
    motp: float
    switches: int
    objects: int


def track_recording(recording, mount, settings=None):
    """
    Return the TrackedScans of a Recording, tracked with odometry where it has some.

    mount: (3,) pose of the laser on the robot's base. settings: TrackerSettings or None.
    """
    tracker = Tracker() if settings is None else Tracker(settings)
    poses = PoseBuffer()
    tracked = []
    for record in recording.records():
        if not isinstance(record, ScanRecord):
            poses.add(record.stamp, record.pose)
            continue
        scan = record.scan
        base, end = (poses.at(stamp) for stamp in (scan.stamp, scan.stamp + scan.sweep_time))
        if recording.odom_topic is None:
            pose, tracks = np.zeros(3), tracker.update(scan)
        elif base is None:
            continue
        else:
            pose = compose(base, mount)
            tracks = tracker.update(
                scan, pose, end_pose=None if end is None else compose(end, mount))
        tracked.append(_in_laser_frame(record, pose, tracks, tracker))
    return tracked


def score_people(tracked, truth):
    """
    Return the Scores of human tracks of TrackedScans against GroundTruth.

    Only scans with annotations count. precision and mota are NaN: whoever was not annotated
    would count as a false alarm.
    """
    scans = truth.scan_index([scan.bag_time for scan in tracked])
    frames = []
    for index in np.unique(scans[scans >= 0]):
        rows, scan = scans == index, tracked[index]
        frames.append((truth.person[rows], truth.position[rows], scan.ids[scan.human],
                       scan.position[scan.human]))
    scores = clear_mot(frames)
    return Scores(scores.recall, np.nan, np.nan, scores.motp, scores.switches, scores.objects)


def clear_mot(frames, gate=GATE):
    """
    Return the Scores of frames: (true ids, true positions, track ids, track positions).

    gate: metres; a track further off is not of that object.
    """
    log = motmetrics.MOTAccumulator(auto_id=True)
    for true_ids, truth, ids, found in frames:
        truth, found = np.reshape(truth, (-1, 2)), np.reshape(found, (-1, 2))
        gap = np.linalg.norm(truth[:, None] - found[None], axis=2)
        log.update(list(true_ids), list(ids), np.where(gap <= gate, gap, np.nan))
    names = ['recall', 'precision', 'mota', 'motp', 'num_switches', 'num_objects']
    found = motmetrics.metrics.create().compute(log, metrics=names).iloc[0]
    return Scores(*(float(found[name]) for name in names[:4]),
                  int(found['num_switches']), int(found['num_objects']))


def people_seen(tracked):
    """Return (number of different human ids, mean number of humans per scan)."""
    ids = {int(number) for scan in tracked for number in scan.ids[scan.human]}
    return len(ids), float(np.mean([scan.human.sum() for scan in tracked]))


def longest_stray(tracked):
    """Return the longest time in seconds a track stayed over STRAY metres from any beam end."""
    since, longest = {}, 0.0
    for scan in tracked:
        astray = {}
        for number, place in zip(scan.ids.tolist(), scan.position):
            gap = np.linalg.norm(scan.points - place, axis=1).min(initial=np.inf)
            if gap > STRAY:
                astray[number] = since.get(number, scan.stamp)
                longest = max(longest, scan.stamp - astray[number])
        since = astray
    return longest


def _in_laser_frame(record, pose, tracks, tracker):
    scan = record.scan
    # As the tracker saw them: a turning laser's raw beam ends lie up to metres beside.
    points = place_beams(scan, scan.hits, tracker.sweep, tracker.settings)[1]
    return TrackedScan(record.bag_time, scan.stamp, pose, points, tracks.id, tracks.label,
                       to_child(pose, tracks.position))
