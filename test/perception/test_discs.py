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
"""Discs under clusters: where their centres are, what is none, and what proves to be one."""

import numpy as np
import pytest
from track_tables import make_discs, make_table

from wallnav_ros.perception.clustering import describe
from wallnav_ros.perception.discs import find_discs, follow_discs
from wallnav_ros.perception.settings import TrackerSettings
from wallnav_ros.perception.track_table import TrackTable

SETTINGS = TrackerSettings(
    match_noise=0.03, disc_doubt=0.07, largest_width=1.1, leg_width=0.25, roundness=0.75)
STEP = np.radians(0.5)
ORIGIN = np.zeros(2)


def arc(centre, radius, first=-1.0, last=1.0):
    """
    Return the beam ends (P, 2) on a disc seen from the origin.

    Of its visible width, from -1 (the right limb) to 1, those from `first` to `last`.
    """
    distance, middle = np.hypot(*centre), np.arctan2(centre[1], centre[0])
    half = np.arcsin(radius / distance)
    number = np.arange(np.ceil((middle + first * half) / STEP),
                       np.floor((middle + last * half) / STEP) + 1)
    angles = STEP * number
    along = distance * np.cos(angles - middle)
    depth = np.maximum(radius ** 2 - (distance * np.sin(angles - middle)) ** 2, 0.0)
    return (along - np.sqrt(depth))[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)


def line(start, end, count=15):
    return np.linspace(start, end, count)


def find(*things, wide=True, chosen=None, mix=None, origin=ORIGIN):
    """Return the Discs under the clusters `things`, their points in the order `mix` (P,)."""
    points = np.concatenate(things)
    owner = np.repeat(np.arange(len(things)), [len(thing) for thing in things])
    if mix is not None:
        points, owner = points[mix], owner[mix]
    clusters = describe(points, origin, owner, STEP)
    chosen = np.arange(len(things)) if chosen is None else np.asarray(chosen)
    sight = (clusters.centroid - origin)[chosen] / clusters.distance[chosen, None]
    wide = np.broadcast_to(wide, len(chosen))
    return find_discs(points, owner, clusters, chosen, sight, wide, SETTINGS)


def miss(centre, truth):
    return np.hypot(*(centre - np.asarray(truth)).T)


@pytest.mark.parametrize('centre, radius', [
    ((2.0, 0.0), 0.3), ((1.0, 1.0), 0.2), ((1.5, -1.0), 0.25), ((-2.0, 0.5), 0.5)])
def test_an_exact_arc_gives_back_its_disc(centre, radius):
    discs = find(arc(centre, radius))
    # The prior expects 3 cm more than the width shows; with tens of beams little is left of it.
    assert miss(discs.centre[0], centre) < 0.002
    assert discs.radius[0] == pytest.approx(radius, abs=0.002)
    assert discs.fits[0] and discs.tells[0]


@pytest.mark.parametrize('radius', [0.2, 0.3, 0.5])
@pytest.mark.parametrize('side', [-1.0, 1.0])
def test_beams_that_graze_a_disc_are_not_missed(side, radius):
    # Without the outermost tenth at either side; the width shows so much less of it.
    centre = (2.0, 0.5 * side)
    discs = find(arc(centre, radius, -0.9, 0.9))
    assert miss(discs.centre[0], centre) < 0.01
    assert discs.radius[0] == pytest.approx(radius, abs=0.01)
    assert discs.fits[0] and discs.tells[0]


@pytest.mark.parametrize('noise, bound', [(0.01, 0.025), (0.02, 0.03)])
@pytest.mark.parametrize('side', [-1.0, 1.0])
def test_the_centre_stays_where_a_third_of_the_arc_is_cut_off(side, noise, bound, rng):
    # From 2 m, 81 degrees to either side of the middle are visible: of 162 only 108, to 27.
    centre, radius, edge = (2.0, 0.0), 0.3, np.sin(np.radians(27.0))
    cut = arc(centre, radius, *((-1.0, edge) if side > 0.0 else (-edge, 1.0)))
    sight = cut / np.hypot(*cut.T)[:, None]
    draws = [find(cut + noise * rng.standard_normal((len(cut), 1)) * sight) for _ in range(200)]
    assert np.median([miss(discs.centre[0], centre) for discs in draws]) < bound
    assert np.mean([discs.fits[0] and discs.tells[0] for discs in draws]) > 0.9
    # Who knows the radius is better off.
    one = np.array([0])
    known = [miss(discs.centre_for(one, np.array([radius]))[0], centre) for discs in draws]
    assert np.median(known) < 0.01
    # The middle of what is seen is 8 cm aside: half of the 0.3 * (1 - sin 27) m cut off.
    assert abs(cut[:, 1].mean()) > 0.07


