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
What policy_node shows to people and other nodes: tracks, walls and markers for RViz.

All of it at its own pace, so that no command ever waits for a picture.
"""

import numpy as np
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from wallnav_ros.mapping.route import RouteError
from wallnav_ros.navigation.localisation import MAP
from wallnav_ros.nodes import conversions as convert
from wallnav_ros.nodes.markers import plan_markers, track_markers, way_markers
from wallnav_ros.nodes.topics import advertise, LATCHED, RELIABLE

PERIOD = 0.1           # s between two pictures


class Display:
    """Publishes what a Navigator knows; `status` is its newest Status, None to begin with."""

    def __init__(self, node, navigator, faults):
        """Advertise the topics of `node`; `faults` as in `topics.advertise`."""
        self.status = None
        self._node, self._navigator, self._shown = node, navigator, None
        self._markers = advertise(node, MarkerArray, 'markers', RELIABLE, faults)
        self._walls = advertise(node, Marker, 'walls', LATCHED, faults)
        self._tracks = (None if navigator.settings.tracks_given
                        else advertise(node, PointCloud2, 'tracks', RELIABLE, faults))

    def start(self):
        """Show what there is from now on, by a clock that does not stop with `/clock`."""
        self._node.create_timer(PERIOD, self._show, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def show_walls(self, walls):
        """Publish mapped Walls; they stay until the next."""
        self._walls.publish(convert.walls_marker(walls, MAP, self._now()))

    def show_tracks(self):
        """Publish the newest tracks where they come from this process and somebody listens."""
        if self._tracks is not None and self._tracks.get_subscription_count():
            self._tracks.publish(convert.tracks_message(
                self._navigator.tracks, self._navigator.localisation.odom_frame))

    def _now(self):
        return self._node.get_clock().now().nanoseconds * 1e-9

    def _show(self):
        place, tracks = self._navigator.localisation, self._navigator.tracks
        if not self._markers.get_subscription_count():
            return
        if tracks is not None and tracks is not self._shown:
            self._shown = tracks
            self._markers.publish(track_markers(tracks, place.odom_frame))
        if self.status is not None and place.newest() is not None:
            self._markers.publish(plan_markers(
                self._navigator.plan, self.status, place.newest(), place.state_frame,
                self._now()))
            self._markers.publish(way_markers(
                *self._way(place), place.state_frame, self._now()))

    def _way(self, place):
        """Return the goal (2,) and the way (K, 2) there, or None for what there is not."""
        guide, position = self._navigator.guide, place.newest()[:2]
        goal = None if guide.goal is None else guide.goal_in_state(place)
        if goal is None:
            return None, None
        way = self._navigator.way
        try:
            return goal, np.array([position, goal]) if way is None else way.path(position)
        except RouteError:
            return goal, None
