# From a fresh clone every target sets up .venv by itself, once.
PYTHON ?= python3
PY := .venv/bin/python
READY := .venv/.ready
RECORDINGS ?=
PROFILE ?= quick
SUFFIX := $(if $(filter full,$(PROFILE)),_full)

.DEFAULT_GOAL := help
.PHONY: help setup demo hardware-demo real arms consistency blind concealed dirty ablation-optim table-optim fig-trajectories fig-friction fig-margins table-methods table-estimators table-control tables dashboard test test-fresh test-slow test-kill test-launchers test-bounds check docs bench lock clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-14s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(READY)  ## create .venv from requirements.lock (needs Python 3.11 or newer; PYTHON=... chooses one)

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "setup: $(PYTHON) is missing or older than 3.11; give a newer one with PYTHON=python3.12" >&2; exit 1; }
	@test -x $(PY) || $(PYTHON) -m venv .venv
	$(PY) -m pip install --quiet --requirement requirements.lock
	@$(PY) -m wipx.compilation & compilation=$$!; \
	$(PY) -m pip install --quiet torch==2.13.0 lightning==2.6.6 pytorch-lightning==2.6.6 lightning-utilities==0.15.3 torchmetrics==1.9.0 && wait $$compilation
	$(PY) -m pip install --quiet --no-deps --editable .
	@touch $@

demo: $(READY)  ## the whole chain on an emulated testbed, one page (PROFILE=full: as many loads and trials as the paper); RECORDINGS=folder diagnoses that robot instead
	$(PY) -m wipx $(if $(RECORDINGS),task=diagnose "recordings.path='$(RECORDINGS)'",task=pipeline$(SUFFIX))

hardware-demo: $(READY)  ## an emulated robot on a CAN bus: record, diagnose, find what it conceals, balance a payload (under 3 minutes)
	$(PY) -m wipx +experiment=hardware_demo

real: $(READY)  ## diagnose public recordings of real robots blind: the table of docs/real_recordings.md and README's picture
	$(PY) -m wipx +experiment=real_recordings task.page=docs/real_recordings.md
	cp runs/real_recordings/dfki_double/heldout.png docs/images/real_before_after.png

arms: $(READY)  ## diagnose public recordings of three real arms blind: the table of docs/real_arms.md
	$(PY) -m wipx +experiment=real_arms task.page=docs/real_arms.md

consistency: $(READY)  ## diagnose every public rig from one group of runs after the other (PROFILE=full: the table of docs/real_consistency.md)
	$(PY) -m wipx +experiment=real_consistency profile=consistency_$(PROFILE) $(if $(filter full,$(PROFILE)),task.page=docs/real_consistency.md)

blind: $(READY)  ## diagnose 30 fresh robots with hidden physics (PROFILE=full: 300, the table of docs/blind_results.md)
	$(PY) -m wipx +experiment=blind profile=$(PROFILE) $(if $(filter full,$(PROFILE)),task.page=docs/blind_results.md)

concealed:
	@echo "make concealed: the name is make blind" >&2
	@$(MAKE) --no-print-directory blind

dirty: $(READY)  ## diagnose 20 fresh dirty robots (PROFILE=full: 200, the table of docs/dirty_robots.md)
	$(PY) -m wipx +experiment=dirty profile=$(PROFILE) $(if $(filter full,$(PROFILE)),task.page=docs/dirty_robots.md)

ablation-optim: $(READY)  ## compare nine optimizers, five seeds each (PROFILE=full: the paper's budget)
	$(PY) -m wipx +experiment=ablation_optim$(SUFFIX) -m

table-optim: $(READY)  ## table and convergence figure of ablation-optim, run first where it is not finished
	$(PY) -m wipx +experiment=ablation_optim$(SUFFIX) -m
	$(PY) -m wipx task=optimizer_table task.folder=runs/ablation_optim$(SUFFIX) hydra.run.dir=runs/tables/optimizers

fig-trajectories: $(READY)  ## reality gap and trajectories of the paper's five methods
	$(PY) -m wipx +experiment=reality_gap -m
	$(PY) -m wipx task=method_table task.folder=runs/reality_gap hydra.run.dir=runs/tables/methods

table-methods: $(READY)  ## the paper's Table I: an estimator trained in five simulations (PROFILE=full: LSTM, ten seeds)
	$(PY) -m wipx +experiment=table_methods$(SUFFIX) -m
	$(PY) -m wipx task=table_methods task.folder=runs/table_methods$(SUFFIX) hydra.run.dir=runs/tables/table_methods

