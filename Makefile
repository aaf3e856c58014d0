# Two commands do everything, their own set-up included: `make demo` and `make test`.

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
NATIVE := $(wildcard firmware/host/*.* firmware/rig_mega/src/core/*.* rig/plant/native/*.* \
	rig/mechanics/fe/native/*.*)

# the matrices here are small: a second BLAS thread only fights with the second test process
export OPENBLAS_NUM_THREADS := 1

.PHONY: demo test setup check docs bench slow clean

demo: $(READY)  ## characterise the default actuator on the virtual bench
	$(BIN)/rig characterise --actuator models/actuators/bellow-bending.yaml

test: $(READY)  ## lint, types, layers and tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(MAKE) -C firmware check
	$(BIN)/python -m pytest -n 2

setup: $(READY)  ## virtual environment with everything in it

$(READY): pyproject.toml setup.py requirements.lock tools/setup.sh $(NATIVE)
	sh tools/setup.sh $(VENV)
	touch $@

bench: $(READY)  ## speed figures, printed as tables
	$(BIN)/python -m tests.bench

docs: $(READY)  ## the documentation, into build/site
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

slow: $(READY)  ## the checks that take minutes
	$(BIN)/python -m pytest -m slow
	HYPOTHESIS_PROFILE=explore $(BIN)/python -m pytest -n 2 -m 'hypothesis and not slow'
	$(MAKE) -C firmware lint coverage

clean:
	rm -rf $(VENV) build dist *.egg-info
