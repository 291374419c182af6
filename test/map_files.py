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
"""Map files for tests: written to order, and where the real ones lie."""

import cv2
import numpy as np

# Every map of the shared data that can be read as published, below maps/.
REAL_MAPS = (
    'asl_office_j/asl_office_j.yaml', 'columbia/columbia.yaml', 'derived_aces_from_log/aces.yaml',
    'fetch_3_1_16/3_1_16_limit.yaml', 'fetch_3_1_16/3_1_16_localization.yaml',
    'fetch_4_26_15/4_26_15.yaml', 'hsmcl_jmap/JMap.yaml', 'hunav_small_house/small_house.yaml',
    'intel_bwi/intel.yaml', 'levinelobby/levinelobby.yaml',
    'mit_basement_fixed/basement_fixed.map.yaml', 'mit_stata_basement/stata_basement.yaml',
    'mtl/mtl.yaml', 'nav2_depot/depot.yaml', 'nav2_depot/depot_keepout.yaml',
    'nav2_depot/depot_speed.yaml', 'nav2_warehouse/warehouse.yaml', 'olin_ac109_3/ac109_3.yaml',
    'olin_mac_1st_floor/mac_1st_floor_final.yaml', 'original_ckk/original_ckk.yaml',
    'spielberg_track/Spielberg_map.yaml', 'testmap_yaw_negate/testmap.yaml',
    'testmap_yaw_negate/testmap2.yaml', 'torino/torino.yaml', 'turtlebot3_world/map.yaml',
    'utexas_gdc_2/2.yaml', 'utexas_gdc_3ne/3ne.yaml', 'willow_0.10/willow-2010-02-18-0.10.yaml')
# Published with an image path that exists nowhere.
MISPLACED_MAPS = ('porto_broken_yaml/porto.yaml', 'sarl_wangtong/wangtong.yaml',
                  'sarl_wulou/wulou.yaml')

FIELDS = {'image': 'map.pgm', 'resolution': '0.05', 'origin': '[0.0, 0.0, 0.0]', 'negate': '0',
          'occupied_thresh': '0.65', 'free_thresh': '0.196'}


def pgm(pixels):
    """Return grey pixels (H, W), row 0 at the top, as the bytes of a binary PGM."""
    pixels = np.asarray(pixels, dtype=np.uint8)
    return b'P5\n%d %d\n255\n' % pixels.shape[::-1] + pixels.tobytes()


def png(pixels):
    """Return pixels (H, W), (H, W, 3) BGR or (H, W, 4) BGRA as the bytes of a PNG."""
    return cv2.imencode('.png', np.asarray(pixels))[1].tobytes()


def write_map_files(folder, pixels=((0, 254), (254, 254)), data=None, **fields):
    """
    Write map.yaml and its image into `folder` and return the path of the YAML.

    fields: YAML text by key, instead of or besides FIELDS; None leaves the key out.
    data: the image's bytes, instead of the PGM of `pixels`.
    """
    fields = {**FIELDS, **fields}
    path = folder / 'map.yaml'
    path.write_text(''.join(f'{key}: {value}\n' for key, value in fields.items()
                            if value is not None))
    (folder / 'map.pgm').write_bytes(pgm(pixels) if data is None else data)
    return path
