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
"""Map files and map messages: read as nav2_map_server reads them, or refused in one line."""

import os

from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
from map_files import FIELDS, MISPLACED_MAPS, png, REAL_MAPS, write_map_files
import numpy as np
import pytest
from refusals import refusal_of

from wallnav_ros.mapping.occupancy_map import from_occupancy_grid, load_map, MapError

# Occupied, free and unknown per cent of the whole image.
SHARES = {
    'turtlebot3_world/map.yaml': (0.5, 5.4, 94.1), 'nav2_depot/depot.yaml': (3.2, 96.8, 0.0),
    'nav2_warehouse/warehouse.yaml': (1.8, 84.5, 13.7),
    'willow_0.10/willow-2010-02-18-0.10.yaml': (0.2, 31.7, 68.1),
    'asl_office_j/asl_office_j.yaml': (0.9, 32.6, 66.5),
    'intel_bwi/intel.yaml': (8.9, 57.4, 33.7),
    'mit_stata_basement/stata_basement.yaml': (0.8, 13.8, 85.4),
    'levinelobby/levinelobby.yaml': (82.9, 17.1, 0.0),
    'fetch_3_1_16/3_1_16_localization.yaml': (4.1, 37.5, 58.4),
    'olin_mac_1st_floor/mac_1st_floor_final.yaml': (1.1, 98.9, 0.0),
    'spielberg_track/Spielberg_map.yaml': (0.8, 99.0, 0.1)}


def cells_of(folder, pixels, **fields):
    """Return the cells of a map with one row of `pixels`, as a list."""
    return load_map(write_map_files(folder, [pixels], **fields)).cells[0].tolist()


def refusal(path):
    """Return the message with which the map at `path` is refused."""
    return refusal_of(MapError, load_map, path)


# --- what the pixels mean ---

def test_trinary_cells_follow_the_thresholds(tmp_path):
    # Occupancy 1 - grey / 255: 89 -> 0.651, 90 -> 0.647, 205 -> 0.1961, 206 -> 0.1922.
    assert cells_of(tmp_path, [0, 89, 90, 205, 206, 255]) == [100, 100, -1, -1, 0, 0]


def test_an_occupancy_on_a_threshold_belongs_to_it(tmp_path):
    # 51 / 255 is 0.2 and 204 / 255 is 0.8.
    assert cells_of(tmp_path, [50, 51, 52, 203, 204, 205], negate='1', free_thresh='0.2',
                    occupied_thresh='0.8') == [0, 0, -1, -1, 100, 100]


def test_negate_makes_white_occupied(tmp_path):
    assert cells_of(tmp_path, [0, 128, 255], negate='1') == [0, -1, 100]


def test_scale_spreads_the_greys_between_the_thresholds(tmp_path):
    # From 0 to 1: 191 is 0.251, 127 is 0.502. From 0.2 to 0.6: 127 is 0.302 / 0.4 = 75.5 %.
    assert cells_of(tmp_path, [255, 191, 127, 0], mode='scale', free_thresh='0.0',
                    occupied_thresh='1.0') == [0, 25, 50, 100]
    assert cells_of(tmp_path, [255, 127, 0], mode='scale', free_thresh='0.2',
                    occupied_thresh='0.6') == [0, 75, 100]


def test_raw_values_are_the_cells_themselves_up_to_100(tmp_path):
    assert cells_of(tmp_path, [0, 3, 84, 100, 101, 255], mode='raw') == [0, 3, 84, 100, -1, -1]


@pytest.mark.parametrize('mode, seen, veiled', [
    ('trinary', 100, -1), ('scale', 100, -1), ('raw', 0, 0)])
def test_what_is_not_opaque_is_unknown_unless_raw(tmp_path, mode, seen, veiled):
    data = png(np.uint8([[[0, 0, 0, 255], [0, 0, 0, 254]]]))

    occupancy_map = load_map(write_map_files(tmp_path, data=data, mode=mode))

    assert occupancy_map.cells.tolist() == [[seen, veiled]]


