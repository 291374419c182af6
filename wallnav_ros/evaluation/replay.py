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
A recording through the robot's own navigator, scan by scan, as the nodes would have met it.

Open loop: the robot goes where it went; the commands are what it would have been told.
"""

from collections import Counter
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from wallnav_ros.evaluation.recordings import Mount, ScanRecord
from wallnav_ros.evaluation.survey import upright
from wallnav_ros.navigation.localisation import Localisation
from wallnav_ros.navigation.navigator import Navigator, NavigatorSettings
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import compose, rotate, to_parent


@dataclass(frozen=True)
class Stage:
    """
    What a recording is replayed in.

    frame: the name of the state frame, `map` or the odometry's.
    map_from_odom: (3,) pose of the odometry's frame in the map, None when no map is used.
    mount: the laser on the robot's base.
    walls: DistanceField of the mapped walls in the map frame, None without a map.
    goal: (2,) metres, in the state frame.
    clock_offset: seconds that the recorder's clock was ahead of the sensors'.
    settings: of the navigator.
    """

    frame: str
    map_from_odom: np.ndarray | None
    mount: Mount
    walls: DistanceField | None
    goal: np.ndarray
    clock_offset: float
    settings: NavigatorSettings

    @property
    def from_odom(self):
        """Return the pose (3,) of the odometry's frame in the state frame."""
        return np.zeros(3) if self.map_from_odom is None else self.map_from_odom


@dataclass(frozen=True)
class Replay:
    """
    What came out, all positions in the stage's frame.

    tracks: the Tracks of every scan used. robot_poses, laser_poses: (S, 3) at each of them.
    bag_times: (S,) when each was received. scan_ms: (S,) spent tracking it.
    stamps: (C,) seconds; commands: (C, 2) m/s and rad/s; decisions: (C,) the navigator's state
    or, where the robot must stand, why: one entry for each decision and each new reason.
    decision_ms: milliseconds of each decision. left_out: how many messages were, by reason.
    """

    tracks: tuple
    robot_poses: np.ndarray
    laser_poses: np.ndarray
    bag_times: np.ndarray
    scan_ms: np.ndarray
    stamps: np.ndarray
    commands: np.ndarray
    decisions: tuple
    decision_ms: np.ndarray
    left_out: Counter


class _Stopwatch:
    """Stands for an object and keeps how many milliseconds each call of one method took."""

    def __init__(self, target, method):
        self._target, self.spent = target, []
        self._timed = getattr(target, method)
        setattr(self, method, self._call)

    def _call(self, *positional, **named):
        started = perf_counter()
        result = self._timed(*positional, **named)
        self.spent.append(1e3 * (perf_counter() - started))
        return result

    def __getattr__(self, name):
        return getattr(self._target, name)


class _ScanOnly:
    """A Tracker that is told nothing of the robot's motion, as the node does without odometry."""

    def __init__(self, tracker, mount):
        self._tracker, self._mount = tracker, mount

    def update(self, scan, *_, **__):
        return self._tracker.update(scan, self._mount.pose, odometry=False)


def replay_recording(recording, stage: Stage, tracker: Tracker, lookahead: Lookahead,
                     progress=None):
    """
    Return the Replay of a Recording on a Stage, with a fresh Tracker.

    Without odometry the robot is taken to be where its frame is, all the time.
    progress: called with 1 for each scan done.
    """
    has_odometry = recording.odom_topic is not None
    tracker = _Stopwatch(
        tracker if has_odometry else _ScanOnly(tracker, stage.mount), 'update')
    lookahead = _Stopwatch(lookahead, 'decide')
    place = Localisation(stage.map_from_odom)
    navigator = Navigator(lookahead, tracker, stage.settings, place)
    navigator.laser_pose = stage.mount.pose
    navigator.set_walls(stage.walls)
    if stage.map_from_odom is None:
        place.odom_frame = stage.frame
    navigator.set_goal(stage.goal, stage.frame)
    log = _Log(stage)
    for record in recording.records():
        now = record.bag_time - stage.clock_offset
        if not isinstance(record, ScanRecord):
            navigator.take_odometry(record.stamp, record.pose, record.twist[[0, 2]], now)
            continue
        scan = upright(record.scan, stage.mount)
        if not has_odometry:
            navigator.take_odometry(scan.stamp, np.zeros(3), np.zeros(2), now)
        if navigator.take_scan(scan, now):
            log.add_scan(record, navigator)
        log.add_status(scan.stamp, navigator.update(now, now), navigator.plan)
        if progress is not None:
            progress(1)
    return log.replay(tracker.spent, lookahead.spent,
                      recording.rejected + navigator.rejected)


class _Log:
    """What a replay has brought about so far."""

    def __init__(self, stage):
        self._stage = stage
        self._scans, self._commands = [], []
        self._plan, self._decision = None, None

    def add_scan(self, record, navigator):
        """Note the Tracks of a scan and where the robot was."""
        to_state = self._stage.from_odom
        tracks = navigator.tracks
        tracks = replace(tracks, position=to_parent(to_state, tracks.position),
                         velocity=rotate(tracks.velocity, to_state[2]))
        base = navigator.localisation.pose(record.scan.stamp)
        self._scans.append((tracks, base, compose(base, self._stage.mount.pose),
                            record.bag_time))

    def add_status(self, stamp, status, plan):
        """Note a Status if it follows from a new Plan or is a new reason to stand."""
        decision = status.stop.cause if status.stop else status.state
        if decision != self._decision or (plan is not None and plan is not self._plan):
            # What was decided: the ramp towards it is for a base that follows.
            command = status.command if status.stop or plan is None else plan.command
            self._commands.append((stamp, command, decision))
        self._decision, self._plan = decision, plan

    def replay(self, scan_ms, decision_ms, left_out):
        """Return it all as a Replay."""
        tracks, bases, lasers, bag_times = zip(*self._scans) if self._scans else [()] * 4
        stamps, commands, decisions = zip(*self._commands) if self._commands else [()] * 3
        return Replay(
            tracks, np.array(bases).reshape(-1, 3), np.array(lasers).reshape(-1, 3),
            np.array(bag_times), np.array(scan_ms), np.array(stamps),
            np.array(commands).reshape(-1, 2), decisions, np.array(decision_ms), left_out)
