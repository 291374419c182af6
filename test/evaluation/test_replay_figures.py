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
"""The picture of a replay: what is drawn where, read from the figure before it is printed."""

from collections import Counter
from dataclasses import replace
from math import pi

import cv2
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
import numpy as np
import pytest

rosbags = pytest.importorskip('rosbags')

from wallnav_ros.evaluation.recordings import Mount  # noqa: E402
from wallnav_ros.evaluation.replay import Replay, Stage  # noqa: E402
from wallnav_ros.evaluation.replay_figures import (  # noqa: E402
    COMMAND, draw_replay, PEOPLE, ROBOT, TRUTH, ways_of)
from wallnav_ros.evaluation.survey import Survey  # noqa: E402
from wallnav_ros.navigation.navigator import NavigatorSettings  # noqa: E402
from wallnav_ros.world.tracks import HUMAN, OBSTACLE, Tracks  # noqa: E402
from wallnav_ros.world.walls import Walls  # noqa: E402

pytestmark = pytest.mark.extras

START = 1000.0


def tracks_at(stamp, *rows):
    """Return Tracks of rows (id, label, x, y, radius)."""
    number, label, x, y, radius = np.array(rows, float).reshape(-1, 5).T
    return Tracks(stamp, number.astype(np.uint32), np.column_stack((x, y)),
                  np.zeros((len(number), 2)), radius, label.astype(np.uint8))


def replay_of(robot, tracks=None, every=0.5, decided=((0.0, 0.0, 0.0, 'driving'),)):
    """Return a Replay of a robot at (S, 2); decided: rows (s since START, m/s, rad/s, why)."""
    robot = np.column_stack((np.array(robot, float), np.zeros(len(robot))))
    stamps = START + every * np.arange(len(robot))
    tracks = tracks or [()] * len(robot)
    times, forward, turn, decisions = zip(*decided)
    return Replay(tuple(tracks_at(stamp, *rows) for stamp, rows in zip(stamps, tracks)),
                  robot, robot, stamps, np.zeros(len(robot)), START + np.array(times),
                  np.column_stack((forward, turn)), decisions, np.empty(0), Counter())


def survey_of(points=((0.0, 0.0),), hits=None, **changed):
    """Return a Survey of beams that ended at `points` in the odometry's frame."""
    points = np.array(points, float)
    whole = Survey('odom', 'base_link', 'laser', np.array([START]), np.zeros((1, 3)),
                   np.zeros((1, 3)), np.array([START]), np.zeros(1), Mount(np.zeros(3)), 'given',
                   points, np.zeros_like(points),
                   np.ones(len(points), int) if hits is None else np.array(hits, int))
    return replace(whole, **changed)


def stage_of(goal=(0.0, 0.0), frame='odom', map_from_odom=None):
    """Return a Stage."""
    return Stage(frame, map_from_odom, Mount(np.zeros(3)), None, np.array(goal, float), 0.0,
                 NavigatorSettings())


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """Return a function that draws as `draw_replay` and returns the figure, not printed."""
    def draw(replay, survey=None, stage=None, **more):
        printed = []
        monkeypatch.setattr(Figure, 'savefig', lambda figure, *_, **__: printed.append(figure))
        draw_replay(tmp_path / 'unprinted', 'a title', replay, survey or survey_of(),
                    stage or stage_of(), **more)
        return printed[0]

    return draw


def lines(axes, color, marker='None'):
    """Return the points (K, 2) of each line of a colour and marker."""
    return [line.get_xydata() for line in axes.get_lines()
            if to_hex(line.get_color()) == color and line.get_marker() == marker]


def words(axes):
    """Return {text: (x, y)} of what is written in the axes; an arrow is a text that is empty."""
    return {text.get_text(): tuple(text.xy) for text in axes.texts if text.get_text()}


def test_a_way_is_all_that_one_track_was():
    # Track 7 is there in both scans and taken for an obstacle first; track 0 comes second.
    one, other = ways_of([
        tracks_at(10.0, (7, OBSTACLE, 0, 0, 0.2)),
        tracks_at(10.5, (0, OBSTACLE, 8, 8, 0.5), (7, HUMAN, 3, 4, 0.4))])

    assert (one.number, one.human, one.radius, one.extent) == (0, False, 0.5, 0.0)
    assert (other.number, other.human, other.extent) == (7, True, 5.0)
    assert other.radius == pytest.approx(0.3)
    assert other.stamp.tolist() == [10.0, 10.5]
    assert other.position.tolist() == [[0.0, 0.0], [3.0, 4.0]]


