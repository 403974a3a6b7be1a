# Every task of the project. A bare machine needs Python 3.11 or newer, git and make.
#   make reproduce   the paper, equation by equation        make test    all checks and tests
#   make check       linters, types, layers                 make format  let ruff put the code in order
#   make bench       the benchmarks                         make pins    renew requirements/*.txt
#   make fuzz        the fuzzers for hours                make docs    the documentation as a site
#   make clean       throw away .venv and caches
SHELL := /bin/bash
VENV ?= .venv
BIN := $(VENV)/bin
ANY_PYTHON := python3 python3.13 python3.12 python3.11
# pyright asks on the network for a newer release unless told not to.
export PYRIGHT_PYTHON_IGNORE_WARNINGS := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Empty means unset: each of the hundreds of processes that tests start would else compile the package anew.
export PYTHONDONTWRITEBYTECODE :=

# PYTHON=... overrides the choice; otherwise the first interpreter that is new enough.
define make_venv
	@set -e; chosen=""; \
	for candidate in $(or $(PYTHON),$(ANY_PYTHON)); do \
	  if "$$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then chosen="$$candidate"; break; fi; \
	done; \
	if [ -z "$$chosen" ]; then \
	  echo "ulna needs Python 3.11 or newer; none of these is: $(or $(PYTHON),$(ANY_PYTHON)). Name one: make PYTHON=/path/to/python3" >&2; exit 1; \
	fi; \
	if ! "$$chosen" -c 'import venv, ensurepip' >/dev/null 2>&1; then \
	  echo "$$chosen has no venv module. On Debian and Ubuntu: apt install python3-venv. Or name another: make PYTHON=/path/to/python3" >&2; exit 1; \
	fi; \
	if ! $(BIN)/python -c 'import pip' >/dev/null 2>&1; then \
	  echo "Setting up $(VENV) with $$("$$chosen" --version); the first time takes about a minute."; \
	  "$$chosen" -m venv --clear $(VENV); \
	fi
endef

.PHONY: reproduce test check format fuzz docs release bench pins clean
.DEFAULT_GOAL := test

reproduce: $(VENV)/.base.stamp
	@$(BIN)/ulna reproduce

# Two processes: on two cores half the time; files stay whole, so that what a file prepares is prepared once.
test: check
	@$(BIN)/python -m pytest -n 2 --dist loadfile

check: $(VENV)/.test.stamp
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/pyright
	@$(BIN)/lint-imports --no-cache --no-logo

format: $(VENV)/.test.stamp
	@$(BIN)/ruff check --fix-only .
	@$(BIN)/ruff format .

# The fuzzers, a hundred times as long as in `make test`, from a seed of the day: about three hours.
fuzz: $(VENV)/.test.stamp
	@ULNA_FUZZ=$(or $(TIMES),100) ULNA_FUZZ_SEED=$(or $(SEED),$(shell date +%Y%m%d)) $(BIN)/python -m pytest -n 2 tests/fuzz

# The documentation as a site that opens from its folder: build/site/index.html. ULNA_GALLERY=cart_pole,duffing builds the
# pages of these plants only.
docs: $(VENV)/.test.stamp
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

# The changelog from its fragments, the wheel tried in a fresh environment, a commit and a tag: make release VERSION=0.2.0
release: check
	@$(BIN)/python .ci/release.py "$(VERSION)"

bench: $(VENV)/.test.stamp
	@$(BIN)/python benchmarks/single_run.py
	@$(BIN)/python benchmarks/firmware.py
	@$(BIN)/python benchmarks/continuous_ensemble.py

# CITATION.cff changes with the version, which the installed package tells too.
$(VENV)/.base.stamp: requirements/base.txt pyproject.toml CITATION.cff
	$(make_venv)
	@$(BIN)/python -m pip install --quiet -r requirements/base.txt
	@$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@$(BIN)/python -m compileall -q src  # as pip does for what it copies: half a second of every start
	@touch $@

$(VENV)/.test.stamp: requirements/test.txt $(VENV)/.base.stamp
	@$(BIN)/python -m pip install --quiet -r requirements/test.txt
	@touch $@

# The newest versions that fit pyproject.toml, found in a fresh environment: first what users get, then what tests add.
pins:
	@set -e; fresh=$$(mktemp -d); trap 'rm -rf "$$fresh"' EXIT; \
	$(firstword $(or $(PYTHON),$(ANY_PYTHON))) -m venv "$$fresh/venv"; pip="$$fresh/venv/bin/python -m pip"; \
	$$pip install --quiet --upgrade hatchling editables .; \
	$$pip freeze --exclude ulna | LC_ALL=C sort > "$$fresh/base.txt"; \
	$$pip install --quiet -c "$$fresh/base.txt" '.[dev]'; \
	$$pip freeze --exclude ulna | LC_ALL=C sort > "$$fresh/all.txt"; \
	cp "$$fresh/base.txt" requirements/base.txt; \
	LC_ALL=C comm -13 "$$fresh/base.txt" "$$fresh/all.txt" > requirements/test.txt

clean:
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +
