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
Which way round a scanner took its beams: as its messages say, or the other way.

Drivers of scanners that turn clockwise flip the beams and leave their times (Slamtec/rplidar_ros
issue 55); straightening such a scan the wrong way bends it twice as much as leaving it.
"""

from wallnav_ros.perception.detection import place_beams
from wallnav_ros.perception.ego_motion import EgoMotion


class BeamOrder:
    """
    Decides for one scanner, by how well turning scans fit earlier ones, straightened either way.

    sign: 1.0 where beams are taken as told, -1.0 where the other way round fits.
    """

    def __init__(self, settings):
        self.settings = settings
        self.sign = 1.0
        self._proof, self._scans = 0.0, 0
        self.restart()

    def restart(self):
        """Forget earlier scans, but not what they proved."""
        # What was straightened one way fits scans straightened that way: each has its own past.
        self._other = EgoMotion(self.settings)

    def weigh(self, scan, wanted, told, misfit, people, given, known, interval, sensor):
        """
        Weigh one Scan; returns whether the decision has changed with it.

        wanted: (B,) bool, beams to use. told: (3,) the laser's motion from first to last beam.
        misfit: that of `EgoMotion.locate`, which also explains the other arguments.
        """
        settings = self.settings
        if self._scans >= settings.order_patience or not told.any():
            return False
        local = place_beams(scan, wanted, -told, settings)[1]
        self._other.locate(local, people, given, known, interval, interval, sensor)
        if misfit is None or self._other.misfit is None or abs(told[2]) < settings.order_turn:
            return False
        self._scans += 1
        self._proof += misfit - self._other.misfit
        if self._proof > settings.order_proof:
            self.sign, self._scans = -1.0, settings.order_patience
            return True
        return False
