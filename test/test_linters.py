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
Style and licence, by ROS's own linters: ament_flake8, ament_pep257, ament_copyright.

ament_copyright has no wheel: without it, its two rules for files are checked here.
"""

import importlib
import importlib.util

import pytest

pytestmark = pytest.mark.linter

HOLDER = '# Copyright 2026 The wallnav_ros authors\n'


@pytest.fixture
def sources(repository):
    """Return the files and folders with Python code of ours, as the linters take them."""
    names = ('wallnav_ros', 'test', 'launch', 'setup.py')
    return [str(repository / name) for name in names if (repository / name).exists()]


@pytest.fixture
def python_files(repository, sources):
    """Return every Python file of `sources`."""
    return [repository / 'setup.py',
            *(path for source in sources for path in repository.joinpath(source).rglob('*.py'))]


@pytest.mark.parametrize('linter', ['ament_flake8', 'ament_pep257'])
def test_a_linter_has_no_complaint(linter, sources):
    lint = importlib.import_module(f'{linter}.main').main

    assert lint(argv=sources) == 0


@pytest.mark.parametrize('linter, source', [
    ('ament_flake8', 'NAME = "double"\n'),
    ('ament_flake8', 'import sys\nimport os\nprint(os, sys)\n'),
    ('ament_pep257', 'def f():\n    """no capital, no full stop"""\n'),
])
def test_a_linter_complains_about_a_bad_file(linter, source, tmp_path):
    (tmp_path / 'bad.py').write_text(source)
    lint = importlib.import_module(f'{linter}.main').main

    assert lint(argv=[str(tmp_path)]) != 0


def test_every_file_opens_with_holder_and_licence(repository, python_files):
    licence = ''.join(
        (repository / 'setup.py').read_text().partition(HOLDER)[2].partition('\n\n')[0])
    others = [repository / 'Makefile', *repository.glob('requirements/*.sh'),
              *repository.glob('.ci/*'), *repository.glob('params/*.yaml')]

    without = [str(path) for path in [*python_files, *others]
               if HOLDER + licence not in path.read_text()[:1000]]

    assert 'Apache License, Version 2.0' in licence
    assert without == []


def test_the_repository_carries_the_licence_and_its_terms_for_contributions(repository):
    assert 'Apache License\n                           Version 2.0, January 2004' in (
        repository / 'LICENSE').read_text()
    assert '5. Submission of Contributions. Unless You explicitly state otherwise,' in (
        repository / 'CONTRIBUTING.md').read_text()


def test_ament_copyright_agrees_where_it_is_installed(repository, sources):
    if importlib.util.find_spec('ament_copyright'):
        lint = importlib.import_module('ament_copyright.main').main
        terms = [str(repository / 'LICENSE'), str(repository / 'CONTRIBUTING.md')]

        assert lint(argv=[*sources, *terms]) == 0
