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
Where the laser is between scans: odometry made sharp by the scans, or the scans alone.

Point-to-line matching with a prior on the motion (Censi 2008), against the last few key scans.
"""

import numpy as np
from scipy.spatial import cKDTree

from wallnav_ros.world.geometry import (
    compose, distances, invert, rotate, to_parent, wrap_angle)

PACE_SPAN = 1.0        # s over which a pace is told; noise of single scans looks like speed
# Along one axis of the world there are fewer cells of `_judge` than this: 500 km.
_CELLS = 1e6


class EgoMotion:
    """
    Keeps an inner frame in which things that stand do stand still.

    correction: (3,) the caller's frame in the inner one. With odometry it makes up for what
    that gets wrong; without, the caller's frame is the robot's own and this is its motion.
    rate: (3,) m/s, m/s, rad/s of the robot, in its own frame at the time.
    pace: m/s and rad/s, added up, that it has gone on average over the last PACE_SPAN seconds.
    certain: bool, the last scan agreed with earlier ones.
    misfit: share of the last scan that lies beside what earlier ones saw; None where it was not
    compared, or too little of it.
    """

    def __init__(self, settings):
        self.settings = settings
        self.correction = np.zeros(3)
        self.rate = np.zeros(3)
        self.pace = 0.0
        self.certain = False
        self.misfit = None
        self._last = {}
        self._steps = {}
        self._references = {}

    def predict(self, given, known, elapsed):
        """
        Return the pose (3,) of a laser in the inner frame before its scan is looked at.

        given: (3,) the laser's pose in the caller's frame. known: whether that follows the
        robot; else the caller's frame is the robot's own. elapsed: s since the last scan.
        """
        if not known:
            return compose(compose(self.correction, self.rate * elapsed), given)
        return compose(self.correction, given)

    def locate(self, points, people, given, known, elapsed, interval, sensor):
        """
        Return the pose (3,) of the laser in the inner frame; other arguments as for `predict`.

        points: (P, 2) beam ends in the laser's frame, in beam order. people: (H, 2) where, in
        the inner frame, people should be: what lies on them does not stand. sensor: its name;
        interval: s since its own last scan.
        """
        prior = self.predict(given, known, elapsed)
        earlier, corrected = self._last.get(sensor, (given, self.correction))
        step = compose(invert(earlier), given)
        reference = self._references.setdefault(sensor, _Reference(self.settings))
        pose, self.certain, self.misfit = prior, True, None
        if not known or not len(reference) or np.hypot(step[0], step[1]) + abs(step[2]) > 1e-3:
            spread = self._spread(step, known, elapsed)
            points = self._standing(points, people, prior)
            matched, share, self.misfit = reference.match(points, prior, spread)
            self.certain = matched is not None
            if matched is not None:
                pose = matched
            elif not known:
                pose = compose(self.correction, given)
            if reference.is_left_behind(pose, share):
                reference.add(points, pose)
        self.correction = compose(pose, invert(given))
        if not known:
            step = compose(invert(corrected), self.correction)
        # Over the way since another scanner's scan, a moment ago, noise would be speed.
        if interval > 0.0:
            self.rate = step / interval
            self.pace = self._pace(step, interval, sensor)
        self._last[sensor] = given, self.correction
        return pose

    def forget(self, sensor):
        """Forget the key scans of a scanner, not where it is."""
        self._references.pop(sensor, None)

    def _pace(self, step, interval, sensor):
        """Return the pace after another `step` (3,) of a scanner in `interval` seconds."""
        steps = self._steps.setdefault(sensor, [])
        steps.append(np.array([*step, interval]))
        while sum(step[3] for step in steps[1:]) >= PACE_SPAN - 1e-3:
            del steps[0]
        # From the mean of the earlier half to that of the later one: scans that are placed to
        # and fro, as among few surfaces, leave both where they are.
        way = np.vstack((np.zeros(4), np.cumsum(steps, axis=0)))
        half = len(way) // 2
        x, y, turn, span = way[-half:].mean(axis=0) - way[:half].mean(axis=0)
        return (np.hypot(x, y) + abs(turn)) / span

    def _standing(self, points, people, pose):
        """Return those of `points` (P, 2) of the laser at `pose` that are not on `people`."""
        if not len(people):
            return points
        gap = distances(people, to_parent(pose, points))
        return points[gap.min(axis=0) > self.settings.carve_radius]

    def _spread(self, step, known, elapsed):
        """Return the standard deviations (3,) of the predicted pose."""
        settings = self.settings
        if not known:
            return max(elapsed, 1e-3) * np.array(
                [settings.unknown_speed, settings.unknown_speed, settings.unknown_turn])
        moved = 0.005 + settings.odometry_slip * float(np.hypot(step[0], step[1]))
        return np.array([moved, moved, 0.002 + settings.odometry_error * abs(step[2])])


class _Reference:
    """The points and normals of the last key scans of one scanner, in the inner frame."""

    def __init__(self, settings):
        self.settings = settings
        self._scans = []
        self._tree = None
        self._pose = None

    def __len__(self):
        return len(self._scans)

    def is_left_behind(self, pose, share):
        """Return whether the laser at `pose`, `share` of its beams explained, has moved on."""
        if self._pose is None:
            return True
        step = compose(invert(self._pose), pose)
        far = np.hypot(step[0], step[1]) > self.settings.key_distance
        return bool(far or abs(step[2]) > self.settings.key_turn or share < 0.6)

    def add(self, points, pose):
        """Take the scan `points` (P, 2), seen from `pose`, into the reference."""
        normals, good = _normals(points)
        points, normals = points[good][::2], normals[good][::2]
        self._scans = self._scans[-2:] + [(to_parent(pose, points), rotate(normals, pose[2]))]
        points, normals = (np.concatenate(parts) for parts in zip(*self._scans))
        # By coordinate, as matching reads them: a point on each line, then its normal.
        self._lines = np.concatenate((points.T, normals.T))
        self._tree = cKDTree(points) if len(points) else None
        self._pose = pose.copy()

    def match(self, points, prior, spread):
        """
        Return (pose (3,) or None, share of points explained, misfit or None) near `prior` (3,).

        spread: (3,) standard deviations of the prior, along x, y and yaw.
        """
        points = points[::max(1, len(points) // self.settings.match_points)]
        if self._tree is None or len(points) < 20:
            return None, 0.0, None
        pose, information = prior.copy(), np.diag(1.0 / spread ** 2)
        reach = 0.2 + 3.0 * spread[0] + 2.0 * spread[2]
        for _ in range(12):
            placed = to_parent(pose, points)
            gap, index = self._tree.query(placed, distance_upper_bound=reach)
            near = np.flatnonzero(np.isfinite(gap))
            if len(near) < 20:
                return None, 0.0, None
            error, weight, jacobian = self._linearise(placed, pose, near, index[near])
            offset = pose - prior
            offset[2] = wrap_angle(offset[2])
            hessian = (jacobian * weight) @ jacobian.T + information
            change = -np.linalg.solve(
                hessian, jacobian @ (weight * error) + information @ offset)
            pose = pose + change
            reach = max(0.7 * reach, 0.15)
            if abs(change[2]) < 5e-4 and np.hypot(change[0], change[1]) < 1e-3:
                break
        return self._judge(points, placed, near, error, pose)

    def _linearise(self, placed, pose, near, index):
        """Return the distances (K,) to the lines, their weights (K,) and derivatives (3, K)."""
        x, y = placed[near].T
        line_x, line_y, normal_x, normal_y = self._lines[:, index]
        error = (x - line_x) * normal_x + (y - line_y) * normal_y
        jacobian = np.array((
            normal_x, normal_y, (x - pose[0]) * normal_y - (y - pose[1]) * normal_x))
        noise = self.settings.match_noise
        return error, 1.0 / (noise ** 2 + error ** 2), jacobian

    def _judge(self, points, placed, near, error, pose):
        """Return what `match` does; a pose if enough lies, widely spread, on the reference."""
        noise = self.settings.match_noise
        good = near[np.abs(error) < 3.0 * noise]
        misfit = 1.0 - np.sum(noise ** 2 / (noise ** 2 + error ** 2)) / len(points)
        share = len(good) / len(points)
        # Half-metre cells with a surface in them: a person alone fills two or three.
        cell = np.floor(2.0 * placed[good])
        held = np.unique(cell[:, 0] * _CELLS + cell[:, 1], return_counts=True)[1]
        few = len(good) < 50 or (held > 2).sum() < 5
        if few or share < self.settings.match_share:
            return None, share, misfit
        pose[2] = wrap_angle(pose[2])
        return pose, share, misfit


def _normals(points):
    """Return (normals (P, 2), good (P,) bool) of `points` (P, 2) along a sweep."""
    if len(points) < 5:
        return np.zeros((len(points), 2)), np.zeros(len(points), dtype=bool)
    ahead, behind = np.roll(points, -2, axis=0), np.roll(points, 2, axis=0)
    along = ahead - behind
    length, *sides = (np.hypot(gap[:, 0], gap[:, 1])
                      for gap in (along, ahead - points, behind - points))
    # A surface: both neighbours are near, and this point lies between them.
    good = (np.maximum(*sides) < 0.4) & (length > 0.8 * (sides[0] + sides[1])) & (length > 1e-3)
    good[:2] = good[-2:] = False
    along = along / np.maximum(length, 1e-6)[:, None]
    return np.stack((-along[:, 1], along[:, 0]), axis=1), good
