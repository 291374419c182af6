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
From one scan to the things in it: clusters with a centre, a size and what earlier views say.

Jump-distance clusters, cut where standing background meets something that arrived, and where
two people touch (the tracker tells where it expects them).
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.perception.clustering import describe, extent, split_runs
from wallnav_ros.perception.discs import Discs, find_discs, FRONT
from wallnav_ros.perception.visibility import look_up
from wallnav_ros.world.geometry import distances


@dataclass(frozen=True)
class Detections:
    """
    D compact things seen in one scan, in the tracking frame.

    position: (D, 2) metres, of the centre. radius: (D,) metres. count: (D,) beams.
    still: (D,) share of the beams that end where earlier views saw a surface too.
    fresh: (D,) share of the beams that end where earlier views saw nothing.
    apart: (D,) bool, stands clear of anything larger than a person.
    leg: (D,) bool, no wider than a leg. noise: (D,) metres, error of a coordinate.
    hidden: (D, 2) metres, by how much what covers its right and its left side is nearer, 0 where
    nothing does. sight: (D, 2) unit vector from the scanner.
    discs: the Discs that they may be.
    """

    position: np.ndarray
    radius: np.ndarray
    count: np.ndarray
    still: np.ndarray
    fresh: np.ndarray
    apart: np.ndarray
    leg: np.ndarray
    hidden: np.ndarray
    noise: np.ndarray
    sight: np.ndarray
    discs: Discs

    def __len__(self):
        """Return the number of detections."""
        return len(self.radius)

    def centre_of(self, which, radius, settings):
        """
        Return the centres (K, 2) of detections `which` (K,), if they are discs of `radius` (K,) m.

        The side that is not hidden is the disc's own limb: the centre is one radius from it.
        """
        seen, sight = self.radius[which], self.sight[which]
        missing = np.clip(radius - seen, 0.0, settings.hidden_width)
        hidden = (self.hidden[which] > 0.0).astype(float)
        shift = missing * (hidden[:, 1] - hidden[:, 0])
        # The mean depth of the visible part of a circle, whose offsets spread evenly.
        behind = np.sqrt(np.maximum((seen + missing) ** 2 - shift ** 2 - seen ** 2 / 3.0, 0.0))
        left = np.stack((-sight[:, 1], sight[:, 0]), axis=1)
        return (self.position[which] + shift[:, None] * left
                + (behind - FRONT * seen)[:, None] * sight)


