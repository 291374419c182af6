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
From scans to tracks: predict, associate, correct, judge, give birth, bury.

Constant-velocity Kalman filters with optimal assignment (Bar-Shalom and Li 1995; Kuhn 1955).
"""

import numpy as np

from wallnav_ros.perception.association import associate
from wallnav_ros.perception.beam_order import BeamOrder
from wallnav_ros.perception.classification import (
    find_gait, settle_labels, weigh_gait, weigh_motion)
from wallnav_ros.perception.detection import detect, judge_points, place_beams
from wallnav_ros.perception.ego_motion import EgoMotion
from wallnav_ros.perception.mapped_walls import lie_on_walls
from wallnav_ros.perception.measuring import measure
from wallnav_ros.perception.own_body import OwnBody
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.track_table import TrackTable, UNJUDGED
from wallnav_ros.perception.visibility import look_up, make_view, ViewMemory
from wallnav_ros.world.geometry import compose, distances, invert, rotate, to_parent
from wallnav_ros.world.tracks import HUMAN, OBSTACLE, Tracks


class Tracker:
    """
    Follows the things a scanner sees; one `update` per scan, in the order of their stamps.

    resets: how often the memory was wiped because time ran backwards or a gap was too long.
    sweep: (3,) the laser's motion from the first beam of the last scan to its last beam, in its
    frame at the first, with the sign in which the scan was straightened.
    """

    def __init__(self, settings=TrackerSettings()):
        self.settings = settings
        self.resets = 0
        self.sweep = np.zeros(3)
        self._orders = {}
        self._table = TrackTable()
        self._known = False
        self._forget()

    @property
    def reversed_sensors(self):
        """Return the names of the scanners whose beams fit only the other way round."""
        return sorted(name for name, order in self._orders.items() if order.sign < 0.0)

    def update(self, scan, pose=None, walls=None, covariance=None, end_pose=None,
               odometry=True, sensor='scan'):
        """
        Take one Scan and return the Tracks at its stamp.

        pose: (3,) of the laser in the tracking frame (`odom` or `map`) at the scan's stamp.
        walls: DistanceField of the mapped walls in the tracking frame; what they explain is
            left out.
        covariance: (3, 3) of `pose` relative to those walls: x, y in m, yaw in rad, along the
            axes of the tracking frame; None where nobody tells.
        end_pose: (3,) of the laser when the last beam was taken, to straighten the sweep.
        odometry: False where `pose` is only where the laser sits on the robot (the origin, if
            None). Tracks are then in the robot's frame at the scan's stamp, their velocities
            over ground, as far as the scans tell how the robot moves.
        sensor: name of the scanner, where several feed one tracker.
        """
        settings, table = self.settings, self._table
        known = odometry and pose is not None
        elapsed = self._advance(scan.stamp, known)
        before, interval = self._take_turn(sensor, scan.stamp)
        table.predict(elapsed, settings)
        given = np.zeros(3) if pose is None else np.asarray(pose, dtype=float)
        told = self._sweep(scan, given, known, end_pose)
        order = self._orders.setdefault(sensor, BeamOrder(settings))
        self.sweep = sweep = order.sign * told
        body = self._bodies.setdefault(sensor, OwnBody(settings))
        own = body.find(scan, self._motion.rate * interval)
        hits, local = place_beams(scan, ~own, sweep, settings)
        people, radii = table.position[table.human], table.radius[table.human]
        pose = self._motion.locate(local, people, given, known, elapsed, interval, sensor)
        if order.weigh(scan, ~own, told, self._motion.misfit, people, given, known, interval,
                       sensor):
            self._unlearn(sensor)
        if walls is not None and known and len(hits):
            open_space = ~lie_on_walls(
                to_parent(given, local), given[:2], walls, covariance, settings)
            hits, local = hits[open_space], local[open_space]
        points = to_parent(pose, local)
        memory = self._views.setdefault(
            sensor, ViewMemory(settings.view_spacing, settings.view_count))
        view = make_view(scan, pose, settings.clear_range, sweep)
        earlier = memory.older_than(scan.stamp - settings.view_age, view)
        evidence = judge_points(points, scan, earlier, settings)
        seen = detect(scan, hits, points, pose, evidence, people, radii, settings)
        match = associate(table, seen, settings)
        missed = self._find_missed(match, before, elapsed)
        self._correct(seen, match, scan, view, interval, walls is not None)
        self._miss(missed, scan, view, elapsed)
        self._give_birth(seen, match, scan.stamp)
        self._merge()
        table.lay_trail(scan.stamp, settings.trail_spacing)
        memory.add(view)
        return self._report(scan.stamp)

    def _advance(self, stamp, known):
        """Return the seconds since the last scan, forgetting everything across a jump."""
        elapsed = 0.0 if self._stamp is None else stamp - self._stamp
        jumped = elapsed < -self.settings.disorder or elapsed > self.settings.longest_gap
        if self._stamp is not None and (jumped or known != self._known):
            self.resets += 1
            self._forget()
            elapsed = 0.0
        if self._stamp is None:
            self._began = self._stamp = stamp
        self._stamp = max(stamp, self._stamp)
        self._known = known
        return max(elapsed, 0.0)

    def _take_turn(self, sensor, stamp):
        """Return the turn of this scanner's scan before, and the seconds since then."""
        self._turn += 1
        before, then = self._turns.get(sensor, (0, stamp))
        self._turns[sensor] = self._turn, max(stamp, then)
        return before, max(stamp - then, 0.0)

    def _forget(self):
        self._table.clear()
        self._views, self._bodies, self._turns = {}, {}, {}
        self._turn = 0
        self._motion = EgoMotion(self.settings)
        for order in self._orders.values():
            order.restart()
        self._began = self._stamp = None

    def _unlearn(self, sensor):
        """Forget what the bent scans of a scanner showed: things stay, as to what they are."""
        self._motion.forget(sensor)
        self._views.pop(sensor, None)
        self._table.unlabel()

    def _sweep(self, scan, given, known, end_pose):
        """Return the laser's motion (3,) from the first beam to the last, in its first frame."""
        if not scan.sweep_time:
            return np.zeros(3)
        if not known:
            end_pose = compose(self._motion.rate * scan.sweep_time, given)
        if end_pose is None:
            return np.zeros(3)
        return compose(invert(given), np.asarray(end_pose, dtype=float))

    def _find_missed(self, match, before, elapsed):
        """Return (N,) bool: tracks not seen since this scanner's scan `before`, by anybody."""
        table = self._table
        missed = (match.first < 0) & (table.turn <= before)
        table.hits -= min(elapsed / 0.5, 1.0) * missed * table.hits
        return missed

    def _correct(self, seen, match, scan, view, interval, mapped):
        """Correct the tracks that were seen, by one detection or the mean of two legs."""
        settings, table = self.settings, self._table
        rows = np.flatnonzero(match.first >= 0)
        if not len(rows):
            return
        one = match.first[rows]
        both = match.second[rows] >= 0
        two = np.where(both, match.second[rows], one)
        # A thing that several scanners see does not live faster.
        elapsed = np.clip(scan.stamp - table.seen[rows], 0.0, interval)
        found = measure(table, rows, seen, one, two, elapsed, settings)
        table.correct(rows, found.position, found.noise, scan.stamp)
        table.turn[rows] = self._turn
        share = np.minimum(elapsed / 0.5, 1.0)
        table.pair[rows] += share * (both - table.pair[rows])
        # What is half hidden shows a part of its width only, but not for ever.
        growth = found.radius - table.radius[rows]
        slow = found.covered & (growth < 0.0)
        rate = np.where(slow, elapsed / settings.shrink_time, share)
        table.radius[rows] += np.where(found.solid, 1.0, rate) * growth
        table.score[rows] = np.minimum(table.score[rows] + elapsed / settings.confirm_time, 1.0)
        weight = seen.count[one] + both * seen.count[two]
        shares = [(kind[one] * seen.count[one] + both * kind[two] * seen.count[two]) / weight
                  for kind in (seen.still, seen.fresh)]
        plain, moved_rate, leap_share = self._trust(mapped)
        # Where the map has taken the walls out, what stands beside is no wall.
        apart = plain[rows] | (seen.apart[one] & seen.apart[two])
        table.apart[rows] += share * (apart - table.apart[rows])
        table.hits[rows] += share * (1.0 - table.hits[rows])
        vacated = look_up([view], scan, table.trail[rows, 6], 0.15, 0.2, 0.0)[0][0]
        gait = weigh_gait(find_gait(table, settings)[rows], shares[0], self._motion.certain,
                          settings)
        weigh_motion(table, rows, *shares, moved_rate[rows] * apart, vacated, gait, elapsed,
                     settings, leap_share[rows], found.disc & mapped)
        settle_labels(table, self._crowded(), settings, plain)

    def _trust(self, mapped):
        """
        Return how far to believe a way that tracks have come: three arrays (N,).

        Bool, they are discs in a place of which the map tells all the rest; log-odds a second for
        what moves; the share of a leap that may be a mix-up.
        """
        settings, table = self.settings, self._table
        # What is not round may be a piece of something that the map lacks; what nobody can tell
        # yet, for it is small or far, is taken for round where most of the rest is.
        judged = np.abs(table.roundness - UNJUDGED) > 0.01
        known = table.roundness[judged & (table.score >= 1.0)]
        common = len(known) >= 3 and known.mean() > settings.roundness
        plain = mapped & np.where(judged, table.roundness > UNJUDGED + 0.05, common)
        # From a moving laser other sides of things are seen: that alone is no motion. And who
        # has only just begun to look does not know what flickers.
        watched = self._stamp - self._began >= settings.still_age
        stands = watched and self._motion.pace < 0.05
        sure = stands and self._motion.certain
        return (plain, np.where(plain, settings.mapped_rate, settings.moved_rate * stands),
                np.where(plain | sure, 0.0, settings.leap_share))

    def _miss(self, missed, scan, view, elapsed):
        """Doubt `missed` (N,) tracks in places seen empty, and bury those unseen for too long."""
        settings, table = self.settings, self._table
        if missed.any():
            # Where something else is seen, it may have been taken for the track's.
            empty, taken = (answer[0] for answer in look_up(
                [view], scan, table.position, 0.1, 0.3, 0.0))
            loss = elapsed * np.where(empty | (table.score < 1.0), 1.0, 0.5 * taken) * missed
            table.score -= loss / settings.miss_time
        hidden = scan.stamp - table.seen
        table.keep(((table.score > 0.0) | ~missed) & (hidden <= settings.occlusion_time))

    def _give_birth(self, seen, match, stamp):
        """Start tracks on what no track explains, two legs together where they may be."""
        settings, table = self.settings, self._table
        free = np.flatnonzero(~match.used & (seen.count >= 3))
        if len(table) and len(free):
            gap = distances(seen.position[free], table.position[table.human])
            crowded = (gap < settings.carve_radius).any(axis=1) & seen.leg[free]
            free = free[~crowded]
        position, radius, pair = seen.position[free], seen.radius[free], np.zeros(len(free))
        table.add(position, radius, pair, stamp, settings)
        table.turn[len(table) - len(free):] = self._turn

    def _merge(self):
        """Drop tracks that are another's second leg, or the edge of another's disc."""
        settings, table = self.settings, self._table
        if len(table) < 2:
            return
        gap = distances(table.position, table.position)
        drift = distances(table.velocity, table.velocity)
        leg = (table.motion > 0.0) & (table.radius < settings.stride / 2.0)
        twin = leg[:, None] & leg[None] & (gap < settings.leg_gap) & (drift < settings.leg_drift)
        edge = ((gap < table.radius[None] + settings.edge_margin)
                & (table.radius[None] > settings.leg_width)
                & (table.radius[:, None] < 0.5 * table.radius[None]))
        # A disc is solid: whatever has its middle within it is a part of it.
        within = (gap < 0.8 * table.radius[None]) & table.is_solid(settings)[None]
        # Who stays: people before things, then the elder (rows are in order of birth).
        rank = table.human * len(table) - np.arange(len(table))
        table.keep(~(((twin | within) & (rank[:, None] < rank[None])) | edge).any(axis=1))

    def _crowded(self):
        """Return (N,) bool: what is so close to a person that it may be a part of them."""
        settings, table = self.settings, self._table
        gap = distances(table.position, table.position)
        leg = (table.radius < settings.leg_width / 2.0) & (table.pair < 0.3)
        walker = table.human & ~table.is_solid(settings)
        owned = leg & ((gap < settings.stride) & (gap > 0.0) & walker).any(axis=1)
        # Of two that come forth together, the elder is the person (rows are in order of birth).
        likely = table.human | (table.motion > settings.human_odds)
        return owned | np.tril((gap < settings.abreast) & likely, -1).any(axis=1)

    def _report(self, stamp):
        table = self._table
        shown = np.flatnonzero(table.score >= 1.0)
        human = table.human[shown]
        speed = np.hypot(*table.velocity[shown].T)
        doubt = np.sqrt(table.covariance[shown, 2])
        moving = speed > doubt * np.where(human, 1.0, 2.5)
        velocity = np.where(moving[:, None], table.steady_velocity[shown], 0.0)
        label = np.where(human, HUMAN, OBSTACLE).astype(np.uint8)
        outward = invert(self._motion.correction)
        return Tracks(stamp, table.id[shown], to_parent(outward, table.position[shown]),
                      rotate(velocity, outward[2]), table.radius[shown], label)
