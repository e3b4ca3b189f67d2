# Needs Python >= 3.11, make and pip. `make run PYTHON=python3.12` picks another interpreter.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip --quiet --disable-pip-version-check install --no-compile # what is imported is compiled then
USE := $(VENV)/installed
DEV := $(VENV)/installed-dev
DOCS := $(VENV)/installed-docs
LINKED := $(VENV)/linked
CORE := $(VENV)/compiled

.NOTPARALLEL:
.PHONY: help run paper test check bench truth fuzz mutants robust portable core cores lint reference docs codemirror wheel clean

help:
	@echo "make run    simulate the collision avoidance example into results/collision_avoidance"
	@echo "make paper  the paper's evaluation: 6,000 runs and their report, into results/table_1"
	@echo "make test   the quick tests"
	@echo "make portable  every digest under settings that stand for other machines (10 min)"
	@echo "make core   compile the core, or recompile it after a change of its sources"
	@echo "make cores  100,000 random networks: does each core make the same runs? (20 min)"
	@echo "make lint   check style, formatting, portable arithmetic, prose, the order of imports, and types, of JavaScript too if node is there"
	@echo "make check  lint and every test, including the slow ones"
	@echo "make bench  benchmarks against peers, into benchmarks/RESULTS.md (20 min; keep the machine otherwise idle)"
	@echo "make truth  what others have published beside what we find, into benchmarks/TRUTH.md and the site (80 minutes; can be interrupted)"
	@echo "make fuzz   50,000 mutants of valid models and 5,000 hostile inputs: does each soon give a model or a message?"
	@echo "make mutants 200 small changes of our sources: do the quick tests notice at least 90 % of them?"
	@echo "make robust 100,000 problems beyond any scenario: does the solver answer each within its limits?"
	@echo "make reference  regenerate docs/reference.md and models/schema.json from the declarations in the code"
	@echo "make docs   build the site of the documents into site/ (runs every packaged model; 2 min)"
	@echo "make codemirror  bundle the studio's text editor again (needs node and npm)"
	@echo "make wheel  build dist/epicycle-*.whl"
	@echo "make clean  remove everything that these made, except results/"

run: $(USE)
	$(BIN)/epicycle run collision_avoidance --set observers=3 --set disturbance=0.25 --seed 7 --out results/collision_avoidance

paper: $(USE) $(CORE)
	$(BIN)/epicycle study table_1 --out results/table_1
	$(BIN)/epicycle report results/table_1

test: $(DEV) $(CORE)
	$(BIN)/python -m pytest -n 2 -q

check: lint $(CORE)
	$(BIN)/python -m pytest -n 2 -q -m ""

bench: $(DEV) $(CORE)
	$(BIN)/python -m benchmarks.all

truth: $(DEV) $(CORE)
	$(BIN)/python -m benchmarks.truth

fuzz: $(DEV) $(CORE)
	$(BIN)/python -m tests.fuzz.fuzz
	$(BIN)/python -m tests.fuzz.hostile

mutants: $(DEV) $(CORE)
	$(BIN)/python -m tests.mutation

robust: $(DEV) $(CORE)
	$(BIN)/python -m tests.actors.robotics.numerics.robustness
	$(BIN)/python -m tests.actors.robotics.numerics.robustness --gap 0.03

core: $(USE)
	@rm -f $(CORE)
	@$(MAKE) --no-print-directory $(CORE)
	$(BIN)/epicycle --version

cores: $(DEV) $(CORE)
	$(BIN)/python -m tests.engine.cores

portable: $(DEV) $(CORE)
	$(BIN)/python -m tests.portable.portable

lint: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m tests.arithmetic
	$(BIN)/python -m tests.prose
	$(BIN)/python -m tests.layers
	$(BIN)/python -m tests.scripts
	$(BIN)/mypy

reference: $(DEV)
	$(BIN)/python -m tests.test_reference .

docs: $(DOCS)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --config-file website/mkdocs.yml
	@echo "open site/index.html"

codemirror:
	cd website/codemirror && npm ci --no-audit --no-fund && npm run build

wheel: $(DEV)
	rm -rf build dist
	EPICYCLE_BUILD=all $(BIN)/python -m build --wheel
	rm -rf build

clean:
	rm -rf $(VENV) build dist site site-parts epicycle.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis .coverage htmlcov
	rm -rf actors/built website/codemirror/node_modules
	find actors aspects models $(wildcard bridges) $(wildcard ptolemy) runner tests -name __pycache__ -type d -prune -exec rm -rf {} +
	find actors aspects runner \( -name '*.so' -o -name '*.pyd' \) -exec rm -f {} +

# Three stamps on one environment; all become stale when pyproject.toml changes.
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Epicycle needs Python 3.11 or newer: make PYTHON=python3.x")'
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

# mypy cannot follow an editable install to the folders at the root.  It does read a package of stubs, which Python
# ignores: links there let it check the programs of users against the source.
$(LINKED): pyproject.toml | $(BIN)/python
	@site=$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))') && \
	mkdir -p "$$site/epicycle-stubs" && \
	ln -sfn "$(CURDIR)/api/__init__.pyi" "$$site/epicycle-stubs/__init__.pyi" && \
	for folder in actors aspects bridges $(wildcard ptolemy) runner; do ln -sfn "$(CURDIR)/$$folder" "$$site/epicycle-stubs/$$folder"; done
	@touch $@

$(USE): pyproject.toml setup.py | $(BIN)/python $(LINKED)
	@echo "Installing epicycle into $(VENV) (first time only, and when pyproject.toml changes)"
	@$(INSTALL) --editable .
	@touch $@

$(DEV): pyproject.toml setup.py | $(BIN)/python $(LINKED)
	@echo "Installing epicycle[dev] into $(VENV) (first time only, and when pyproject.toml changes)"
	@$(INSTALL) --editable '.[dev]'
	@touch $(USE) $@

# The compiled core, for what makes many runs; where there is no compiler, all goes on in Python.
$(CORE): setup.py actors/compiled.py | $(USE)
	@echo "Compiling the core and the robots' kernels (two minutes, the first time and after a change of their list)"
	@EPICYCLE_BUILD=all $(INSTALL) --editable .
	@$(BIN)/python -m epicycle.actors.robotics.numerics.warm_up
	@touch $@

$(DOCS): pyproject.toml setup.py | $(BIN)/python $(LINKED)
	@echo "Installing epicycle[docs] into $(VENV) (first time only, and when pyproject.toml changes)"
	@$(INSTALL) --editable '.[docs]'
	@touch $(USE) $@