@pytest.mark.parametrize('width', [0.3, 0.4])
def test_a_short_piece_of_wall_may_be_a_disc_and_does_not_tell(width):
    discs = find(line((2.0, -width / 2), (2.0, width / 2)))
    assert discs.fits[0] and not discs.tells[0]
    # All that is known of its radius is the prior, of which 10 cm are not known.
    assert SETTINGS.disc_doubt < discs.doubt[0] < 0.1


def test_two_legs_abreast_may_be_a_disc_and_do_not_tell():
    # 10 cm between them: one cluster, 0.38 m wide.
    discs = find(np.concatenate((arc((2.0, -0.12), 0.07), arc((2.0, 0.12), 0.07))))
    assert not discs.tells[0]


@pytest.mark.parametrize('side, turn', [(0.3, -1.0), (0.6, 1.0)])
def test_a_corner_is_no_disc_and_tells(side, turn):
    # Of a room (-1), or of a box that turns its edge to the scanner: the best circle, of 0.35 m,
    # has the edge 8 cm outside, and 4 cm of itself before the middle of either side.
    ends = side * np.sqrt(0.5) * np.array([[turn, -1.0], [turn, 1.0]])
    discs = find(np.concatenate((line(ends[0] + [2.0, 0.0], (2.0, 0.0)),
                                 line((2.0, 0.0), ends[1] + [2.0, 0.0])[1:])))
    assert not discs.fits[0] and discs.tells[0]


def test_a_body_whose_arm_stands_out_is_no_disc_and_tells():
    # A body 0.3 m wide, and an arm that reaches 0.4 m towards the scanner beside it.
    discs = find(np.concatenate((arc((2.0, 0.0), 0.15), line((1.95, 0.17), (1.55, 0.17)))))
    assert not discs.fits[0] and discs.tells[0]


def test_what_is_wider_than_anybody_is_no_disc():
    discs = find(arc((3.0, 0.0), 0.5), arc((3.0, 0.0), 0.6))
    assert discs.fits.tolist() == [True, False]
    assert discs.tells.tolist() == [True, True]


def test_too_few_beams_are_neither_a_disc_nor_none():
    whole = arc((2.0, 0.0), 0.3)
    four, five = (whole[np.linspace(0, len(whole) - 1, count).astype(int)] for count in (4, 5))
    discs = find(four, five)
    assert discs.fits.tolist() == [False, True]
    assert discs.tells.tolist() == [False, True]


def test_what_is_not_wide_is_not_tried_and_lies_behind_its_front():
    thing = arc((2.0, 0.0), 0.3)
    discs = find(thing, arc((0.0, 2.0), 0.3), wide=[False, True])
    assert discs.fits.tolist() == discs.tells.tolist() == [False, True]
    # Half as wide as it looks; its middle pi / 4 of that behind the mean of its beams.
    half = 0.5 * (np.ptp(thing[:, 1]) + STEP * thing[:, 0].mean())
    assert discs.radius[0] == pytest.approx(half, abs=1e-4)
    np.testing.assert_allclose(
        discs.centre[0], thing.mean(axis=0) + [np.pi / 4.0 * half, 0.0], atol=1e-4)
    # Were it larger, nothing says that its centre would be elsewhere.
    assert not discs.pull[0].any()


def test_nothing_is_found_among_nothing():
    for discs in (find(arc((2.0, 0.0), 0.3), chosen=np.empty(0, int)),
                  find(arc((2.0, 0.0), 0.3), wide=False)):
        assert not discs.fits.any() and not discs.tells.any()


THINGS = (arc((2.0, 0.0), 0.3), line((-0.2, 1.5), (0.2, 1.5)), arc((-1.0, 1.0), 0.2),
          arc((0.5, -2.0), 0.4, -0.9, 0.4))


def assert_same(some, others, tolerance=1e-9):
    for name in ('centre', 'radius', 'pull', 'doubt'):
        np.testing.assert_allclose(getattr(some, name), getattr(others, name), atol=tolerance)
    assert some.fits.tolist() == others.fits.tolist()
    assert some.tells.tolist() == others.tells.tolist()


