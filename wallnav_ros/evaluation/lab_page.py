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
The text of docs/lab.md around its measured figures.

The paper's Table 4 (its real robot) beside what `drive` measured in the same tests.
"""

from dataclasses import dataclass

DRIFT = 0.02       # of the odometry: standard deviation of its scales, and rad per m of its bend
PAPER_TIMES = {'lab_1': 14.0, 'lab_2': 58.0, 'lab_3': 50.0}    # s, Table 4

PAGE = """# The laboratory tests

The paper's three laboratory tests (its Table 4), driven through simulated LiDAR and the whole node
graph (`drive`: simulator, tracker, walls and policy as processes, over DDS), with a robot 0.48 m
wide (radius 0.24 m, 0.8 m/s). This page is written by

```
ros2 run wallnav_ros lab_tests --runs {runs} --speed {speed:g} --out out/labs --page docs/lab.md
```

which drives every test {runs} times, each from a seed of its own, with a perfect pose in the map
and again with one that is off by {noise} (slowly changing); every figure is
measured, none is edited. The pose comes as from AMCL, once in 0.1 m or 0.1 rad. Odometry drifts by
{drift:g} % of the way and of turns, and by {drift:g} rad in a hundred metres. These are standard
deviations.

| scenario | what it holds | way |
|---|---|---|
| `lab_1` | a corridor 1.20 m wide, then 0.80 m between the legs of six chairs | 7 m |
| `lab_2` | a path 0.70 m wide along two bends of curvature 0.98 per metre; then a room with \
six chairs, a standing figure and five walkers | 12 m |
| `lab_3` | the chairs of `lab_1`, a hall with seven walkers, the bends of `lab_2` | 21 m |

| test | pose in the map | goal | touched people / walls | too late | mean time (paper) \
| longest | least gap to people / walls | scan to command, p50 |
|---|---|---|---|---|---|---|---|---|
{rows}

Gaps are the least of all runs of the row, times those of runs that reached the goal. The latency
is the median of the runs' medians, on a machine shared with other work{priority}.

## How it gets through

Chairs are four legs of 3 cm, as a laser sees them. Neither they nor the standing figure are on the
maps, which `make_maps` draws from the walls alone. People see the robot and leave it a berth of
0.2 m (`robot.berth`); without it, ORCA's people brush past at no distance at all, and a robot that
stands is touched.

The shipped weights were trained in ways of 1.2 m and more, with gaps of 0.9 m and more beside
pillars. In the bends the policy gets nowhere by itself; what helps it along is described in
[nodes](nodes.md#the-way-to-the-goal), and `evaluate`, which runs the policy alone, does not have
it. A pose that is off by 5 cm is of no use in a passage that leaves 11 cm on each side: scans are
matched with the map around it ([nodes](nodes.md#frames)).

## Pictures

The first run of every row.

{pictures}
"""


@dataclass(frozen=True)
class Series:
    """
    Runs of one test under one condition.

    lab: its scenario. noise: (2,) m and rad of the pose in the map. runs: what `drive` writes of
    each. picture: file of the first one, relative to the page.
    """

    lab: str
    noise: tuple
    runs: list
    picture: str


def page(series, speed=1.0, real_time=False):
    """
    Return the text of the page about a list of Series, simulated `speed` times real time.

    real_time: whether the nodes had real-time priority.
    """
    noisy = next((one.noise for one in series if any(one.noise)), None)
    return PAGE.format(
        runs=_several({len(one.runs) for one in series}), drift=100.0 * DRIFT,
        speed=speed, priority=', which the nodes came before (`chrt --rr`)' if real_time else '',
        noise='nothing' if noisy is None else _noise(noisy),
        rows='\n'.join(map(_row, series)),
        pictures='\n\n'.join(f'![{_title(one)}]({one.picture})' for one in series))


def _several(counts):
    return str(counts.pop()) if len(counts) == 1 else f'{min(counts)} to {max(counts)}'


def _noise(noise):
    return f'{100.0 * noise[0]:g} cm and {57.29578 * noise[1]:.0f} degrees'


def _title(series):
    return f'{series.lab}, ' + (
        f'pose off by {_noise(series.noise)}' if any(series.noise) else 'perfect pose')


def _row(series):
    runs = series.runs
    count = {outcome: sum(run['outcome'] == outcome for run in runs)
             for outcome in ('goal', 'collision', 'wall_collision', 'timeout')}
    times = [run['time'] for run in runs if run['outcome'] == 'goal']
    mean = f'{sum(times) / len(times):.1f} s' if times else 'none'
    longest = f'{max(times):.1f} s' if times else 'none'
    cells = (series.lab, _noise(series.noise) if any(series.noise) else 'perfect',
             f'{count["goal"]} of {len(runs)}',
             f'{count["collision"]} / {count["wall_collision"]}', count['timeout'],
             f'{mean} ({PAPER_TIMES[series.lab]:g} s)', longest,
             f'{_least(runs, "min_gap_agent")} / {_least(runs, "min_gap_wall")}',
             _median([run['scan_to_command_ms_p50'] for run in runs]))
    return '| ' + ' | '.join(map(str, cells)) + ' |'


def _least(runs, key):
    gaps = [run[key] for run in runs if run[key] is not None]
    return f'{min(gaps):.2f} m' if gaps else '–'


def _median(values):
    values = sorted(value for value in values if value is not None)
    return f'{values[len(values) // 2]:.0f} ms' if values else '–'
