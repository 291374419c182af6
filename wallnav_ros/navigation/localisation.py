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
Where the robot is: odometry, corrected by a localisation's last word and by what is seen.

REP-105: `odom` is continuous and drifts, `map` jumps; what AMCL corrects is odom in map.
Scan matching: `mapping.registration`.
"""

from dataclasses import replace
import math

import numpy as np

from wallnav_ros.mapping.registration import register
from wallnav_ros.navigation.watchdogs import Stop
from wallnav_ros.perception.odometry_buffer import PoseBuffer
from wallnav_ros.world.geometry import compose, invert, rotate, wrap_angle

MAP = 'map'
FIX_DISTANCE = 0.5         # m driven without a fix before its age counts
ODOMETRY_DRIFT = 0.02      # m per m and rad per m from where the map last spoke; common wheels
UNTOLD = np.diag((0.1, 0.1, 0.05)) ** 2      # covariance of a fix that comes without one
LEAST = np.diag((0.02, 0.02, 0.01)) ** 2     # added to one: no fix is as good as some believe
REFINED_EVERY = 0.1        # s
DOUBTFUL = 3.0             # standard deviations of a fix, beyond which a correction is not taken


class Localisation:
    """
    The robot's pose in the state frame: `map` once it is localised, else that of odometry.

    odom_frame, base_frame: names, from the odometry itself. map_from_odom: (3,) pose of the
    odometry's frame in the map, None while not localised. velocity: (2,) m/s forward, rad/s.
    travelled: metres driven since the last fix. fix_stamp: its stamp in seconds, or None.
    last_jump: metres by which the last fix moved the robot.
    """

    def __init__(self, map_from_odom=None):
        """Start at an unknown place, or with the odometry's frame fixed in the map at (3,)."""
        self.odom_frame, self.base_frame = 'odom', 'base_link'
        self.fixed = map_from_odom is not None
        self.map_from_odom = map_from_odom
        self.forget()

    def forget(self):
        """Forget everything but a fixed odometry frame, as after a jump of the clock."""
        self.velocity = np.zeros(2)
        self.travelled, self.last_jump, self._jumped = 0.0, 0.0, 0.0
        self.fix_stamp = self._doubt = self._fix = None
        self._refined, self._correction = -math.inf, None
        self._poses = PoseBuffer()
        self._first = self._last = None
        self._waiting = None
        if not self.fixed:
            self.map_from_odom = None

    @property
    def state_frame(self):
        """Return the name of the frame that poses, goal and walls are brought into."""
        return self.odom_frame if self.map_from_odom is None else MAP

    @property
    def odom_in_state(self):
        """Return the pose (3,) of the odometry's frame in the state frame."""
        return np.zeros(3) if self.map_from_odom is None else self.map_from_odom

    def add_odometry(self, stamp, pose, velocity):
        """Take a pose (3,) and velocity (2,); returns whether it was in order."""
        if not self._poses.add(stamp, pose):
            return False
        # A message from before the clock was set back may still come after it.
        if self._last is None or stamp < self._first:
            self._first = stamp
        if self._last is not None:
            self.travelled += math.hypot(pose[0] - self._last[0], pose[1] - self._last[1])
        self._last, self.velocity = pose, velocity
        self._settle()
        return True

    def add_fix(self, stamp, pose, covariance=None):
        """
        Take the robot's pose (3,) in the map at `stamp`; used once odometry reaches it.

        covariance: (3, 3) of x, y (m) and yaw (rad) in the map, None where nobody tells.
        """
        self._waiting = stamp, pose, covariance
        self._settle()

    def set_correction(self, stamp, map_from_odom):
        """Take the pose (3,) of the odometry's frame in the map, as TF gives it."""
        if self.map_from_odom is not None and self._last is not None:
            moved = (compose(map_from_odom, self._last) - compose(self.map_from_odom, self._last))
            self.last_jump = float(np.hypot(*moved[:2]))
            self._jumped = max(self._jumped, self.last_jump)
        self.map_from_odom, self.fix_stamp, self.travelled = map_from_odom, stamp, 0.0
        # TF says where the robot is, but not how well that is known: an earlier word on it stays.
        self._fix, self._refined = (map_from_odom, self._fix and self._fix[1]), -math.inf
        self._doubt = self._fix[1]
        if self._correction is None:
            self._correction = map_from_odom

    def refine(self, stamp, laser, points, walls):
        """
        Correct the last fix by what was seen at `stamp`.

        laser: (3,) pose of the scanner in the odometry's frame; points: (K, 2) beam ends in its
        own; walls: DistanceField of the map, or None. Where they do not tell, the fix holds.
        """
        fresh = 0.0 <= stamp - self._refined < REFINED_EVERY
        if self.fixed or self._fix is None or walls is None or fresh:
            return
        self._refined = stamp
        before = self._correction
        self.map_from_odom, self._doubt = self._fix
        carried = self._carried(laser[:2])
        covariance = LEAST + (UNTOLD if carried is None else carried)
        fix = compose(self.map_from_odom, laser)
        # Where it was right is where to look first: a fix may have got behind a wall.
        for start in (compose(before, laser), fix):
            found = None
            if _deviations(start - fix, covariance) < DOUBTFUL:
                found = register(points, start, fix, covariance, walls)
            if found is not None and _deviations(found.pose - fix, covariance) < DOUBTFUL:
                self.map_from_odom = self._correction = compose(found.pose, invert(laser))
                self._doubt = laser[:2], found.covariance
                return
        self._correction = self.map_from_odom

    def take_jump(self):
        """Return the farthest jump in metres since this was last asked."""
        jumped, self._jumped = self._jumped, 0.0
        return jumped

    def fault(self, now, timeout):
        """Return the Stop that a fix calls for which is older than `timeout` s, or None."""
        if self.map_from_odom is None or self.fixed:
            return None
        # AMCL is silent while the robot stands: only what was driven since makes a fix old.
        age = now - self.fix_stamp
        if age <= timeout or self.travelled <= FIX_DISTANCE:
            return None
        return Stop('localisation_stale', f'localisation: no pose for {age:.2f} s and '
                    f'{self.travelled:.2f} m (timeout {timeout:g} s)')

    def odom_pose(self, stamp):
        """Return the robot (3,) in the odometry's frame at `stamp`, None if it cannot be told."""
        return self._poses.at(stamp)

    def pose(self, stamp):
        """Return the robot (3,) in the state frame at `stamp`, None if it cannot be told."""
        pose = self._poses.at(stamp)
        return None if pose is None else compose(self.odom_in_state, pose)

    def newest(self):
        """Return the newest pose (3,) in the state frame; None before any odometry."""
        return None if self._last is None else compose(self.odom_in_state, self._last)

    def frame_in_state(self, frame):
        """Return the pose (3,) of `frame` in the state frame, None if they are not related."""
        if frame == self.state_frame:
            return np.zeros(3)
        if frame == self.odom_frame:
            return self.odom_in_state
        if frame == self.base_frame:
            return self.newest()
        return None

    def walls_in_odom(self, walls):
        """Return a DistanceField of the map in the odometry's frame, None unless localised."""
        if walls is None or self.map_from_odom is None:
            return None
        return replace(walls, pose=compose(invert(self.map_from_odom), walls.pose))

    def covariance_at(self, place):
        """
        Return how well the map knows what is at `place` (2,) of the odometry's frame.

        (3, 3) of x, y (m) and yaw (rad), along the axes of that frame; None where no fix told.
        A fix that is d metres away has its heading's error times d in it, and odometry's drift.
        """
        covariance = self._carried(place)
        if covariance is None:
            return None
        turn = np.eye(3)
        turn[:2, :2] = rotate(np.eye(2), -self.map_from_odom[2]).T
        return turn @ covariance @ turn.T

    def _carried(self, place):
        """Return the same along the axes of the map."""
        if self._doubt is None or self.map_from_odom is None:
            return None
        fixed, covariance = self._doubt
        way = rotate(place - fixed, self.map_from_odom[2])
        carry = np.array([[1.0, 0.0, -way[1]], [0.0, 1.0, way[0]], [0.0, 0.0, 1.0]])
        drift = ODOMETRY_DRIFT * math.hypot(*way)
        return carry @ covariance @ carry.T + drift ** 2 * np.eye(3)

    def in_odom(self, pose):
        """Return a pose (3,), given in the state frame, in the odometry's."""
        return compose(invert(self.odom_in_state), pose)

    def _settle(self):
        """Use the waiting fix if odometry can tell where the robot was then."""
        if self._waiting is None or self._last is None:
            return
        stamp, pose, covariance = self._waiting
        # AMCL speaks when the robot moves: a fix from before our first odometry still holds.
        odom = self._poses.at(max(stamp, self._first))
        if odom is not None:
            self._waiting = None
            self.set_correction(stamp, compose(pose, invert(odom)))
            self._doubt = None if covariance is None else (odom[:2], covariance)
            self._fix = self.map_from_odom, self._doubt


def _deviations(off, covariance):
    """Return how many standard deviations of `covariance` (3, 3) a pose (3,) is `off`."""
    off = np.array([off[0], off[1], wrap_angle(off[2])])
    return math.sqrt(off @ np.linalg.solve(covariance, off))
