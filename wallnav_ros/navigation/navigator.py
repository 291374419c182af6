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
The robot-side core: newest data in, one command out, and the reason whenever it is zero.

The data's way of docs/architecture.md; paper sections 4 (decision) and 8 (the real robot).
"""

from collections import Counter
from dataclasses import replace

import numpy as np

from wallnav_ros.navigation.driving import Driver
from wallnav_ros.navigation.guidance import Guide
from wallnav_ros.navigation.localisation import Localisation
from wallnav_ros.navigation.plans import NavigatorSettings, Status
from wallnav_ros.navigation.scene import Scene, worth_predicting
from wallnav_ros.navigation.watchdogs import ClockWatch, Feed, LoopWatch, Stop
from wallnav_ros.world.geometry import compose, drive_unicycle
from wallnav_ros.world.state import Robot

MOST_REASONS = 50              # kept apart
LOOK_EVERY = 0.5               # s between two looks for who stands in the way


class Navigator:
    """
    Takes what the sensors say, in any order, and says what to do.

    All times are seconds of the clock in use, given with every call. Whatever cannot be used
    is counted by its reason in `rejected` and otherwise ignored.
    tracker: what follows things from scan to scan. plan: the newest Plan, or None. map_fault: the
    Stop that the map calls for, or None.
    """

    def __init__(self, lookahead, tracker, settings=NavigatorSettings(), localisation=None):
        self.localisation = localisation or Localisation()
        self.guide, self.scene = Guide(), Scene(self.localisation, lookahead.rule.time_step)
        self.laser_pose = np.zeros(3)
        self.rejected = Counter()
        self.clock, self.loop = ClockWatch(), LoopWatch(settings.control_period)
        # In the order of blame: without odometry no scan can be used either.
        self.feeds = {'odometry': Feed('odometry'), 'scan': Feed('scan')}
        if settings.tracks_given:
            self.feeds['tracks'] = Feed('tracks')
        self.plan = self.map_fault = None
        self._driver, self.tracker = Driver(lookahead, settings), tracker
        self._due = self._looked = -np.inf
        self.set_settings(settings)

    def set_settings(self, settings):
        """Take NavigatorSettings; they hold from the next command on."""
        self.settings = settings
        self._driver.set_settings(settings)
        timeouts = {'odometry': settings.odom_timeout, 'scan': settings.scan_timeout,
                    'tracks': settings.tracks_timeout}
        for feed in self.feeds.values():
            feed.timeout = timeouts[feed.name]

    def reject(self, name, reason):
        """Count an input (`scan`, `odometry`, `goal`, ...) that could not be used, and why."""
        key = f'{name}: {reason}'
        # Reasons may quote what was received: a stream of nonsense must not fill the memory.
        if key not in self.rejected and len(self.rejected) >= MOST_REASONS:
            key = f'{name}: another reason'
        self.rejected[key] += 1
        if name in self.feeds:
            self.feeds[name].refused(reason)

    def set_walls(self, walls):
        """Take the DistanceField of the mapped walls, in the map frame, or None."""
        self.scene.map_walls, self.plan = walls, None

    @property
    def walls(self):
        """Return the DistanceField of the mapped walls, in the map frame, or None."""
        return self.scene.map_walls

    @property
    def tracks(self):
        """Return the newest Tracks, in the odometry's frame, or None."""
        return self.scene.tracks

    def set_goal(self, position, frame):
        """
        Drive to `position` (2,) metres in `frame`; on a map, this plans the route there.

        Returns None, or why the goal is refused; the robot then stands without a goal.
        """
        self.plan, self._due = None, -np.inf
        refusal = self.guide.take_goal(position, frame, self.localisation)
        if refusal is not None:
            self.reject('goal', refusal)
            return refusal
        return self._plan_route()

    def take_path(self, points, frame):
        """Follow the path `points` (K, 2) metres in `frame` where it leads to the goal."""
        refusal = self.guide.take_path(points, frame, self.localisation)
        if refusal is not None:
            self.reject('plan', refusal)

    def _plan_route(self):
        """Plan the route where a map calls for one; returns why the goal is refused, if it is."""
        guide, place = self.guide, self.localisation
        if not guide.needs_route(place, self.walls):
            return None
        refusal = guide.plan(place, self.walls, self._room)
        if refusal is not None:
            guide.refuse(refusal)
            self.reject('goal', refusal)
        return refusal

    @property
    def way(self):
        """Return the GivenPath, Route or Detour followed to the goal, None for straight."""
        return self.guide.way(self.localisation, self._room)

    @property
    def _room(self):
        """Return the radius that routes keep clear, in metres."""
        return self.settings.radius + self.settings.base.clearance

    def take_odometry(self, stamp, pose, velocity, now):
        """Take the robot's pose (3,) and velocity (2,) by odometry."""
        if self.localisation.add_odometry(stamp, pose, velocity):
            self.feeds['odometry'].arrived(stamp, now)
        else:
            self.reject('odometry', 'out of order')

    def take_scan(self, scan, now):
        """Take a Scan and, when one is due, decide on it; returns whether it was used."""
        place = self.localisation
        base = place.odom_pose(scan.stamp)
        if base is None:
            self.reject('scan', 'no odometry at its stamp')
            return False
        if not (scan.hits | scan.clear).any():
            self.reject('scan', 'no beam is valid')
            return False
        self.feeds['scan'].arrived(scan.stamp, now)
        laser = compose(base, self.laser_pose)
        place.refine(scan.stamp, laser, self.scene.take_scan(scan, laser), self.walls)
        if not self.settings.tracks_given:
            end = place.odom_pose(scan.stamp + scan.sweep_time)
            self.scene.tracks = self.tracker.update(
                scan, laser, walls=place.walls_in_odom(self.walls),
                covariance=place.covariance_at(laser[:2]),
                end_pose=laser if end is None else compose(end, self.laser_pose))
            self._decide_when_due(scan.stamp, now)
        return True

    def take_tracks(self, tracks, frame, now):
        """Take Tracks of another process and, when one is due, decide on them."""
        place = self.localisation
        relation = place.frame_in_state(frame)
        if relation is None:
            self.reject('tracks', f'frame {frame!r} is not known')
            return
        self.feeds['tracks'].arrived(tracks.stamp, now)
        self.scene.take_tracks(tracks, place.in_odom(relation))
        self._decide_when_due(tracks.stamp, now)

    def update(self, now, steady):
        """
        Return the Status at `now` (s, the clock in use) and `steady` (s, never set).

        To be called often: it is what notices that nothing arrives, and what keeps every command
        one that the robot can still stop after.
        """
        late = self.loop.step(steady)
        if self.clock.set_back(now, steady):
            self._start_over()
        self._doubt_jumps()
        stop = late or self._obstacle_to_driving(now, steady)
        if stop is None and self._arrived():
            stop = self.guide.end(Stop('goal_reached', 'goal reached'))
        if stop is not None:
            # What was decided before a stop says nothing about the world after it.
            self.plan = None
            self.guide.rest()
        elif self.plan is None:
            stop = Stop('planning', 'first decision due')
        else:
            stop = self.plan.stop
        if stop is None:
            period = self.loop.period
            robot = self._robot(self._pose(now), self.plan.goal)
            near = self.scene.observe_near(robot, now, self._driver.reach(period),
                                           self.settings.base.clearance)
            command = self._driver.follow(self.plan, near, now, period)
            if command is not None:
                return Status(command, 'waiting' if self.plan.waits else 'driving', None)
            stop = Stop('braking', 'something has come too close to drive on')
            self.plan, self._due = replace(self.plan, stop=stop), -np.inf
        return Status(self._driver.halt(now), 'stopped', stop)

    def _start_over(self):
        """Forget what a clock set back has made wrong, the goal included."""
        self.localisation.forget()
        for feed in self.feeds.values():
            feed.forget()
        self._driver.forget()
        self.scene.tracks = self.plan = None
        self.guide.end(Stop('clock_jumped', 'the clock was set back: send the goal again'))
        self._due = -np.inf

    def _doubt_jumps(self):
        """Drop the goal when a new pose in the map moved the robot too far to be true."""
        jump = self.localisation.take_jump()
        if jump > self.settings.localisation_jump and self.guide.goal is not None:
            self.guide.end(Stop(
                'localisation_jumped', f'localisation: the pose in the map jumped by {jump:.2f} m '
                f'(limit {self.settings.localisation_jump:g} m): send the goal again'))

    def _obstacle_to_driving(self, now, steady):
        """Return the first Stop that applies, or None."""
        fault = self.clock.fault(steady) or self.map_fault
        for feed in self.feeds.values():
            fault = fault or feed.fault(now)
        if fault is None:
            fault = self.localisation.fault(now, self.settings.localisation_timeout)
        if fault is None and self.guide.goal is None:
            fault = self.guide.ended
        if fault is None and self.guide.goal_in_state(self.localisation) is None:
            fault = Stop('localisation_missing', f'localisation: no pose in {self.guide.goal[1]}')
        return fault

    def _arrived(self):
        place = self.localisation
        gap = self.guide.goal_in_state(place) - place.newest()[:2]
        return np.hypot(*gap) < self.settings.goal_tolerance

    def _decide_when_due(self, stamp, now):
        step = self._driver.time_step
        if self.guide.goal is None:
            return
        if stamp < self._due:
            self._look_ahead(stamp)
            return
        # Counted from the last due time, so that decisions keep their rate at any scan rate.
        self._due = (self._due if stamp - self._due < step else stamp) + step
        place = self.localisation
        if self.guide.goal_in_state(place) is None or not self.feeds['scan'].count:
            return
        stuck = self.guide.is_stuck(place, self._room, place.newest()[:2], stamp)
        if stuck or self.guide.needs_route(place, self.walls):
            # Planning takes longer than a command may: the robot stands before it begins.
            if self.plan is not None:
                self.plan, self._due = None, stamp
                return
            if not stuck and self._plan_route() is not None:
                return
            if stuck:
                self._plan_detour(now)
        self.plan = self._driver.decide(self.observe(now), stamp, place.state_frame, now)

    def _look_ahead(self, stamp):
        """Go round whoever stands in the way; between decisions, so that none waits for it."""
        place = self.localisation
        if self.plan is not None and not 0.0 <= stamp - self._looked < LOOK_EVERY:
            self._looked = stamp
            self.guide.go_round(place, self._room, place.newest()[:2], self.scene.bystanders())

    def _plan_detour(self, now):
        """Plan a route around what blocks the way now; the old one stays where there is none."""
        refusal = self.guide.replan(
            self.localisation, self.walls, self._room, self.scene.standing(now))
        if refusal is not None:
            self.reject('detour', refusal)

    def observe(self, now):
        """Return the Observation at `now`, all of it carried forward to that moment."""
        pose = self._pose(now)
        goal, beyond = self.guide.sub_goal(self.localisation, self._room, pose[:2])
        return self.scene.observe(self._robot(pose, goal, beyond), now)

    def _pose(self, now):
        """Return where the robot (3,) is at `now` if it goes on as it did."""
        return drive_unicycle(self.localisation.newest(), *self.localisation.velocity,
                              worth_predicting(now - self.feeds['odometry'].stamp))

    def _robot(self, pose, goal, beyond=0.0):
        return Robot(pose, self.localisation.velocity, goal, np.float64(self.settings.radius),
                     np.float64(self._driver.speed), np.float64(beyond))
