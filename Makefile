# Every target does its own set-up; `make` alone lists them.
VENV := .venv
BIN := $(VENV)/bin
STAMPS := $(VENV)/stamps
# One interpreter for every Cargo call, or the binding would be compiled anew each time.
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
THREADS ?= 2
# The picture is done when either is reached.
DEMO_LIMITS ?= --spp 48 --time 45
# A Debian of its own, with Blender and an X server.
BLENDER_ROOT ?= out/blender_window
# Extra arguments, e.g. `make bench ARGS="--scenes kitchen"`.
ARGS ?=

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help setup build demo test bench docs format clean
.PHONY: lint lint-rust lint-python test-rust test-python test-blender-all ui-test blender-extension

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 18

setup: $(STAMPS)/build ## the virtual environment in .venv

build: $(STAMPS)/usd_plugin ## compile and install; leaves the command at .venv/bin/tyndall
	$(BIN)/maturin develop --release --manifest-path crates/tyndall-py/Cargo.toml

demo: build ## make a cloud and a stage, render them to out/demo.exr and out/demo.png
	$(BIN)/python demo/make_assets.py --out out/demo --images out
	$(BIN)/tyndall render out/demo/demo.usda $(DEMO_LIMITS)

test: lint-rust test-rust build lint-python test-python ## all that .ci/run runs

lint: lint-rust lint-python ## formatting, clippy, ruff, mypy

lint-rust: setup
	cargo fmt --all --check
	cargo clippy --workspace --all-targets -- -D warnings

lint-python: build $(STAMPS)/test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --config-file usd_plugin/pyproject.toml crates/tyndall-py/python/tyndall usd_plugin/tyndall_usd

test-rust: setup
	scripts/cargo_tests

test-python: build $(STAMPS)/blender
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not long" $(ARGS)

test-blender-all: build $(STAMPS)/blender ## every comparison with Cycles, in Blender 4.2, 4.5, 5.0 and 5.2
	rm -rf out/wheel
	$(BIN)/maturin build --release --strip --manifest-path crates/tyndall-py/Cargo.toml --out out/wheel
	scripts/test_blender_all out/wheel/*.whl out/blender $(ARGS)

ui-test: blender-extension ## Blender with a window, installed from the extension; screenshots in out/ui (root)
	scripts/setup_blender_window $(BLENDER_ROOT)
	TYNDALL_BLENDER_ROOT=$(BLENDER_ROOT) $(BIN)/python -m pytest tests/blender/test_window.py $(ARGS)

bench: build $(STAMPS)/bench ## speed and error against time beside Cycles and Mitsuba 3; JSON in out/bench
	scripts/setup_bench
	PYTHONPATH=tests $(BIN)/python tests/bench/run.py --threads $(THREADS) $(ARGS)

blender-extension: build $(STAMPS)/blender ## the Blender add-on with its wheel as out/tyndall-*.zip, validated by Blender's tool
	scripts/build_extension $(BIN)/python out

docs: ## API documentation in target/doc
	cargo doc --workspace --no-deps

format: $(STAMPS)/test ## rewrite all code in the common format
	cargo fmt --all
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean: ## remove everything made here
	rm -rf target out $(VENV)

$(STAMPS)/build: scripts/setup scripts/requirements/build.txt
	scripts/setup $(VENV) scripts/requirements/build.txt
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/test $(STAMPS)/bench $(STAMPS)/blender: $(STAMPS)/%: scripts/requirements/%.txt $(STAMPS)/build
	$(BIN)/python -m pip install --quiet --requirement $<
	@touch $@

$(STAMPS)/usd_plugin: usd_plugin/pyproject.toml $(STAMPS)/build
	$(BIN)/python -m pip install --quiet --no-deps --editable usd_plugin
	@touch $@
