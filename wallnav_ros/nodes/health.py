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
The health of the navigation for `diagnostics`: state, reason, rates, ages, latencies.

REP-107 (diagnostics): one status, values as text.
"""

from collections import deque

from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np

from wallnav_ros.navigation.given_path import GivenPath
from wallnav_ros.nodes.conversions import diagnostic_status
from wallnav_ros.nodes.parameters import declare

# Standing for these reasons is as it should be; any other calls for a person's eye.
EXPECTED = ('no_goal', 'goal_reached', 'planning', 'shutdown')


def declare_diagnostics_period(node):
    """Return the seconds between two messages of `node` on `diagnostics`; raises ValueError."""
    return declare(node, 'diagnostics_period', 1.0, 's between two messages on diagnostics',
                   (0.01, 60.0))


def tell_reversal(node, topic, tracker, before):
    """Log for `node` that a Tracker reverses the beams of `topic`, if it did not `before`."""
    if tracker.reversed_sensors != before:
        node.get_logger().warning(
            f'{topic}: its beams fit earlier scans only if taken in the order opposite to '
            'what the message says, and are straightened so')


class Latencies:
    """The last few hundred durations, in seconds, as percentiles."""

    def __init__(self, most=500):
        self._samples = deque(maxlen=most)

    def add(self, duration):
        """Note a duration in seconds."""
        self._samples.append(duration)

    def values(self, name):
        """Return {name_p50, name_p99} in milliseconds, empty before the first sample."""
        if not self._samples:
            return {}
        p50, p99 = 1e3 * np.percentile(self._samples, (50, 99))
        return {f'{name}_ms_p50': round(float(p50), 2), f'{name}_ms_p99': round(float(p99), 2)}


def navigation_status(name, navigator, status, now, latencies, faults):
    """
    Return the DiagnosticStatus of a Navigator whose last Status is `status`.

    latencies: {name: Latencies}. faults: {key: text} of what keeps others from hearing us or us
    from hearing them. Keys: state, cause, then feeds, localisation and rejections.
    """
    stop = status.stop
    values = {'state': status.state, 'cause': stop.cause if stop else ''}
    for feed in navigator.feeds.values():
        values[f'{feed.name}_count'] = feed.count
        values[f'{feed.name}_rate'] = f'{feed.rate:.1f}'
        if (age := feed.age(now)) is not None:
            values[f'{feed.name}_age'] = f'{age[0]:.3f}'
    place = navigator.localisation
    values['state_frame'] = place.state_frame
    values['localisation_jump'] = f'{place.last_jump:.3f}'
    values['tracks'] = 0 if navigator.tracks is None else len(navigator.tracks)
    values['beams_reversed'] = ', '.join(navigator.tracker.reversed_sensors) or 'none'
    values['walls'] = 'none' if navigator.walls is None else 'from the map'
    values.update(_way(navigator))
    values['clock_jumps'] = navigator.clock.jumps
    values['overruns'] = navigator.loop.overruns
    values['longest_step_ms'] = f'{1e3 * navigator.loop.longest:.1f}'
    for key, latency in latencies.items():
        values.update(latency.values(key))
    values['rejected'] = sum(navigator.rejected.values())
    values.update({f'rejected {reason}': count for reason, count in navigator.rejected.items()})
    values.update(faults)
    expected = stop is None or stop.cause in EXPECTED
    level = DiagnosticStatus.OK if expected and not faults else DiagnosticStatus.WARN
    message = '; '.join((stop.detail if stop else status.state, *faults.values()))
    return diagnostic_status(name, 'wallnav_ros', level, message, values)


def _way(navigator):
    """Return what is known about the way to the goal, as values for diagnostics."""
    guide, place = navigator.guide, navigator.localisation
    if guide.goal is None or place.newest() is None or guide.goal_in_state(place) is None:
        return {}
    way = navigator.way
    if way is None:
        return {'way': 'straight'}
    # A detour is the robot's own plan too.
    kind = 'given' if isinstance(way, GivenPath) else 'planned'
    return {'way': kind, 'detours': guide.detours,
            'to_go': f'{float(way.to_go(place.newest()[:2])):.1f}'}
