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
Transforms from TF where the robot has tf2_ros; nothing where it has not.

REP-105: map -> odom -> base_link -> laser. Without TF the nodes take parameters and amcl_pose.
"""

from geometry_msgs.msg import Point, Pose, TransformStamped
from rclpy.time import Time
from std_msgs.msg import Header

from wallnav_ros.nodes.conversions import MessageError, pose_from_message, pose_message, seconds


class FrameTree:
    """The newest transform between two frames, as planar poses."""

    def __init__(self, node):
        """Listen to `tf` and `tf_static`; raises ImportError where tf2_ros is not installed."""
        import tf2_ros
        self._failures = tf2_ros.TransformException
        self._buffer = tf2_ros.Buffer(node=node)
        self._listener = tf2_ros.TransformListener(self._buffer, node)

    def pose(self, parent, child):
        """Return when (s) and where (3,) `child` last was in `parent`, or None if not known."""
        try:
            found = self._buffer.lookup_transform(parent, child, Time())
            return seconds(found.header.stamp), pose_from_message(_pose(found.transform))
        except (self._failures, MessageError):
            return None


def find_frames(node):
    """Return the FrameTree of `node`, or None where tf2_ros is not installed."""
    try:
        return FrameTree(node)
    except ImportError:
        return None


def find_broadcaster(node):
    """Return a function that sends a list of transforms, or None where tf2_ros is missing."""
    try:
        from tf2_ros import TransformBroadcaster
    except ImportError:
        return None
    return TransformBroadcaster(node).sendTransform


def transform_message(stamp, parent, child, pose):
    """Return the TransformStamped of `child` at `pose` (3,) in `parent`; `stamp` is a Time."""
    placed = pose_message(pose)
    message = TransformStamped(header=Header(stamp=stamp, frame_id=parent), child_frame_id=child)
    message.transform.translation.x = placed.position.x
    message.transform.translation.y = placed.position.y
    message.transform.rotation = placed.orientation
    return message


def _pose(transform):
    """Return the Pose that a geometry_msgs Transform is."""
    shift = transform.translation
    return Pose(position=Point(x=shift.x, y=shift.y, z=shift.z), orientation=transform.rotation)
