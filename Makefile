# Every target sets up what it needs: a fresh clone only wants Python 3.11 or newer and a C++ compiler.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
# Python compiles what it imports; pip would compile all sixteen thousand files, for longer than it installs them.
PIP := $(BIN)/pip install --quiet --no-compile
# Some machines forbid that. Then each process, of which the tests start hundreds, compiles 1,300 files anew.
export PYTHONDONTWRITEBYTECODE :=
BUILD_INPUTS := pyproject.toml CMakeLists.txt $(wildcard cpp/*)
# An editable install knows the Python files of its day, so it is named after their list.
FILES := $(shell find partwright -name '*.py' | LC_ALL=C sort | cksum | cut -d' ' -f1)
PACKAGE := .venv/package-$(FILES)
INSTALLED := .venv/installed-$(FILES)
DEMO_SHAPE := examples/shapes/watering_can.ply

LOWEST_TESTS := tests/shapes tests/assembly tests/meshing tests/render tests/cli

.PHONY: setup demo test test-heavy test-commands test-lowest lint types docs page release bench benchmarks guard clean
setup: $(INSTALLED)

$(BIN)/python:
	$(PYTHON) -m venv .venv

# The package alone: what it needs is a fraction of what its tests do.
$(PACKAGE): $(BUILD_INPUTS) | $(BIN)/python
	$(PIP) -e .
	touch $@

# torch first and alone: it is the one big download, and stays when the package is rebuilt.
.venv/torch: | $(BIN)/python
	$(PIP) torch==2.13.0
	touch $@

$(INSTALLED): .venv/torch $(BUILD_INPUTS)
	$(PIP) -e ".[test,dev]"
	touch $(PACKAGE) $@

demo: $(PACKAGE)
	$(BIN)/partwright fit $(DEMO_SHAPE) -o demo-output

# A process a core, so one thread each of PyTorch and BLAS, which spin while they wait: with one a core in every process
# they take each other's, and a file of fits takes up to three times as long. The fits' own threads stay. A file is one
# process's, so that what its tests share is made once; files are begun in the order of tests/conftest.py.
PYTEST := OMP_NUM_THREADS=1 OMP_WAIT_POLICY=PASSIVE $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder
test: setup
	$(PYTEST)

# The tests that are marked heavy: whole fits and trainings, and sweeps of all cases, that repeat in the large what
# quick tests say, and the commands of the documentation. Takes some minutes, so it is not in .ci/run: before a release,
# and after a change to what they try.
test-heavy: setup test-commands
	$(PYTEST) -m heavy

# Every command of the documentation's pages; those of the README are in .ci/run.
test-commands: setup
	$(BIN)/python .ci/readme_commands docs/*.md

# The lowest versions that pyproject.toml declares. Takes some minutes, so it is not in .ci/run: before a
# release, and when a dependency is used in a new way.
test-lowest:
	$(PYTHON) -m venv .venv-lowest
	.venv-lowest/bin/pip install --quiet uv
	.venv-lowest/bin/uv pip install --quiet --python .venv-lowest/bin/python --resolution lowest-direct \
		-e . "pytest>=8.0" "hypothesis>=6.100" "jsonschema>=4.20"
	.venv-lowest/bin/python -m pytest $(LOWEST_TESTS)

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports

types: setup
	$(BIN)/mypy

# The pages and the reference into build/site; a broken link is an error. Fetches nothing.
docs: setup
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

# The page of the studio, from its sources in studio/. Where there is no Node the built one is taken as it is: a test
# compares the sources' hash that it records.
page:
	if command -v npm >/dev/null && (cd studio && npm ci --no-audit --no-fund --silent); then \
		cd studio && npm run --silent build && git diff --exit-code --stat -- ../partwright/export/page.html; \
	else echo "no Node or no registry: the page is not built again"; fi

# What a release uploads, from a clean build, and the wheel of this machine tried where no compiler can be found. Takes
# minutes, so it is not in .ci/run.
release: .venv/release
	rm -rf dist
	$(BIN)/python -m build
	$(BIN)/python release/sbom.py
	rm -rf build/try && $(PYTHON) -m venv build/try
	build/try/bin/pip install --quiet --only-binary :all: dist/*.whl
	CC=false CXX=false build/try/bin/python release/try_wheel.py

.venv/release: pyproject.toml | $(BIN)/python
	$(PIP) build "cyclonedx-python-lib[json-validation]" nanobind packaging
	touch $@

bench: setup
	$(BIN)/python benchmarks/fit.py

# Every table of the documentation: quick ones of our own shapes, or, with FULL=1 DATA=FOLDER, as they are committed.
benchmarks: setup
	$(PIP) -e ".[bench]"
	$(BIN)/python benchmarks/tables.py $(if $(FULL),--full --data $(DATA))

# Quality and relative speed of a few fits against committed references; in .ci/run.
guard: setup
	$(BIN)/python benchmarks/guard.py

clean:
	rm -rf .venv .venv-lowest build dist demo-output .pytest_cache .hypothesis .mypy_cache .ruff_cache
	find partwright tests examples benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
	rm -f partwright/*.so
