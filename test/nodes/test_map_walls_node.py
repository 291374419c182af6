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
"""The walls node over real DDS: from a file, from the map topic, refusing what is no map."""

from array import array
import signal
from time import monotonic

from map_files import write_map_files
from nav_msgs.msg import OccupancyGrid
from nodes_over_dds import TIMEOUT
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from visualization_msgs.msg import Marker
from wallnav_ros.nodes.conversions import pose_message
from wallnav_ros.nodes.topics import LATCHED

BLOCK = np.full((4, 6), 254)
BLOCK[1:3, 1:5] = 0


class Viewer:
    """A peer that collects `walls` and can publish `map`."""

    def __init__(self, namespace=''):
        self.walls = []
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node('viewer', namespace=namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._node.create_subscription(Marker, 'walls', self.walls.append, LATCHED)
        self._map = self._node.create_publisher(OccupancyGrid, 'map', LATCHED)

    def wait_for_walls(self, count=1):
        """Spin until that many messages have come and return the last one."""
        self.wait(lambda: len(self.walls) >= count, f'{count} messages on walls')
        return self.walls[-1]

    def wait(self, condition, what):
        deadline = monotonic() + TIMEOUT
        while not condition():
            assert monotonic() < deadline, f'{what}: did not come'
            self._executor.spin_once(timeout_sec=0.05)

    def publish_map(self, cells, resolution=0.5, origin=(0.0, 0.0, 0.0), frame='map'):
        cells = np.asarray(cells, dtype=np.int8)
        message = OccupancyGrid()
        message.header.frame_id = frame
        message.info.height, message.info.width = cells.shape
        message.info.resolution = resolution
        message.info.origin = pose_message(origin)
        message.data = array('b', cells.tobytes())
        self._map.publish(message)

    def close(self):
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()


@pytest.fixture
def view(ros_domain_id):
    """Return a function that makes a Viewer, which closes with the test."""
    made = []

    def make(namespace=''):
        made.append(Viewer(namespace))
        return made[-1]

    yield make
    for viewer in made:
        viewer.close()


def corners(marker):
    return {(round(point.x, 6), round(point.y, 6)) for point in marker.points}


def test_the_walls_of_a_file_reach_a_subscriber_that_comes_late(start, view, tmp_path):
    path = write_map_files(tmp_path, BLOCK, resolution='0.5', origin='[10.0, -2.0, 0.0]')
    node = start('map_walls_node', {'map': path})
    view().wait_for_walls()

    marker = view().wait_for_walls()

    assert marker.type == Marker.LINE_LIST
    assert marker.action == Marker.ADD
    assert marker.header.frame_id == 'map'
    assert len(marker.points) == 2 * 4
    assert corners(marker) == {(10.5, -1.5), (10.5, -0.5), (12.5, -1.5), (12.5, -0.5)}
    assert marker.pose.orientation.w == 1.0
    assert marker.scale.x > 0.0 and marker.color.a > 0.0
    node.process.send_signal(signal.SIGINT)
    assert node.status() == 0


def test_every_new_map_on_the_topic_gives_its_walls(start, view):
    viewer = view(namespace='/robot_1')
    viewer.publish_map([[100, 0], [0, 0]], origin=(1.0, 2.0, np.pi / 2), frame='floor')
    node = start('map_walls_node', arguments=['-r', '__ns:=/robot_1'])

    marker = viewer.wait_for_walls()
    assert marker.header.frame_id == 'floor'
    assert corners(marker) == {(1.0, 2.0), (1.0, 2.5), (0.5, 2.0), (0.5, 2.5)}

    viewer.publish_map([[0, 0, 0], [0, 100, 100]])
    assert corners(viewer.wait_for_walls(2)) == {(0.5, 0.5), (1.5, 0.5), (0.5, 1.0), (1.5, 1.0)}

    viewer.publish_map(np.zeros((2, 2)))
    assert viewer.wait_for_walls(3).points == []
    node.process.send_signal(signal.SIGTERM)
    assert node.status() == 0


def test_a_map_message_that_makes_no_sense_leaves_the_walls_as_they_were(start, view):
    viewer = view()
    viewer.publish_map([[100, 0]])
    node = start('map_walls_node')
    viewer.wait_for_walls()

    viewer.publish_map([[100, 100]], resolution=0.0)

    viewer.wait(lambda: any('resolution' in line for line in node.lines), 'a refusal in the log')
    viewer.publish_map([[0, 100]])
    viewer.wait_for_walls(2)
    assert len(viewer.walls) == 2


def test_speckle_and_tolerance_are_parameters(start, view, tmp_path):
    pixels = np.full((20, 20), 254)
    pixels[3, 3] = pixels[8:12, 8:12] = 0
    path = write_map_files(tmp_path, pixels, resolution='0.1')
    start('map_walls_node', {'map': path, 'wall_min_size': 0.3, 'wall_tolerance': 0.01,
                             'map_frame': 'level_2'})

    marker = view().wait_for_walls()

    assert len(marker.points) == 8
    assert marker.header.frame_id == 'level_2'


@pytest.mark.parametrize('parameters, problem', [
    ({'map': '/nowhere/map.yaml'}, "/nowhere/map.yaml: file: '/nowhere/map.yaml' does not exist"),
    ({'wall_tolerance': -1.0}, 'parameter wall_tolerance: outside its limits'),
    ({'wall_min_size': 'big'}, 'parameter wall_min_size: expected a number')])
def test_a_node_that_cannot_start_says_why_in_one_line(start, parameters, problem):
    node = start('map_walls_node', parameters)

    assert node.status() == 2
    assert len(node.lines) == 1
    assert problem in node.lines[0]


def test_a_map_file_that_is_broken_is_refused_at_the_start(start, tmp_path):
    node = start('map_walls_node', {'map': write_map_files(tmp_path, negate='5')})

    assert node.status() == 2
    assert len(node.lines) == 1
    assert 'negate: 5 given; expected 0 or 1' in node.lines[0]


def test_a_node_that_waits_for_a_map_ends_quietly(start, view):
    node = start('map_walls_node')
    view().wait(lambda: any('waiting for' in line for line in node.lines), 'the node')

    node.process.send_signal(signal.SIGTERM)

    assert node.status() == 0
    assert not any('Traceback' in line for line in node.lines)
