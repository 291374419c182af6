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
Build and install wallnav_ros as an ament_python package.

Layout after REP-122; one folder of the repository per asset kind goes to share/wallnav_ros.
"""

from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = 'wallnav_ros'
NODES = ('policy_node', 'scan_tracker_node', 'map_walls_node', 'simulator_node')
TOOLS = ('extract_walls', 'replay', 'train', 'train_motion', 'evaluate', 'drive', 'benchmark',
         'make_maps', 'score_tracking', 'lab_tests')
ASSETS = ('params', 'maps', 'models', 'scenarios', 'launch', 'rviz')


def asset_files(folder):
    """Return (destination, files) pairs for `folder` and the folders below it."""
    directories = [Path(folder), *sorted(p for p in Path(folder).rglob('*') if p.is_dir())]
    return [
        (f'share/{PACKAGE}/{directory.as_posix()}',
         sorted(p.as_posix() for p in directory.iterdir() if p.is_file()))
        for directory in directories
        if directory.is_dir() and directory.name != '__pycache__'
    ]


setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        *(entry for folder in ASSETS for entry in asset_files(folder)),
    ],
    python_requires='>=3.11',
    # ROS 2 itself comes from apt or from wheels, never through this list.
    install_requires=['setuptools'],
    extras_require={
        'robot': ['numpy>=1.26', 'scipy>=1.11', 'opencv-python-headless>=4.6', 'shapely>=2.0',
                  'PyYAML>=6.0', 'matplotlib>=3.6'],
        'tools': ['pyrvo>=0.4', 'rosbags>=0.11', 'tqdm>=4.60'],
        'learning': ['torch>=2.2', 'gymnasium>=1.0', 'motmetrics>=1.4'],
        'test': ['pytest>=7.4', 'hypothesis>=6.100', 'ruff>=0.6'],
    },
    zip_safe=True,
    maintainer='The wallnav_ros authors',
    maintainer_email='wallnav-ros@noreply.example.com',
    description='Map-aware crowd navigation for ROS 2.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            *(f'{name} = {PACKAGE}.nodes.{name}:main' for name in NODES),
            *(f'{name} = {PACKAGE}.commands.{name}:main' for name in TOOLS),
        ],
    },
)
