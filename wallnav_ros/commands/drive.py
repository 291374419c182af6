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
Close the loop over DDS: simulator, tracker, walls and policy as processes, N crowds.

Writes summary.json, a picture and the nodes' logs for every run (docs/drive.md).
"""

import argparse
from contextlib import contextmanager
import json
from pathlib import Path
import signal
import sys
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from wallnav_ros.commands.arguments import natural, output_file, positive
from wallnav_ros.commands.node_processes import Domain, NodeGroup, NodeRefused, ProcessEnded
from wallnav_ros.evaluation.trajectory_figures import draw_trajectories
from wallnav_ros.nodes.topics import LATCHED, RELIABLE
from wallnav_ros.policy.value_function import load_value_function
from wallnav_ros.simulation.episodes import draw_episode
from wallnav_ros.simulation.scenario import ScenarioError
from wallnav_ros.simulation.scenarios import load_scenario
from wallnav_ros.world.files import atomic_write, find_asset, share_directory

READY_TIMEOUT = 60.0       # s until every node must have started and found the others
RESULT = ('outcome', 'time', 'path_length', 'min_gap_agent', 'min_gap_wall',
          'scan_to_command_ms_p50', 'scan_to_command_ms_p99')


def main(arguments=None):
    """Run the command; returns its exit status: 0 only if every run reached the goal."""
    options = _parse(arguments)
    out = Path(options.out)
    try:
        out.mkdir(parents=True, exist_ok=True)
        load_value_function(find_asset('models', options.model, '.npz'))
        scenario = load_scenario(options.scenario)
        draw_episode(scenario, options.case, options.seed)
    except (OSError, ValueError) as error:
        return _tell(error, 2)
    runs, status = [], 0
    try:
        with _signals_noted() as asked:
            for number in range(options.runs):
                runs.append(_run(options, scenario, options.seed + number, asked))
    except (NodeRefused, ScenarioError) as error:
        status = _tell(error, 2)
    except (ProcessEnded, OSError) as error:
        status = _tell(error, 1)
    except _Asked:
        status = 128 + asked[0]
    # What earlier runs gave is not lost with a later one.
    if runs:
        _write_summary(options, runs)
    return status or int(any(run['outcome'] != 'goal' for run in runs))


def _tell(error, status):
    print(f'drive: {error}', file=sys.stderr)
    return status


def _parse(arguments):
    parser = argparse.ArgumentParser('drive', description=__doc__.strip().splitlines()[0])
    parser.add_argument('--scenario', default='cross_path', help='file, or a shipped name')
    parser.add_argument('--case', default='mixed', help='of the scenario')
    parser.add_argument('--runs', type=positive, default=1, help='crowds, each from its own seed')
    parser.add_argument('--seed', type=natural, default=1, help='of the first crowd')
    parser.add_argument('--out', required=True, help='folder for the results')
    parser.add_argument('--name', help='of the one run: writes NAME.png and NAME.json')
    parser.add_argument('--speed', type=float, default=1.0, help='simulated seconds per second')
    parser.add_argument('--model', default='wallnav', help='weight file, or a shipped name')
    parser.add_argument('--beams', type=_beams, default=360, help='of the scanner')
    parser.add_argument('--scan-rate', type=float, default=10.0, metavar='HZ')
    parser.add_argument('--odom-drift', type=float, default=0.0, metavar='FRACTION',
                        help='of the odometry, per metre and radian')
    parser.add_argument('--localisation-noise', type=float, nargs=2, default=[0.0, 0.0],
                        metavar=('M', 'RAD'), help='of the pose in the map')
    parser.add_argument('--json', metavar='FILE', type=output_file,
                        help='also write the summary here')
    options = parser.parse_args(arguments)
    if options.name is not None and options.runs != 1:
        parser.error('--name is for a single run')
    if not 0.05 <= options.speed <= 50.0:
        parser.error('--speed: expected 0.05 to 50')
    return options


def _beams(text):
    if natural(text) < 2:
        raise argparse.ArgumentTypeError(f'expected 2 or more, got {text}')
    return int(text)


@contextmanager
def _signals_noted():
    """Yield a list that SIGINT and SIGTERM are added to for as long as the context lasts."""
    # Noted, not raised: an exception in the midst of a fork is swallowed by Python.
    asked = []
    before = {number: signal.signal(number, lambda received, _: asked.append(received))
              for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def map_of(world, drawn):
    """Return the path of a map of a Scenario's walls, `drawn` where none is shipped."""
    if world.map_path is not None:
        return world.map_path
    # By the file, not by the name in it: a copy with other walls may have kept that.
    folder = share_directory()
    shipped = folder / 'maps' / f'{world.path.stem}.yaml'
    if world.path.resolve().parent == (folder / 'scenarios').resolve() and shipped.is_file():
        return shipped
    world.draw_map(drawn)
    return drawn


class _Asked(Exception):
    """The command was asked to end by a signal."""


