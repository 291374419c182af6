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
The ROS 2 nodes, the only room that imports rclpy; see docs/nodes.md.

Importing this room, before NumPy, keeps BLAS and OpenCV to one thread.
"""

import os

# BLAS threads spin while they wait for each other: on a robot that is heat, not speed.
for _name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
    os.environ.setdefault(_name, '1')

import cv2  # noqa: E402

# Nor do they help with images of a few hundred pixels: they are waited for.
cv2.setNumThreads(1)

from wallnav_ros.world.extras import explain_missing_extras  # noqa: E402

explain_missing_extras()
