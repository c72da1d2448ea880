# Each target first makes .venv from environment.lock, when it is missing or older than the lock.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
MODULE := PYTHONPATH=workflow/scripts $(BIN)/python -m palpate.workflow
SNAKEMAKE := $(BIN)/snakemake --profile workflow/profiles/default
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENCV_FOR_THREADS_NUM=1
VALIDATION = $(SNAKEMAKE) --keep-going --configfile $(RIGS)
PROTOCOLS := $(SNAKEMAKE) --configfile config/protocols.yaml
SAMPLE := $(SNAKEMAKE) --configfile tests/sample/config.yaml
CUT := $(SNAKEMAKE) --configfile tests/cut/config.yaml
# Captures of `make protocols`: config/protocols_lab.yaml.
BONDED := 01 $(addprefix 01-a0,1 2 3 4 5 6 7 8 9) 01-a10 02
PROTOCOL_CAPTURES := $(addprefix glued_block/bumblebee/,$(BONDED)) loose_block/bumblebee/01 \
  $(addprefix bad_bench/bumblebee/,01 01-a01)
# Figures that README.md and docs show, of a full run, of `make bench sections="growth rig"`.
PICTURES := overview growth plan rig_load rig_pivot rig_stiffness
REPORT := --quiet all --report-stylesheet workflow/report/style.css --report

# What follows a run: results $(1), the run's command $(2).
define after
	$(MODULE).resources $(1)
	$(2) $(REPORT) $(1)/report.html
	$(MODULE).closing $(1)
endef

# Of `make truth`: all estimates, and tables beside the lab's own solutions.
TRUTH := $(addprefix results/truth/results/,figures/direct_moduli.png tables/indentation_accuracy.csv)

# Of `make faults`.
kills := 50
# Of `make validation` and `make refit`.
seed := 1
RIGS = validation/$(seed)
ESTIMATES = $(wildcard $(RIGS)/results/*/*/direct.json)

.PHONY: results sample cut truth validation errors refit observations protocols test test-all nightly faults lint bench check lock docs pictures quoted sample-captures \
  own-object own-object-captures slurm-resources corpus mutants audit clean

results: .venv/installed
	$(SNAKEMAKE)
	$(call after,results,$(SNAKEMAKE))

sample: .venv/installed
	$(SAMPLE)
	$(call after,results/sample,$(SAMPLE))

# The study with every rule on few, small captures, from nothing: what this can't run, no run can.
cut: .venv/installed
	rm -rf results/cut
	$(CUT)
	$(call after,results/cut/results,$(CUT))
	$(BIN)/python -m pytest -m cut tests/cut

# The default lab's joint and single estimates, from nothing, against the truth: tests/truth/record.csv.
truth: .venv/installed
	rm -rf results/truth
	$(BIN)/python tools/truth_gate.py begin
	$(SNAKEMAKE) --configfile tests/truth/config.yaml -- $(TRUTH)
	PYTHONPATH=workflow/scripts $(ONE_THREAD) $(BIN)/python -m validation.forecasts \
	  results/truth/captures results/truth/results
	$(BIN)/python tools/truth_gate.py record

# Randomised objects and rigs of a seed, estimated and compared with their truth; a rejected capture
# does not stop the others.
validation: .venv/installed
	PYTHONPATH=workflow/scripts $(BIN)/python -m virtual_lab.randomise \
	  config/validation.yaml $(RIGS) --seed $(seed)
	-$(VALIDATION)/config.yaml -- validation
	PYTHONPATH=workflow/scripts $(BIN)/python -m validation.randomised_rigs $(RIGS)

# Each error of a rig by itself and all at once, on a block, a ball and a randomised object.
errors: .venv/installed
	PYTHONPATH=workflow/scripts $(BIN)/python -m virtual_lab.randomise \
	  config/validation.yaml $(RIGS)-alone --seed $(seed) --alone
	-$(VALIDATION)-alone/config.yaml -- validation
	PYTHONPATH=workflow/scripts $(BIN)/python -m validation.randomised_rigs $(RIGS)-alone

# The estimates alone, anew, of what a finished `make validation` observed.
refit: .venv/installed
	@test -n "$(ESTIMATES)" || { echo "error: $(RIGS): expected what make validation seed=$(seed) found, found nothing"; exit 1; }
	$(VALIDATION)/config.yaml --allowed-rules direct_object --forcerun direct_object -- $(ESTIMATES)
	PYTHONPATH=workflow/scripts $(BIN)/python -m validation.randomised_rigs $(RIGS)

# Draws of protocols, rigs and noise on the contact solutions of a finished `make validation`.
observations: .venv/installed
	PYTHONPATH=workflow/scripts $(ONE_THREAD) $(BIN)/python -m validation.observations $(RIGS)

# One indentation by many protocols, each estimated by itself; one that is rejected does not stop the
# others.
protocols: .venv/installed
	-$(PROTOCOLS) --keep-going -- $(PROTOCOL_CAPTURES:%=protocols/results/%/direct.json)
	PYTHONPATH=workflow/scripts $(BIN)/python -m validation.protocols protocols/results

# A worker for each core; with the long ones (pytest.mark.long) nearly twice as long.
test: .venv/installed
	$(BIN)/python -m pytest --numprocesses logical --dist loadfile

