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
The tools, one module each.

Importing this room, before NumPy, keeps BLAS to one thread.
"""

import os

# Matrices here are small: a second BLAS thread gains nothing, and where cores are shared the
# threads wait for each other. Workers are processes instead.
for _name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
    os.environ.setdefault(_name, '1')

from wallnav_ros.world.extras import explain_missing_extras  # noqa: E402

explain_missing_extras()