def _run(options, scenario, seed, asked):
    """Drive crowd `seed` of a Scenario or Family to its end; returns its entry of the summary."""
    out, world = Path(options.out), scenario.at(seed)
    name = options.name or f'run_{seed - options.seed:03d}'
    map_path = map_of(world, out / f'{name}_map.yaml')
    with Domain(), NodeGroup(out / f'{name}_logs') as nodes:
        _start(nodes, options, world, map_path, seed)
        with _Watcher(asked) as watcher:
            watcher.wait(lambda: watcher.ready, READY_TIMEOUT, nodes)
            watcher.send_goal(world.goal)
            # A machine too slow for --speed simulates slower, and is given the time for it.
            limit = 30.0 + 4.0 * world.time_limit / min(options.speed, 1.0)
            watcher.wait(lambda: watcher.episode.get('state') == 'ended', limit, nodes)
            report = watcher.episode
    result = {'seed': seed} | {key: report.get(key) for key in RESULT}
    draw_trajectories(out / f'{name}.png', world.walls.segments, report['trajectories'],
                      _title(options, result))
    if options.name:
        with atomic_write(out / f'{name}.json') as stream:
            json.dump({key: result[key] for key in RESULT}, stream, indent=2)
    print(_title(options, result), flush=True)
    return result


def _start(nodes, options, world, map_path, seed):
    sim_time = options.speed != 1.0
    nodes.start('simulator_node', {
        'scenario': world.path, 'case': options.case, 'seed': seed,
        'speed': options.speed, 'wait_for_goal': True, 'beams': options.beams,
        'scan_rate': options.scan_rate, 'odom_drift': options.odom_drift,
        'localisation_noise': options.localisation_noise[0],
        'localisation_turn_noise': options.localisation_noise[1]})
    nodes.start('map_walls_node', {'map': map_path, 'use_sim_time': sim_time})
    nodes.start('scan_tracker_node', {'map': map_path, 'use_sim_time': sim_time})
    nodes.start('policy_node', {
        'map': map_path, 'tracks_source': 'topic', 'use_sim_time': sim_time,
        'model': find_asset('models', options.model, '.npz').resolve(),
        'robot_radius': world.radius, 'preferred_speed': world.preferred_speed})


class _Watcher:
    """
    Follows a run from outside, as an operator with RViz would.

    ready: whether policy_node waits for nothing but a goal. episode: the simulator's last report.
    """

    def __init__(self, asked):
        """Give up waiting as soon as the list `asked` holds a signal."""
        self._asked = asked

    def __enter__(self):
        """Join the ROS domain of this process."""
        self.ready, self.episode, self._standing = False, {}, 'policy_node is not there yet'
        self._context = rclpy.Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node('drive', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._node.create_subscription(
            DiagnosticArray, 'diagnostics', self._take_diagnostics, RELIABLE)
        self._node.create_subscription(String, 'episode', self._take_episode, LATCHED)
        self._goal_publisher = self._node.create_publisher(PoseStamped, 'goal_pose', RELIABLE)
        return self

    def __exit__(self, *_):
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def wait(self, condition, timeout, nodes):
        """Wait until `condition` holds; raises ProcessEnded after `timeout` s."""
        deadline = monotonic() + timeout
        while not condition():
            nodes.check()
            if self._asked:
                raise _Asked
            if monotonic() > deadline:
                raise ProcessEnded(f'nothing more happened within {timeout:.0f} s '
                                   f'({self._standing}); see the logs')
            self._executor.spin_once(timeout_sec=0.1)

    def send_goal(self, goal):
        """Send the robot to `goal` (2,) in the map."""
        message = PoseStamped()
        message.header.frame_id = 'map'
        message.pose.position.x, message.pose.position.y = map(float, goal)
        message.pose.orientation.w = 1.0
        self._goal_publisher.publish(message)

    def _take_diagnostics(self, message):
        for status in message.status:
            if status.name.endswith('/policy_node'):
                values = {item.key: item.value for item in status.values}
                self._standing = status.message
                # Both who judge the goal must hear it.
                self.ready = (values['cause'] == 'no_goal' and values['state_frame'] == 'map'
                              and self._goal_publisher.get_subscription_count() >= 2)

    def _take_episode(self, message):
        self.episode = json.loads(message.data)


def _title(options, result):
    def metres(value):
        return 'none' if value is None else f'{value:.2f} m'
    return (f'{Path(options.scenario).stem} {options.case}, seed {result["seed"]}: '
            f'{result["outcome"].replace("_", " ")} after {result["time"]:.1f} s, '
            f'{result["path_length"]:.1f} m; least gap to people '
            f'{metres(result["min_gap_agent"])}, to walls {metres(result["min_gap_wall"])}')


def _write_summary(options, runs):
    reached = sum(run['outcome'] == 'goal' for run in runs)
    summary = {'scenario': options.scenario, 'case': options.case, 'model': options.model,
               'success_rate': reached / len(runs), 'runs': runs}
    for path in filter(None, (Path(options.out) / 'summary.json', options.json)):
        with atomic_write(path) as stream:
            json.dump(summary, stream, indent=2)
    latencies = [run['scan_to_command_ms_p50'] for run in runs
                 if run['scan_to_command_ms_p50'] is not None]
    if latencies:
        worst = max(run['scan_to_command_ms_p99'] or 0.0 for run in runs)
        print(f'scan to command: median {sorted(latencies)[len(latencies) // 2]:.1f} ms, '
              f'99 in 100 within {worst:.1f} ms')
    print(f'{reached} of {len(runs)} reached the goal; results in {options.out}')


if __name__ == '__main__':
    sys.exit(main())
