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
    body_width: float = 0.45
    """m; wider clusters may be two people, or a person before a wall."""
    carve_radius: float = 0.4
    """m; how far from its middle a person's body and arms reach."""
    apart_distance: float = 0.4
    """m; what lies nearer to a wall than this may be a piece of it."""
    apart_width: float = 1.5
    """m; two people side by side; what hangs together over more is furniture or wall."""
    stride: float = 0.8
    """m; legs further apart than a long step do not belong to one person."""

    # The robot's own body.
    own_reach: float = 0.8
    """m; parts of a robot lie no further from its scanner."""
    own_margin: float = 0.05
    """m; range noise, on a body that keeps its place."""
    own_travel: float = 1.0
    """m; nothing but the robot itself stays put in the scan for so long a way."""

    # Earlier views.
    view_lateral: float = 0.06
    """m; a place counts as free only if beams pass it on both sides by this much."""
    view_depth: float = 0.12
    """m; range noise and pose error between two views."""
    view_slack: float = 0.015
    """rad; heading error of odometry within a few seconds, felt on slanting walls."""
    view_spacing: float = 0.25
    """s between the views kept; a walker clears its own width in about this time."""
    view_count: int = 8
    """views; their ages grow in equal ratios, so that eight reach back half a minute."""
    view_age: float = 0.35
    """s; younger views show a walker still where it is."""
    still_age: float = 1.0
    """s; a slow walker has left its place by then, what stands has not."""
    background_age: float = 2.0
    """s; what was there so long ago belongs to the place, not to somebody passing."""
    clear_range: float = 7.0
    """m; a beam without a return proves free space only this far: dark cloth absorbs."""

    # Ego-motion.
    odometry_slip: float = 0.1
    """share of a step; wheels slip less, and in a corridor nothing else tells how far it was."""
    odometry_error: float = 0.3
    """share of a turn; slip, and odometry that lags the scan by a few hundredths of a second."""
    unknown_speed: float = 0.6
    """m/s; how much an untracked robot's velocity changes between two scans."""
    unknown_turn: float = 0.6
    """rad/s; how much its turn rate changes between two scans."""
    match_noise: float = 0.03
    """m; range noise of common scanners."""
    match_share: float = 0.4
    """share of the beams that must lie on what was seen before, or the match is not believed."""
    match_points: int = 250
    """beams used; more sharpen the pose no further than range noise allows."""
    key_distance: float = 0.4
    """m; after that, new sides of things come into view."""
    key_turn: float = 0.35
    """rad; after that, a third of a scanner's view is new."""

    # Order of the beams.
    order_turn: float = 0.02
    """rad in a scan; less bends it by no more than range noise at five metres."""
    order_proof: float = 2.0
    """scans of which nothing fits as told and all the other way: 20, if it is a tenth each."""
    order_patience: int = 100
    """turning scans; who has not been refuted by then is right."""

    # Motion.
    acceleration_noise: float = 0.4
    """m/s^2 over root Hz; people change their velocity by about 0.4 m/s within a second."""
    steady_noise: float = 0.25
    """m/s^2 over root Hz; the same, for the velocity that is told: people mostly go on."""
    body_noise: float = 0.03
    """m; how well the centre of a body is known: range noise and the side that is seen."""
    leg_noise: float = 0.10
    """m; where the body is when one leg is seen: a quarter of a stride away."""
    hidden_noise: float = 0.1
    """m; where the centre is when something nearer covers it: a third of a body away."""
    hidden_width: float = 0.2
    """m; how far a body reaches behind what covers it, at most: a narrow one's radius."""
    shrink_time: float = 5.0
    """s; in which a track that is never seen whole comes down to the part that is seen."""
    birth_speed_noise: float = 1.0
    """m/s; standard deviation of a person's velocity before it is known."""
    disc_doubt: float = 0.07
    """m; a radius not known to this is that of an arc so flat that a wall would pass for it."""
    roundness: float = 0.75
    """share of half a second in which all beams lie on one disc; people keep it up for less."""

    rest_time: float = 0.3
    """s; in which the velocity of a thing that seems to stand dies away."""
    fastest: float = 3.0
    """m/s; nobody runs faster indoors."""

    # Association.
    gate: float = 3.0
    """standard deviations; 99 % of what belongs together lies within."""
    human_gate: float = 4.0
    """standard deviations; people turn more sharply than the motion noise allows for."""
    second_leg_cost: float = 2.0
    """squared deviations; a leg of one's own goes before another's second."""
    mismatch_cost: float = 4.0
    """squared deviations; walkers do not turn into furniture, nor specks into legs, and what is
    new waits for what is known."""
    size_cost: float = 0.5
    """squared deviations for each squared log ratio of sizes; legs merge and part."""

    leg_gap: float = 0.35
    """m between two tracks of legs that are one person's: they pass each other in each step."""
    leg_drift: float = 0.7
    """m/s between the two; more, and they are two people who pass."""
    abreast: float = 0.5
    """m between the middles of two people, at least: the width of a pair of shoulders."""
    edge_margin: float = 0.05
    """m beyond a disc where its limb, hit at a slant, may break off as a cluster of its own."""

    # Life.
    confirm_time: float = 0.25
    """s; clutter flickers for a scan or two, things stay."""
    occlusion_time: float = 1.0
    """s; a person who walks behind another is back within a second."""
    miss_time: float = 0.35
    """s; a place seen empty for longer holds nothing."""
    longest_gap: float = 1.5
    """s between scans; after that nothing remembered about moving things can be trusted."""

    disorder: float = 0.5
    """s that a scan may be older than one before, several scanners being out of step; more
    means that the clock was set back."""

    # Human or obstacle.
    trail_spacing: float = 0.1
    """s; the trail of sixteen places spans 1.6 s, enough to tell walking from swaying."""
    walking_speed: float = 0.25
    """m/s; slower drift is explained by the changing view of a thing that stands still."""
    walking_distance: float = 0.25
    """m; what a thing must have covered to count as moving by itself."""
    earned_proof: float = 6.0
    """log-odds gathered, after which one who stands keeps the label: a second of walking."""
    swing: float = 0.12
    """m a leg moves against the other within a second; a slow step is twice that."""
    gait_rate: float = 4.0
    """log-odds a second while two legs move against each other."""
    open_gait: float = 5.0
    """times that in the open, where there is nothing else that stands on legs."""
    thin_radius: float = 0.035
    """m; thinner than any leg: chair legs, poles, cables."""
    fresh_rate: float = 6.0
    """log-odds a second while all of a thing is where nothing was."""
    vacated_rate: float = 6.0
    """log-odds a second while it moves and where it was is seen empty."""
    moved_rate: float = 3.0
    """log-odds a second while it moves, seen from a laser that stands."""
    mapped_rate: float = 8.0
    """log-odds a second while it moves and the map has taken out what slides along walls."""
    disc_distance: float = 0.1
    """m; the centre of a disc is known to 2 cm, so what came further has moved."""
    disc_rate: float = 16.0
    """log-odds a second while a disc does so, and the map has taken the walls out."""
    leap_share: float = 0.75
    """share of the longest leap on the trail that counts for a mix-up and not for a way."""
    still_rate: float = 2.5
    """log-odds a second against, while all of a thing is where something always was."""
    human_odds: float = 2.0
    """log-odds; 88 % sure to name it human, 88 % sure to take the name away."""
    motion_limit: float = 4.0
    """log-odds; 98 %: certainty that a second of evidence can still turn round."""

    # Mapped walls.
    map_noise: float = 0.04
    """m; half a cell of a common map, and what mapping bent."""
    pose_noise: float = 0.05
    """m; of a robot in its map, where nobody tells and no scan matches: one cell."""
    heading_noise: float = 0.02
    """rad; the same of its heading: what scan matching comes to in a corridor."""
    wall_deviations: float = 2.0
    """standard deviations within which a beam end is the wall: 95 % of them."""
    wall_reach: float = 0.3
    """m; no doubt makes what lies further from a wall part of it: people beside it stand so far
    out, and are worth more than a stretch of wall taken for a thing."""
