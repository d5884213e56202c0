# `make demo` shows WebMap, `make test` tests it, `make help` lists all targets.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.NOTPARALLEL:
.DEFAULT_GOAL := help

# Every path is relative to this file, so that the checkout may be anywhere.
BIN := .venv/bin
PY := $(BIN)/python
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# The tests start hundreds of processes. Without bytecode on disk each of them compiles
# all modules that it imports, which takes longer than the import.
unexport PYTHONDONTWRITEBYTECODE
# Modules of a user's other projects would be imported instead of those in .venv.
unexport PYTHONPATH PYTHONHOME
# npm fails if it cannot write below the home folder.
ifeq ($(shell [ -w "$$HOME" ] && echo yes),)
export HOME := $(CURDIR)/.venv/.home
endif

# Each stamp is in the folder that it marks as complete, and is deleted with it.
MADE := .venv/.made
INSTALLED := .venv/.installed
DEV := .venv/.installed-dev
DOCS := .venv/.installed-docs
NODE := node_modules/.installed

# More tests with a browser at once take as long on two processors. Tests without a
# browser wait for half of their time or more.
JOBS ?= 2
WAITING_JOBS ?= 4
# Beside other parts, test-plain and test-gate use only the time of the processors that
# those leave, so one test may take minutes.
PATIENT := --timeout 600
ARGS ?=
# The file for the outcome of each test, for the summary of "make test".
RESULTS ?=
TO_RESULTS = $(if $(RESULTS),"--results=$(RESULTS)")
# Which tests of a part run: "not thorough" in "make test", the others in "make test-rest".
PICK ?=
PICKED = $(if $(PICK), and ($(PICK)))

## help: list the targets
.PHONY: help
help:
	@sed -n 's/^## /  make /p' Makefile

## demo: install WebMap here and show simulated robots (ARGS="--robots 2 --quiet")
.PHONY: demo
demo: $(INSTALLED)
	@exec $(BIN)/webmap demo $(ARGS)

## test: lint, types, contracts and the tests of every feature and promise, in ten minutes
## test-all: make test, and then make test-rest
## test-rest: what make test leaves out: thorough tests, docs
.PHONY: test test-all test-rest
test: $(DEV) $(NODE)
	@$(PY) tools/run_tests.py test
test-rest: $(DEV) $(DOCS) $(NODE)
	@$(PY) tools/run_tests.py rest
test-all: $(DEV) $(DOCS) $(NODE)
	@$(PY) tools/run_tests.py test rest

## check: lint, types, import contracts, generated files
.PHONY: check
check: lint types contracts

## lint: ruff, codespell, eslint
.PHONY: lint
lint: $(DEV) $(NODE)
	$(BIN)/ruff check --no-cache
	$(BIN)/ruff format --check
	$(BIN)/codespell
	node_modules/.bin/eslint .

## types: mypy --strict on the Python, tsc on the JavaScript
.PHONY: types
types: $(DEV) $(NODE)
	$(BIN)/mypy
	$(BIN)/mypy benchmarks tools
	node_modules/.bin/tsc

## contracts: which room may import which, and whether generated files are up to date
.PHONY: contracts
contracts: $(DEV)
	$(BIN)/lint-imports --no-logo
	$(PY) tools/make_javascript.py --check
	$(PY) tools/make_layers_page.py --check

## generated: write the files that are made from others
.PHONY: generated
generated: $(DEV)
	$(PY) tools/make_javascript.py
	$(PY) tools/make_layers_page.py

## test-fast: the tests that need neither a browser nor a peer nor a quiet machine
.PHONY: test-fast
test-fast: $(DEV)
	$(BIN)/pytest -q -n $(WAITING_JOBS) --dist loadfile -m "not browser and not peer and not serial and not slow and not thorough"

## test-web: the JavaScript that touches no DOM, in Node
.PHONY: test-web
test-web: $(NODE)
	node --test --test-reporter=spec --test-reporter-destination=stdout \
	  $(if $(RESULTS),--test-reporter=./tools/node_results.js "--test-reporter-destination=$(RESULTS)") \
	  $$(find tests -name '*.test.js' | sort)

