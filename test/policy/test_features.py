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
Network inputs are the same wherever the map's origin lies and in whatever order agents come.

Paper section 2: one robot-centred frame, turned towards the goal; any number of walls.
"""

from dataclasses import replace

import numpy as np
import pytest

from wallnav_ros.policy import features
from wallnav_ros.policy.features import AGENT, ROBOT
from wallnav_ros.world.distance_field import DistanceField
from wallnav_ros.world.geometry import compose, rotate, to_parent
from wallnav_ros.world.state import Agents, Robot
from wallnav_ros.world.walls import Walls

# A room of 8 m x 6 m with a block in it; no wall is parallel to another one nearby.
ROOM = [np.array([[-4.0, -3.0], [4.0, -3.2], [4.1, 3.0], [-3.9, 2.8]]),
        np.array([[1.0, 1.0], [2.0, 1.1], [1.9, 1.9]])]


def field_of(walls, resolution=0.05):
    """Return the exact distances to `walls` on a grid that reaches a metre beyond them."""
    corners = walls.segments.reshape(-1, 2)
    low, high = corners.min(axis=0) - 1.0, corners.max(axis=0) + 1.0
    columns, rows = np.ceil((high - low) / resolution).astype(int) + 1
    grid = np.stack(np.meshgrid(*(low[axis] + resolution * np.arange(count)
                                  for axis, count in ((0, columns), (1, rows)))), axis=-1)
    distance = walls.distance(grid.reshape(-1, 2)).reshape(rows, columns)
    return DistanceField(distance.astype(np.float32), np.array([*low, 0.0]), resolution)


@pytest.fixture(scope='module')
def room():
    return Walls.from_polylines(ROOM, closed=True)


@pytest.fixture(scope='module')
def field(room):
    return field_of(room)


def some_robot():
    return Robot(np.array([-1.0, -0.5, 0.3]), np.array([0.6, 0.2]), np.array([3.0, 2.0]),
                 np.array(0.2), np.array(0.8))


def some_agents(rng, count=5):
    return Agents.of(rng.uniform(-3.0, 3.0, (count, 2)), rng.uniform(-1.0, 1.0, (count, 2)),
                     rng.uniform(0.1, 0.5, count))


def seen(robot, agents, field):
    return features.extract(robot, agents, features.agent_clearance(agents, field), field)


def moved(pose, robot, agents):
    """Return the same world described in the frame's parent, where the frame lies at `pose`."""
    robot = replace(robot, pose=compose(pose, robot.pose), goal=to_parent(pose, robot.goal))
    agents = replace(agents, position=to_parent(pose, agents.position),
                     velocity=rotate(agents.velocity, pose[2]))
    return robot, agents


def test_a_hand_worked_state():
    """The goal lies 4 m to the left of the map's x axis: the frame is turned by 90 degrees."""
    robot = Robot(np.array([1.0, 1.0, np.pi]), np.array([0.5, 0.1]), np.array([1.0, 5.0]),
                  np.array(0.2), np.array(0.8))
    # Two metres straight towards the goal, walking back towards the robot.
    agents = Agents.of([[1.0, 3.0]], [[0.0, -1.0]], [0.3])

    state = seen(robot, agents, DistanceField.empty())

    # 4 m / 10, 0.8 m/s, 0.2 m, heading 90 degrees left of the goal, 0.5 m/s, no wall near.
    assert state.robot == pytest.approx([0.4, 0.8, 0.2, 0.0, 1.0, 0.5, 2.0], abs=1e-6)
    assert (state.walls == 1.0).all()
    named = dict(zip(AGENT, state.agents[0].tolist()))
    assert named == pytest.approx({
        'x': 0.4, 'y': 0.0, 'vx': -1.0, 'vy': 0.0, 'radius': 0.3, 'reach': 0.5, 'gap': 0.3,
        'speed': 1.0, 'approach': 1.0, 'clearance': 2.0, 'clearance_ahead': 2.0,
        # Relative velocity (-1, -0.5): nearest after 2 / 1.25 = 1.6 s of 5, at (0.4, -0.8).
        'cpa_time': 0.32, 'cpa_gap': np.sqrt(0.8) - 0.5}, abs=1e-6)


