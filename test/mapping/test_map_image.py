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
"""Map images: every format decodes to the same grey levels; broken files are named as such."""

import struct
import zlib

import cv2
from hypothesis import given, settings
from hypothesis import strategies as st
from map_files import pgm, png
import numpy as np
import pytest

from wallnav_ros.mapping.map_image import decode_image, ImageError

GREY = np.array([[0, 100, 205], [254, 255, 89]], np.uint8)


def chunk(kind, body):
    return struct.pack('>I', len(body)) + kind + body + struct.pack('>I', zlib.crc32(kind + body))


def png_of_size(width, height):
    header = struct.pack('>IIBBBBB', width, height, 8, 0, 0, 0, 0)
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', header)
            + chunk(b'IDAT', zlib.compress(b'\0\0')) + chunk(b'IEND', b''))


@pytest.mark.parametrize('data', [
    pgm(GREY),
    b'P5 3 2 255 ' + GREY.tobytes(),
    b'P5\n# CREATOR: GIMP\n# two lines\n3 2\n# one more\n255\n' + GREY.tobytes(),
    b'P2\n3 2\n255\n0 100 205\n254 255 89\n',
    b'P2\r\n3 2\r\n255\r\n0 100 205 254 # inside\r\n255 89',
    b'P3\n3 2\n255\n' + b' '.join(b'%d' % v for v in np.repeat(GREY.ravel(), 3)),
    b'P6\n3 2\n255\n' + np.repeat(GREY.ravel(), 3).tobytes(),
    b'P5\n3 2\n65535\n' + (GREY.astype('>u2') * 257).tobytes(),
    png(GREY),
    png(cv2.cvtColor(GREY, cv2.COLOR_GRAY2BGR)),
    png(GREY.astype(np.uint16) * 257),
], ids=['P5', 'P5 one line', 'P5 comments', 'P2', 'P2 comment', 'P3', 'P6', 'P5 16 bit',
        'PNG grey', 'PNG RGB', 'PNG 16 bit'])
def test_every_format_gives_the_same_grey_levels(data):
    grey, opacity = decode_image(data)

    np.testing.assert_array_equal(grey, GREY)
    assert grey.dtype == np.uint8
    assert opacity is None


def test_the_opacity_of_a_png_is_kept_apart():
    opacity = np.array([[255, 254, 0], [255, 255, 7]], np.uint8)

    grey, found = decode_image(png(np.dstack((GREY, GREY, GREY, opacity))))

    np.testing.assert_array_equal(grey, GREY)
    np.testing.assert_array_equal(found, opacity)


@pytest.mark.parametrize('blue, green, red, level', [
    (0, 0, 255, 76),        # 0.299 * 255 = 76.2
    (0, 255, 0, 150),       # 0.587 * 255 = 149.7
    (255, 0, 0, 29)])       # 0.114 * 255 = 29.1
def test_colours_become_their_luma(blue, green, red, level):
    assert decode_image(png(np.uint8([[[blue, green, red]]])))[0] == [[level]]
    assert decode_image(b'P6 1 1 255 ' + bytes([red, green, blue]))[0] == [[level]]


def test_samples_are_rescaled_to_the_white_the_header_names():
    # 3 of 10 is 76.5 of 255, rounded up; what lies beyond white is white.
    np.testing.assert_array_equal(decode_image(b'P2 4 1 10 0 3 10 99')[0], [[0, 77, 255, 255]])


@pytest.mark.parametrize('data, problem', [
    (b'', 'empty'),
    (b'GIF89a', 'neither PGM, PPM nor PNG'),
    (b'P5', 'header'),
    (b'P5\n3 x\n255\n', 'header'),
    (b'P5\n3 2\n0\n' + GREY.tobytes(), '0 as white'),
    (b'P5\n0 2\n255\n', 'empty'),
    (pgm(GREY)[:-1], 'truncated: 5 of 6'),
    (b'P5\n3 2\n65535\n' + bytes(11), 'truncated: 5 of 6'),
    (b'P2\n3 2\n255\n1 2 3', 'truncated: 3 of 6'),
    (b'P2\n3 2\n255\n1 2 3 4 five 6', 'text other than numbers'),
    (b'P2\n3 2\n255\n1 2 -3 4 5 6', 'text other than numbers'),
    (b'P5\n999999999 999999999\n255\n', 'more than'),
    (png(GREY)[:-4], 'truncated'),
    (png(GREY)[:30], 'truncated'),
    (png(GREY)[:8], 'truncated'),
    (png(GREY).replace(b'IDAT', b'IDAX'), 'corrupt'),
    (png_of_size(0, 5), 'empty'),
    (png_of_size(60000, 60000), 'more than'),
    (png_of_size(3, 3), 'corrupt'),
])
def test_a_broken_image_is_refused_with_the_reason(data, problem):
    with pytest.raises(ImageError, match=problem):
        decode_image(data)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(start=st.sampled_from([pgm(GREY), png(GREY), b'P2 3 2 255 1 2 3 4 5 6', b'P6', b'']),
       cut=st.integers(0, 90), noise=st.binary(max_size=60))
def test_any_bytes_give_an_image_or_an_image_error(start, cut, noise):
    data = start[:cut] + noise + start[cut + len(noise):]
    try:
        grey, opacity = decode_image(data)
    except ImageError as error:
        assert '\n' not in str(error)
    else:
        assert grey.dtype == np.uint8 and grey.ndim == 2 and grey.size > 0
        assert opacity is None or opacity.shape == grey.shape
