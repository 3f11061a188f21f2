# make demo | test | studies | bounds | bounds-all | fuzz | mutants | licences | install | bench | soak | faults | faults-hours | reference | lint | docs | pictures | package
# Each creates .venv from the lock file by itself.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/pip install --quiet --disable-pip-version-check --no-compile
# On all cores; pip would use one. Where Python may not write bytecode, every process would compile all that it imports.
BYTECODE := $(BIN)/python -W ignore -m compileall -q -j 0 .venv/lib src || true

CHECKED = src tests benchmarks docs/*.py

# Tests that run commands, services or whole studies: the kernels they call are called by the others too.
NO_KERNELS = live autopilot docs soak cli package study reference_outputs fuzz mavlink

.PHONY: install demo test studies bounds bounds-all fuzz mutants licences bench soak faults faults-hours reference lint docs pictures package lock

install: .venv/.test

# The core is what the program itself needs, with the build backend of the editable install.
.venv/.core: requirements-core.lock pyproject.toml
	$(PYTHON) -m venv .venv
	$(PIP) --require-hashes -r requirements-core.lock
	$(PIP) --no-deps --no-build-isolation -e .
	@$(BYTECODE)
	@touch $@

.venv/.test: .venv/.core requirements.lock
	$(PIP) --require-hashes -r requirements.lock
	@$(BYTECODE)
	@touch $@

.venv/.bench: .venv/.test requirements-bench.lock
	$(PIP) --require-hashes -r requirements-bench.lock
	@$(BYTECODE)
	@touch $@

.venv/.docs: .venv/.test requirements-docs.lock
	$(PIP) --require-hashes -r requirements-docs.lock
	@$(BYTECODE)
	@touch $@

demo: .venv/.core
	$(BIN)/steerway demo -o demo

test: .venv/.test
	$(BIN)/python -m pytest -m "not study" --numprocesses logical --dist worksteal

# The tests of the studies, every study whole with one seed, and the statistics over many seeds: an hour.
studies: .venv/.test
	$(BIN)/python -m pytest -m study --numprocesses logical --dist worksteal --timeout 3600

# Every kernel with its indices checked: run by the interpreter, where NumPy checks them, a second of each test that calls
# kernels, and every public name with arrays of the wrong size.
bounds: .venv/.test
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m tests.hostile_arguments --rounds 50
	$(BIN)/python -m pytest -p tests.bounds -p no:timeout --numprocesses logical $(NO_KERNELS:%='--ignore-glob=*/test_*%*')

# The whole of those tests, with checks in the compiled kernels: twenty minutes of processor time.
bounds-all: .venv/.test
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m tests.hostile_arguments --rounds 200
	NUMBA_BOUNDSCHECK=1 $(BIN)/python -m pytest -m "not study" --numprocesses logical --dist worksteal $(NO_KERNELS:%='--ignore-glob=*/test_*%*')

# Mutated inputs to everything that reads what others wrote, and rows of every link to a boat that is steered, in so many
# minutes. The last input of one that ends the process is in ~/.cache/steerway/fuzz.
fuzz: .venv/.test
	STEERWAY_FUZZ=$(or $(MINUTES),15) $(BIN)/python -m pytest --numprocesses logical --timeout 0 -rP tests/test_fuzz.py

# Mutations of core files that the tests have to notice; cosmic-ray is installed beside the locked packages.
mutants: .venv/.test
	$(PIP) cosmic-ray==8.7.0
	$(BIN)/python -m tests.mutants --sample $(or $(SAMPLE),300)

licences: .venv/.test
	$(BIN)/python -m pytest -n0 -v tests/test_docs.py -k licence

bench: .venv/.bench
	$(BIN)/python -m benchmarks

soak: .venv/.test
	$(BIN)/python -m benchmarks.soak

faults: .venv/.test
	$(BIN)/python -m tests.faults

# Sound routes for so many hours on a virtual clock, of which each takes two to five minutes.
faults-hours: .venv/.test
	STEERWAY_SORTIES=$$((9 * $(or $(HOURS),10))) $(BIN)/python -m pytest -m study --numprocesses logical tests/test_integrity.py -k never_reported

# What every estimator, law and study returns on generated input; ONLY=WORD for some of the cases.
reference: .venv/.test
	$(BIN)/python -m tests.reference_outputs $(ONLY)

# The site, with its tutorials run and its links checked: site/index.html.
docs: .venv/.docs
	$(BIN)/python docs/build.py

# The README's pictures: of pages, taken in Chromium, and of its tutorial.
pictures: .venv/.test
	$(BIN)/python docs/pictures.py

# Wheel and sdist in dist/, each tried in an environment of its own.
package: .venv/.core
	.ci/package

lint: .venv/.test
	$(BIN)/ruff check $(CHECKED)
	$(BIN)/ruff format --check $(CHECKED)
	$(BIN)/mypy

lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header --extra test -o requirements.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header --extra develop --extra report -c requirements.lock -o requirements-core.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header --extra test --extra bench -c requirements.lock -o requirements-bench.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header --extra test --extra docs -c requirements.lock -o requirements-docs.lock pyproject.toml
