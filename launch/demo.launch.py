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
A robot among simulated people, with the whole node graph and RViz: click a 2D Goal Pose.

ros2 launch wallnav_ros demo.launch.py scenario:=cross_path case:=mixed seed:=7
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = (
    ('scenario', 'cross_path', 'file, or the name of a shipped one'),
    ('case', 'mixed', 'of the scenario'),
    ('seed', '1', 'that the people are drawn from'),
    ('speed', '1.0', 'simulated seconds per second'),
    ('map', PathJoinSubstitution(
        [FindPackageShare('wallnav_ros'), 'maps',
         [LaunchConfiguration('scenario'), '.yaml']]), 'YAML file of the map of the scenario'),
    ('robot_radius', '0.2', 'm, as the scenario says; 0.24 in lab_1 to lab_3'),
    ('preferred_speed', '0.8', 'm/s, as the scenario says'),
    ('model', 'wallnav', 'weight file, or the name of a shipped one'),
    ('rviz', 'true', 'open RViz'),
)


def generate_launch_description():
    """Return the simulator and the nodes of the robot side."""
    def value(name, kind):
        return ParameterValue(LaunchConfiguration(name), value_type=kind)

    simulated = ParameterValue(
        PythonExpression(['float(', LaunchConfiguration('speed'), ') != 1.0']), value_type=bool)
    clock = {'use_sim_time': simulated}
    on_map = {**clock, 'map': value('map', str)}

    def node(executable, parameters):
        return Node(package='wallnav_ros', executable=executable, name=executable,
                    output='screen', parameters=[parameters])

    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=default, description=description)
          for name, default, description in ARGUMENTS),
        node('simulator_node', {
            'scenario': value('scenario', str), 'case': value('case', str),
            'seed': value('seed', int), 'speed': value('speed', float), 'wait_for_goal': True}),
        node('map_walls_node', on_map),
        node('scan_tracker_node', on_map),
        node('policy_node', {
            **on_map, 'tracks_source': 'topic', 'model': value('model', str),
            'robot_radius': value('robot_radius', float),
            'preferred_speed': value('preferred_speed', float)}),
        Node(package='rviz2', executable='rviz2', output='screen',
             arguments=['-d', PathJoinSubstitution(
                 [FindPackageShare('wallnav_ros'), 'rviz', 'wallnav.rviz'])],
             parameters=[clock], condition=IfCondition(LaunchConfiguration('rviz'))),
    ])
