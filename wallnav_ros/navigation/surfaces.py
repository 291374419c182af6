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
What the scanner sees that neither the map nor a track explains, as walls.

Keeps furniture, closed doors and unmapped walls from being driven into; without a map it is
all the walls there are. Distances by Euclidean distance transform (Felzenszwalb 2012).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial.distance import cdist

from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import to_child, wrap_angle
from wallnav_ros.world.state import Agents

RESOLUTION = 0.05      # m
REACH = 8.0            # m around the robot; the policy feels walls up to 5 m from where it looks
LEAST_BEAMS = 3        # on an agent, or its outline is not believed
LARGEST_RADIUS = 0.6   # m; the largest the policy was trained on, and a margin
TRACK_MARGIN = 0.25    # m beyond a track's radius that still belong to it
WALL_MARGIN = 0.15     # m; what lies nearer to a mapped wall is part of it


def scan_points(scan):
    """Return where the beams of a Scan ended (K, 2), in the frame of the laser."""
    angles, ranges = scan.angles[scan.hits], scan.ranges[scan.hits]
    return np.stack((ranges * np.cos(angles), ranges * np.sin(angles)), axis=1)


def assign_points(points, agents, walls, eye):
    """
    Return `agents` grown to what is seen of them, and the points (U, 2) that belong to none.

    points: (K, 2) beam ends seen from `eye` (2,); those on mapped `walls` (DistanceField or
    None) are dropped. One within TRACK_MARGIN of an agent's edge is part of the nearest agent.
    """
    if walls is not None and len(points):
        points = points[walls.at(points) > WALL_MARGIN]
    if not len(points) or not agents.radius.size:
        return agents, points
    gap = cdist(points, agents.position) - agents.radius
    nearest = gap.argmin(axis=1)
    taken = gap[np.arange(len(points)), nearest] <= TRACK_MARGIN
    return _grow(agents, nearest[taken], points[taken] - eye, eye), points[~taken]


def _grow(agents, owner, rays, eye):
    """
    Return `agents`, each at least the disc that its `rays` (K, 2) from `eye` touch and end on.

    A disc of radius r whose near side is d away subtends a half angle a with
    sin a = r / (d + r). A tracker that goes by the width it sees tells a wide body, or one that
    is close, too small and too near.
    """
    count = np.bincount(owner, minlength=agents.radius.size)
    toward = agents.position - eye
    middle = np.arctan2(toward[:, 1], toward[:, 0])
    bearing = wrap_angle(np.arctan2(rays[:, 1], rays[:, 0]) - middle[owner])
    low, high = np.full(count.shape, np.inf), np.full(count.shape, -np.inf)
    near = np.full(count.shape, np.inf)
    np.minimum.at(low, owner, bearing)
    np.maximum.at(high, owner, bearing)
    np.minimum.at(near, owner, np.hypot(rays[:, 0], rays[:, 1]))
    seen = count >= LEAST_BEAMS
    low, high, near = (np.where(seen, part, 0.0) for part in (low, high, near))
    # Each edge lies, on average, half a beam beyond the last one that ends on the body.
    half = 0.5 * (high - low) * count / np.maximum(count - 1, 1)
    sine = np.sin(np.minimum(half, 1.0))
    radius = np.minimum(near * sine / (1.0 - sine), LARGEST_RADIUS)
    grown = seen & (radius > agents.radius)
    bearing = middle + 0.5 * (low + high)
    centre = eye + (near + radius)[:, None] * np.stack((np.cos(bearing), np.sin(bearing)), axis=1)
    return Agents.of(np.where(grown[:, None], centre, agents.position), agents.velocity,
                     np.where(grown, radius, agents.radius))


def add_surfaces(points, walls, centre, reach=REACH):
    """
    Return the DistanceField of `points` (K, 2) and `walls` (DistanceField or None) together.

    It covers `reach` metres around `centre` (2,); where there is nothing to add, `walls` itself.
    """
    points = points[(np.abs(points - centre) < reach).all(axis=1)]
    if not len(points):
        return DistanceField.empty() if walls is None else walls
    size = int(np.ceil(2 * reach / RESOLUTION)) + 1
    corner = np.asarray(centre, dtype=float) - reach
    aligned = walls is not None and not walls.pose[2] and walls.resolution == RESOLUTION
    if aligned:
        corner = walls.pose[:2] + RESOLUTION * np.rint((corner - walls.pose[:2]) / RESOLUTION)
    free = np.ones((size, size), np.uint8)
    column, row = np.rint((points - corner) / RESOLUTION).astype(np.intp).T
    free[row, column] = 0
    distance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_5) * RESOLUTION
    if walls is not None:
        there = _cut(walls, corner, size) if aligned else _resample(walls, corner, size)
        np.minimum(distance, there, out=distance)
    return DistanceField(distance, np.array([*corner, 0.0]), RESOLUTION)


@dataclass(frozen=True)
class NearSurfaces:
    """
    Points (K, 2) and mapped `walls` (DistanceField or None), for a few exact distances.

    What `add_surfaces` makes of them is as coarse as its grid.
    """

    points: np.ndarray
    walls: DistanceField | None

    def at(self, places):
        """Return the distance (...) in metres from `places` (..., 2) to the nearest of them."""
        places = np.asarray(places, dtype=float)
        distance = (np.full(places.shape[:-1], np.inf) if self.walls is None
                    else np.asarray(self.walls.at(places), dtype=float))
        if not len(self.points):
            return distance
        nearest = cdist(places.reshape(-1, 2), self.points).min(axis=1)
        return np.minimum(distance, nearest.reshape(distance.shape))


STANDING = 0.2         # m/s, below which an agent counts as standing


def outlines(points, agents):
    """Return `points` (K, 2) and points on the edges of the agents that stand."""
    still = np.hypot(*agents.velocity.T) < STANDING
    turn = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    edge = np.stack((np.cos(turn), np.sin(turn)), axis=1)
    rings = agents.position[still, None] + agents.radius[still, None, None] * edge
    return np.vstack((points, rings.reshape(-1, 2)))


def _cut(walls, corner, size):
    """Return (size, size) nodes of `walls` from the one at `corner` (2,) on."""
    column, row = np.rint((corner - walls.pose[:2]) / walls.resolution).astype(np.intp)
    height, width = walls.distance.shape
    rows = np.clip(row + np.arange(size), 0, height - 1)
    columns = np.clip(column + np.arange(size), 0, width - 1)
    return walls.distance.take(rows, axis=0).take(columns, axis=1)


def _resample(walls, corner, size):
    """Return `walls` looked up at (size, size) nodes, RESOLUTION apart, from `corner` (2,) on."""
    # cv2 does in half a millisecond what `walls.at` takes twenty for, to 1/32 of a cell.
    nodes = to_child(walls.pose, corner + RESOLUTION * np.array([[0, 0], [1, 0], [0, 1]]))
    nodes /= walls.resolution
    to_cells = np.stack((nodes[1] - nodes[0], nodes[2] - nodes[0], nodes[0]), axis=1)
    return cv2.warpAffine(np.ascontiguousarray(walls.distance, dtype=np.float32), to_cells,
                          (size, size), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                          borderMode=cv2.BORDER_REPLICATE)
