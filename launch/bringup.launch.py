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
Bring the navigation up on a robot whose scan, odometry and localisation are running.

ros2 launch wallnav_ros bringup.launch.py map:=/path/to/map.yaml
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = (
    ('map', '', 'YAML file of the map; empty: take it from topic map'),
    ('params_file', PathJoinSubstitution(
        [FindPackageShare('wallnav_ros'), 'params', 'wallnav.yaml']),
     'parameters of all nodes; what has an argument here is not taken from the file'),
    ('namespace', '', 'of all nodes and topics'),
    ('use_sim_time', 'false', 'take the time from /clock'),
    ('tracks_in_process', 'true', 'let policy_node track the scan itself'),
    ('model', 'wallnav', 'weight file, or the name of a shipped one'),
    ('scan', 'scan', 'topic of the laser scan'),
    ('odom', 'odom', 'topic of the odometry'),
    ('cmd_vel', 'cmd_vel', 'topic of the commands'),
    ('stamped', 'false', 'publish TwistStamped commands'),
    ('rviz', 'false', 'open RViz'),
)


def generate_launch_description():
    """Return the nodes of the robot side."""
    def value(name, kind):
        return ParameterValue(LaunchConfiguration(name), value_type=kind)

    shared = {'map': value('map', str), 'use_sim_time': value('use_sim_time', bool)}
    tracks_in_process = LaunchConfiguration('tracks_in_process')
    source = PythonExpression(
        ["'scan' if '", tracks_in_process, "'.lower() in ('true', '1') else 'topic'"])
    remappings = [(name, LaunchConfiguration(name)) for name in ('scan', 'odom', 'cmd_vel')]

    def node(executable, condition=None, **parameters):
        return Node(
            package='wallnav_ros', executable=executable, name=executable, output='screen',
            namespace=LaunchConfiguration('namespace'), remappings=remappings,
            parameters=[LaunchConfiguration('params_file'), {**shared, **parameters}],
            condition=condition)

    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=description)
          for name, default, description in ARGUMENTS),
        node('policy_node', model=value('model', str),
             tracks_source=ParameterValue(source, value_type=str),
             enable_stamped_cmd_vel=value('stamped', bool)),
        node('scan_tracker_node', UnlessCondition(tracks_in_process)),
        Node(package='rviz2', executable='rviz2', output='screen',
             namespace=LaunchConfiguration('namespace'), remappings=remappings,
             arguments=['-d', PathJoinSubstitution(
                 [FindPackageShare('wallnav_ros'), 'rviz', 'wallnav.rviz'])],
             parameters=[{'use_sim_time': value('use_sim_time', bool)}],
             condition=IfCondition(LaunchConfiguration('rviz'))),
    ])
