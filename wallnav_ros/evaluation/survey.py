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
A first look through a recording: the way of the robot and everything its laser met.

Odometry is taken as it is (REP-105: continuous, drifting); nothing is tracked yet.
"""

from dataclasses import dataclass, replace

import numpy as np

from wallnav_ros.evaluation.recordings import Mount, RecordingError, ScanRecord
from wallnav_ros.world.geometry import to_parent

CELL = 0.05
# Points are boiled down to cells whenever this many have come together.
_BATCH = 400_000
# More would not show more; they bound the memory that an hour's recording takes.
_MOST_SCANS = 2000


@dataclass(frozen=True)
class Survey:
    """
    What the whole of a recording shows, in the odometry's frame.

    odom_frame, base_frame, laser_frame: names; the first two are None without odometry.
    stamps: (K,) seconds and path: (K, 3) poses of the base; one pose at zero without odometry.
    twists: (K, 3) of the base, as in OdometryRecord.
    scan_times: (S,) bag times of the usable scans in seconds; latencies: (S,) how much later
    those are than the scans' own stamps.
    mount: the laser on the base. mount_source: where that was taken from, for people.
    points, origins: (P, 2) metres: one per 5 cm cell that a beam ended in, and the laser then.
    hits: (P,) how many beams ended in it.
    """

    odom_frame: str | None
    base_frame: str | None
    laser_frame: str
    stamps: np.ndarray
    path: np.ndarray
    twists: np.ndarray
    scan_times: np.ndarray
    latencies: np.ndarray
    mount: Mount
    mount_source: str
    points: np.ndarray
    origins: np.ndarray
    hits: np.ndarray


def survey_recording(recording, laser_pose=None):
    """
    Return the Survey of a Recording; of a long one, the beams of every n-th scan.

    laser_pose: (3,) of the laser on the base; None takes it from the bag's tf, and from
    nowhere but the origin if that has none. Raises RecordingError as `Recording.records`, and
    when every scan of it is unusable.
    """
    odometry, scans, scan_times, latencies = [], [], [], []
    every = 1 + recording.scan_count // _MOST_SCANS
    for record in recording.records():
        if not isinstance(record, ScanRecord):
            odometry.append(record)
            continue
        scan_times.append(record.bag_time)
        latencies.append(record.bag_time - record.scan.stamp)
        if len(scan_times) % every == 1 % every:
            scans.append(record)
    if recording.odom_topic is not None and not odometry:
        raise RecordingError(f'{_unusable(recording, recording.odom_topic, "message")}: choose '
                             'another --odom-topic')
    if not scans:
        raise RecordingError(f'{_unusable(recording, recording.scan_topic, "scan")}: choose '
                             'another --scan-topic')
    base = odometry[0].child_frame if odometry else None
    laser = scans[0].frame
    mount, source = _find_mount(recording, laser_pose, base, laser)
    stamps, path, twists = _way(odometry)
    points, origins, hits = _collect(scans, mount, stamps, path)
    return Survey(odometry[0].frame if odometry else None, base, laser, stamps, path, twists,
                  np.array(scan_times), np.array(latencies), mount, source, points, origins, hits)


def upright(scan, mount):
    """Return `scan` as seen from above: mirrored when the laser hangs upside down."""
    if not mount.upside_down:
        return scan
    return replace(scan, angle_min=-scan.angle_min, angle_increment=-scan.angle_increment)


def _unusable(recording, topic, kind):
    """Return in words that nothing of a topic can be used, and why."""
    why = '; '.join(recording.rejected) if recording.topics[topic][1] else 'it is empty'
    return f'{recording.path}: {topic}: no {kind} in it can be used ({why})'


def _find_mount(recording, laser_pose, base, laser):
    """Return the Mount of the laser and where it is known from."""
    if laser_pose is not None:
        return Mount(np.asarray(laser_pose, float)), 'given'
    if base is not None and laser == base:
        return Mount(np.zeros(3)), f'scan is in {base}'
    found = recording.mount(base or 'base_link', laser)
    if found is not None:
        return found, f'tf {base or "base_link"} -> {laser}'
    return Mount(np.zeros(3)), 'unknown'


def _way(odometry):
    """Return stamps (K,) in ascending order, poses (K, 3) with unwrapped yaw, twists (K, 3)."""
    if not odometry:
        return np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3))
    stamps = np.array([record.stamp for record in odometry])
    poses = np.array([record.pose for record in odometry])
    twists = np.array([record.twist for record in odometry])
    stamps, first = np.unique(stamps, return_index=True)
    poses, twists = poses[first], twists[first]
    poses[:, 2] = np.unwrap(poses[:, 2])
    return stamps, poses, twists


def _collect(scans, mount, stamps, path):
    """Return the points, origins and hits of a Survey."""
    cells = _Cells()
    for record in scans:
        scan = upright(record.scan, mount)
        base = np.array([np.interp(scan.stamp, stamps, column) for column in path.T])
        laser = np.array([*to_parent(base, mount.pose[:2]), base[2] + mount.pose[2]])
        angles, ranges = scan.angles[scan.hits], scan.ranges[scan.hits]
        ends = np.stack((ranges * np.cos(angles), ranges * np.sin(angles)), axis=-1)
        cells.add(to_parent(laser, ends), laser[:2])
    return cells.result()


class _Cells:
    """Beam ends boiled down to one point, one origin and a count per cell."""

    def __init__(self):
        self._parts, self._waiting = [], 0

    def add(self, points, origin):
        self._parts.append((points, np.broadcast_to(origin, points.shape),
                            np.ones(len(points), dtype=np.int64)))
        self._waiting += len(points)
        if self._waiting > _BATCH:
            self._parts, self._waiting = [self.result()], 0

    def result(self):
        points, origins, hits = (np.concatenate(parts) for parts in zip(*self._parts))
        # Both cell numbers in one integer: sorting pairs would take ten times as long.
        column, row = np.floor(points / CELL).astype(np.int64).T
        _, first, cell = np.unique(column * (1 << 32) + row, return_index=True,
                                   return_inverse=True)
        return points[first], origins[first], np.bincount(cell.ravel(), hits,
                                                          len(first)).astype(np.int64)
