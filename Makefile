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

# The two commands of a newcomer: `make demo` and `make test`. `make help` lists the rest.

# The scene of the demo, and the seed its crowd is drawn from.
SCENARIO ?= cross_path
CASE ?= mixed
SEED ?= 43
# PYTHON=python3.12 names the interpreter of a new environment; else the first that fits.
PYTHON ?=

VENV := .venv
OLDEST := .venv-oldest
IN_VENV := $(VENV)/bin/python
PYTEST := -m pytest
# The tests of what runs on a robot.
ROBOT_TESTS := $(wildcard $(addprefix test/,world mapping perception policy navigation nodes))
LISTS := $(wildcard requirements/*) setup.py setup.cfg

# A Python with ROS 2 from wheels hands these to its children, and they bind another
# environment's Python to its libraries.
ifdef _ROS_WHEELS_BOOTSTRAP_COMPLETE
unexport LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
endif
export PYTHON
# Plugins of a sourced ROS 2 (launch_testing) do not run under every pytest; the suite needs none.
export PYTEST_DISABLE_PLUGIN_AUTOLOAD = 1
# Matrices are small: BLAS threads only wait for each other where cores are shared.
export OMP_NUM_THREADS = 1
export OPENBLAS_NUM_THREADS = 1

.PHONY: help setup check demo test test-oldest lint clean
.NOTPARALLEL:

help:
	@echo 'make demo    a robot crosses a junction full of people; result in out/demo/'
	@echo '             (SCENARIO=$(SCENARIO) CASE=$(CASE) SEED=$(SEED))'
	@echo 'make test    lint, the nodes on their oldest supported versions, then every test'
	@echo 'make lint    style, docstrings, licence headers, package.xml'
	@echo 'make setup   the environment in $(VENV) alone, as make demo uses it'
	@echo 'make clean   remove the environments, the build and out/demo'
	@echo 'PYTHON=python3.12 chooses the interpreter of a new environment.'

setup: $(VENV)/.demo-installed

check:
	@requirements/install.sh $(VENV) check
	@requirements/install.sh $(OLDEST) check

$(VENV)/.demo-installed: $(LISTS) | check
	requirements/install.sh $(VENV) demo
	@touch $@

$(VENV)/.test-installed: $(LISTS) | check
	requirements/install.sh $(VENV) test
	@touch $@ $(VENV)/.demo-installed

$(OLDEST)/.oldest-installed: $(LISTS) | check
	requirements/install.sh $(OLDEST) oldest
	@touch $@

demo: setup
	$(IN_VENV) -m wallnav_ros.commands.drive --scenario $(SCENARIO) --case $(CASE) \
		--runs 1 --seed $(SEED) --out out/demo --name demo

lint: $(VENV)/.test-installed
	$(VENV)/bin/ruff check .
	$(IN_VENV) $(PYTEST) -q -m linter test

# Where a ROS 2 is sourced there is no such environment: its distribution's versions are the ones.
test-oldest: $(OLDEST)/.oldest-installed
	@if [ -x $(OLDEST)/bin/python ]; then \
		$(OLDEST)/bin/python $(PYTEST) -q -m 'not extras and not linter and not slow' \
			$(ROBOT_TESTS); \
	fi

test: lint test-oldest
	$(IN_VENV) $(PYTEST) --durations=15 -m 'not linter' test

clean:
	rm -rf $(VENV) $(OLDEST) out/demo build install log *.egg-info
	rm -rf .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