test-all: .venv/installed
	$(BIN)/python -m pytest --numprocesses logical --dist loadfile -m "not cut"

# Runs of the sample, killed again and again at random moments; half an hour on two quiet cores.
faults: .venv/installed
	$(BIN)/python tools/faults.py results/faults.md --kills $(kills) $(if $(targets),--targets $(targets))

# What CI has no time for: the long tests, corrupted inputs, kills, mutation testing, vulnerabilities.
nightly: test-all corpus faults mutants audit

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint --workflow-profile none
	PYTHONPATH=workflow/scripts $(BIN)/lint-imports
	$(BIN)/python tools/truth_gate.py check

bench: .venv/installed
	PYTHONPATH=workflow/scripts:tests $(ONE_THREAD) $(BIN)/python tools/bench.py results/bench.csv $(sections)

# Corrupted captures, files and results against tests/corpus/expected.csv (docs/developers.md), six
# minutes; with=--update writes it anew, with='--match PATTERN' takes some of them.
corpus: .venv/installed
	$(BIN)/python tools/corpus.py $(with)

# One operator or constant of palpate.vision, solid and estimate changed at a time, 40 drawn with a
# seed: which the tests notice (docs/developers.md); with='--seed 2 --count 10 --packages solid'.
mutants: .venv/installed
	$(ONE_THREAD) $(BIN)/python tools/mutants.py $(with)

# What is installed against the lock; then known vulnerabilities (their database is in the network).
audit: .venv/installed
	$(BIN)/pip install --quiet --dry-run --no-deps --require-hashes -r environment.lock
	$(BIN)/pip check
	$(PYTHON) -m venv results/.pip-audit && results/.pip-audit/bin/pip install --quiet pip-audit \
	  && results/.pip-audit/bin/pip-audit --strict --disable-pip --require-hashes -r environment.lock

# The page that follows from the code, and the site: results/site/index.html. Broken links, formulas
# and docstrings end it; Sphinx has a lock of its own.
docs: .venv/installed results/.sphinx/installed
	PYTHONPATH=workflow/scripts $(BIN)/python -m thesis.options docs/options.md
	PYTHONPATH=results/.sphinx:workflow/scripts $(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going \
	  --doctree-dir results/.sphinx/doctrees docs results/site

# From the last `make results` and `make bench`: the PNGs of docs/pictures are copies.
pictures: results/figures/plan.png
	cp $(PICTURES:%=results/figures/%.png) docs/pictures/

results/figures/plan.png: .venv/installed
	$(BIN)/palpate plan tests/own_object/raw/toy_cow --sensor bench_cam --modulus-kpa 30 --figure $@ \
	  --sensors tests/own_object/sensors --probes tests/own_object/probes

# What README.md, docs/trust.md and docs/start_here.md quote, against the last `make truth`,
# `make results`, `make protocols` and `make own-object`.
quoted: .venv/installed
	$(BIN)/python tools/quoted.py

# What the SLURM profile asks for, from the benchmarks of the last `make results`.
slurm-resources: .venv/installed
	PYTHONPATH=workflow/scripts $(BIN)/python tools/slurm_resources.py \
	  results/benchmarks workflow/profiles/slurm/config.yaml

# The committed captures of tests/sample, made anew by the virtual lab.
sample-captures: .venv/installed
	$(SNAKEMAKE) --configfile tests/sample/lab_config.yaml -- lab
	rm -rf tests/sample/raw
	cp -r results/sample_lab/raw tests/sample/raw
	find tests/sample/raw -type f -name '.*' -delete

# Everything that is wrong with what was dropped into raw/, and what is there: all objects, or one.
check: .venv/installed
	PYTHONPATH=workflow/scripts $(ONE_THREAD) $(BIN)/python -m palpate check \
	  $(if $(object),'raw/$(subst ','\'',$(object))')

# The guide's example, without a file of it copied.
own-object: .venv/installed
	$(SNAKEMAKE) --configfile tests/own_object/example.yaml

# The committed captures of tests/own_object, made anew: a mesh of another origin than ours, under
# a name and of a material that nothing else names.
own-object-captures: .venv/installed
	$(SNAKEMAKE) --configfile tests/own_object/lab_config.yaml -- lab
	rm -rf tests/own_object/raw
	mkdir -p tests/own_object/raw/toy_cow
	cd results/own_object_lab/raw/toy_cow && \
	  cp -r object.yaml template.ply bench_cam $(CURDIR)/tests/own_object/raw/toy_cow
	find tests/own_object/raw -name '.snakemake_timestamp' -delete

COMPILE := uv pip compile --python-version 3.11 --generate-hashes --no-header --no-emit-index-url
lock:
	$(COMPILE) environment.in -o environment.lock
	$(COMPILE) docs/environment.in --constraint environment.lock -o docs/environment.lock

# raw/ may hold recordings that nobody can make again: it is not touched.
clean:
	rm -rf results .venv

.venv/installed: environment.lock
	rm -rf .venv
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r environment.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

results/.sphinx/installed: docs/environment.lock .venv/installed
	rm -rf results/.sphinx
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --require-hashes \
	  --target results/.sphinx -r docs/environment.lock
	touch $@
