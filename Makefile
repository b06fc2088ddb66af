# Every target sets up .venv by itself; the stamp is renewed when pyproject.toml changes.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
STUBS := $(VENV)/stubs
PIP := $(BIN)/python -m pip install -qq --disable-pip-version-check

.PHONY: matrix trials coverage lines mutation fuzz release-check demo test lint bench soak docs pictures reproduce clean

demo: $(STAMP)
	@$(BIN)/barberpole demo

test: lint
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2
	@echo "make test: lint and all tests passed"

lint: $(STAMP) $(STUBS)/.installed
	@$(BIN)/ruff check
	@$(BIN)/ruff format --check --quiet || { $(BIN)/ruff format --diff --quiet; echo "run: $(BIN)/ruff format"; exit 1; }
	@$(BIN)/python tests/matrix.py compile
	@$(BIN)/pyright --warnings
	@$(BIN)/pyright --warnings --project firmware/pyrightconfig.json
	@$(BIN)/pyright --warnings --project firmware/driver/pyrightconfig.json
	@$(BIN)/pyright --warnings --project firmware/arrays/pyrightconfig.json

# Every Python from 3.11 to 3.13 that is here, each in an environment of the lock file: ruff, pyright, the quick tests.
matrix: $(STAMP)
	@$(BIN)/python tests/matrix.py

# Time, error and memory beside plain least squares and the peers; build/bench.json keeps them for the next run.
bench: $(STAMP) $(VENV)/.bench
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -m bench -s
	@PYTHONPATH=tests OPENBLAS_NUM_THREADS=1 $(BIN)/python -m bench

# A few hundred logs of an independent truth: what is named, what is missed, what is alarmed falsely.
trials: $(STAMP)
	@PYTHONPATH=tests OPENBLAS_NUM_THREADS=1 $(BIN)/python -m truth.trials

# Intervals of 95 % over 500 logs of every effect, in white and in 1/f noise: half an hour.
coverage: $(STAMP)
	@PYTHONPATH=tests OPENBLAS_NUM_THREADS=1 $(BIN)/python -m truth.coverage

# Which lines the tests run: the host's, the generator's, and the firmware's in MicroPython. A quarter of an hour.
lines: $(STAMP)
	@PYTHONPATH=tests OPENBLAS_NUM_THREADS=1 $(BIN)/python -m lines

# Small faults put into fit, diagnosis, effects and generator, one at a time; how many the tests notice. Half an hour.
mutation: $(STAMP)
	@PYTHONPATH=tests OPENBLAS_NUM_THREADS=1 $(BIN)/python -m mutation

# Ten thousand damaged files of every kind through the command line, then a search guided by coverage over every
# reader: no traceback, no hang, no lost memory. What fails is kept in build/fuzz.
FUZZ_CASES ?= 10000
FUZZ_SEED ?= 1
FUZZ_SECONDS ?= 30
fuzz: $(STAMP) $(VENV)/.fuzz
	@PYTHONPATH=tests OPENBLAS_NUM_THREADS=1 $(BIN)/python -m fuzzing.run --cases $(FUZZ_CASES) --seed $(FUZZ_SEED)
	@PYTHONPATH=tests OPENBLAS_NUM_THREADS=1 $(BIN)/python -m fuzzing.guided --seconds $(FUZZ_SECONDS) --seed $(FUZZ_SEED)

# Thirty days of one emulated board, a power-up every hour: memory, flash, gains, every refused run. Four minutes.
soak: $(STAMP)
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -m soak -s tests/twin/test_soak.py

# Source archive and wheel of what is committed; the wheel in an empty environment, without the repository. Two minutes.
release-check: $(STAMP)
	@$(BIN)/python -m pytest -m 'release or not release' tests/host/test_release.py

docs: $(STAMP)
	@$(BIN)/python -m barberpole.docs host/docs

# Pictures in host/docs, taken by chromium of the pages that the docs' commands write.
pictures: $(STAMP)
	@$(BIN)/python tests/web/pictures.py host/docs/pictures

reproduce: $(STAMP)
	@$(BIN)/python -m barberpole.reproduce host/docs/reproduction.md

clean:
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .hypothesis

$(STAMP): pyproject.toml
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "installing barberpole and its tools into $(VENV) (once; some minutes, and it says nothing meanwhile)"
	@$(PIP) --editable '.[twin,fleet,test]'
	@touch $@

$(VENV)/.bench: $(STAMP)
	@$(PIP) --editable '.[bench]'
	@touch $@

# Without a wheel of atheris for this Python the coverage-guided part says that it is skipped.
$(VENV)/.fuzz: $(STAMP)
	@$(PIP) --only-binary atheris --editable '.[fuzz]' || echo "atheris cannot be installed here"
	@touch $@

# The stubs of MicroPython's modules shadow the standard library, so they live apart from the packages of .venv.
$(STUBS)/.installed: $(STAMP)
	@$(PIP) --upgrade --target $(STUBS) micropython-stm32-pybv11-stubs
	@touch $@
