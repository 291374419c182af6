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
What is around the robot, in the state frame and carried forward to the moment it is needed.

Tracks as agents, beams and mapped walls as distances; paper section 2 (state).
"""

from dataclasses import replace

import numpy as np

from wallnav_ros.navigation.detours import Standing
from wallnav_ros.navigation.localisation import MAP
from wallnav_ros.navigation.surfaces import (
    add_surfaces, assign_points, NearSurfaces, outlines, scan_points, WALL_MARGIN)
from wallnav_ros.navigation.trails import Trails
from wallnav_ros.world.geometry import rotate, to_parent
from wallnav_ros.world.state import Agents, Observation
from wallnav_ros.world.tracks import Tracks

LONGEST_PREDICTION = 0.5       # s that tracks and the robot are carried forward at most


class Scene:
    """
    The newest tracks, scan and map, placed by a Localisation.

    time_step: s between two decisions, and between the places of a trail. map_walls:
    DistanceField of the mapped walls, in the map's frame, or None.
    """

    def __init__(self, place, time_step):
        self.map_walls = None
        self._place, self._tracks, self._trails = place, None, Trails(time_step)
        self._standing = Standing()
        self._points, self._laser = np.empty((0, 2)), np.zeros(3)
        self._assigned = (), None

    @property
    def tracks(self):
        """Return the newest Tracks, in the odometry's frame, or None."""
        return self._tracks

    @tracks.setter
    def tracks(self, tracks):
        self._tracks = tracks
        if tracks is None:
            self._trails.forget()
            self._standing.forget()
        else:
            self._trails.take(tracks)
            self._standing.take(tracks)

    def take_scan(self, scan, laser):
        """
        Take the beams of a Scan from a laser at the pose (3,) in the odometry's frame.

        Returns where they ended (K, 2), in the laser's own frame.
        """
        points = scan_points(scan)
        self._points, self._laser = to_parent(laser, points), laser
        return points

    def take_tracks(self, tracks, pose):
        """Take Tracks in a frame placed at `pose` (3,) in the odometry's."""
        self.tracks = moved(tracks, pose)

    @property
    def walls(self):
        """Return the DistanceField of the mapped walls, None while the robot is not in the map."""
        return self.map_walls if self._place.state_frame == MAP else None

    def observe(self, robot, now):
        """Return the Observation of a Robot at `now` (s)."""
        agents, points = self._seen(now)
        trail = to_parent(self._place.odom_in_state, self._trails.of(self._tracks))
        agents = replace(agents, trail=trail)
        return Observation(robot, agents, add_surfaces(points, self.walls, robot.position))

    def observe_near(self, robot, now, reach, clearance):
        """
        Return the same with exact distances, of what is within `reach` m.

        Beam ends more than `clearance` m from a mapped wall count besides that wall: the map, or
        the robot's pose in it, may be as wrong as that.
        """
        agents, points = self._seen(now)
        points = _within(reach, points, robot.position)
        if self.walls is not None:
            ends = _within(reach, to_parent(self._place.odom_in_state, self._points),
                           robot.position)
            off = self.walls.at(ends)
            points = np.vstack((points, ends[(off > clearance) & (off <= WALL_MARGIN)]))
        return Observation(robot, agents, NearSurfaces(points, self.walls))

    def standing(self, now):
        """Return points (K, 2) on everything that stands and that the map does not know."""
        agents, points = self._seen(now)
        return outlines(points, agents)

    def bystanders(self):
        """Return the position (K, 2) and radius (K,) of all tracks that have stood for long."""
        position, radius = self._standing.discs()
        return to_parent(self._place.odom_in_state, position), radius

    def _seen(self, now):
        """Return the Agents at `now` and the points (K, 2) that belong to none of them."""
        # A decision and the command that follows from it look at the same.
        given = self._points, self._tracks, self._place.map_from_odom, self.walls
        before, assigned = self._assigned
        if len(before) != len(given) or any(a is not b for a, b in zip(before, given)):
            assigned = self._assign()
            self._assigned = given, assigned
        seen, points = assigned
        ahead = worth_predicting(now - self._tracks.stamp)
        return Agents.of(seen.position + ahead * seen.velocity, seen.velocity, seen.radius), points

    def _assign(self):
        """Return the Agents at the stamp of their tracks, and the points that belong to none."""
        in_state = self._place.odom_in_state
        return assign_points(
            to_parent(in_state, self._points), moved(self._tracks, in_state).agents(), self.walls,
            to_parent(in_state, self._laser[:2]))


def _within(reach, points, centre):
    return points[(np.abs(points - centre) < reach).all(axis=1)]


def worth_predicting(age):
    """Return `age` seconds where things may be carried forward so far, else the bound."""
    return float(np.clip(age, 0.0, LONGEST_PREDICTION))


def moved(tracks, pose):
    """Return Tracks, given in the frame placed at `pose` (3,), in its parent."""
    return Tracks(tracks.stamp, tracks.id, to_parent(pose, tracks.position),
                  rotate(tracks.velocity, pose[2]), tracks.radius, tracks.label)
