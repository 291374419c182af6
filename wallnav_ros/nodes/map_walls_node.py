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
The node that shows walls: a map file or the `map` topic in, `walls` out, latched.

The same extraction as in policy_node, for RViz and for whoever else wants walls in metres.
"""

import sys

from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from visualization_msgs.msg import Marker

from wallnav_ros.mapping.occupancy_map import load_map
from wallnav_ros.mapping.wall_extraction import extract_walls
from wallnav_ros.nodes import conversions as convert
from wallnav_ros.nodes.parameters import declare
from wallnav_ros.nodes.runner import run
from wallnav_ros.nodes.topics import advertise, LATCHED, subscribe


class MapWallsNode(Node):
    """Publishes the walls of a map file, or of every map that arrives where none is named."""

    def __init__(self):
        """Declare parameters and read the map file; raises ValueError where it is no good."""
        super().__init__('map_walls_node')
        path = declare(self, 'map', '', 'map YAML; empty: take the map topic')
        self._frame = declare(self, 'map_frame', 'map', 'frame of a map file, and of messages '
                              'that name none')
        self._tolerance = declare(self, 'wall_tolerance', 0.0,
                                  'm that a wall may be moved by; 0: half a cell', (0.0, 10.0))
        self._min_size = declare(self, 'wall_min_size', 0.1,
                                 'm; smaller specks of the map are no walls', (0.0, 10.0))
        self._publisher = advertise(self, Marker, 'walls', LATCHED)
        if path:
            self._show(load_map(path), self._frame)
        else:
            subscribe(self, OccupancyGrid, 'map', self._take_map, LATCHED)
            self.get_logger().info(f'waiting for {self.resolve_topic_name("map")}; the parameter '
                                   'map names a file instead')

    def _take_map(self, message):
        try:
            occupancy_map = convert.map_from_message(message)
        except ValueError as error:
            self.get_logger().error(f'map refused, the walls stay as they were: {error}')
            return
        self._show(occupancy_map, convert.frame_name(message.header.frame_id) or self._frame)

    def _show(self, occupancy_map, frame):
        for warning in occupancy_map.warnings:
            self.get_logger().warning(warning)
        extraction = extract_walls(occupancy_map, self._tolerance or None, self._min_size)
        stamp = self.get_clock().now().nanoseconds * 1e-9
        self._publisher.publish(convert.walls_marker(extraction.walls, frame, stamp))
        stats = extraction.stats
        self.get_logger().info(
            f'{stats["polylines"]} walls, {stats["segments"]} segments, {stats["length"]:.1f} m '
            f'in {frame}; moved by at most {stats["tolerance"]:g} m, '
            f'{stats["speckles_dropped"]} specks left out')


def main(args=None):
    """Run the node; returns its exit status."""
    return run(MapWallsNode, args)


if __name__ == '__main__':
    sys.exit(main())