## test-gate: every branch of the gate, and of all that it imports, is taken by a test
.PHONY: test-gate
# What needs the display too, or numpy, or takes long and takes no branch that the others
# do not take, is not where branches are counted.
GATE_BESIDE := $(addprefix tests/gate/test_gate_,activity.py client.py assist_road.py idle.py machine.py \
  recorded.py schedules.py) \
  $(addprefix tests/ros/test_ros_,image_answer.py incoming.py large.py leaving.py limits.py offload.py \
  offload_parts.py paced.py questions.py renewal.py timing.py unwatched.py work.py)
WITH_GATE := $(filter-out $(GATE_BESIDE),$(wildcard tests/gate/test_*.py tests/base/test_*.py tests/config/test_*.py tests/ros/test_*.py)) \
  tests/ros/foxglove/test_foxglove_protocol.py
test-gate: $(DEV)
	$(PY) tools/pytest_beside.py $(JOBS) $(TO_RESULTS) $(PATIENT) -m "not serial" \
	  --cov --cov-config=tests/gate/coverage.toml --cov-report= $(WITH_GATE)
	$(BIN)/coverage report --rcfile=tests/gate/coverage.toml --fail-under=100

# The parts of pytest besides test-gate; tests that measure time are in the last three.
.PHONY: test-plain test-browser test-motion test-load test-time
test-plain: $(DEV)
	$(PY) tools/pytest_beside.py $(WAITING_JOBS) $(TO_RESULTS) $(PATIENT) -m "not browser and not serial$(PICKED)" \
	  $(addprefix --ignore ,$(WITH_GATE))
WITH_BROWSER := $(shell grep -rl --include='test_*.py' 'mark\.browser' tests | sort)
test-browser: $(DEV) $(NODE)
	$(PY) tools/pytest_beside.py $(JOBS) $(TO_RESULTS) -m "browser and not serial$(PICKED)" $(WITH_BROWSER)
# Tests that measure time wait most of the time, so two files of them run in parallel on
# any machine, the longest first; with three, robots are stopped because the page is late.
# Safety tests allow for the delays of the machine and do not run again; the other tests
# run a second time if they fail. Tests under load run alone.
ALONE := $(wildcard tests/safety/test_*_load.py tests/safety/test_*_soak.py)
LONG = $(ONE_LANE) $(OTHER_LANE)
OF_MOTION = $(LONG) $(filter-out $(LONG) $(ALONE),$(wildcard tests/safety/test_*.py))
OF_TIME := $(sort $(filter-out tests/safety/%,$(shell grep -rl --include='test_*.py' 'mark\.serial' tests)))
TRIALS ?=
test-motion: $(DEV) $(NODE)
	$(if $(TRIALS),WEBMAP_SAFETY_TRIALS=$(TRIALS)) \
	  $(BIN)/pytest -q $(TO_RESULTS) -m "serial$(PICKED)" -n 2 --dist loadfile $(OF_MOTION)
test-load: $(DEV) $(NODE)
	$(BIN)/pytest -q $(TO_RESULTS) -m serial $(ALONE)
test-time: $(DEV) $(NODE)
	$(PY) tools/pytest_beside.py 3 $(TO_RESULTS) -m "serial$(PICKED)" $(OF_TIME)

## test-safety: long tests of the motion guarantees, and the table of figures (TRIALS=20, RESUME=1, LANES=2)
.PHONY: test-safety
RESUME ?=
LANES ?= 1
FIGURES := docs/_build/safety-figures.jsonl
SAFETY := WEBMAP_SAFETY_TRIALS=$(or $(TRIALS),20) WEBMAP_SAFETY_RESUME=$(RESUME) \
  WEBMAP_SAFETY_FIGURES="$(abspath $(FIGURES))" $(BIN)/pytest -v --timeout 3600