def test_without_tracks_there_are_no_ways():
    assert ways_of([Tracks.none(1.0), Tracks.none(2.0)]) == []


def test_the_view_holds_robot_goal_and_people_with_a_metre_around(drawn):
    tracks = [[(1, HUMAN, 4, 6, 0.3), (2, OBSTACLE, 90, 90, 0.3)], []]

    place = drawn(replay_of([(0, 0), (8, 0)], tracks), survey_of([(2.0, -1.0)]),
                  stage_of((10.0, 0.0))).axes[0]

    assert (place.get_xlim(), place.get_ylim()) == ((-1.0, 11.0), (-2.0, 7.0))
    assert place.get_aspect() == 1.0


def test_where_no_beam_hit_anything_the_view_holds_robot_and_goal(drawn):
    nothing = survey_of(np.empty((0, 2)), [])
    place = drawn(replay_of([(0, 0), (8, 0)]), nothing, stage_of((10.0, 6.0))).axes[0]
    assert (place.get_xlim(), place.get_ylim()) == ((-1.0, 11.0), (-1.0, 7.0))


def test_the_view_is_never_a_stripe(drawn):
    place = drawn(replay_of([(0, 0), (18, 0)])).axes[0]

    # 20 m wide with its margins: at least 7 m high.
    assert (place.get_xlim(), place.get_ylim()) == ((-1.0, 19.0), (-3.5, 3.5))


def test_stray_beams_do_not_widen_the_view_and_steady_ones_do_not_narrow_it(drawn):
    # 400 cells along 4 m, each hit often; one of them very often, and one beam that went astray.
    wall = np.column_stack((np.linspace(0.0, 4.0, 400), np.zeros(400)))
    survey = survey_of([*wall, (300.0, 0.0)], [100_000, *[5] * 399, 1])

    # Half a per cent of the 4 m is left out at the end.
    view = drawn(replay_of([(0, 0)] * 2), survey).axes[0].get_xlim()
    assert view == pytest.approx((-1.0, 5.0), abs=0.05)


@pytest.mark.parametrize('goal, size', [
    ((10.0, 8.0), (16.5, 10.6)),     # 12 m x 10 m: the strips beside the place
    ((0.0, 18.0), (11.0, 10.6)),     # 7 m x 20 m: the place no slimmer than 5.5 inches
    ((18.0, 0.0), (15.0, 10.9)),     # 20 m x 7 m: 14 x 4.9 inches, and 6 for the strips below
])
def test_the_page_suits_the_place(drawn, goal, size):
    figure = drawn(replay_of([(0, 0)] * 2), stage=stage_of(goal))

    assert figure.texts[0].get_text() == 'a title'
    np.testing.assert_allclose(figure.get_size_inches(), size)


def test_beams_are_drawn_in_the_frame_of_the_stage_darker_the_more_there_were(drawn):
    # Odometry starts at (2, 1) in the map and looks up: (3, 0.02) there is (1.98, 4) here.
    survey = survey_of([(3.0, 0.02), (1.0, 0.02)], [50, 1])
    stage = stage_of((2.0, 1.0), 'map', np.array([2.0, 1.0, pi / 2]))

    place = drawn(replay_of([(2, 1)] * 2), survey, stage).axes[0]

    image, = place.get_images()
    shade, (left, _, bottom, _) = image.get_array(), image.get_extent()
    rows, columns = np.nonzero(shade < 1.0)
    # The centres of the two cells of 5 cm, the lower one first, as rows are counted.
    assert image.origin == 'lower'
    np.testing.assert_allclose(left + 0.05 * (columns + 0.5), [1.98, 1.98], atol=0.026)
    np.testing.assert_allclose(bottom + 0.05 * (rows + 0.5), [2.0, 4.0], atol=0.026)
    seldom, often = shade[rows, columns]
    assert often == pytest.approx(0.25) and 0.25 < seldom < 1.0
    assert (place.get_xlabel(), place.get_ylabel()) == ('x in map [m]', 'y in map [m]')


