# Everything sets itself up: on a fresh Debian machine with git, make and python3 (venv), each target just works.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Python compiles what it imports when it does; compiling all that is installed takes most of the installation's time.
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile

# Each process takes tests that stand together, which share what is made for them, and at the end some of the other's.
PARALLEL := -n 2 --dist worksteal

.PHONY: demo test pythons beside-opencsp lint docs bench pictures mutants coverage release clean help

help:
	@echo "make demo   render photographs, calibrate, write demo/camera.h5 and demo/report.html"
	@echo "make test   lint, type-check and test everything"
	@echo "make pythons   a selection of tests on the oldest and newest Python and dependencies, where they are here"
	@echo "make beside-opencsp   install beside OpenCSP's own OpenCV and NumPy"
	@echo "make docs   build the documentation into docs/_build"
	@echo "make bench  run the studies in validation/"
	@echo "make mutants, coverage   how well the tests test"
	@echo "make pictures   draw the pictures of the documentation again"
	@echo "make release   build wheel and sdist, and try the wheel in a clean environment"

demo: $(VENV)/.core
	$(BIN)/opencsp-calib demo demo

test: lint
	$(BIN)/python -m pytest $(PARALLEL)

# The oldest dependencies that we support on the oldest Python, the newest on the newest that is here.
pythons:
	.ci/other-python 3.10 .ci/oldest.txt
	.ci/other-python 3.13

beside-opencsp:
	.ci/beside-opencsp

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/.docs
	$(BIN)/sphinx-build -W -q -b html docs docs/_build

bench: $(VENV)/.dev
	$(INSTALL) --group studies
	$(BIN)/python validation/bench.py

pictures: $(VENV)/.dev
	for script in photographs lens_models screenshots; do $(BIN)/python docs/scripts/$$script.py || exit 1; done

# One change to the code at a time: does a test notice? An hour; apart from make test.
mutants: $(VENV)/.dev
	$(INSTALL) --group studies
	$(BIN)/python validation/bench.py mutants

coverage: $(VENV)/.dev
	$(BIN)/python validation/bench.py lines_tested

# Wheel and sdist into dist/, and the wheel with all its extras at work in a clean environment.
release: $(VENV)/.dev
	rm -rf dist .venv-release
	$(BIN)/python -m hatchling build --target sdist --directory dist
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist dist/*.tar.gz
	$(PYTHON) -m venv .venv-release
	.venv-release/bin/python -m pip install --quiet --disable-pip-version-check --no-compile "$$(ls dist/*.whl)[all]"
	cd dist && ../.venv-release/bin/opencsp-calib --version && ../.venv-release/bin/opencsp-calib plugins
	cd dist && ../.venv-release/bin/opencsp-calib demo demo --views 10
	rm -rf .venv-release dist/demo

# What users of the main job install; quick when it is there.
$(VENV)/.core: pyproject.toml $(wildcard native/*)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(INSTALL) --upgrade 'pip>=25.1'
	$(INSTALL) --editable '.[opencv]'
	touch $@

# Everything there is, with mrcal and Chromium from Debian where this machine may install them.
$(VENV)/.dev: $(VENV)/.core .ci/system-packages
	sh .ci/system-packages
	$(INSTALL) --editable '.[all]' --group dev
	touch $@

$(VENV)/.docs: $(VENV)/.dev
	$(INSTALL) --group docs
	touch $@

clean:
	rm -rf $(VENV) .venv-* demo docs/_build dist build
