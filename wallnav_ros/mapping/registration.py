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
A pose that is roughly known, corrected until what the scanner saw lies on the mapped walls.

Newton's method on squared distances, robustly weighted, with what is known as a prior: scan
matching on a distance field (Fitzgibbon 2003).
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.world.geometry import lengths, rotate, wrap_angle

REACH = 6.0            # m; what is farther off moves too much with the heading to be matched
GATE = 0.35            # m from every wall, beyond which a beam end is no wall of the map
SOFT = 0.10            # m from a wall, beyond which a beam end counts for ever less
NOISE = 0.05           # m, of a beam end and the map together
FEWEST = 15            # beam ends near walls, below which nothing is told
MOST = 100             # beam ends that are looked at
ROUNDS = 6
CLOSE = 1e-3           # m and rad, below which another round is not worth it
_AROUND = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)])


@dataclass(frozen=True)
class Registration:
    """
    Where a scanner is, given what it saw.

    pose: (3,) m, m, rad in the walls' frame. covariance: (3, 3) of it, along that frame's axes.
    """

    pose: np.ndarray
    covariance: np.ndarray


def register(points, start, known, covariance, walls):
    """
    Return the Registration of a scanner known to be near `known` (3,), None if it is not told.

    points: (K, 2) beam ends in the scanner's frame. start: (3,), the pose to begin with, and
    covariance: (3, 3) of `known`, along the axes of the frame of `walls`, a DistanceField. What
    the walls do not tell, such as how far down a corridor the scanner is, stays as it was known.
    """
    points = points[lengths(points) < REACH]
    points = points[::1 + len(points) // MOST]
    near = walls.at(_placed(start, points)) < GATE
    points = points[near]
    if near.sum() < FEWEST:
        return None
    prior, pose = np.linalg.inv(covariance), start.copy()
    for _ in range(ROUNDS):
        slope, bend = _towards_walls(points, pose, walls)
        off = pose - known
        off[2] = wrap_angle(off[2])
        step = np.linalg.solve(bend + prior, -(slope + prior @ off))
        pose = pose + step
        if np.abs(step).max() < CLOSE:
            break
    pose[2] = wrap_angle(pose[2])
    return Registration(pose, np.linalg.inv(bend + prior))


def _placed(pose, points):
    return rotate(points, pose[2]) + pose[:2]


def _towards_walls(points, pose, walls):
    """Return slope (3,) and bend (3, 3) at `pose` of half the sum of squared distances."""
    arms = rotate(points, pose[2])
    step = walls.resolution
    # Squared distances are smooth where distances have their kink: on the wall itself.
    half = 0.5 * walls.at(arms + pose[:2] + step * _AROUND[:, None]) ** 2
    here, right, left, up, down, both, neither, right_down, left_up = half
    weight = 1.0 / (1.0 + 2.0 * here / SOFT ** 2) ** 2 / NOISE ** 2
    x, y = (right - left) / (2.0 * step), (up - down) / (2.0 * step)
    xx = np.clip((right + left - 2.0 * here) / step ** 2, 0.0, 1.0)
    yy = np.clip((up + down - 2.0 * here) / step ** 2, 0.0, 1.0)
    xy = (both + neither - right_down - left_up) / (4.0 * step ** 2)
    most = np.sqrt(xx * yy)
    xy = np.clip(xy, -most, most)
    # How the ends move when the pose does: with it, and at right angles to their arms.
    move = np.zeros((len(points), 2, 3))
    move[:, 0, 0] = move[:, 1, 1] = 1.0
    move[:, 0, 2], move[:, 1, 2] = -arms[:, 1], arms[:, 0]
    slope = np.einsum('p,pi,pij->j', weight, np.stack((x, y), axis=1), move)
    bends = np.stack((np.stack((xx, xy), axis=1), np.stack((xy, yy), axis=1)), axis=1)
    return slope, np.einsum('p,pki,pkl,plj->ij', weight, move, bends, move)
