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
Quality of service of every topic, and a log line when a peer's does not fit.

The table of topics in docs/nodes.md; REP-2003 for sensors and maps.
"""

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

SENSOR = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=10)
# One value that counts until the next: the last one is kept for subscribers that come late.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def subscribe(node, message_type, topic, callback, qos):
    """Subscribe `node` to `topic`; an incompatible publisher is named in the log."""
    def warn(_):
        node.get_logger().warning(
            f'{node.resolve_topic_name(topic)}: a publisher offers a quality of service that '
            'does not fit; see `ros2 topic info -v`')
    return node.create_subscription(
        message_type, topic, callback, qos,
        event_callbacks=SubscriptionEventCallbacks(incompatible_qos=warn))


def advertise(node, message_type, topic, qos):
    """Return a publisher of `node` on `topic`; an incompatible subscriber is named in the log."""
    def warn(_):
        node.get_logger().warning(
            f'{node.resolve_topic_name(topic)}: a subscriber asks for a quality of service that '
            'does not fit; see `ros2 topic info -v`')
    return node.create_publisher(
        message_type, topic, qos, event_callbacks=PublisherEventCallbacks(incompatible_qos=warn))