def test_people_are_drawn_in_the_colour_of_their_id_with_it_at_the_end(drawn):
    tracks = [[(number, HUMAN, 1, number, 0.3) for number in (3, 11, 12)],
              [(number, HUMAN, 2, number, 0.3) for number in (3, 11, 12)]]

    place = drawn(replay_of([(0, 0)] * 2, tracks)).axes[0]

    # There are eight colours: 3 and 11 share one.
    assert sorted(way.tolist() for way in lines(place, PEOPLE[3])) == [
        [[1.0, 3.0], [2.0, 3.0]], [[1.0, 11.0], [2.0, 11.0]]]
    assert [way.tolist() for way in lines(place, PEOPLE[4])] == [[[1.0, 12.0], [2.0, 12.0]]]
    assert [dot.tolist() for dot in lines(place, PEOPLE[4], 'o')] == [[[1.0, 12.0]]]
    assert words(place) == {'3': (2.0, 3.0), '11': (2.0, 11.0), '12': (2.0, 12.0)}


def test_of_a_crowd_the_25_longest_ways_are_named(drawn):
    # The way of track n is n / 10 m long.
    tracks = [[(n, HUMAN, 0, n, 0.3) for n in range(1, 31)],
              [(n, HUMAN, n / 10, n, 0.3) for n in range(1, 31)]]

    place = drawn(replay_of([(0, 0)] * 2, tracks)).axes[0]

    assert sorted(map(int, words(place))) == list(range(6, 31))


def test_what_stood_still_for_a_second_is_a_disc_at_its_middle(drawn):
    # Scans are half a second apart: track 2 lives for 1 s, track 3 for 0.5 s. Track 4 is a person.
    tracks = [[(2, OBSTACLE, 1, 5, 0.2), (4, HUMAN, 7, 7, 0.3)],
              [(2, OBSTACLE, 1.2, 5, 0.2), (3, OBSTACLE, 3, 3, 0.2)],
              [(2, OBSTACLE, 9, 5, 0.2), (3, OBSTACLE, 3, 3, 0.2), (4, HUMAN, 7, 7, 0.3)]]

    discs, = (held for held in drawn(replay_of([(0, 0)] * 3, tracks)).axes[0].collections
              if isinstance(held, EllipseCollection))

    np.testing.assert_allclose(discs.get_offsets(), [[1.2, 5.0]])
    np.testing.assert_allclose((discs.get_widths(), discs.get_heights()), [[0.4], [0.4]])


def test_the_seconds_are_told_along_the_way_of_a_robot_that_moves(drawn):
    # A scan every 2 s. From 10 s to 30 s it stands, until 40 s it creeps 0.9 m, then it goes on.
    x = np.interp(2.0 * np.arange(31), [0, 10, 30, 40, 60], [0.0, 5.0, 5.0, 5.9, 9.9])
    robot = np.column_stack((x, np.zeros(31)))

    place = drawn(replay_of(robot, every=2.0), stage=stage_of((3.0, 3.0))).axes[0]

    way, = lines(place, ROBOT)
    np.testing.assert_allclose(way, robot)
    assert [mark.tolist() for mark in lines(place, ROBOT, 's')] == [[[0.0, 0.0]]]
    assert {word: xy[0] for word, xy in words(place).items()} == pytest.approx(
        {'10 s': 5.0, '50 s': 7.9, '60 s': 9.9})
    # The head lies along the last 0.3 m and more: from where it was at 58 s.
    arrow, = (text for text in place.texts if not text.get_text())
    np.testing.assert_allclose((arrow.xyann, arrow.xy), [(9.5, 0.0), (9.9, 0.0)])
    assert [star.tolist() for star in lines(place, '#ffd700', '*')] == [[[3.0, 3.0]]]