@pytest.mark.parametrize('which', range(len(THINGS)))
def test_what_else_is_there_makes_no_difference(which):
    assert_same(find(*THINGS, chosen=[which]), find(THINGS[which]))
    discs = find(*THINGS)
    np.testing.assert_allclose(discs.centre[which], find(THINGS[which]).centre[0], atol=1e-9)
    assert discs.radius[which] == pytest.approx(find(THINGS[which]).radius[0])


def test_the_order_of_the_beams_makes_no_difference(rng):
    mix = rng.permutation(sum(len(thing) for thing in THINGS))
    assert_same(find(*THINGS, mix=mix), find(*THINGS))


def test_the_clusters_are_told_in_the_order_they_were_chosen():
    discs = find(*THINGS, chosen=[3, 0, 2], wide=[True, False, True])
    assert discs.fits.tolist() == [True, False, True]
    assert_same(find(THINGS[3], THINGS[0], THINGS[2], wide=[True, False, True]), discs)


@pytest.mark.parametrize('turn', [0.5, 2.0, -1.3])
def test_discs_turn_and_move_with_the_frame(turn):
    cosine, sine, shift = np.cos(turn), np.sin(turn), np.array([3.0, -5.0])
    rotation = np.array([[cosine, sine], [-sine, cosine]])      # of rows, from the right
    before = find(*THINGS)
    after = find(*(thing @ rotation + shift for thing in THINGS), origin=shift)
    # A step is bounded along either axis, which the flat one feels: by a few millimetres.
    for which, tolerance in (([0, 2, 3], 1e-6), ([1], 0.005)):
        np.testing.assert_allclose(
            after.centre[which], before.centre[which] @ rotation + shift, atol=tolerance)
        np.testing.assert_allclose(
            after.pull[which], before.pull[which] @ rotation, atol=2.0 * tolerance)
        np.testing.assert_allclose(after.radius[which], before.radius[which], atol=tolerance)
        np.testing.assert_allclose(after.doubt[which], before.doubt[which], atol=tolerance)
    assert after.fits.tolist() == before.fits.tolist()
    assert after.tells.tolist() == before.tells.tolist()


def test_flatter_arcs_say_less_of_their_radius():
    doubt = find(*(arc((2.0, 0.0), 0.3, -share, share) for share in (1.0, 0.8, 0.5))).doubt
    assert 0.0 < doubt[0] < doubt[1] < doubt[2] < 0.1


def test_a_larger_disc_has_its_centre_further_from_the_scanner():
    discs = find(arc((2.0, 0.0), 0.3, -0.6, 0.6), arc((0.0, -2.0), 0.3, -0.6, 0.6))
    both = np.array([1, 0])
    same = discs.centre_for(both, discs.radius[both])
    np.testing.assert_allclose(same, discs.centre[both])
    # The front stays where it is seen: the centre moves by a little more than the radius.
    away = discs.centre_for(both, discs.radius[both] + 0.05) - same
    np.testing.assert_allclose(away, [[0.0, -0.053], [0.053, 0.0]], atol=2e-3)
    # The arc alone puts a disc of 0.3 m too near; told its radius, it comes back.
    assert miss(discs.centre[0], (2.0, 0.0)) > 0.03
    told = discs.centre_for(both, np.array([0.3, 0.3]))
    np.testing.assert_allclose(told, [[0.0, -2.0], [2.0, 0.0]], atol=2e-3)


def follow(table, discs, single=True, elapsed=0.1, row=0):
    """Correct a row by the first of the Discs; returns whether it lies on the track's disc."""
    return follow_discs(table, np.array([row]), discs, np.array([0]), np.array([single]),
                        np.array([elapsed]), SETTINGS)[0]


def disc(radius=0.3, doubt=0.02, fits=True, tells=True):
    return make_discs([[2.0, 0.0]], radius, doubt=doubt, fits=fits, tells=tells)


def test_the_first_disc_sets_the_radius():
    table = make_table([[2.0, 0.0], [5.0, 0.0]], roundness=0.5)
    assert follow(table, disc(0.27))
    assert table.disc.tolist() == [pytest.approx(0.27), 0.0]
    assert table.disc_variance.tolist() == [pytest.approx(0.02 ** 2), 0.0]
    assert table.roundness.tolist() == [pytest.approx(0.6), 0.5]     # 0.2 of what is missing


def test_what_is_no_disc_sets_no_radius():
    table = make_table([[2.0, 0.0]], roundness=0.5)
    assert not follow(table, disc(fits=False))
    assert table.disc[0] == 0.0


