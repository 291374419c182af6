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
Nodes as processes: each starter in a domain of its own, and the end of a node told in words.

That none outlives its starter is tested with the whole command in test_drive.py.
"""

import os
from threading import Event
from time import monotonic

import pytest

rclpy = pytest.importorskip('rclpy')

from wallnav_ros.commands.node_processes import (  # noqa: E402
    Domain, DOMAINS, NodeGroup, NodeRefused, ProcessEnded)

pytestmark = pytest.mark.extras


def test_two_domains_at_once_are_two(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    monkeypatch.delenv('ROS_AUTOMATIC_DISCOVERY_RANGE', raising=False)

    with Domain() as first:
        assert os.environ['ROS_DOMAIN_ID'] == str(first.id)
        assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
        with Domain() as second:
            assert first.id != second.id
            assert {first.id, second.id} <= set(DOMAINS)

    assert os.environ['ROS_DOMAIN_ID'] == '7'
    assert 'ROS_AUTOMATIC_DISCOVERY_RANGE' not in os.environ


def end_of(nodes):
    """Return the error with which a group notices that a node has ended."""
    deadline, pause = monotonic() + 60.0, Event()
    while monotonic() < deadline:
        try:
            nodes.check()
        except ProcessEnded as error:
            return error
        pause.wait(0.05)
    pytest.fail('the node did not end')


def test_a_node_that_refuses_its_parameters_is_told_from_one_that_fails(tmp_path):
    with Domain(), NodeGroup(tmp_path / 'refused') as nodes:
        nodes.start('map_walls_node', {'wall_min_size': -1.0})
        error = end_of(nodes)
    assert isinstance(error, NodeRefused)
    assert str(error) == ('map_walls_node ended with status 2: map_walls_node: parameter '
                          'wall_min_size: outside its limits, 0 to 10')

    with Domain(), NodeGroup(tmp_path / 'failed') as nodes:
        nodes.start('no_such_node', {})
        error = end_of(nodes)
    assert not isinstance(error, NodeRefused)
    assert str(error).startswith('no_such_node ended with status 1: ')
    assert 'No module named' in str(error)
    assert (tmp_path / 'failed' / 'no_such_node.log').is_file()


def test_parameters_of_every_kind_arrive(tmp_path):
    with Domain(), NodeGroup(tmp_path) as nodes:
        # Each is taken, or the node would end before it comes to the map.
        nodes.start('policy_node', {
            'use_sim_time': True, 'robot_radius': 0.25, 'laser_pose': [0.1, 0.0, 1.5],
            'tracks_source': 'topic', 'map': tmp_path / 'nowhere.yaml'})
        error = end_of(nodes)

    assert isinstance(error, NodeRefused)
    assert f"{tmp_path / 'nowhere.yaml'}' does not exist" in str(error)
