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
Lay out what a recording is replayed in: the frame, the walls and the goal.

Whatever had to be guessed is told in `Staging.warnings`, for a person to read.
"""

from dataclasses import dataclass

import numpy as np

from wallnav_ros.evaluation.recordings import RecordingError
from wallnav_ros.evaluation.replay import Stage
from wallnav_ros.evaluation.survey import Survey
from wallnav_ros.mapping.distance_field import distance_field
from wallnav_ros.mapping.scan_matching import match_scans
from wallnav_ros.navigation.localisation import MAP
from wallnav_ros.navigation.navigator import NavigatorSettings
from wallnav_ros.world.geometry import compose, invert, to_parent
from wallnav_ros.world.walls import Walls

# A map is matched with what was seen near the start, before odometry drifts.
_MATCHED_WITHIN = 15.0
# Fewer beams than this in a cell of the survey are noise or somebody passing.
_STEADY = 3
# A robot that ends nearer to its start than this went nowhere in particular.
_SHORTEST_WAY = 1.0
_GOAL_AHEAD = 5.0
# A scan received this long after its stamp, or before it, was stamped by another clock.
_MOST_LATENCY = 0.3


@dataclass(frozen=True)
class Staging:
    """
    A Stage and how it came about.

    walls: mapped Walls in the stage's frame, None when no map is used.
    summary: what summary.json says of it. warnings: one line each.
    """

    stage: Stage
    walls: Walls | None
    summary: dict
    warnings: list


def set_stage(survey: Survey, settings=NavigatorSettings(), walls=None, initial_pose=None,
              goal=None):
    """
    Return the Staging of a surveyed recording.

    walls: Walls of a map, or None. initial_pose: (3,) of the robot's base in the map at the
    start; None has it found by matching scans to the walls, and the map left out when that is
    not certain. goal: (2,) in the state frame; None takes where the robot ended.

    Raises RecordingError where the walls are too far apart to be used.
    """
    warnings = _doubts(survey)
    summary = {'laser_pose': _rounded(survey.mount.pose), 'laser_pose_from': survey.mount_source,
               'laser_upside_down': survey.mount.upside_down}
    map_from_odom = field = None
    if walls is not None:
        try:
            field = distance_field(walls)
        except ValueError as error:
            raise RecordingError(f'--map: {error}') from None
        map_from_odom, summary['map'] = _locate(survey, field, initial_pose)
        if map_from_odom is None:
            walls = field = None
            warnings.append('the robot could not be located in the map with certainty '
                            f'(score {summary["map"]["score"]}, elsewhere '
                            f'{summary["map"]["score_elsewhere"]}): the map is not used; '
                            'give --initial-pose X Y YAW')
    own = 'base_link' if survey.mount.pose.any() else survey.laser_frame
    frame = MAP if map_from_odom is not None else (
        survey.odom_frame or survey.base_frame or own)
    position, source = _goal(survey, map_from_odom, goal)
    summary.update(frame=frame, goal={'position': _rounded(position), 'from': source})
    stage = Stage(frame, map_from_odom, survey.mount, field, position, _clock_offset(survey),
                  settings)
    return Staging(stage, walls, summary, warnings)


def _clock_offset(survey):
    """Return by how much the recorder's clock is ahead, zero where both may be one clock."""
    latency = float(np.median(survey.latencies))
    return latency if abs(latency) > _MOST_LATENCY or latency < 0.0 else 0.0


def _doubts(survey):
    """Return what had to be assumed about the robot."""
    doubts = []
    if survey.odom_frame is None:
        doubts.append('no odometry in the bag: the robot is assumed to stand still, and '
                      'positions are relative to it')
    if survey.mount_source == 'unknown':
        doubts.append(f'no tf to {survey.laser_frame} in the bag: the laser is assumed at the '
                      'origin of the robot, facing forward; give --laser-pose X Y YAW')
    return doubts


def _locate(survey, field, initial_pose):
    """Return the odometry frame's pose in the map, or None, and how it was found."""
    if initial_pose is not None:
        pose = compose(np.asarray(initial_pose, float), invert(survey.path[0]))
        return pose, {'used': True, 'pose_of_odom': _rounded(pose), 'from': 'initial pose'}
    used = np.hypot(*(survey.origins - survey.path[0, :2]).T) < _MATCHED_WITHIN
    used &= survey.hits >= min(_STEADY, len(survey.scan_times))
    try:
        match = match_scans(survey.points[used], survey.origins[used], field)
    except ValueError as error:
        return None, {'used': False, 'from': str(error), 'score': 0.0, 'score_elsewhere': 0.0}
    found = {'used': match.is_certain, 'pose_of_odom': _rounded(match.pose),
             'from': 'matching scans to the walls', 'score': round(match.score, 3),
             'score_elsewhere': round(match.rival, 3)}
    return (match.pose if match.is_certain else None), found


def _goal(survey, map_from_odom, goal):
    """Return the goal (2,) in the state frame and where it comes from."""
    from_odom = np.zeros(3) if map_from_odom is None else map_from_odom
    if goal is not None:
        return np.asarray(goal, float), 'given'
    start, end = survey.path[0], survey.path[-1]
    if np.hypot(*(end - start)[:2]) >= _SHORTEST_WAY:
        return to_parent(from_odom, end[:2]), 'where the robot ended'
    ahead = to_parent(start, np.array([_GOAL_AHEAD, 0.0]))
    return to_parent(from_odom, ahead), f'{_GOAL_AHEAD:g} m ahead of where the robot started'


def _rounded(values):
    return [round(float(value), 4) for value in values]