def test_two_radii_known_as_well_meet_halfway():
    table = make_table([[2.0, 0.0]], disc=0.3, disc_variance=0.02 ** 2)
    assert follow(table, disc(0.34), elapsed=0.0)
    assert table.disc[0] == pytest.approx(0.32)
    assert table.disc_variance[0] == pytest.approx(0.02 ** 2 / 2.0)


def test_radii_that_agree_converge(rng):
    table = make_table([[2.0, 0.0]], roundness=0.5)
    variances, radii = [], []
    for _ in range(60):
        follow(table, disc(0.3 + 0.01 * rng.standard_normal()))
        variances.append(table.disc_variance[0])
        radii.append(table.disc[0])
    assert np.all(np.diff(variances) < 0.0)
    # q = 0.02^2 * 0.1 s are added each time to p, of r = 0.02^2: p^2 + q p = q r, p = 1.08e-4.
    assert variances[-1] == pytest.approx(1.081e-4, rel=1e-3)
    assert np.abs(np.array(radii[20:]) - 0.3).max() < 0.01


@pytest.mark.parametrize('jump, within', [(2.4, True), (-2.4, True), (2.6, False), (-2.6, False)])
def test_a_radius_agrees_within_two_and_a_half_standard_deviations(jump, within):
    # 0.02 m of the track, 0.02 m of drift in a second, 0.03 m of the arc.
    deviation = np.sqrt(0.02 ** 2 + 0.02 ** 2 + 0.03 ** 2)
    table = make_table([[2.0, 0.0]], disc=0.3, disc_variance=0.02 ** 2)
    found = follow(table, disc(0.3 + jump * deviation, doubt=0.03), elapsed=1.0)
    assert found == within
    assert (table.disc[0] != 0.3) == within


@pytest.mark.parametrize('seen, single', [
    (disc(0.45), True), (disc(fits=False), True), (disc(), False), (disc(tells=False), False)])
def test_another_disc_or_none_or_two_clusters_speak_against_a_disc(seen, single):
    table = make_table([[2.0, 0.0]], disc=0.3, disc_variance=0.01 ** 2, roundness=0.9)
    assert not follow(table, seen, single)
    assert table.roundness[0] == pytest.approx(0.9 * 0.8)
    assert table.disc[0] == 0.3
    assert table.disc_variance[0] == pytest.approx(0.01 ** 2 + 0.02 ** 2 * 0.1)


@pytest.mark.parametrize('seen', [disc(tells=False), disc(0.45, tells=False),
                                  disc(fits=False, tells=False)])
def test_what_does_not_tell_leaves_roundness_alone(seen):
    table = make_table([[2.0, 0.0]], disc=0.3, disc_variance=0.01 ** 2, roundness=0.6)
    for _ in range(10):
        follow(table, seen)
    assert table.roundness[0] == 0.6


def test_a_disc_is_proved_in_about_half_a_second():
    table = TrackTable()
    table.add(np.array([[2.0, 0.0]]), np.array([0.3]), np.zeros(1), 0.0, SETTINGS)
    solid = []
    for _ in range(6):
        follow(table, disc())
        solid.append(bool(table.is_solid(SETTINGS)[0]))
    # 0.5, then 0.6, 0.68, 0.74 and 0.80.
    assert solid == [False, False, False, True, True, True]
    # Two scans that show none leave 0.87 * 0.8 * 0.8 = 0.56.
    for _ in range(2):
        follow(table, disc(fits=False))
    assert not table.is_solid(SETTINGS)[0]


def test_a_long_gap_is_worth_no_more_than_half_a_second():
    table = make_table([[2.0, 0.0]], roundness=0.2)
    follow(table, disc(), elapsed=1.2)
    assert table.roundness[0] == 1.0


def test_each_track_is_corrected_by_its_own_disc():
    table = make_table(np.zeros((3, 2)), roundness=0.5)
    discs = make_discs(np.zeros((2, 2)), [0.2, 0.4], fits=True)
    found = follow_discs(table, np.array([2, 0]), discs, np.array([0, 1]),
                         np.array([True, True]), np.array([0.1, 0.2]), SETTINGS)
    assert found.tolist() == [True, True]
    np.testing.assert_allclose(table.disc, [0.4, 0.0, 0.2])
    np.testing.assert_allclose(table.roundness, [0.7, 0.5, 0.6])
