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
Pictures for RViz: tracks, goal, route, sub-goal, the predicted path and why it stands.

visualization_msgs/MarkerArray; colours by meaning: people orange, obstacles grey.
"""

from geometry_msgs.msg import Point
import numpy as np
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from wallnav_ros.nodes.conversions import pose_message, time_message
from wallnav_ros.world.tracks import HUMAN

PERSON = ColorRGBA(r=0.95, g=0.5, b=0.1, a=0.8)
OBSTACLE = ColorRGBA(r=0.5, g=0.5, b=0.5, a=0.8)
GOAL = ColorRGBA(r=0.1, g=0.7, b=0.2, a=0.8)
SUB_GOAL = ColorRGBA(r=0.5, g=0.9, b=0.3, a=0.8)
PATH = ColorRGBA(r=0.1, g=0.3, b=0.9, a=1.0)
TEXT = ColorRGBA(r=0.9, g=0.9, b=0.9, a=1.0)
HEIGHT = 1.0           # m, of the cylinders


def track_markers(tracks, frame):
    """Return a MarkerArray of Tracks in `frame`: cylinders, numbers and one-second arrows."""
    header = Header(stamp=time_message(tracks.stamp), frame_id=frame)
    shown = [Marker(header=header, ns='tracks', action=Marker.DELETEALL)]
    for number, position, velocity, radius, label in zip(
            tracks.id.tolist(), tracks.position.tolist(), tracks.velocity.tolist(),
            tracks.radius.tolist(), tracks.label.tolist()):
        colour = PERSON if label == HUMAN else OBSTACLE
        disc = _marker(header, 'tracks', number, Marker.CYLINDER, colour, (*position, 0.0))
        disc.scale.x = disc.scale.y = max(2.0 * radius, 0.02)
        disc.scale.z = HEIGHT
        shown.append(disc)
        name = _marker(header, 'ids', number, Marker.TEXT_VIEW_FACING, TEXT, (*position, 0.0))
        name.pose.position.z, name.scale.z, name.text = HEIGHT, 0.3, str(number)
        shown.append(name)
        if any(velocity):
            arrow = _marker(header, 'velocities', number, Marker.ARROW, colour, (0.0, 0.0, 0.0))
            arrow.scale.x, arrow.scale.y = 0.05, 0.12
            arrow.points = [Point(x=position[0], y=position[1]),
                            Point(x=position[0] + velocity[0], y=position[1] + velocity[1])]
            shown.append(arrow)
    return MarkerArray(markers=shown)


def plan_markers(plan, status, robot, frame, stamp):
    """
    Return a MarkerArray of a Plan (or None) and a Status, the `robot` (3,) being in `frame`.

    The predicted path ends in an arrow: the chosen action. The text says why the robot stands.
    """
    header = Header(stamp=time_message(stamp), frame_id=frame)
    text = _marker(header, 'status', 0, Marker.TEXT_VIEW_FACING, TEXT, (*robot[:2], 0.0))
    text.pose.position.z, text.scale.z = HEIGHT + 0.3, 0.3
    text.text = status.state if status.stop is None else status.stop.detail
    if plan is None:
        return MarkerArray(markers=[text, *_gone(header, 'sub_goal', 'path', 'action')])
    goal = _marker(header, 'sub_goal', 0, Marker.CYLINDER, SUB_GOAL, (*plan.goal, 0.0))
    goal.scale.x = goal.scale.y = 0.25
    goal.scale.z = 0.03
    path = _line(header, 'path', PATH, plan.path[:, :2])
    action = _marker(header, 'action', 0, Marker.ARROW, PATH, plan.path[-1])
    action.scale.x, action.scale.y, action.scale.z = 0.4, 0.08, 0.08
    return MarkerArray(markers=[text, goal, path, action])


def way_markers(goal, way, frame, stamp):
    """Return a MarkerArray of the goal (2,) and the way (K, 2) to it in `frame`; None: none."""
    header = Header(stamp=time_message(stamp), frame_id=frame)
    shown = _gone(header, *(name for name, what in (('goal', goal), ('route', way))
                            if what is None))
    if goal is not None:
        disc = _marker(header, 'goal', 0, Marker.CYLINDER, GOAL, (*goal, 0.0))
        disc.scale.x = disc.scale.y = 0.4
        disc.scale.z = 0.02
        shown.append(disc)
    if way is not None:
        shown.append(_line(header, 'route', GOAL, way))
    return MarkerArray(markers=shown)


def _gone(header, *namespaces):
    return [Marker(header=header, ns=name, action=Marker.DELETE) for name in namespaces]


def _line(header, namespace, colour, points):
    line = _marker(header, namespace, 0, Marker.LINE_STRIP, colour, (0.0, 0.0, 0.0))
    line.scale.x = 0.05
    line.points = [Point(x=x, y=y) for x, y in np.asarray(points, dtype=float).tolist()]
    return line


def _marker(header, namespace, number, kind, colour, pose):
    number = number % (1 << 31)      # marker ids are signed
    marker = Marker(header=header, ns=namespace, id=number, type=kind, action=Marker.ADD)
    marker.pose, marker.color = pose_message(pose), colour
    return marker
