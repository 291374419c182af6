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
Every figure the tracker uses, in physical units, with the reason for its value.

`params/wallnav.yaml` carries the same names under `tracker.`.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class TrackerSettings:
    """What the tracker assumes of scanners, people and poses."""

    # Clustering.
    max_range: float = 25.0
    """m; beyond it one degree spans 0.4 m and a person is a single beam."""
    break_distance: float = 0.12
    """m; less than the gap between two legs in mid-stride, more than noise on one surface."""
    beam_factor: float = 2.5
    """beam spacings; a surface at 65 degrees to the beam shows gaps this wide."""
    largest_width: float = 1.1
    """m; the widest disc the policy was trained on (radius 0.5 m) and a margin for noise."""
    leg_width: float = 0.25
    """m; a trouser leg is 0.10 to 0.20 m across, a body at least 0.25 m."""
    stride: float = 0.7
    """m; legs further apart than a long step do not belong to one person."""

    # Motion.
    acceleration_noise: float = 0.8
    """m/s^2 over root Hz; people change their velocity by about 1 m/s within a second."""
    body_noise: float = 0.04
    """m; how well the centre of a body is known: range noise and the side that is seen."""
    leg_noise: float = 0.10
    """m; where the body is when one leg is seen: a quarter of a stride away."""
    birth_speed_noise: float = 1.0
    """m/s; standard deviation of a person's velocity before it is known."""
    gate: float = 0.45
    """m; a body does not jump further from its prediction; widened by the uncertainty."""

    # Life.
    confirm_time: float = 0.25
    """s; clutter flickers for a scan or two, things stay."""
    occlusion_time: float = 1.0
    """s; a person who walks behind another is back within a second."""
    miss_time: float = 0.35
    """s; a place seen empty for longer holds nothing."""
    longest_gap: float = 1.5
    """s between scans; after that nothing remembered about moving things can be trusted."""

    # Human or obstacle.
    walking_speed: float = 0.25
    """m/s; slower drift is explained by the changing view of a thing that stands still."""
    walking_distance: float = 0.3
    """m; what a thing must have covered to count as moving by itself."""

    # Mapped walls.
    wall_margin: float = 0.15
    """m; range noise, half a map cell and the map's own error."""
