# Two commands: `make kitchen` shows the whole job, `make test` checks everything.
# On Linux the CPU build of torch is smaller: make kitchen TORCH_INDEX=https://download.pytorch.org/whl/cpu

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check
TORCH_INDEX ?=
INDEX := $(if $(TORCH_INDEX),--extra-index-url $(TORCH_INDEX))
OUT ?= sessions/kitchen

.PHONY: kitchen test setup clean help

help:
	@echo "make kitchen   capture, report and train in a simulated kitchen"
	@echo "make test      set up everything and run all checks"
	@echo "make setup     only set up, with everything a developer needs"
	@echo "make clean     remove the environment and what the commands made"

kitchen: $(VENV)/ready-user
	@tools/kitchen "$(OUT)"

test: $(VENV)/ready-dev
	@tools/check

setup: $(VENV)/ready-dev

$(BIN)/python:
	@tools/make-venv "$(PYTHON)" $(VENV)

$(VENV)/ready-user: pyproject.toml constraints.txt | $(BIN)/python
	@echo "Setting up (this happens once) …"
	@$(PIP) -c constraints.txt $(INDEX) -e '.[fields]'
	@touch $@

$(VENV)/ready-dev: pyproject.toml constraints.txt | $(BIN)/python
	@echo "Setting up for development (this happens once) …"
	@$(PIP) -c constraints.txt $(INDEX) -e '.[fields,tensorboard,sofa,mesh,cluster,dev]'
	@$(BIN)/pyright --version >/dev/null
	@touch $(VENV)/ready-user $@

clean:
	rm -rf $(VENV) sessions runs results build *.egg-info
