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
Map images (PGM, PPM, PNG) as grey levels and opacity, with broken files refused by name.

Netpbm formats P2, P3, P5, P6 and PNG (ISO/IEC 15948); grey is Rec. 601 luma as in nav2_map_server.
"""

import re
import struct
import zlib

import cv2
import numpy as np

# 400 m x 400 m at 0.05 m; a larger header is a mistake or an attack, not a map.
MOST_PIXELS = 64_000_000
_SIGNATURE = b'\x89PNG\r\n\x1a\n'
# Whatever else a PNG carries (profiles, text, animation) says nothing about the map.
_USED_CHUNKS = (b'IHDR', b'PLTE', b'tRNS', b'IDAT', b'IEND')


class ImageError(ValueError):
    """An image that cannot be read; the message says why, and what to do."""


def decode_image(data):
    """
    Return grey levels (H, W) uint8, row 0 at the top, and opacity likewise or None.

    `data` is the file's content; the format is told from it, never from the file's name.
    Samples of other depths than 8 bits are rescaled. Raises ImageError.
    """
    if not data:
        raise ImageError('the image file is empty; save the map again')
    if data[:2] in (b'P2', b'P3', b'P5', b'P6'):
        pixels = _decode_netpbm(data)
    elif data.startswith(_SIGNATURE):
        pixels = _decode_png(data)
    else:
        raise ImageError('neither PGM, PPM nor PNG data; convert the image to PNG')
    if pixels.ndim == 2:
        return pixels, None
    if pixels.shape[2] == 4:
        return cv2.cvtColor(pixels, cv2.COLOR_BGRA2GRAY), np.ascontiguousarray(pixels[..., 3])
    return cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), None


def _decode_netpbm(data):
    """Return pixels (H, W) or (H, W, 3) uint8, channels in BGR order."""
    header = re.match(rb'P[2356]' + 3 * rb'(?:\s|#[^\n\r]*[\n\r])+(\d{1,9})' + rb'\s', data)
    if header is None:
        raise ImageError('the PGM header is malformed; save the map again')
    width, height, peak = (int(number) for number in header.groups())
    _check_size(width, height)
    if not 0 < peak < 65536:
        raise ImageError(f'the PGM header gives {peak} as white; expected 1 to 65535')
    channels = 3 if data[1:2] in (b'3', b'6') else 1
    count = width * height * channels
    body = data[header.end():]
    samples = _ascii_samples(body) if data[1:2] in (b'2', b'3') else _binary_samples(body, peak)
    if len(samples) < count:
        raise ImageError(
            f'truncated: {len(samples)} of {count} samples are there; copy or save the map again')
    samples = _to_8_bits(samples[:count], peak)
    if channels == 1:
        return samples.reshape(height, width)
    return np.ascontiguousarray(samples.reshape(height, width, 3)[..., ::-1])


def _ascii_samples(body):
    if b'#' in body:
        body = re.sub(rb'#[^\n\r]*', b'', body)
    if body.translate(None, b'0123456789 \t\n\v\f\r'):
        raise ImageError('text other than numbers among the pixels; save the map again')
    return np.fromstring(body, dtype=np.int64, sep=' ')


def _binary_samples(body, peak):
    sample = np.dtype('u1' if peak < 256 else '>u2')
    return np.frombuffer(body[:len(body) - len(body) % sample.itemsize], dtype=sample)


def _to_8_bits(samples, peak):
    if peak == 255 and samples.dtype == np.uint8:
        return samples
    level = np.minimum(samples.astype(np.float64), peak) * (255.0 / peak)
    return np.floor(level + 0.5).astype(np.uint8)


def _decode_png(data):
    """Return pixels (H, W), (H, W, 3) or (H, W, 4) uint8, channels in BGR(A) order."""
    try:
        pixels = cv2.imdecode(np.frombuffer(_used_chunks(data), np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    if pixels is None or not pixels.size:
        raise ImageError('the PNG data are corrupt; copy or save the map again')
    return pixels if pixels.dtype == np.uint8 else _to_8_bits(pixels, 65535)


def _used_chunks(data):
    """Return the PNG with the chunks that matter, each checked against its checksum."""
    kept, position, kind = [_SIGNATURE], len(_SIGNATURE), b''
    while kind != b'IEND':
        length, kind = struct.unpack('>I4s', data[position:position + 8].ljust(8, b'\0'))
        end = position + 12 + length
        if end > len(data):
            raise ImageError('truncated: the PNG has no end; copy or save the map again')
        checksum = struct.pack('>I', zlib.crc32(data[position + 4:end - 4]))
        if data[end - 4:end] != checksum:
            raise ImageError('the PNG data are corrupt (checksum); copy or save the map again')
        if kind == b'IHDR' and length >= 8:
            _check_size(*struct.unpack('>II', data[position + 8:position + 16]))
        if kind in _USED_CHUNKS:
            kept.append(data[position:end])
        position = end
    return b''.join(kept)


def _check_size(width, height):
    if width < 1 or height < 1:
        raise ImageError(f'the image is empty ({width} x {height} pixels); save the map again')
    if width * height > MOST_PIXELS:
        raise ImageError(f'{width} x {height} pixels are more than the {MOST_PIXELS} supported; '
                         'crop the map or lower its resolution')
