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
Measure the tracker on every recording of a folder and in the simulator, and write the page.

Targets and gates are those of docs/tracking.md; figures are never edited by hand.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader

from wallnav_ros.evaluation.ground_truth import load_ground_truth
from wallnav_ros.evaluation.recordings import Recording, SCAN_TYPE
from wallnav_ros.evaluation.survey import survey_recording
from wallnav_ros.evaluation.tracking import (
    GATE, longest_stray, people_seen, score_people, STRAY, track_recording)
from wallnav_ros.evaluation.tracking_page import PAGE
from wallnav_ros.evaluation.tracking_simulation import MATCH, score_simulation, SETTLED, STEP
from wallnav_ros.simulation.scenarios import load_scenario

COUNTS = 'people_counts.txt'
# (name's ending, what it must reach): recall by tracks labelled human, MOTP in m, switches.
ANNOTATED = {'moving_1': (0.90, 0.10, 2), 'following_outdoor_1': (0.97, 0.07, 2)}
EMPTY = ('negative_2', 'tamu_people_2024/03')
MOST_IN_EMPTY = 0.05       # humans per scan where nobody is
LONGEST_STRAY = 1.0        # s
# (scenario, case, seeds, whether something is asked of it): the rest is to compare with.
SIMULATED = (('cross_path', 'mixed', range(8), True),
             ('cross_path', 'mixed', range(200, 232), False),
             ('curve_path', 'mixed', range(200, 232), False))


@dataclass(frozen=True)
class Row:
    """One scan topic of one recording: its name, TrackedScans and annotations, if any."""

    name: str
    tracked: list
    truth: object
    expected: int | None


def read_rows(data):
    """Yield a Row for every scan topic of every rosbag2 folder under `data`."""
    root = Path(data)
    for folder in sorted(path.parent for path in root.rglob('metadata.yaml')):
        with Reader(folder) as reader:
            topics = sorted(topic for topic, info in reader.topics.items()
                            if info.msgtype == SCAN_TYPE)
        for topic in topics:
            recording = Recording(folder, scan_topic=topic)
            mount = (np.zeros(3) if recording.odom_topic is None
                     else survey_recording(recording, None).mount.pose)
            truth = folder.parent / 'ground_truth_people.csv'
            name = str(folder.relative_to(root)).removesuffix('/rosbag2')
            yield Row(f'{name} {topic}' if len(topics) > 1 else name,
                      track_recording(recording, mount),
                      load_ground_truth(truth) if truth.is_file() else None,
                      _expected(folder))


def recording_line(row):
    """Return the Markdown table row of a Row."""
    ids, humans = people_seen(row.tracked)
    cells = [row.name, len(row.tracked), ids, f'{humans:.2f}',
             f'{longest_stray(row.tracked):.1f} s', '; '.join(_verdicts(row, ids, humans))]
    return '| ' + ' | '.join(str(cell) for cell in cells) + ' |'


def simulation_lines():
    """Return the Markdown table rows of the simulated episodes."""
    lines = []
    for scenario, case, seeds, asked in SIMULATED:
        found = score_simulation(load_scenario(scenario), case, seeds)
        for name, value, wanted, met in (
                ('MOTA', found.scores.mota, '>= 0.90', found.scores.mota >= 0.90),
                ('velocity RMSE, m/s', found.velocity_rmse, '<= 0.12',
                 found.velocity_rmse <= 0.12),
                ('label accuracy', found.label_accuracy, '>= 0.95',
                 found.label_accuracy >= 0.95),
                ('label accuracy, decidable', found.decided_accuracy, '', True),
                ('recall', found.scores.recall, '', True),
                ('precision', found.scores.precision, '', True),
                ('MOTP, m', found.scores.motp, '', True),
                ('ID switches', found.scores.switches, '', True),
                ('count error', found.count_error, '', True)):
            verdict = (wanted, _met(met)) if wanted and asked else ('', '')
            cells = (f'{scenario}, {case}', f'{seeds[0]}-{seeds[-1]}', name, f'{value:.3f}',
                     *verdict)
            lines.append('| ' + ' | '.join(cells) + ' |')
    return lines


def page(recordings, simulations, pictures):
    """Return the text of docs/tracking.md from its table rows and [(file, caption)]."""
    shown = '\n\n'.join(f'![{caption}]({file})\n\n*{caption}*' for file, caption in pictures)
    return PAGE.format(
        recordings='\n'.join(recordings), simulations='\n'.join(simulations), pictures=shown,
        gate=GATE, stray=STRAY, match=MATCH, settled=SETTLED, step=STEP)


def _verdicts(row, ids, humans):
    """Return what is asked of this recording and whether it holds."""
    verdicts = []
    if row.truth is not None:
        scores = score_people(row.tracked, row.truth)
        text = (f'recall {scores.recall:.3f}, MOTP {scores.motp:.3f} m, '
                f'{scores.switches} switches of {scores.objects} positions')
        for ending, (recall, motp, switches) in ANNOTATED.items():
            if row.name.endswith(ending):
                met = (scores.recall >= recall and scores.motp <= motp
                       and scores.switches <= switches)
                text += f' (target {recall}, {motp} m, {switches}: {_met(met)})'
        verdicts.append(text)
    if row.expected is not None:
        slack = 0 if row.expected <= 3 else 1 if row.expected <= 5 else 3
        verdicts.append(f'{row.expected} people passed (target within {slack}: '
                        f'{_met(abs(ids - row.expected) <= slack)})')
    if any(name in row.name for name in EMPTY):
        verdicts.append(f'nobody there (target {MOST_IN_EMPTY} per scan: '
                        f'{_met(humans <= MOST_IN_EMPTY)})')
    if longest_stray(row.tracked) > LONGEST_STRAY:
        verdicts.append(f'a track strayed for more than {LONGEST_STRAY} s')
    return verdicts


def _met(met):
    return 'met' if met else '**missed**'


def _expected(folder):
    """Return how many people passed, where a file beside the folder says so."""
    listing = folder.parent / COUNTS
    if not listing.is_file():
        return None
    for line in listing.read_text(encoding='utf-8').splitlines():
        name, _, count = line.strip().partition(' ')
        if name.removesuffix('.bag') == folder.name:
            return int(count)
    return None
