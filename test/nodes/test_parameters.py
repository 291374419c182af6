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
"""The parameter file and the nodes agree; values that make no sense are refused by name."""

import math

import pytest

rclpy = pytest.importorskip('rclpy')

from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402

from wallnav_ros.nodes.map_walls_node import MapWallsNode  # noqa: E402
from wallnav_ros.nodes.parameters import declare, declare_pose, declare_settings  # noqa: E402
from wallnav_ros.nodes.policy_node import PolicyNode  # noqa: E402
from wallnav_ros.nodes.scan_tracker_node import ScanTrackerNode  # noqa: E402
from wallnav_ros.perception.settings import TrackerSettings  # noqa: E402
import yaml  # noqa: E402


@pytest.fixture
def ros(ros_domain_id):
    """Return a function that starts ROS with command-line arguments."""
    def start(*arguments):
        rclpy.init(args=['--ros-args', *arguments] if arguments else None)
    yield start
    rclpy.try_shutdown()


def flat(section, prefix=''):
    """Return {dotted name: value} of a nested section of a parameter file."""
    found = {}
    for key, value in section.items():
        found.update(flat(value, f'{prefix}{key}.') if isinstance(value, dict)
                     else {prefix + key: value})
    return found


def parameters_of(make_node):
    """Return {name: value} of a node's own parameters."""
    node = make_node()
    try:
        return {name: value.value for name, value in node.get_parameters_by_prefix('').items()
                if not name.startswith(('qos_overrides', 'start_type_description_service'))}
    finally:
        node.destroy_node()


def all_nodes():
    nodes = [MapWallsNode, ScanTrackerNode, PolicyNode]
    try:
        from wallnav_ros.nodes.simulator_node import SimulatorNode
    except ImportError:      # pyrvo is not on a robot
        return nodes
    return [*nodes, SimulatorNode]


@pytest.mark.extras
def test_the_parameter_file_holds_every_parameter_with_its_default(ros, repository):
    document = yaml.safe_load((repository / 'params' / 'wallnav.yaml').read_text())
    listed = flat(document['/**']['ros__parameters'])
    ros()
    declared = {}
    for node in all_nodes():
        for name, value in parameters_of(node).items():
            value = list(value) if not isinstance(value, (str, bool, int, float)) else value
            # One line of the file speaks to all nodes, so they must agree on it.
            assert declared.setdefault(name, value) == value, name
    assert listed == declared


def test_the_nodes_of_the_robot_start_with_the_parameter_file(ros, repository):
    ros('--params-file', str(repository / 'params' / 'wallnav.yaml'))
    for node in (MapWallsNode, ScanTrackerNode, PolicyNode):
        assert parameters_of(node)


@pytest.mark.parametrize('given, told', [
    ('speed:=-1.0', 'speed'), ('speed:=fast', 'speed'), ('speed:=.nan', 'speed'),
    ('mode:=sideways', 'left, right'), ('pose:=[1.0]', 'pose'), ('pose:=[1.0, .inf, 0.0]', 'pose'),
    ('tracker.gate:=-1.0', 'tracker.gate')])
def test_a_value_that_makes_no_sense_is_refused_by_name(ros, given, told):
    ros('-p', given)
    node = Node('any')
    with pytest.raises(ValueError, match=told):
        declare(node, 'speed', 1.0, 'm/s', (0.0, 2.0))
        declare(node, 'mode', 'left', 'side', choices=('left', 'right'))
        declare_pose(node, 'pose', 'of anything')
        declare_settings(node, 'tracker', TrackerSettings())


def test_parameters_come_with_a_description_and_limits(ros):
    ros()
    node = Node('any')
    assert declare(node, 'speed', 1.0, 'm/s', (0.0, 2.0)) == 1.0
    descriptor = node.describe_parameter('speed')
    assert descriptor.description == 'm/s' and descriptor.read_only
    limits = descriptor.floating_point_range[0]
    assert (limits.from_value, limits.to_value) == (0.0, 2.0)


@pytest.fixture
def policy(ros):
    """Return a policy_node in this process."""
    ros()
    node = PolicyNode()
    yield node
    node.destroy_node()


def test_safe_parameters_change_while_it_runs(policy):
    done = policy.set_parameters([Parameter('max_speed', value=0.3),
                                  Parameter('allow_reverse', value=True)])
    assert all(result.successful for result in done)
    base = policy.navigator.settings.base
    assert base.max_speed == 0.3 and base.reverse


@pytest.mark.parametrize('name, value, told', [
    ('robot_radius', 0.5, 'read-only'), ('model', 'other', 'read-only'),
    ('max_speed', -1.0, 'max_speed'), ('scan_timeout', math.nan, 'out of range'),
    ('max_speed', 'fast', 'type')])
def test_what_is_fixed_or_makes_no_sense_is_refused_with_the_reason(policy, name, value, told):
    before = policy.navigator.settings
    result, = policy.set_parameters([Parameter(name, value=value)])
    assert not result.successful and told in result.reason
    assert policy.navigator.settings == before


def test_a_parameter_that_is_fixed_says_so_in_its_description(policy):
    assert 'restart' in policy.describe_parameter('robot_radius').additional_constraints
    assert policy.describe_parameter('max_speed').additional_constraints == ''
