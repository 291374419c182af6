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
A day of driving to and fro among people, as fast as it goes: memory stays flat, nothing raises.

WALLNAV_DAY says how many simulated hours: 24 is the whole day, a few minutes are the suite's.
"""

import gc
import os

import numpy as np
import pytest

pyrvo = pytest.importorskip('pyrvo')

from wallnav_ros.evaluation.closed_loop import ClosedLoop, Rig  # noqa: E402
from wallnav_ros.mapping.distance_field import distance_field  # noqa: E402
from wallnav_ros.navigation.localisation import MAP  # noqa: E402
from wallnav_ros.navigation.navigator import Navigator  # noqa: E402
from wallnav_ros.navigation.plans import NavigatorSettings  # noqa: E402
from wallnav_ros.perception.tracking import Tracker  # noqa: E402
from wallnav_ros.policy.lookahead import Lookahead  # noqa: E402
from wallnav_ros.policy.value_function import load_value_function  # noqa: E402
from wallnav_ros.simulation.episodes import draw_episode  # noqa: E402
from wallnav_ros.simulation.lidar import Lidar  # noqa: E402
from wallnav_ros.simulation.live_world import Base, LiveWorld  # noqa: E402
from wallnav_ros.simulation.scenarios import load_scenario  # noqa: E402
from wallnav_ros.world.files import find_asset  # noqa: E402

pytestmark = pytest.mark.extras
HOURS = float(os.environ.get('WALLNAV_DAY', 0.05))
SPAN = 600.0           # s of it, after which memory is looked at again
REST = 60.0            # s that the robot rests at every goal
GROWTH = 8.0           # MB that memory may grow by, from a tenth of the day on
PLACES = np.array([(0.0, -4.0), (0.0, 4.0), (4.0, 0.0), (-4.0, 0.0)])


class EndlessWorld(LiveWorld):
    """A world that goes on after a contact and after its time, and keeps no history."""

    def _judge(self, pose_before, agents_before):
        pass

    def _record(self):
        self.history = []


def resident():
    """Return the memory of this process, in MB."""
    with open('/proc/self/status', encoding='ascii') as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith('VmRSS')) / 1024.0


@pytest.fixture
def loop(rng):
    """Return the ClosedLoop of a robot with drifting odometry on the cross path."""
    scenario = load_scenario('cross_path')
    world = EndlessWorld(draw_episode(scenario, 'dynamic', 1),
                         Base(drift=0.02, fix_noise=0.03, fix_turn_noise=0.01), rng)
    world.goal = np.array([1e3, 1e3])
    weights = load_value_function(find_asset('models', 'wallnav', '.npz'))
    navigator = Navigator(Lookahead.from_weights(weights), Tracker(),
                          NavigatorSettings(control_period=0.1))
    navigator.set_walls(distance_field(scenario.walls))
    lidar = Lidar(180, -np.pi, 2.0 * np.pi / 180)
    return ClosedLoop(world, navigator, rng, Rig(lidar, 5.0, 20.0, 10.0, tick=0.05))


def test_memory_stays_flat(loop):
    end, rested, reached, chosen = 3600.0 * HOURS, 0.0, 0, 0
    look, memory, drives = 0.0, [], 0
    while loop.now < end:
        loop.step()
        stop = loop.status and loop.status.stop
        if stop is not None and stop.cause in ('no_goal', 'goal_reached', 'localisation_jumped'):
            reached += stop.cause == 'goal_reached' and not rested
            rested = rested or loop.now
            if loop.now - rested >= REST or not drives:
                rested, chosen, drives = 0.0, chosen + 1, drives + 1
                loop.navigator.set_goal(PLACES[chosen % len(PLACES)], MAP)
        if loop.now >= look:
            look = loop.now + min(SPAN, end / 20.0)
            gc.collect()
            memory.append(resident())
            print(f'{loop.now / 3600.0:6.2f} h: {memory[-1]:.1f} MB, {reached} goals, '
                  f'{sum(loop.navigator.rejected.values())} rejected', flush=True)
    settled = memory[len(memory) // 10:]
    assert max(settled) - settled[0] < GROWTH
    assert reached > 20.0 * HOURS
