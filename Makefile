# make demo | test | bounds | install | bench | soak | faults | reference | lint — each creates .venv from the lock file by itself.
PYTHON ?= python3
BIN := .venv/bin

# Tests that run commands, services or whole studies: the kernels they call are called by the others too.
NO_KERNELS = live autopilot desk docs soak cli commands package public_names study studies mission reference_outputs fuzz mavlink campaign

.PHONY: install demo test bounds bench soak faults reference lint lock

install: .venv/.installed

.venv/.installed: requirements.lock pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

.venv/.bench: .venv/.installed requirements-bench.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements-bench.lock
	@touch $@

demo: install
	$(BIN)/steerway demo -o demo

test: install
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile

# Kernels with index checks, compiled into a cache directory of their own: about ten minutes of two cores.
bounds: install
	NUMBA_BOUNDSCHECK=1 $(BIN)/python -m pytest --numprocesses 2 --dist loadfile $(NO_KERNELS:%='--ignore-glob=*/test_*%*')

bench: .venv/.bench
	$(BIN)/python -m benchmarks

soak: install
	$(BIN)/python -m benchmarks.soak

faults: install
	$(BIN)/python -m tests.faults

# What every estimator, law and study returns on generated input; ONLY=WORD for some of the cases.
reference: install
	$(BIN)/python -m tests.reference_outputs $(ONLY)

lint: install
	$(BIN)/ruff check src tests benchmarks
	$(BIN)/ruff format --check src tests benchmarks
	$(BIN)/mypy

lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header --extra test -o requirements.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header --extra test --extra bench -c requirements.lock -o requirements-bench.lock pyproject.toml
