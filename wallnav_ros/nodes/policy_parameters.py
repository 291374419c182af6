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

from dataclasses import dataclass, replace

from wallnav_ros.navigation.localisation import Localisation
from wallnav_ros.navigation.navigator import Navigator
from wallnav_ros.navigation.plans import NavigatorSettings
from wallnav_ros.nodes.health import declare_diagnostics_period
from wallnav_ros.nodes.parameters import declare, declare_pose, declare_settings
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.tracking import Tracker
from wallnav_ros.policy.lookahead import Lookahead
from wallnav_ros.policy.value_function import load_value_function
from wallnav_ros.world.files import find_asset


@dataclass(frozen=True)
class Setting:
    """
    A parameter that is a field of NavigatorSettings, or of its `base`.

    live: it may change while the robot drives, being read anew for every command.
    """

    name: str
    field: str
    description: str
    limits: tuple | None
    live: bool = True


SETTINGS = (
    Setting('robot_radius', 'radius', 'm, of the circle around all of it', (0.01, 5.0), False),
    Setting('preferred_speed', 'preferred_speed', 'm/s where nothing is in the way', (0.01, 5.0)),
    Setting('goal_tolerance', 'goal_tolerance', 'm from the goal that count as there',
            (0.01, 5.0)),
    Setting('max_speed', 'base.max_speed', 'm/s', (0.01, 5.0)),
    Setting('max_turn_rate', 'base.max_turn_rate', 'rad/s', (0.01, 10.0)),
    Setting('min_turn_rate', 'base.min_turn_rate', 'rad/s, below which the base does not turn',
            (0.0, 10.0)),
    Setting('acceleration', 'base.acceleration', 'm/s^2, of speeding up and braking',
            (0.05, 100.0), False),
    Setting('turn_acceleration', 'base.turn_acceleration', 'rad/s^2', (0.05, 100.0), False),
    Setting('latency', 'base.latency', 's until a command takes effect', (0.0, 1.0), False),
    Setting('clearance', 'base.clearance', 'm kept from everything', (0.0, 1.0)),
    Setting('allow_reverse', 'base.reverse', 'back off where every way ahead is blocked', None),
    Setting('scan_timeout', 'scan_timeout', 's', (0.05, 10.0)),
    Setting('odom_timeout', 'odom_timeout', 's', (0.05, 10.0)),
    Setting('tracks_timeout', 'tracks_timeout', 's', (0.05, 10.0)),
    Setting('localisation_timeout', 'localisation_timeout',
            's without a pose in the map while driving', (0.1, 60.0)),
    Setting('localisation_jump', 'localisation_jump',
            'm that a new pose in the map may differ by', (0.01, 100.0)),
)


@dataclass(frozen=True)
class Options:
    """The parameters that are the node's own: see docs/nodes.md."""

    map: str  # noqa: A003
    stamped: bool
    control_rate: float
    diagnostics_period: float
    wall_min_size: float


def declare_options(node):
    """Return the Options of `node`; raises ValueError."""
    return Options(
        map=declare(node, 'map', '', 'YAML file of the map; empty: take it from topic map'),
        stamped=declare(node, 'enable_stamped_cmd_vel', False,
                        'publish TwistStamped instead of Twist'),
        control_rate=declare(node, 'control_rate', 20.0, 'commands a second', (5.0, 200.0)),
        diagnostics_period=declare_diagnostics_period(node),
        wall_min_size=declare(node, 'wall_min_size', 0.1,
                              'm; smaller specks of the map are no walls', (0.0, 10.0)))


def make_navigator(node, control_rate):
    """Return the Navigator the parameters ask for; raises ValueError or OSError."""
    source = declare(node, 'tracks_source', 'scan',
                     'track the scan in this process, or take tracks from their topic',
                     choices=('scan', 'topic'))
    settings = NavigatorSettings(control_period=1.0 / control_rate, tracks_given=source == 'topic')
    settings = with_values(settings, {
        setting.field: declare(node, setting.name, _value(settings, setting.field),
                               setting.description, setting.limits, live=setting.live)
        for setting in SETTINGS})
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


def follow_changes(node, navigator):
    """Hand parameters that are set while `node` runs to its `navigator`."""
    fields = {setting.name: setting.field for setting in SETTINGS if setting.live}

    def apply(parameters):
        values = {fields[parameter.name]: parameter.value for parameter in parameters
                  if parameter.name in fields}
        if values:
            navigator.set_settings(with_values(navigator.settings, values))

    node.add_post_set_parameters_callback(apply)


def with_values(settings, values):
    """Return NavigatorSettings with `values`, {field or base.field: value}."""
    base = {field[5:]: value for field, value in values.items() if field.startswith('base.')}
    own = {field: value for field, value in values.items() if not field.startswith('base.')}
    return replace(settings, base=replace(settings.base, **base), **own)


def _value(settings, field):
    return getattr(settings.base, field[5:]) if field.startswith('base.') else getattr(
        settings, field)
