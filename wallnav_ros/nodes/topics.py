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
from rclpy.qos import (
    DurabilityPolicy, qos_policy_name_from_kind, QoSProfile, ReliabilityPolicy)

SENSOR = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
# What is worth nothing once there is a newer one: none waits behind others for a busy machine.
NEWEST_SCAN = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
NEWEST_TRACKS = QoSProfile(depth=1)
RELIABLE = QoSProfile(depth=10)
# One value that counts until the next: the last one is kept for subscribers that come late.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def subscribe(node, message_type, topic, callback, qos, faults=None):
    """
    Subscribe `node` to `topic`; an incompatible publisher is named in the log.

    faults: a dictionary in which it is noted too, {topic: text}.
    """
    def warn(event):
        _note_mismatch(node, topic, 'publisher', event, faults)
    return node.create_subscription(
        message_type, topic, callback, qos,
        event_callbacks=SubscriptionEventCallbacks(
            incompatible_qos=warn, use_default_callbacks=False))


def advertise(node, message_type, topic, qos, faults=None):
    """Return a publisher of `node` on `topic`; the rest is as for `subscribe`."""
    def warn(event):
        _note_mismatch(node, topic, 'subscriber', event, faults)
    return node.create_publisher(
        message_type, topic, qos, event_callbacks=PublisherEventCallbacks(
            incompatible_qos=warn, use_default_callbacks=False))


def _note_mismatch(node, topic, peer, event, faults):
    policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
    text = (f'{node.resolve_topic_name(topic)}: the quality of service of a {peer} does not fit '
            f'({policy}); see `ros2 topic info -v`')
    node.get_logger().warning(text)
    if faults is not None:
        faults[topic] = text


def unheard_kind(node, publisher, others):
    """
    Return why nobody hears `publisher` of `node`, or None.

    others: {message type: what to do about it}, types that its topic's subscribers may take
    instead of its own.
    """
    taken = {info.topic_type for info in node.get_subscriptions_info_by_topic(
        publisher.topic_name)}
    own = _type_name(publisher.msg_type)
    for kind, fix in others.items():
        if _type_name(kind) in taken and own not in taken:
            return (f'{publisher.topic_name}: its subscribers take {_type_name(kind)}, this node '
                    f'publishes {own}: {fix}')
    return None


def _type_name(message_type):
    package = message_type.__module__.split('.')[0]
    return f'{package}/msg/{message_type.__name__}'