def test_the_lowest_image_row_is_row_0(tmp_path):
    path = write_map_files(tmp_path, [[0, 254, 254], [254, 254, 254]])

    assert load_map(path).cells.tolist() == [[0, 0, 0], [100, 0, 0]]


def test_resolution_and_origin_are_kept(tmp_path):
    occupancy_map = load_map(write_map_files(tmp_path, resolution='0.025',
                                             origin='[-3, 4.5, -1.57]'))

    assert occupancy_map.resolution == 0.025
    assert occupancy_map.origin.tolist() == [-3.0, 4.5, -1.57]


# --- how YAML may be written ---

@pytest.mark.parametrize('field, text', [
    ('resolution', '5e-2'), ('resolution', "'0.05'"), ('resolution', '1'),
    ('negate', 'false'), ('negate', 'no'), ('negate', "'0'"),
    ('mode', 'Trinary'), ('origin', '[1, 2e0, -1.0e-3]'), ('free_thresh', '196e-3')])
def test_spellings_that_nav2_understands_are_understood(tmp_path, field, text):
    assert load_map(write_map_files(tmp_path, **{field: text})).cells[1, 0] == 100


def test_the_image_may_be_given_by_an_absolute_path(tmp_path):
    elsewhere = tmp_path / 'elsewhere'
    elsewhere.mkdir()
    path = write_map_files(elsewhere)
    moved = path.rename(tmp_path / 'map.yaml')
    moved.write_text(moved.read_text().replace('map.pgm', f'{elsewhere}/map.pgm'))

    assert load_map(str(moved)).cells.shape == (2, 2)


# --- what is refused, with field and fix ---

@pytest.mark.parametrize('key', FIELDS)
def test_a_missing_key_is_named(tmp_path, key):
    assert refusal(write_map_files(tmp_path, **{key: None})).startswith(f'{key}: missing; add')


@pytest.mark.parametrize('field, text', [
    ('resolution', '0.0'), ('resolution', '-0.05'), ('resolution', '.nan'), ('resolution', 'inf'),
    ('resolution', 'fine'), ('resolution', 'true'), ('resolution', '[0.05]'),
    ('resolution', '1e300'), ('resolution', '0x' + 'f' * 5000),
    ('origin', '[0.0, 0.0]'), ('origin', '[0, 0, 0, 0]'), ('origin', '[0, 0, .nan]'),
    ('origin', '[0, 0, north]'), ('origin', '0.0'), ('origin', '{x: 0, y: 0, yaw: 0}'),
    ('origin', '[1e9, 0, 0]'), ('negate', '2'), ('negate', '0.0'), ('negate', 'maybe'),
    ('free_thresh', '-0.1'), ('free_thresh', 'low'), ('free_thresh', '.nan'),
    ('free_thresh', '0.65'), ('free_thresh', '0.7'), ('occupied_thresh', '1.1'),
    ('occupied_thresh', '65'), ('mode', 'ternary'), ('mode', '3'), ('image', "''"),
    ('image', '7'), ('image', '[map.pgm]')])
def test_a_wrong_value_is_named_with_what_is_expected(tmp_path, field, text):
    message = refusal(write_map_files(tmp_path, **{field: text}))

    assert message.startswith(f'{field}: ')
    assert 'expected' in message or 'usual values' in message
    assert len(message) < 200


