# What people type. Needs python3 >= 3.11 with venv, make and a package index; everything lands in $(VENV).
# Paths are relative on purpose: the tree may lie in a directory with a space in its name.

PYTHON ?= python3
VENV   ?= .venv
JOBS   ?= auto
UV     ?= uv
ARCH   ?= $(shell dpkg --print-architecture 2>/dev/null || echo unknown)
CASES  ?= 100000
SECONDS ?= 3600

PY      = $(VENV)/bin/python
INSTALL = $(PY) -m pip install --quiet --disable-pip-version-check --no-input
COMPILE = $(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url
SOURCES = gatewayd tests

# Tests start hundreds of processes and collect thousands of tests: let nobody's environment make each compile it all anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo test quick setup dev lint format types check docs-check generated unit-checks ci bench fuzz soak deb deb-check image dist dist-check \
	install lock install-hook clean

help: ## Show this list
	@echo "make TARGET, where TARGET is one of:"
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  \1|\2/p' Makefile | awk -F'|' '{ printf "%-14s %s\n", $$1, $$2 }'

demo: $(VENV)/.runtime ## Set up, then run simulator, gateway and a small PLC program together (ARGS="--seconds 20")
	$(PY) -m gatewayd demo $(ARGS)

test: $(VENV)/.dev ## Set up, then pass the tests (ARGS="tests/core -x")
	$(PY) -m pytest -n $(JOBS) --dist worksteal $(ARGS)

quick: $(VENV)/.dev ## Pass the tests that are not slow: no kernel, no browser, few processes (ARGS="tests/core -x")
	$(PY) -m pytest -n $(JOBS) --dist worksteal -m "not slow" $(ARGS)

setup: $(VENV)/.runtime ## Set up what the daemon needs
dev: $(VENV)/.dev ## Set up what developers need

lint: $(VENV)/.dev ## Lint and check the format
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .

format: $(VENV)/.dev ## Format the code and mend what ruff can mend
	$(PY) -m ruff check --fix-only .
	$(PY) -m ruff format .

types: $(VENV)/.dev ## Check the types (mypy, strict)
	$(PY) -m mypy

check: $(VENV)/.runtime ## Check the shipped mappings
	$(PY) -m gatewayd check --strict mappings/*.yaml

docs-check: $(VENV)/.dev ## Check links, commands and generated parts of docs/
	$(PY) -m pytest tests/test_docs.py tests/docs $(ARGS)

generated: $(VENV)/.dev ## Make what is generated anew: schema, rule catalogue, parts of docs/
	$(PY) -m gatewayd.mapping.schema > mappings/schema.json.new && mv mappings/schema.json.new mappings/schema.json
	$(PY) -m gatewayd.mapping.rules.catalogue docs/reference
	$(PY) -m tests.docs
	$(PY) -m tests.rtde.api.test_sample_fields

unit-checks: $(VENV)/.dev ## Let systemd judge the units: no mistake, and little that the service may do
	$(PY) -m pytest tests/systemd/test_units.py $(ARGS)

ci: ## Everything the project asks of a commit, in a clean clone of HEAD
	.ci/run

bench: $(VENV)/.dev ## Measure, and print the figures as ratios (ARGS="modbus latency")
	$(PY) -m tests.benchmarks $(ARGS)

deb: $(VENV)/.runtime ## Build the Debian package of this tree into dist/ (ARCH="amd64 arm64 armhf"; this machine's by default)
	@for arch in $(ARCH); do packaging/deb dist $(PY) "$$arch" || exit 1; done; ls -sh dist/*.deb

deb-check: deb ## Judge it (lintian), try it in trees of Debian 12, 13 (UBUNTU=mirror: 24.04 too), upgrade one (as root; ARCH=...)
	$(PY) packaging/check_deb.py dist/*.deb
	lintian --allow-root --fail-on error,warning dist/*.deb
	for package in dist/*.deb; do packaging/check-trees "$$package" || exit 1; done

image: deb ## Build a container image of it into dist/, of Debian's packages alone (as root; needs mmdebstrap and buildah)
	packaging/image dist/gatewayd_*_$$(dpkg --print-architecture).deb

dist: $(VENV)/.runtime ## Build wheel and sdist into dist/
	@mkdir -p dist && rm -f dist/*.whl dist/*.tar.gz
	$(PY) -c 'import flit_core.buildapi as build; build.build_wheel("dist"), build.build_sdist("dist")'
	@chmod 644 dist/*.whl

dist-check: dist $(VENV)-release/.made ## ... and let twine judge what a registry would be given
	$(VENV)-release/bin/twine check --strict dist/*.whl dist/*.tar.gz

install: $(VENV)/.runtime ## Install as the package would, below DESTDIR (as root; see docs/howto/install.md)
	packaging/install "$(DESTDIR)" $(PY)

fuzz: $(VENV)/.dev ## Try the parsers and the running daemon with 100,000 hostile cases (CASES=1000000)
	GATEWAYD_FUZZ_CASES=$(CASES) $(PY) -m pytest --timeout 1800 tests/e2e/test_hostile.py tests/links/modbus_server/test_fuzz.py tests/rtde $(ARGS)

soak: $(VENV)/.dev ## Torment the running daemon for an hour, from a seed (SECONDS=300 ARGS="--seed 7 --speed fast")
	$(PY) -m tests.soak --seconds $(SECONDS) $(ARGS)

lock: ## Pin and hash the newest packages that pyproject.toml allows (needs uv)
	$(COMPILE) --upgrade --custom-compile-command "make lock" pyproject.toml --group build -o requirements.lock
	$(COMPILE) --upgrade --custom-compile-command "make lock" pyproject.toml --group dev -c requirements.lock -o requirements-dev.lock
	$(COMPILE) --upgrade --custom-compile-command "make lock" --group release -c requirements.lock -o requirements-release.lock

install-hook: ## Let git run lint and types before each commit
	printf '#!/bin/sh\nexec make --no-print-directory lint types\n' > "$$(git rev-parse --git-path hooks)/pre-commit"
	chmod +x "$$(git rev-parse --git-path hooks)/pre-commit"

clean: ## Remove everything that make made
	rm -rf -- "$(VENV)" "$(VENV)-release" build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis

# The stamps make a second run start at once. requirements-dev.lock contains requirements.lock, version by version.

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "gatewayd needs Python 3.11 or newer; this is " + sys.version.split()[0] + ". Name another one: make PYTHON=python3.12 ...")'
	$(PYTHON) -m venv "$(VENV)"
	@touch "$@"

$(VENV)/.runtime: $(VENV)/.made requirements.lock pyproject.toml
	$(INSTALL) --require-hashes -r requirements.lock
	$(INSTALL) --no-deps --no-build-isolation --editable .
	@touch "$@"

$(VENV)/.dev: $(VENV)/.made requirements-dev.lock pyproject.toml
	$(INSTALL) --require-hashes -r requirements-dev.lock
	$(INSTALL) --no-deps --no-build-isolation --editable .
	@touch "$(VENV)/.runtime" "$@"

$(VENV)-release/.made: requirements-release.lock
	$(PYTHON) -m venv "$(VENV)-release"
	"$(VENV)-release/bin/python" -m pip install --quiet --disable-pip-version-check --no-input --require-hashes -r $<
	@touch "$@"