ONE_LANE := tests/safety/test_safety_links.py
OTHER_LANE := tests/safety/test_safety_browser.py tests/safety/test_safety_processes.py
test-safety: $(DEV) $(NODE)
	mkdir -p $(dir $(FIGURES))
	[ "$(RESUME)" = 1 ] || rm -f $(FIGURES) $(FIGURES).schedules
	failed=0; \
	if [ "$(LANES)" = 2 ]; then \
	  $(SAFETY) $(ONE_LANE) & one=$$!; \
	  $(SAFETY) $(OTHER_LANE) || failed=1; \
	  wait $$one || failed=1; \
	else \
	  $(SAFETY) $(ONE_LANE) $(OTHER_LANE) || failed=1; \
	fi; \
	$(SAFETY) tests/safety $(addprefix --ignore ,$(ONE_LANE) $(OTHER_LANE)) || failed=1; \
	$(SAFETY) -n $(JOBS) tests/gate/test_gate_machine.py || failed=1; \
	$(PY) tests/safety/safety_figures.py $(FIGURES); exit $$failed

## sbom: what is installed here, with its licences, as CycloneDX in dist/webmap.cdx.json
## pins: write the versions and hashes of all packages to requirements/image.txt
.PHONY: sbom pins
sbom: $(DEV)
	$(PY) tools/supply_chain.py sbom dist/webmap.cdx.json
pins: $(DEV)
	$(PY) tools/supply_chain.py pins

## docs: the documentation, in docs/_build/html
.PHONY: docs
docs: $(DOCS)
	$(BIN)/sphinx-build -n -W --keep-going -q -b html docs docs/_build/html

## bench: measure WebMap beside others, in 15 minutes; see benchmarks/README.md (ARGS="bridge")
.PHONY: bench
bench: $(DEV) $(NODE)
	$(PY) -m benchmarks $(ARGS)

## bench-peers: install NiceGUI, viser and ros2d, which the benchmark "peers" shows beside WebMap
.PHONY: bench-peers
bench-peers: system
	tools/make_venv.sh .venv-peers
	.venv-peers/bin/python -m pip install --quiet --upgrade "pip>=25.1"
	.venv-peers/bin/python -m pip install --quiet --group peers
	npm install --no-save --no-audit --no-fund --loglevel=error --prefix .venv-peers ros2d@0.10.0 easeljs@1.0.2

## bench-quick: a rough look at the cheap benchmarks, in 2 minutes
.PHONY: bench-quick
bench-quick: $(DEV) $(NODE)
	$(PY) -m benchmarks --quick $(ARGS)

## bench-soak: an hour with 50 robots and 20 viewers; memory and ages must not grow (SECONDS=3600)
.PHONY: bench-soak
bench-soak: SECONDS := 3600
bench-soak: $(DEV)
	$(PY) -m benchmarks.soak --seconds $(SECONDS)

## screenshots: contact sheets of every state of the console, in test-results/screenshots
.PHONY: screenshots
screenshots: $(DEV) $(NODE)
	$(PY) tools/contact_sheet.py $(ARGS)

## format: format the Python files with ruff
.PHONY: format
format: $(DEV)
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

## clean: remove what was built here, environments too
.PHONY: clean
clean:
	rm -rf .venv .venv-peers node_modules docs/_build build dist \
	  .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

$(MADE): tools/make_venv.sh
	tools/make_venv.sh .venv
	touch $@

$(INSTALLED): pyproject.toml $(MADE)
	@echo "webmap: installing WebMap and its dependencies into .venv"
	$(PY) -m pip install --quiet --editable .
	touch $@

# pip has dependency groups since version 25.1.
$(DEV): pyproject.toml $(INSTALLED)
	@echo "webmap: installing the dependencies of the checks and tests into .venv"
	$(PY) -m pip install --quiet --upgrade "pip>=25.1"
	$(PY) -m pip install --quiet --group dev
	touch $@

$(DOCS): pyproject.toml $(DEV)
	@echo "webmap: installing the dependencies of the documentation into .venv"
	$(PY) -m pip install --quiet --group docs
	touch $@

# Checked every time: it is quick, and a missing browser is reported at once.
.PHONY: system
system:
	@tools/need_browser_and_node.sh

$(NODE): package.json package-lock.json | system
	npm ci --no-audit --no-fund --loglevel=error
	touch $@