table-estimators: $(READY)  ## the paper's Table II: estimators and lengths (PROFILE=full: five seeds)
	$(PY) -m wipx +experiment=table_estimators$(SUFFIX) -m
	$(PY) -m wipx task=table_estimators task.folder=runs/table_estimators$(SUFFIX) hydra.run.dir=runs/tables/table_estimators

table-control: $(READY)  ## balancing and tracking under unknown loads: tables, figures, README's animation (PROFILE=full: all scenarios)
	$(PY) -m wipx +experiment=control$(SUFFIX) -m
	$(PY) -m wipx +experiment=control_methods$(SUFFIX) -m
	$(PY) -m wipx task=table_control task.folder=runs/control$(SUFFIX) task.methods=runs/control_methods$(SUFFIX) \
		task.film=docs/images/control.gif hydra.run.dir=runs/tables/control

fig-friction: $(READY)  ## the paper's Fig. 3: its joint model beside Coulomb and viscous friction
	$(PY) -m wipx task=friction_figure hydra.run.dir=runs/tables/friction

fig-margins: $(READY)  ## stability margins of all controllers, and the loads from which they recover
	$(PY) -m wipx +experiment=margins

tables: $(READY)  ## every table and figure, and one page beside the paper's figures (PROFILE=full, LAUNCHER=submitit_slurm, ONLY=methods,control)
	$(PY) -m wipx task=tables$(SUFFIX) $(if $(LAUNCHER),task.launcher=$(LAUNCHER)) $(if $(ONLY),'task.only=[$(ONLY)]') tracking=none hydra.run.dir=runs/tables

dashboard: $(READY)  ## MLflow in a browser: runs, comparisons, files (PORT=5001 for another port)
	$(PY) -m wipx task=dashboard $(if $(PORT),task.port=$(PORT))

# A process of the tests has one core; threads of linear algebra on small matrices would only wait for each other.
ONE_THREAD := OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
# Tests of one file share what is expensive to set up or to compile.
EACH_CORE := -n auto --dist loadfile

test: $(READY)  ## run the tests (without the slow ones)
	$(ONE_THREAD) $(PY) -m pytest -q $(EACH_CORE) -m "not slow"

test-fresh: $(READY)  ## run the tests on fresh random numbers, statistical claims ten times (SEED=N: those of an earlier run)
	$(ONE_THREAD) $(PY) -m pytest -q $(EACH_CORE) -m "not slow" --seed=$(or $(SEED),fresh)

test-slow: $(READY)  ## run the slow tests
	$(PY) -m pytest -q -m "slow and not kill and not launchers"

test-kill: $(READY)  ## disturb a sweep at 20 random moments, start it again, and compare it with an undisturbed one
	$(PY) -m pytest -q -m kill --seed=$(or $(SEED),0)

test-launchers: $(READY)  ## compare the launchers' results (Slurm needs Debian's slurmctld, slurmd, munge; Ray wipx[ray])
	$(PY) -m pytest -q -m launchers -rs

test-bounds: $(READY)  ## run the tests with compiled code that checks its indices (slow)
	$(ONE_THREAD) NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(CURDIR)/runs/bounds $(PY) -m pytest -q $(EACH_CORE) -m "not slow"

check: $(READY)  ## lint, formatting and types
	$(PY) -m ruff check
	$(PY) -m ruff format --check
	$(PY) -m pyright

docs: $(READY)  ## build the site into runs/docs; open runs/docs/index.html
	NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --strict

bench: $(READY)  ## measure speed and memory
	$(PY) benchmarks/run.py

# Pins for every Python from 3.11 on and every platform; kept where they still fit, `UPGRADE=--upgrade` renews them.
lock: $(READY)  ## renew requirements.lock after a change of pyproject.toml
	$(PY) -m uv pip compile --quiet --universal --python-version 3.11 --extra dev --extra mujoco --extra baselines --extra docs --extra import --extra slurm $(UPGRADE) \
		--no-emit-index-url --no-emit-find-links --no-annotate --no-header --output-file requirements.lock pyproject.toml

clean:  ## remove runs/, caches and .venv
	rm -rf runs .venv .pytest_cache .ruff_cache .hypothesis dist build
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
