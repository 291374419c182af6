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
Where the package's own files lie, and how to write a file so that it is never half there.

Assets come from the ament index when installed (REP-122 layout), else from the source tree.
"""

from contextlib import contextmanager
import os
from pathlib import Path
import tempfile

PACKAGE = 'wallnav_ros'


def share_directory():
    """Return the directory that holds params, maps, models and scenarios."""
    source = Path(__file__).resolve().parents[2]
    if (source / 'package.xml').is_file():
        return source
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        share = Path(prefix) / 'share' / PACKAGE
        if prefix and share.is_dir():
            return share
    for parent in Path(__file__).resolve().parents:
        share = parent / 'share' / PACKAGE
        if share.is_dir():
            return share
    raise FileNotFoundError(
        f'the share directory of {PACKAGE} was not found: source the workspace it was built in')


def find_asset(kind, name, suffix):
    """
    Return the path of an asset given by file name or by the short name the package ships it under.

    `kind` is the folder ('models', 'scenarios', 'maps'), `suffix` the extension of short names.
    Raises FileNotFoundError that lists what is shipped.
    """
    path = Path(name)
    if path.is_file():
        return path
    folder = share_directory() / kind
    for shipped in (folder / f'{name}{suffix}', share_directory() / name):
        if shipped.is_file():
            return shipped
    known = ', '.join(sorted(found.stem for found in folder.glob(f'*{suffix}'))) or 'none'
    raise FileNotFoundError(
        f'{name or repr(name)}: no such file, nor one of the shipped {kind} ({known})')


@contextmanager
def errors_of(path):
    """Let a ValueError of the block begin with `path`, which what is wrong was read from."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None


@contextmanager
def atomic_write(path, mode='w', **options):
    """
    Open a temporary file beside `path` that replaces it only when the block ends well.

    A reader, or a run killed half way, sees the old file or the whole new one. A link is
    followed; what is no file, such as /dev/stdout, is written to and stays what it is. Text is
    UTF-8 unless `options`, which are those of `open`, say otherwise.
    """
    if 'b' not in mode:
        options.setdefault('encoding', 'utf-8')
    path = Path(path)
    if path.exists() and not (path.is_file() or path.is_dir()):
        with open(path, mode, **options) as stream:
            yield stream
        return
    path = Path(os.path.realpath(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f'.{path.name}.')
    try:
        with os.fdopen(handle, mode, **options) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
