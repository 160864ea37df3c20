# make play                     install, and play the default scene; options by ARGS="--scene paper-roll"
# make test                     install, and run every check and the tests of every day; some by TESTS="tests/physics -x"
# make test-long                the tests that are marked long; SLICE=0 ... 4 runs a fifth of them
# make site                     the documentation as a site in build/site, which opens from the disk
# make install                  only make .venv, with every extra
# make lock                     resolve the dependencies of pyproject.toml afresh
# make PYTHON=python3.13 ...    with another Python, 3.11 to 3.14
PYTHON ?= python3
export PYTHON
ARGS ?=
TESTS ?=
BIN := .venv/bin
STAMP := .venv/.installed
DEV_STAMP := .venv/.installed-dev

.PHONY: play test test-long check site install install-dev lock system-play system-test
.DEFAULT_GOAL := play

play: install
	@exec $(BIN)/drumstick up $(ARGS)

# Three passes: what only computes, on every core; what starts real processes, two at a time, since a third would only
# wait on two cores; what measures real time, alone. What took longest is told at the end of each. The byte code of the
# tests is kept, whatever the environment says: three more passes read it.
unexport PYTHONDONTWRITEBYTECODE
PYTEST := $(BIN)/pytest --durations=15 --durations-min=5
# Each core has a worker already: threads of linear algebra would only wait for each other.
ONE_THREAD := OPENBLAS_NUM_THREADS=1
COMPUTING := --ignore tests/system --numprocesses auto --maxprocesses 4 --dist loadfile
PROCESSES := tests/system --numprocesses auto --maxprocesses 2 --dist loadfile
REAL_CLOCK := $(shell grep -rl real_clock tests --include=test_*.py)
test: check
ifdef TESTS
	$(BIN)/pytest $(TESTS)
else
	$(ONE_THREAD) $(PYTEST) $(COMPUTING) -m "not real_clock and not long"
	$(PYTEST) $(PROCESSES) -m "not real_clock and not long"
	$(PYTEST) $(REAL_CLOCK) -m "real_clock and not long"
endif

# pytest ends with 5 when a pass holds no test: a slice may have none of one kind.
SLICE ?= all
test-long: install-dev
	$(ONE_THREAD) $(PYTEST) --slice $(SLICE) $(COMPUTING) -m "long and not real_clock" || test $$? -eq 5
	$(PYTEST) --slice $(SLICE) $(PROCESSES) -m "long and not real_clock" || test $$? -eq 5
	$(PYTEST) --slice $(SLICE) $(REAL_CLOCK) -m "long and real_clock" || test $$? -eq 5

check: install-dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/ty check --quiet
	$(BIN)/pyright --threads 2
	$(BIN)/lint-imports

# A warning stops it: a link that leads nowhere, a page that no list names (docs/project.md).
site: install-dev
	$(BIN)/sphinx-build -W --keep-going -q -E -a -c docs/site -d build/doctrees docs build/site

install: system-play $(STAMP)

install-dev: system-test $(DEV_STAMP)

$(STAMP): requirements.lock pyproject.toml lab/pyproject.toml deploy/install-venv.sh | system-play
	deploy/install-venv.sh requirements.lock
	@touch $@

# The development lock holds everything that the other one does, in the same versions.
$(DEV_STAMP): requirements-dev.lock requirements.lock pyproject.toml lab/pyproject.toml deploy/install-venv.sh | system-test
	deploy/install-venv.sh requirements-dev.lock
	@touch $(STAMP) $@

system-play:
	@deploy/install-system.sh play

system-test:
	@deploy/install-system.sh play test

# uv resolves for every Python and system at once; it comes from the development lock.
COMPILE := $(BIN)/uv pip compile pyproject.toml --quiet --universal --python-version 3.11 --all-extras \
	--generate-hashes --no-emit-index-url --custom-compile-command "make lock"

lock:
	@test -x $(BIN)/uv || $(MAKE) install-dev
	$(COMPILE) --group build --output-file requirements.lock
	$(COMPILE) --group dev --constraints requirements.lock --output-file requirements-dev.lock
