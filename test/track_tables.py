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
"""Tracks and detections for tests of perception: columns that are zero unless given."""

from dataclasses import fields

import numpy as np

from wallnav_ros.perception.detection import Detections
from wallnav_ros.perception.discs import Discs
from wallnav_ros.perception.track_table import TrackTable


def make_table(position, **columns):
    """Return a TrackTable of tracks at `position` (N, 2); `columns` (N, ...) or one for all."""
    table = TrackTable()
    position = np.asarray(position, dtype=float).reshape(-1, 2)
    columns = {'position': position, 'id': 1 + np.arange(len(position)),
               'trail': position[:, None], 'born_at': position, 'place': position, **columns}
    for name, (shape, kind) in TrackTable.COLUMNS.items():
        values = np.asarray(columns.pop(name, 0), dtype=kind)
        setattr(table, name, np.broadcast_to(values, (len(position), *shape)).copy())
    assert not columns, f'no such columns: {columns}'
    return table


def make_detections(position, discs=None, **columns):
    """Return Detections at `position` (D, 2); `columns` (D, ...) or one for all."""
    position = np.asarray(position, dtype=float).reshape(-1, 2)
    discs = make_discs(position) if discs is None else discs
    columns = {'noise': 0.03, 'radius': 0.2, 'count': 10, **columns}
    logical, shape = ('apart', 'leg'), {'hidden': (2,), 'sight': (2,)}
    return Detections(position=position, discs=discs, **{
        field.name: np.broadcast_to(np.asarray(
            columns.get(field.name, 0), dtype=bool if field.name in logical else None),
            (len(position), *shape.get(field.name, ()))).copy()
        for field in fields(Detections) if field.name not in ('position', 'discs')})


def make_discs(centre, radius=0.3, pull=(0.0, 0.0), doubt=0.02, fits=False, tells=True):
    """Return Discs at `centre` (D, 2); what else is given holds for each or for all."""
    centre = np.asarray(centre, dtype=float).reshape(-1, 2)
    count = len(centre)
    return Discs(centre, np.full(count, radius, dtype=float),
                 np.broadcast_to(np.asarray(pull, dtype=float), (count, 2)).copy(),
                 np.full(count, doubt, dtype=float), np.full(count, fits), np.full(count, tells))
