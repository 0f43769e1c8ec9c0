# Everything sets itself up: on a fresh Debian machine with git, make and python3 (venv), each target just works.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test lint docs bench oldest clean help

help:
	@echo "make demo   render photographs, calibrate, write demo/camera.h5 and demo/report.html"
	@echo "make test   lint, type-check and test everything"
	@echo "make docs   build the documentation into docs/_build"
	@echo "make bench  run the studies in validation/"

demo: $(VENV)/.core
	$(BIN)/opencsp-calib demo demo

test: lint
	$(BIN)/python -m pytest -n 2

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/.docs
	$(BIN)/sphinx-build -W -q -b html docs docs/_build

bench: $(VENV)/.dev
	set -e; for study in validation/[a-z]*.py; do echo "== $$study"; $(BIN)/python $$study; done

# What users of the main job install; quick when it is there.
$(VENV)/.core: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[opencv]'
	touch $@

# Everything there is, with mrcal and Chromium from Debian where this machine may install them.
$(VENV)/.dev: $(VENV)/.core .ci/system-packages
	sh .ci/system-packages
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[all]' --group dev
	touch $@

$(VENV)/.docs: $(VENV)/.dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --group docs
	touch $@

clean:
	rm -rf $(VENV) .venv-* demo docs/_build dist build
