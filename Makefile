# `make help` explains every target. Each target does its own set-up.
PYTHON ?= python3
VENV := .venv
READY := $(VENV)/.ready
TESTABLE := $(VENV)/.testable
DOCUMENTABLE := $(VENV)/.documentable
RUN := $(VENV)/bin/python -m

.PHONY: help setup demo docs collect train plan evaluate palletize test test-all regression bench-parts bench-import bench-collect \
	bench-train bench-plan bench-serve bench-soak check format reference results clean
.DEFAULT_GOAL := help

help: ## Explain the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/  make \1\t\2/' | expand -t 22

setup: $(READY) ## Set up .venv with pinned packages, and a Vulkan driver

$(READY): pyproject.toml .ci/constraints.txt .ci/setup
	PYTHON=$(PYTHON) .ci/setup
	@touch $@

# Tests need what collecting and planning do without: [cad] (700 MB), Ray, drivers, web servers, a browser (100 MB).
$(TESTABLE): pyproject.toml .ci/constraints.txt .ci/setup
	PYTHON=$(PYTHON) EXTRAS=dev,cad,cluster,franka,mujoco,parquet,serve,view BROWSER=yes .ci/setup
	@touch $@ $(READY)

demo: $(READY) ## Plan a grasp, carry it out and film it: out/demo/grasp.gif (less than a minute)
	$(RUN) mskgrasp.demo

# What the extra [docs] names, and nothing else: the site is made without importing the packages.
$(DOCUMENTABLE): .ci/constraints.txt
	[ -x $(VENV)/bin/pip ] || $(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python -m pip --disable-pip-version-check install --quiet --constraint .ci/constraints.txt zensical
	@touch $@

docs: $(DOCUMENTABLE) ## Build the documentation site: build/site/index.html
	$(RUN) tests.docs.build_site

collect: $(READY) ## Collect the demo dataset into data/demo (the main job; resumes)
	$(RUN) mskgrasp.collect --config configs/collect/demo.yaml

train: $(READY) ## Train both networks on data/demo into models/demo
	$(RUN) mskgrasp.train --data data/demo --out models/demo

plan: $(READY) ## Plan one grasp in the simulated cell, without moving
	$(RUN) mskgrasp.plan --out out/plan

evaluate: $(READY) ## Plan and execute grasps of held-out parts in the simulated cell
	$(RUN) mskgrasp.evaluate --parts test --n-parts 10 --trials 2 --out out/evaluate

palletize: $(READY) ## Grasp held-out parts and place them, corrected by the predicted displacement
	$(RUN) mskgrasp.palletize --parts test --n-parts 6 --trials 2 --out out/palletize

# Three processes for two cores: robots that are simulated in real time leave one idle.
test: $(TESTABLE) ## Run the tests
	$(RUN) pytest -n 3 --dist loadfile --no-loadscope-reorder --durations 15

test-all: $(TESTABLE) ## Run the slow tests, too: every family, the faults of both drivers, 50 kills
	MSKGRASP_FAMILIES=99 MSKGRASP_KILLS=10 $(RUN) pytest -n 3 --dist loadfile --no-loadscope-reorder \
		--durations 15 -m "slow or not slow"

# The folder is removed first: results of an earlier state of the code must not count.
regression: $(READY) ## Plan, grasp and place a fixed set, compare with the stored run
	rm -rf out/regression
	$(RUN) tests.sim_in_the_loop.regression --workers 2 $(ARGS)

bench-parts: $(TESTABLE) ## Measure seconds to build a part, by family and stage
	$(RUN) tests.benchmarks.build_parts

bench-import: $(TESTABLE) ## Measure the share of open CAD files that become parts, and seconds a file
	$(RUN) tests.benchmarks.cad_files out/cad_files
	$(RUN) tests.benchmarks.import_parts out/cad_files --speed-up 2

bench-collect: $(TESTABLE) ## Measure grasps/s of the collector, plain ManiSkill and raw SAPIEN
	$(RUN) tests.benchmarks.collect_speed

bench-train: $(TESTABLE) ## Measure samples/s of training, our networks and the paper's
	$(RUN) tests.benchmarks.train_speed

bench-plan: $(TESTABLE) ## Measure milliseconds of a plan, our networks and the paper's
	$(RUN) tests.benchmarks.plan_speed

bench-serve: $(TESTABLE) ## Measure requests/s of the server, and what malformed requests do
	$(RUN) tests.benchmarks.serve_load $(ARGS)

bench-soak: $(READY) ## Plan and grasp for two hours in simulation, measure the growth of memory (ARGS="--minutes 10")
	$(RUN) tests.benchmarks.soak $(ARGS)

check: $(TESTABLE) ## Check style, types and the layers of imports
	$(RUN) ruff format --check .
	$(RUN) ruff check .
	$(VENV)/bin/pyright
	$(VENV)/bin/lint-imports

format: $(READY) ## Format the code
	$(RUN) ruff format .
	$(RUN) ruff check --fix .

reference: $(READY) ## Write docs/reference.md and docs/cell_file.md from docstrings and configurations
	$(RUN) tests.docs.make_reference
	$(RUN) tests.docs.make_cell_file

results: $(READY) ## Render docs/results from stored reports (ARGS="--record NAME" runs a command anew)
	$(RUN) tests.docs.make_results $(ARGS)

clean: ## Remove the virtual environment and caches (data, models and out stay)
	rm -rf $(VENV) build .pytest_cache .ruff_cache .hypothesis .import_linter_cache *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
