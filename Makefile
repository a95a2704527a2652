# Every target sets up the virtual environment it needs: a fresh clone runs `make demo` or `make test` at once.
PYTHON ?= python3
BIN := .venv/bin
RUN := .venv/.run
DEV := .venv/.dev
# pip leaves out the bytecode, as most modules are never loaded; Python keeps that of those it loads, whoever forbids it.
unexport PYTHONDONTWRITEBYTECODE
INSTALL := $(BIN)/python -m pip install --no-compile -c constraints.txt

.PHONY: setup setup-dev packages first-kernels kernels bytecode demo docs test suite lint validate stress fuzz audit disturbed

setup: $(RUN)

setup-dev: $(DEV)

# What running needs. An environment that is there is kept. Files that no run loads are removed. The kernels are compiled
# ahead of the first run, which would wait for them: some while pip installs what they do not need.
$(RUN): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed, this is " + sys.version) if sys.version_info < (3, 11) else None'
	test -x $(BIN)/pip || $(PYTHON) -m venv .venv
	$(INSTALL) libigl numba safetensors scipy threadpoolctl
	$(MAKE) --jobs 2 kernels bytecode
	touch $@

# Parts of this set-up.
packages:
	$(INSTALL) -e .
	$(BIN)/python -P .ci/trim.py

first-kernels:
	$(BIN)/python -m iga_nn.compile_kernels growth

kernels: packages
	$(BIN)/python -P -m iga_nn.compile_kernels network

bytecode: packages first-kernels
	$(BIN)/python -P -c 'import iga_nn.cli.commands, jinja2, matplotlib.pyplot, pyvista.plotting, trimesh'

# The development tools and the extras on top of it: pip leaves alone what is there.
$(DEV): $(RUN)
	$(INSTALL) -e '.[dev]'
	touch $@

demo: $(RUN)
	$(BIN)/iga-nn run poisson seashell --out out/demo --force

# The tables in docs/output.md and docs/ways.md, and the site, in docs/_build/html; a warning is an error. Nothing is fetched.
docs: $(DEV)
	$(BIN)/python -P docs/files_table.py
	$(BIN)/python -P docs/ways_table.py
	OMP_NUM_THREADS=1 $(BIN)/python -P -m sphinx -W --keep-going -b html docs docs/_build/html

# Both at once: checkers of code use one core.
test: $(DEV)
	$(MAKE) --jobs 2 lint suite

suite: $(DEV)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

lint: $(DEV)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

# The suite as other processors round: with control points moved by 1e-15, then with plain kernels.
disturbed: $(DEV)
	PYTHONPATH=tests/support OMP_NUM_THREADS=1 $(BIN)/python -m pytest -p disturbed -n 2 --dist loadfile
	NPY_DISABLE_CPU_FEATURES="X86_V3 X86_V4" NUMBA_CPU_NAME=generic OPENBLAS_CORETYPE=Nehalem OMP_NUM_THREADS=1 \
		$(BIN)/python -m pytest -n 2 --dist loadfile

validate: $(DEV)
	$(BIN)/python examples/benchmarks/validation.py
	$(BIN)/python -m pytest -m slow

# Takes some two to ten minutes a surface, where nothing certifies up to 40; goes on where it was interrupted.
stress: $(DEV)
	$(BIN)/python examples/benchmarks/stress.py

fuzz: $(DEV)
	OMP_NUM_THREADS=1 $(BIN)/python tests/support/fuzzing.py --files 100000

# In an environment of its own. --strict: a package that the service does not answer for is a failure, not a success.
audit: $(DEV)
	$(PYTHON) -m venv .venv/audit
	.venv/audit/bin/python -m pip install pip-audit==2.10.1
	.venv/audit/bin/pip-audit --strict --no-deps --disable-pip -r constraints.txt || \
		{ echo "NOT AUDITED: a package has a known vulnerability, or the service could not be asked; the lines above say which"; exit 1; }