@pytest.mark.parametrize('text, problem', [
    ('', 'not a map YAML'), ('- image: map.pgm\n', 'not a map YAML'),
    ('map.pgm', 'not a map YAML'),
    ('image: [map.pgm\n', 'not valid YAML'), ('image:\tmap.pgm\n\tx: 1', 'not valid YAML'),
    ('a: 1\n---\nb: 2\n', 'not valid YAML'), ('{[1]: 2}', 'not valid YAML'),
    ('image: !!python/object/apply:os.getcwd []', 'not valid YAML'),
    ('[' * 50_000, 'more than 100 lists'), ('stamp: 2001-99-99', 'not valid YAML'),
    ('image: \x01', 'not valid YAML'), ('# ' + 'x' * 200_000, 'too large'),
    ('image: &a map.pgm\nother: *a\n', 'aliases'),
    ('resolution: 0.05\nresolution: 0.1\n', 'given more than once')])
def test_what_is_no_map_yaml_is_refused(tmp_path, text, problem):
    path = tmp_path / 'map.yaml'
    path.write_text(text)

    assert problem in refusal(path)


def test_yaml_that_is_not_text_is_refused(tmp_path):
    path = tmp_path / 'map.yaml'
    path.write_bytes(b'\xff\xfe\x00\xd8')

    assert 'not valid YAML' in refusal(path)


def test_a_missing_yaml_and_a_directory_are_refused(tmp_path):
    assert 'does not exist' in refusal(tmp_path / 'map.yaml')
    assert 'not a regular file' in refusal(tmp_path)


def test_a_pipe_is_refused_instead_of_waited_on(tmp_path):
    path = write_map_files(tmp_path)
    (tmp_path / 'map.pgm').unlink()
    os.mkfifo(tmp_path / 'map.pgm')

    assert 'not a regular file' in refusal(path)


@pytest.mark.parametrize('name, fix', [
    ('lost.pgm', "if 'map.pgm' beside the YAML is meant, write 'image: map.pgm'"),
    ('/nowhere/map.pgm', "if 'map.pgm' beside the YAML is meant, write 'image: map.pgm'"),
    ('/nowhere/lost.png', 'put the image there or correct the path'),
    ('"a\\0b"', 'put the image there or correct the path'),
    ('a' * 5000, 'put the image there or correct the path')])
def test_an_image_that_is_not_there_is_refused_with_what_to_do(tmp_path, name, fix):
    message = refusal(write_map_files(tmp_path, image=name))

    assert message.startswith('image: ')
    assert message.endswith(fix)


@pytest.mark.parametrize('data, problem', [
    (b'', 'empty'), (b'P5 0 0 255 ', 'empty'), (b'P5 9 9 255 x', 'truncated'),
    (b'<svg/>', 'neither')])
def test_an_unreadable_image_is_refused_by_name(tmp_path, data, problem):
    message = refusal(write_map_files(tmp_path, data=data))

    assert message.startswith('image (map.pgm): ')
    assert problem in message


# --- warnings ---

def test_unexplored_grey_that_counts_as_free_is_warned_of(tmp_path):
    pixels = np.full((10, 10), 254)
    pixels[:3], pixels[5, 5] = 205, 0

    warnings = load_map(write_map_files(tmp_path, pixels, free_thresh='0.25')).warnings

    assert len(warnings) == 1
    assert '30.0 % of the map is grey 205' in warnings[0]
    assert 'set free_thresh: 0.196 to keep it unknown' in warnings[0]
    assert not load_map(write_map_files(tmp_path, pixels, free_thresh='0.196')).warnings


def test_the_threshold_a_warning_advises_keeps_the_grey_unknown(tmp_path):
    for grey, advice in ((204, '0.199'), (205, '0.196'), (206, '0.192')):
        pixels = [[0, 254, grey]]
        warned, = load_map(write_map_files(tmp_path, pixels, free_thresh='0.3')).warnings
        assert f'set free_thresh: {advice} ' in warned
        assert cells_of(tmp_path, pixels[0], free_thresh=advice) == [100, 0, -1]


def test_a_little_grey_is_furniture(tmp_path):
    pixels = np.full((20, 20), 254)
    pixels[0, :3], pixels[5, 5] = 205, 0

    assert not load_map(write_map_files(tmp_path, pixels, free_thresh='0.25')).warnings