def place_beams(scan, wanted, sweep, settings):
    """
    Return (hits (P,) int, points (P, 2)): the beams in reach and their ends, straightened.

    wanted: (B,) bool, beams to use.
    sweep: (3,) the laser's motion from the first beam to the last, in its frame at the first,
    which is the frame of the points.
    """
    hits = np.flatnonzero(scan.hits & wanted & (scan.ranges <= settings.max_range))
    share = hits / max(len(scan.ranges) - 1, 1)
    angles, ranges = scan.angles[hits] + share * sweep[2], scan.ranges[hits]
    ends = ranges[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    return hits, ends + share[:, None] * sweep[:2]


def judge_points(points, scan, views, settings):
    """
    Return (still, fresh, background), each (P,) bool: what earlier `views` say of `points` (P, 2).

    still: mostly occupied a while before; fresh: mostly empty; background: occupied long before.
    """
    if not views or not len(points):
        nothing = np.zeros(len(points), dtype=bool)
        return nothing, nothing, nothing
    free, occupied = look_up(views, scan, points, settings.view_lateral, settings.view_depth,
                             settings.view_slack)
    full, empty = occupied.astype(np.float32), free.astype(np.float32)
    ages = scan.stamp - np.array([view.stamp for view in views])
    # Counting by products of matrices takes a tenth of the time of counting truths.
    counted = np.array([ages > settings.still_age, ages > settings.background_age], np.float32)
    still, background = counted @ (full - empty) > 0.0
    fresh = np.ones(len(views), np.float32) @ (empty - 2.0 * full) > 0.0
    return still, fresh, background


def detect(scan, hits, points, pose, evidence, expected, radii, settings):
    """
    Return the Detections among `points` (P, 2), the ends of beams `hits` (P,) of `scan`.

    pose: (3,) of the laser. evidence: what `judge_points` says.
    expected: (N, 2) m, where people should be; radii: (N,) m, how wide they are.
    """
    still, fresh, background = evidence
    step = abs(scan.angle_increment)
    owner = split_runs(scan.angles[hits], scan.ranges[hits], step, scan.full_circle,
                       settings.break_distance, settings.beam_factor)
    clusters = describe(points, pose[:2], owner, step)
    if (np.maximum(clusters.width, clusters.depth) > settings.body_width).any():
        owner = _cut(owner, clusters, points, background, expected, radii, settings)
        clusters = describe(points, pose[:2], owner, step)
    size = np.maximum(clusters.width, clusters.depth)
    chosen = np.flatnonzero(size <= settings.largest_width)
    total = len(clusters)
    apart = _stand_apart(scan, hits, points, settings)
    apart = np.bincount(owner, apart, total)[chosen] > 0.5 * clusters.count[chosen]
    still = np.bincount(owner, still, total)[chosen] / clusters.count[chosen]
    fresh = np.bincount(owner, fresh, total)[chosen] / clusters.count[chosen]
    distance = np.maximum(clusters.distance[chosen], 1e-6)
    sight = (clusters.centroid[chosen] - pose[:2]) / distance[:, None]
    radius = 0.5 * clusters.width[chosen]
    leg = clusters.width[chosen] <= settings.leg_width + step * distance
    noise = np.hypot(settings.body_noise, 0.3 * step * distance)
    hidden = _find_hidden(scan, hits, owner, clusters, settings)[chosen]
    hidden *= (radius > settings.thin_radius)[:, None]
    centre = clusters.centroid[chosen] + sight * (FRONT * radius)[:, None]
    discs = find_discs(points, owner, clusters, chosen, sight, ~leg, settings)
    return Detections(centre, radius, clusters.count[chosen], still, fresh, apart, leg, hidden,
                      noise, sight, discs)


def _find_hidden(scan, hits, owner, clusters, settings):
    """
    Return (C, 2) m: by how much what covers the right and the left side of a cluster is nearer.

    A beam beside it ends well before it, or on a nearer cluster that it was cut from.
    """
    total, beams = len(clusters), len(scan.ranges)
    first, last = np.full(total, beams), np.full(total, -1)
    np.minimum.at(first, owner, hits)
    np.maximum.at(last, owner, hits)
    ranges, middle = np.where(scan.hits, scan.ranges, np.inf), np.full(beams, np.inf)
    middle[hits] = clusters.distance[owner]
    edge = np.array((first, first, last, last))
    beside = edge + [[-1], [-2], [1], [2]]
    nearer = ranges[edge] - ranges[beside % beams]
    seam = ((np.abs(nearer) <= settings.break_distance)
            & (middle[beside % beams] < clusters.distance - 3.0 * settings.body_noise))
    cover = np.where(nearer > settings.break_distance, nearer, seam * settings.break_distance)
    if not scan.full_circle:
        cover *= (beside >= 0) & (beside < beams)
    sides = np.maximum(cover[::2], cover[1::2]).T
    return sides if scan.angle_increment > 0.0 else sides[:, ::-1]


def _stand_apart(scan, hits, points, settings):
    """Return (P,) bool: the beam end is no part of, nor close to, anything large."""
    step = abs(scan.angle_increment)
    group = split_runs(scan.angles[hits], scan.ranges[hits], step, scan.full_circle,
                       settings.apart_distance, settings.beam_factor)
    return extent(points, group)[group] < settings.apart_width


def _cut(owner, clusters, points, background, expected, radii, settings):
    """Return new owners (P,): wide clusters cut at the background's edge and around people."""
    size = np.maximum(clusters.width, clusters.depth)
    which = np.flatnonzero((size > settings.body_width)[owner])
    kind = np.where(_smooth(background)[which], -1, 0)
    if len(expected):
        gap = distances(points[which], expected)
        nearest = (gap - radii).argmin(axis=1)
        reach = np.maximum(settings.carve_radius, radii + settings.edge_margin)
        mine = (gap[np.arange(len(which)), nearest] < reach[nearest]) & (kind == 0)
        # One person in a cluster of a person's size needs no cutting out.
        people = np.zeros((len(clusters), len(expected)), dtype=bool)
        people[owner[which[mine]], nearest[mine]] = True
        several = people.sum(axis=1)[owner[which]] > 1
        large = (size > settings.largest_width)[owner[which]]
        kind = np.where((mine & large) | (several & (kind == 0)), nearest + 1, kind)
    label = np.zeros(len(owner), dtype=np.intp)
    label[which] = kind - kind.min(initial=0)
    pairs = owner * (label.max() + 1) + label
    return (np.cumsum(np.bincount(pairs) > 0) - 1)[pairs]


def _smooth(flags):
    """Return `flags` (P,) after a majority vote of five neighbours."""
    return np.convolve(flags, np.ones(5), mode='same') > 2.5