def test_shapes_and_types_are_those_of_the_network(rng, field):
    state = seen(some_robot(), some_agents(rng), field)

    shapes = {name: part.shape for name, part in vars(state).items()}
    assert shapes == {'robot': (len(ROBOT),), 'walls': (features.WALL_RAYS,),
                      'agents': (5, len(AGENT)), 'present': (5,)}
    assert {part.dtype for part in (state.robot, state.walls, state.agents)} == {np.dtype('f4')}


@pytest.mark.parametrize('pose', [(30.0, -20.0, 0.0), (0.0, 0.0, 2.0), (-7.0, 3.0, -2.9)])
def test_the_maps_origin_and_axes_do_not_matter(rng, field, pose):
    robot, agents = some_robot(), some_agents(rng)
    elsewhere = replace(field, pose=compose(pose, field.pose))

    before = seen(robot, agents, field)
    after = seen(*moved(pose, robot, agents), elsewhere)

    for name in ('robot', 'walls', 'agents', 'present'):
        assert getattr(after, name) == pytest.approx(getattr(before, name), abs=1e-5), name


def test_walls_drawn_on_another_grid_give_the_same_features_within_its_resolution(rng, room):
    pose = np.array([5.0, -2.0, 0.7])
    robot, agents = some_robot(), some_agents(rng)
    turned = Walls(to_parent(pose, room.segments))

    before = seen(robot, agents, field_of(room, 0.02))
    after = seen(*moved(pose, robot, agents), field_of(turned, 0.02))

    # A ray may end up to a cell earlier, and a step of its march may fall otherwise.
    assert after.walls == pytest.approx(before.walls, abs=0.05 / features.WALL_RANGE)
    assert after.agents == pytest.approx(before.agents, abs=0.02)


def test_agents_may_come_in_any_order(rng, field):
    agents, order = some_agents(rng), rng.permutation(5)
    shuffled = Agents(*(part[order] for part in vars(agents).values()))

    before, after = seen(some_robot(), agents, field), seen(some_robot(), shuffled, field)

    assert (after.agents == before.agents[order]).all()
    assert (after.robot == before.robot).all()


def test_no_agents_at_all_is_a_state_like_any_other(field):
    state = seen(some_robot(), Agents.none(), field)

    assert state.agents.shape == (0, len(AGENT))
    assert state.present.shape == (0,)
    assert np.isfinite(state.walls).all()


def test_padding_is_zero_whatever_it_holds(rng, field):
    agents = some_agents(rng)
    present = np.array([True, False, True, True, False])
    rubbish = np.where(present[:, None], agents.position, 1e6)

    state = seen(some_robot(), replace(agents, position=rubbish, present=present), field)
    without = Agents(*(part[present] for part in vars(agents).values()))

    assert (state.agents[~present] == 0.0).all()
    assert (state.agents[present] == seen(some_robot(), without, field).agents).all()


def test_many_robots_share_one_crowd(rng, field):
    """Candidate states of one decision: leading axes broadcast."""
    agents = some_agents(rng)
    pose = rng.uniform(-2.0, 2.0, (7, 3))
    robots = Robot(pose, rng.uniform(0.0, 1.0, (7, 2)), np.tile([3.0, 2.0], (7, 1)),
                   np.full(7, 0.2), np.full(7, 0.8))
    crowd = Agents(*(part[None] for part in vars(agents).values()))

    together = features.extract(robots, crowd, features.agent_clearance(crowd, field), field)

    for row in range(7):
        alone = seen(Robot(*(part[row] for part in vars(robots).values())), agents, field)
        for name in ('robot', 'walls', 'agents', 'present'):
            assert (getattr(together, name)[row] == getattr(alone, name)).all(), name


