# Everything a person does with a checkout. `make` alone lists the targets.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check install --quiet
DATA   ?= proteus-data
TRAINING ?= proteus-training
TESTERS ?= auto
PORT   ?= 8000

export PIP_REQUIRE_VIRTUALENV := 1

.DEFAULT_GOAL := help
.PHONY: help setup page demo serve test check benchmark train-default lock clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(VENV)/.runtime ## create .venv with what the service needs, from the lock file

page: $(VENV)/.runtime ## build the page at /, with Node from a wheel; once for the same sources
	@$(BIN)/python -m service.web --is-built || { \
	    echo "building the page (a minute or so, once)"; \
	    $(PIP) --require-hashes -r requirements/page.txt && $(BIN)/python -m service.web; }

demo: $(VENV)/.runtime ## start everything, load the demo collection, ask; EXIT=1 ends there
	@$(MAKE) --no-print-directory page || echo "the page was not built; everything else works"
	@$(BIN)/proteus demo --data-dir $(DATA) --port $(PORT) $(if $(EXIT),--exit)

serve: $(VENV)/.runtime ## start everything: broker, worker and API as one program
	@$(MAKE) --no-print-directory page || echo "the page was not built; everything else works"
	@$(BIN)/proteus serve --data-dir $(DATA) --port $(PORT)

test: $(VENV)/.dev page ## set up and pass all tests
	$(BIN)/python -m pytest --numprocesses $(TESTERS) --dist loadfile $(PYTEST)

check: $(VENV)/.dev ## lint, types and import contracts
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m service.web --check

benchmark: $(VENV)/.dev ## measure side by side with peers
	$(BIN)/python -m benchmarks

train-default: $(VENV)/.runtime ## train the model that comes with Proteus anew (half an hour on two processors; goes on where it was)
	@$(BIN)/python -m benchmarks.default_model --data-dir $(TRAINING)
	@$(BIN)/python -m benchmarks.windows --cache $(TRAINING)/windows --write

lock: ## resolve the dependencies anew (needs uv on the PATH)
	uv pip compile -q --universal --python-version 3.11 --generate-hashes --no-annotate --no-header \
	    pyproject.toml requirements/build.in -o requirements/runtime.txt
	uv pip compile -q --universal --python-version 3.11 --generate-hashes --no-annotate --no-header \
	    requirements/page.in -o requirements/page.txt
	uv pip compile -q --universal --python-version 3.11 --generate-hashes --no-annotate --no-header \
	    --group dev -c requirements/runtime.txt pyproject.toml requirements/build.in -o requirements/dev.txt

clean: ## remove the environment and all caches, but no data
	rm -rf $(VENV) build dist service/web/dist service/web/node_modules *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo "Proteus needs Python 3.11 or newer; name one with: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@echo "creating $(VENV)"
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.runtime: requirements/runtime.txt pyproject.toml | $(VENV)/bin/python
	@echo "installing what the service needs (hashes checked; a minute or so)"
	@$(PIP) --require-hashes -r requirements/runtime.txt
	@$(PIP) --no-deps --no-build-isolation -e .
	@touch $@

$(VENV)/.dev: requirements/dev.txt $(VENV)/.runtime
	@echo "installing what the tests need"
	@$(PIP) --require-hashes -r requirements/dev.txt
	@touch $@