def test_a_map_without_a_wall_is_warned_of(tmp_path):
    warning, = load_map(write_map_files(tmp_path, [[254, 254]])).warnings

    assert 'no walls' in warning


# --- real maps ---

@pytest.mark.parametrize('name', REAL_MAPS)
def test_a_real_map_is_read(shared_data, name):
    occupancy_map = load_map(shared_data / 'maps' / name)

    cells = occupancy_map.cells
    assert occupancy_map.occupied.any()
    if name in SHARES:
        shares = [(cells == value).mean() * 100.0 for value in (100, 0, -1)]
        np.testing.assert_allclose(shares, SHARES[name], atol=0.051)


@pytest.mark.parametrize('name', MISPLACED_MAPS)
def test_a_real_map_with_its_image_elsewhere_is_refused_with_the_fix(shared_data, name):
    message = refusal(shared_data / 'maps' / name)

    assert message.startswith('image: ')
    assert 'beside the YAML is meant' in message


def test_the_real_maps_with_unexplored_area_made_free_are_warned_of(shared_data):
    warned = {name for name in REAL_MAPS if load_map(shared_data / 'maps' / name).warnings}

    assert warned == {
        'hunav_small_house/small_house.yaml', 'nav2_depot/depot.yaml',
        'nav2_depot/depot_keepout.yaml', 'olin_mac_1st_floor/mac_1st_floor_final.yaml'}


# --- messages ---

def test_a_message_is_read_row_by_row_from_the_lower_left():
    occupancy_map = from_occupancy_grid([0, 100, -1, 64, 65, -7], 3, 2, 0.1, [1.0, 2.0, 0.5])

    assert occupancy_map.cells.tolist() == [[0, 100, -1], [64, 65, -1]]
    assert occupancy_map.occupied.tolist() == [[False, True, False], [False, True, False]]
    assert occupancy_map.origin.tolist() == [1.0, 2.0, 0.5]


@pytest.mark.parametrize('change, field', [
    ({'data': [0] * 5}, 'data'), ({'width': 0, 'data': []}, 'data'),
    ({'resolution': 0.0}, 'resolution'), ({'resolution': np.nan}, 'resolution'),
    ({'origin': [0.0, np.inf, 0.0]}, 'origin')])
def test_a_message_that_cannot_be_used_is_refused(change, field):
    message = {'data': [0] * 6, 'width': 3, 'height': 2, 'resolution': 0.1,
               'origin': [0.0, 0.0, 0.0], **change}

    with pytest.raises(MapError, match=f'^map topic: {field}: '):
        from_occupancy_grid(**message)


# --- anything at all ---

VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=12),
    st.lists(st.floats(), max_size=4),
    st.sampled_from(['map.pgm', '/', '.', '..', '0.05', 'scale', 'raw', '1e-2', '-', '*a', '&a']))


@settings(max_examples=200, deadline=None, derandomize=True,
          suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(fields=st.dictionaries(st.sampled_from([*FIELDS, 'mode']), VALUES, max_size=3),
       tail=st.binary(max_size=20))
def test_any_yaml_gives_a_map_or_a_map_error(tmp_path, fields, tail):
    path = write_map_files(tmp_path, **{
        key: str(value).encode('utf-8', 'replace').decode() for key, value in fields.items()})
    path.write_bytes(path.read_bytes() + tail)
    try:
        occupancy_map = load_map(path)
    except MapError as error:
        assert '\n' not in str(error) and str(path) in str(error)
    else:
        assert occupancy_map.cells.shape == (2, 2)
        assert np.isfinite(occupancy_map.origin).all() and occupancy_map.resolution > 0.0


@settings(max_examples=150, deadline=None, derandomize=True,
          suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.binary(max_size=200))
def test_any_bytes_for_yaml_give_a_map_error(tmp_path, text):
    path = tmp_path / 'map.yaml'
    path.write_bytes(text)

    assert refusal(path)
