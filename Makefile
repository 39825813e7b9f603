# `make help` explains every target. Each target does its own set-up.
PYTHON ?= python3
VENV := .venv
READY := $(VENV)/.ready
TESTABLE := $(VENV)/.testable
RUN := $(VENV)/bin/python -m

.PHONY: help setup collect train plan evaluate palletize test test-all regression bench-parts bench-collect bench-train bench-plan check format clean
.DEFAULT_GOAL := help

help: ## Explain the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/  make \1\t\2/' | expand -t 22

setup: $(READY) ## Virtual environment in .venv with pinned packages, and a Vulkan driver

$(READY): pyproject.toml .ci/constraints.txt .ci/setup
	PYTHON=$(PYTHON) .ci/setup
	@touch $@

# Tests need what collecting and planning do without: [cad] (700 MB), Ray, the drivers, and a browser (100 MB).
$(TESTABLE): pyproject.toml .ci/constraints.txt .ci/setup
	PYTHON=$(PYTHON) EXTRAS=dev,cad,cluster,franka BROWSER=yes .ci/setup
	@touch $@ $(READY)

collect: $(READY) ## Collect the demo dataset into data/demo (the main job; resumes)
	$(RUN) mskgrasp.collect --config configs/collect/demo.yaml

train: $(READY) ## Train both networks on data/demo into models/demo
	$(RUN) mskgrasp.train --data data/demo --out models/demo

plan: $(READY) ## Plan a grasp in the simulated cell
	$(RUN) mskgrasp.plan --out out/plan

evaluate: $(READY) ## Plan and execute grasps in the simulated cell
	$(RUN) mskgrasp.evaluate --parts test --n-parts 10 --trials 2 --out out/evaluate

palletize: $(READY) ## Grasp parts, correct by the predicted displacement and place them
	$(RUN) mskgrasp.palletize --parts test --n-parts 6 --trials 2 --out out/palletize

# Two at once: robots that are simulated in real time lose their drivers on a machine that is busier.
test: $(TESTABLE) ## Run the tests
	$(RUN) pytest -n 2 --dist loadfile --no-loadscope-reorder --durations 15

test-all: $(TESTABLE) ## The same and the slow ones: every family, both drivers' faults, 20 kills
	MSKGRASP_FAMILIES=99 MSKGRASP_KILLS=10 $(RUN) pytest -n 2 --dist loadfile --no-loadscope-reorder \
		--durations 15 -m "slow or not slow"

# From scratch: results of an earlier state of the code must not count.
regression: $(READY) ## Run the loop over a fixed set and print what has changed (ARGS=--store keeps it)
	rm -rf out/regression
	$(RUN) tests.sim_in_the_loop.regression --workers 2 $(ARGS)

bench-parts: $(TESTABLE) ## Seconds to make a part, by family and stage
	$(RUN) tests.benchmarks.build_parts

bench-collect: $(TESTABLE) ## Grasps/s of the collector beside plain ManiSkill and raw SAPIEN
	$(RUN) tests.benchmarks.collect_speed

bench-train: $(TESTABLE) ## Samples/s of training, our network beside the paper's
	$(RUN) tests.benchmarks.train_speed

bench-plan: $(TESTABLE) ## Milliseconds of a plan, our network beside the paper's
	$(RUN) tests.benchmarks.plan_speed

check: $(TESTABLE) ## Check style, types and the layers of imports
	$(RUN) ruff format --check .
	$(RUN) ruff check .
	$(VENV)/bin/pyright
	$(VENV)/bin/lint-imports

format: $(READY) ## Format the code
	$(RUN) ruff format .
	$(RUN) ruff check --fix .

clean: ## Remove the virtual environment and caches (data, models and out stay)
	rm -rf $(VENV) .pytest_cache .ruff_cache .hypothesis .import_linter_cache *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
