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
Network inputs: robot, agents and walls in the robot-centred frame turned towards the goal.

Paper section 2 and its decisions: invariant to the map's origin, any number of walls.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.world.geometry import joined, rotate

VERSION = 2            # raised when a feature changes meaning: older weights are then refused
WALL_RAYS = 16         # rays, the first towards the goal, counter-clockwise
WALL_RANGE = 5.0       # m, beyond which a wall does not matter
WALL_STEPS = 6         # sphere-tracing steps: grazing rays end short, never beyond a wall
AGENT_SCALE = 5.0      # m
GOAL_SCALE = 10.0      # m
GOAL_LIMIT = 15.0      # m, beyond which a farther goal looks the same
CLEARANCE_LIMIT = 2.0  # m
CPA_HORIZON = 5.0      # s, beyond which a closest point of approach does not matter
AHEAD = 1.0            # s, how far ahead of an agent its walls are felt

ROBOT = ('goal_distance', 'preferred_speed', 'radius', 'heading_cos', 'heading_sin', 'speed',
         'wall_gap')
AGENT = ('x', 'y', 'vx', 'vy', 'radius', 'reach', 'gap', 'speed', 'approach', 'clearance',
         'clearance_ahead', 'cpa_time', 'cpa_gap')


@dataclass(frozen=True)
class Features:
    """
    float32 arrays with shared leading axes.

    robot: (..., 7); walls: (..., 16); agents: (..., N, 13); present: (..., N) bool.
    """

    robot: np.ndarray
    walls: np.ndarray
    agents: np.ndarray
    present: np.ndarray


def describe():
    """Return what a weight file must have been trained on to be used with these features."""
    return {'version': VERSION, 'robot': list(ROBOT), 'agent': list(AGENT),
            'wall_rays': WALL_RAYS, 'wall_range': WALL_RANGE, 'wall_steps': WALL_STEPS}


def agent_clearance(agents, walls):
    """
    Return the wall distance (..., N, 2) at each agent and AHEAD seconds along its velocity.

    Metres, clipped to CLEARANCE_LIMIT; `walls` is the DistanceField of the agents' frame.
    """
    ahead = agents.position + AHEAD * agents.velocity
    points = np.stack((agents.position, ahead), axis=-2)
    return np.minimum(walls.at(points), CLEARANCE_LIMIT).astype(np.float32)


def extract(robot, agents, clearance, walls):
    """
    Return the Features of states: `robot` has leading axes (...), `agents` (..., N).

    The leading axes broadcast (many candidate robots against one crowd). `clearance`
    (..., N, 2) comes from `agent_clearance`; `walls` is the DistanceField of their frame.
    """
    to_goal = robot.goal - robot.position
    distance = np.hypot(to_goal[..., 0], to_goal[..., 1]) + robot.beyond
    bearing = np.arctan2(to_goal[..., 1], to_goal[..., 0])
    heading = robot.pose[..., 2] - bearing
    own = joined(
        np.minimum(distance, GOAL_LIMIT) / GOAL_SCALE, robot.preferred_speed, robot.radius,
        np.cos(heading), np.sin(heading), robot.velocity[..., 0],
        np.minimum(walls.at(robot.position) - robot.radius, CLEARANCE_LIMIT), dtype=np.float32)
    rays = bearing[..., None] + 2.0 * np.pi / WALL_RAYS * np.arange(WALL_RAYS)
    reach = walls.raycast(robot.position[..., None, :], rays, WALL_RANGE, WALL_STEPS)
    return Features(own, (reach / WALL_RANGE).astype(np.float32),
                    _agents(robot, agents, clearance, bearing),
                    np.broadcast_to(agents.present, own.shape[:-1] + agents.radius.shape[-1:]))


def _agents(robot, agents, clearance, bearing):
    """Return the agent features (..., N, 13), zero where an agent is padding."""
    bearing = bearing[..., None]
    offset = rotate(agents.position - robot.position[..., None, :], -bearing)
    velocity = rotate(agents.velocity, -bearing)
    distance = np.hypot(offset[..., 0], offset[..., 1])
    reach = agents.radius + np.asarray(robot.radius)[..., None]
    approach = -np.sum(offset * velocity, axis=-1) / np.maximum(distance, 1e-6)
    cpa_time, cpa_distance = _closest_point(robot, offset, velocity, bearing)
    rows = joined(
        offset[..., 0] / AGENT_SCALE, offset[..., 1] / AGENT_SCALE,
        velocity[..., 0], velocity[..., 1], agents.radius, reach,
        (distance - reach) / AGENT_SCALE, np.hypot(velocity[..., 0], velocity[..., 1]),
        approach, clearance[..., 0], clearance[..., 1], cpa_time / CPA_HORIZON,
        np.minimum(cpa_distance - reach, CLEARANCE_LIMIT), dtype=np.float32)
    np.copyto(rows, 0.0, where=~agents.present[..., None])
    return rows


def _closest_point(robot, offset, velocity, bearing):
    """Return when (s) and how far off (m) each agent is nearest if all keep their velocity."""
    heading = robot.pose[..., 2, None] - bearing
    speed = robot.velocity[..., 0, None]
    x = velocity[..., 0] - speed * np.cos(heading)
    y = velocity[..., 1] - speed * np.sin(heading)
    approach = -(offset[..., 0] * x + offset[..., 1] * y)
    time = np.clip(approach / np.maximum(x * x + y * y, 1e-6), 0.0, CPA_HORIZON)
    return time, np.hypot(offset[..., 0] + time * x, offset[..., 1] + time * y)
