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
How comfortable a drive was: jerk, and time spent within people's personal space.

Hall's distances ("The Hidden Dimension", 1966): 0.45 m intimate, 1.2 m personal.
"""

import numpy as np

INTIMATE, PERSONAL = 0.45, 1.2     # m between the surfaces of robot and person
# What `comfort` returns.
COMFORT = ('mean_jerk', 'intimate_time', 'personal_time')


def comfort(result):
    """
    Return the COMFORT figures of an EpisodeResult by name.

    mean_jerk: m/s^3. intimate_time, personal_time: s that somebody was as near as that.
    """
    step = result.time / len(result.gaps) if len(result.gaps) else 0.0
    return {'mean_jerk': mean_jerk(result.path, step),
            'intimate_time': step * float((result.gaps < INTIMATE).sum()),
            'personal_time': step * float((result.gaps < PERSONAL).sum())}


def mean_jerk(path, step):
    """Return the mean size of the third derivative of a path (T, 2+) sampled each `step` s."""
    third = np.diff(np.asarray(path)[:, :2], n=3, axis=0)
    return float(np.linalg.norm(third, axis=1).mean() / step ** 3) if len(third) else 0.0