def test_walls_and_annotated_people_are_drawn_and_named_in_the_key_where_there_are_any(drawn):
    walls = Walls(np.array([[[0.0, 0.0], [4.0, 0.0]]]))
    truth = np.array([[1.0, 2.0], [3.0, 2.5]])

    bare = drawn(replay_of([(0, 0)] * 2))
    full = drawn(replay_of([(0, 0)] * 2), walls=walls, truth=truth)

    assert not lines(bare.axes[0], TRUTH, 'x') and not bare.axes[0].collections
    np.testing.assert_allclose(lines(full.axes[0], TRUTH, 'x'), [truth])
    drawn_walls, = full.axes[0].collections
    assert isinstance(drawn_walls, LineCollection)
    np.testing.assert_allclose(drawn_walls.get_segments(), walls.segments)
    names = [{text.get_text() for text in figure.axes[1].get_legend().get_texts()}
             for figure in (bare, full)]
    assert names[1] - names[0] == {'walls of the map', 'annotated person'}
    assert len(names[0]) == 5


def test_the_strips_tell_commanded_and_driven_speeds_since_the_first_scan(drawn):
    survey = survey_of(stamps=np.array([START - 1.0, START + 1.0]), path=np.zeros((2, 3)),
                       twists=np.array([[0.4, 9.0, -0.1], [0.5, 9.0, 0.1]]))
    decided = [(0.5, 0.6, 0.3, 'driving'), (1.0, 0.0, 0.0, 'scan_stale'),
               (1.5, 0.1, 0.2, 'waiting'), (2.0, 0.0, 0.0, 'goal_reached')]

    _, _, speed, turn, _ = drawn(replay_of([(0, 0)] * 6, decided=decided), survey).axes

    assert [line.tolist() for line in lines(speed, COMMAND)] == [
        [[0.5, 0.6], [1.0, 0.0], [1.5, 0.1], [2.0, 0.0]]]
    assert [line.tolist() for line in lines(turn, COMMAND)] == [
        [[0.5, 0.3], [1.0, 0.0], [1.5, 0.2], [2.0, 0.0]]]
    assert [line.tolist() for line in lines(speed, '#999999')] == [[[-1.0, 0.4], [1.0, 0.5]]]
    assert [line.tolist() for line in lines(turn, '#999999')] == [[[-1.0, -0.1], [1.0, 0.1]]]
    # Waiting and having arrived are no faults.
    assert [stop.tolist() for stop in lines(speed, PEOPLE[0], 'x')] == [[[1.0, 0.0]]]


def test_without_odometry_no_driven_speed_is_told(drawn):
    _, _, speed, turn, _ = drawn(replay_of([(0, 0)] * 2), survey_of(odom_frame=None)).axes

    assert not lines(speed, '#999999') and not lines(turn, '#999999')


def test_the_last_strip_counts_the_people_of_each_scan(drawn):
    tracks = [[(1, HUMAN, 0, 0, 0.3), (2, HUMAN, 1, 1, 0.3), (3, OBSTACLE, 2, 2, 0.3)],
              [(1, HUMAN, 0, 0, 0.3)], []]

    people = drawn(replay_of([(0, 0)] * 3, tracks)).axes[4]

    assert [line.tolist() for line in lines(people, PEOPLE[1])] == [
        [[0.0, 2.0], [0.5, 1.0], [1.0, 0.0]]]
    assert (people.get_xlim(), people.get_ylim()) == ((0.0, 1.0), (0.0, 2.5))


def test_the_picture_is_printed_whole_and_up_is_up(tmp_path):
    # 9 m x 9 m: ten inches for the place, 5.5 beside it, at 100 pixels an inch.
    truth = np.array([[1.0, 1.0], [5.0, 1.0], [1.0, 5.0]])

    for name, people in (('with', truth), ('without', np.empty((0, 2)))):
        draw_replay(tmp_path / name, '', replay_of([(0, 0)] * 2), survey_of(), stage_of((7, 7)),
                    truth=people)
    some, none = (cv2.imread(str(tmp_path / name)) for name in ('with', 'without'))

    assert some.shape == (1060, 1550, 3)
    # The two differ by three crosses; rows of pixels are counted downwards.
    crosses = cv2.connectedComponentsWithStats((some != none).any(axis=2).astype(np.uint8))[3][1:]
    upper, left, right = sorted(crosses, key=sum)
    side = right[0] - left[0]
    assert side > 300.0
    np.testing.assert_allclose((right - left, left - upper), ((side, 0.0), (0.0, side)), atol=1.5)
