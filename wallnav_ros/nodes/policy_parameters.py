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
The parameters of policy_node, and the Navigator they make.

params/wallnav.yaml lists them; docs/nodes.md explains them.
"""

from dataclasses import dataclass

from wallnav_ros.navigation.localisation import Localisation
from wallnav_ros.navigation.navigator import Navigator
from wallnav_ros.navigation.plans import NavigatorSettings
from wallnav_ros.navigation.stopping import BaseLimits
from wallnav_ros.nodes.parameters import declare, declare_pose, declare_settings
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.value_function import load_value_function
from wallnav_ros.world.files import find_asset


@dataclass(frozen=True)
class Options:
    """The parameters that are the node's own: see docs/nodes.md."""

    map: str  # noqa: A003
    stamped: bool
    control_rate: float
    wall_min_size: float


def declare_options(node):
    """Return the Options of `node`; raises ValueError."""
    return Options(
        map=declare(node, 'map', '', 'YAML file of the map; empty: take it from topic map'),
        stamped=declare(node, 'enable_stamped_cmd_vel', False,
                        'publish TwistStamped instead of Twist'),
        control_rate=declare(node, 'control_rate', 20.0, 'commands a second', (5.0, 200.0)),
        wall_min_size=declare(node, 'wall_min_size', 0.1,
                              'm; smaller specks of the map are no walls', (0.0, 10.0)))


def make_navigator(node):
    """Return the Navigator the parameters ask for; raises ValueError or OSError."""
    defaults = NavigatorSettings()
    source = declare(node, 'tracks_source', 'scan',
                     'track the scan in this process, or take tracks from their topic',
                     choices=('scan', 'topic'))
    settings = NavigatorSettings(
        radius=declare(node, 'robot_radius', defaults.radius, 'm', (0.01, 5.0)),
        preferred_speed=declare(node, 'preferred_speed', defaults.preferred_speed, 'm/s',
                                (0.01, 5.0)),
        goal_tolerance=declare(node, 'goal_tolerance', defaults.goal_tolerance,
                               'm from the goal that count as there', (0.01, 5.0)),
        scan_timeout=declare(node, 'scan_timeout', defaults.scan_timeout, 's', (0.05, 10.0)),
        odom_timeout=declare(node, 'odom_timeout', defaults.odom_timeout, 's', (0.05, 10.0)),
        tracks_timeout=declare(node, 'tracks_timeout', defaults.tracks_timeout, 's',
                               (0.05, 10.0)),
        localisation_timeout=declare(
            node, 'localisation_timeout', defaults.localisation_timeout,
            's without a pose in the map while driving', (0.1, 60.0)),
        tracks_given=source == 'topic', base=_declare_base(node))
    tracker = Tracker(declare_settings(node, 'tracker', TrackerSettings()))
    model = declare(node, 'model', 'wallnav', 'weight file, or name of a shipped one')
    lookahead = Lookahead.from_weights(load_value_function(find_asset('models', model, '.npz')))
    laser_pose = declare_pose(node, 'laser_pose', 'of the laser on the base, where TF has none')
    fixed = declare(node, 'localisation', 'auto',
                    'auto: amcl_pose or TF; fixed: odometry starts at odom_in_map',
                    choices=('auto', 'fixed')) == 'fixed'
    odom_in_map = declare_pose(node, 'odom_in_map', 'where odometry starts, if localisation fixed')
    navigator = Navigator(lookahead, tracker, settings,
                          Localisation(odom_in_map if fixed else None))
    navigator.laser_pose = laser_pose
    return navigator


def _declare_base(node):
    defaults = BaseLimits()
    return BaseLimits(
        acceleration=declare(node, 'acceleration', defaults.acceleration,
                             'm/s^2, of speeding up and braking', (0.05, 50.0)),
        turn_acceleration=declare(node, 'turn_acceleration', defaults.turn_acceleration,
                                  'rad/s^2', (0.05, 100.0)),
        latency=declare(node, 'latency', defaults.latency,
                        's until a command takes effect', (0.0, 1.0)),
        clearance=declare(node, 'clearance', defaults.clearance,
                          'm kept from everything', (0.0, 1.0)))
