# Every target sets up the virtual environment it needs: a fresh clone runs `make demo` or `make test` at once.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.stamp

.PHONY: setup demo test lint validate stress

setup: $(STAMP)

# torch first: it decides which numpy and which shared libraries the rest meets.
$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed, this is " + sys.version) if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -c constraints.txt torch==2.13.0
	$(BIN)/pip install -c constraints.txt -e '.[dev]'
	touch $@

demo: $(STAMP)
	$(BIN)/iga-nn run poisson seashell --out out/demo --force
	@echo "Look at out/demo/faces.png, distortion.png and error.png; the numbers are in out/demo/report.json."

test: lint
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(STAMP)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

validate: $(STAMP)
	$(BIN)/python examples/validation.py
	$(BIN)/python -m pytest -m slow

# Takes some two minutes a surface; goes on where it was interrupted.
stress: $(STAMP)
	$(BIN)/python examples/benchmarks/stress.py