def test_rays_never_reach_beyond_a_wall(rng, room, field):
    for _ in range(50):
        position = rng.uniform([-3.5, -2.5], [3.5, 2.5])
        if room.distance(position[None])[0] < 0.2:
            continue
        robot = replace(some_robot(), pose=np.array([*position, rng.uniform(-3.0, 3.0)]))
        bearing = np.arctan2(*(robot.goal - position)[::-1])
        angles = bearing + 2.0 * np.pi / features.WALL_RAYS * np.arange(features.WALL_RAYS)
        exact = np.minimum(room.raycast(position, angles, 10.0), features.WALL_RANGE)

        reach = seen(robot, Agents.none(), field).walls * features.WALL_RANGE

        assert (reach <= exact + 0.005).all()
        # Six steps of the march find all but grazing rays within a fifth of a metre.
        assert np.median(exact - reach) < 0.2


def test_the_first_ray_looks_towards_the_goal_and_the_rest_go_round_leftwards():
    """One wall, 2 m behind the goal's opposite: seen by the ray of half a turn."""
    walls = Walls(np.array([[[-2.0, -50.0], [-2.0, 50.0]]]))
    robot = Robot(np.zeros(3), np.zeros(2), np.array([4.0, 0.0]), np.array(0.2), np.array(0.8))
    left = replace(robot, goal=np.array([0.0, -4.0]))
    field = field_of(walls, 0.1)

    assert seen(robot, Agents.none(), field).walls.argmin() == 8
    # Facing the goal in the south, the wall in the west is to the right: 3/4 of a turn leftwards.
    assert seen(left, Agents.none(), field).walls.argmin() == 12


def test_goals_beyond_the_limit_look_alike(field):
    near, far = (seen(replace(some_robot(), goal=np.array([x, -0.5])), Agents.none(), field)
                 for x in (15.0, 40.0))

    assert near.robot[0] == far.robot[0] == pytest.approx(1.5)


def test_clearance_is_felt_here_and_a_second_ahead_up_to_its_limit():
    walls = Walls(np.array([[[3.0, -5.0], [3.0, 5.0]], [[-20.0, -5.0], [-20.0, 5.0]]]))
    agents = Agents.of([[2.0, 0.0], [-9.0, 0.0]], [[0.5, 0.0], [0.0, 0.0]], [0.3, 0.3])

    clearance = features.agent_clearance(agents, field_of(walls, 0.1))

    assert clearance == pytest.approx(np.array([[1.0, 0.5], [2.0, 2.0]]), abs=1e-6)


@pytest.mark.extras
def test_a_mirrored_world_gives_mirrored_features(rng, room, field):
    """What training mirrors (y changes sign) is what a mirrored world would have shown."""
    from wallnav_ros.learning.memory import mirror
    robot, agents = some_robot(), some_agents(rng)
    flip = np.array([1.0, -1.0])
    mirrored = field_of(Walls(room.segments * flip))
    state = seen(robot, agents, field)
    image = seen(
        replace(robot, pose=robot.pose * [1.0, -1.0, -1.0], velocity=robot.velocity * flip,
                goal=robot.goal * flip),
        replace(agents, position=agents.position * flip, velocity=agents.velocity * flip),
        mirrored)
    own = np.concatenate((state.robot, state.walls))[None]
    crowd = state.agents[None].copy()

    mirror(own, crowd)

    assert own[0] == pytest.approx(np.concatenate((image.robot, image.walls)), abs=0.01)
    assert crowd[0] == pytest.approx(image.agents, abs=0.01)


def test_features_describe_themselves_for_weight_files():
    assert features.describe() == {
        'version': 2, 'robot': list(ROBOT), 'agent': list(AGENT), 'wall_rays': 16,
        'wall_range': 5.0, 'wall_steps': 6}
