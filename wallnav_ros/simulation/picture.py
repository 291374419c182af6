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
A scene as an image: walls, people, the robot and its goal, seen from above.

For Gymnasium's `rgb_array`; quick rather than pretty, unlike the figures of `evaluation`.
"""

import cv2
import numpy as np

SIZE = 512             # pixels of the longer side
MARGIN = 0.5           # m around everything that is shown
BACKGROUND, WALL, GOAL = (255, 255, 255), (40, 40, 40), (30, 150, 60)
ROBOT, STANDING, WALKING = (22, 80, 176), (150, 150, 150), (230, 130, 20)
SUBPIXELS = 4          # bits of a pixel's fraction that OpenCV draws with


def draw_scene(walls, robot, agents):
    """
    Return an (H, W, 3) uint8 RGB image of one moment.

    walls: Walls. robot, agents: a Robot and Agents without leading axes, in the walls' frame.
    """
    shown = np.vstack((walls.segments.reshape(-1, 2), robot.position, robot.goal))
    low, high = shown.min(axis=0) - MARGIN, shown.max(axis=0) + MARGIN
    scale = SIZE / (high - low).max()
    width, height = np.ceil((high - low) * scale).astype(int)
    image = np.full((height, width, 3), BACKGROUND, dtype=np.uint8)

    def pixel(point):
        x, y = (np.asarray(point) - low) * scale
        return _fixed(x), _fixed(height - y)

    options = {'lineType': cv2.LINE_AA, 'shift': SUBPIXELS}
    for start, end in walls.segments:
        cv2.line(image, pixel(start), pixel(end), WALL, 2, **options)
    moving = np.hypot(agents.velocity[:, 0], agents.velocity[:, 1]) > 0.0
    for row in np.flatnonzero(agents.present):
        cv2.circle(image, pixel(agents.position[row]), _fixed(agents.radius[row] * scale),
                   WALKING if moving[row] else STANDING, cv2.FILLED, **options)
    cv2.drawMarker(image, tuple(value >> SUBPIXELS for value in pixel(robot.goal)), GOAL,
                   cv2.MARKER_STAR, 16, 2)
    cv2.circle(image, pixel(robot.position), _fixed(robot.radius * scale), ROBOT, cv2.FILLED,
               **options)
    ahead = robot.radius * np.array([np.cos(robot.pose[2]), np.sin(robot.pose[2])])
    cv2.line(image, pixel(robot.position), pixel(robot.position + ahead), BACKGROUND, 2,
             **options)
    return image


def _fixed(value):
    return int(round(float(value) * (1 << SUBPIXELS)))
