# Every target first makes the environment .venv if it is missing; nothing outside this folder is touched.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DEMO_OUT ?= demo

.PHONY: help demo test verify bench check lock clean

help:
	@echo "make demo    run the whole way on the embedded phantom; writes $(DEMO_OUT)/results/report.html"
	@echo "make test    run the tests"
	@echo "make bench   measure solver and lift beside other engines; makes their environments first (2.5 GB, once)"
	@echo "make verify  compare the tissue mechanics with closed forms and other engines; writes studies/verify"
	@echo "make check   ruff, mypy --strict, import contracts"
	@echo "make lock    renew requirements.lock from pyproject.toml"

$(VENV)/.ready: pyproject.toml requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "Glisson needs Python 3.11 or newer; name one with: make PYTHON=/path/to/python3.12"; exit 1; }
	@echo "== making the environment $(VENV) from requirements.lock (about 1 GB, once)"
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	@$(BIN)/uv pip install --quiet --python $(BIN)/python --require-hashes -r requirements.lock
	@$(BIN)/uv pip install --quiet --python $(BIN)/python --no-deps --editable .
	@touch $@

demo: $(VENV)/.ready
	$(BIN)/glisson demo --out $(DEMO_OUT)

test: $(VENV)/.ready
	$(BIN)/python -m pytest

bench: $(VENV)/.ready
	PYTHON=$(PYTHON) UV=$(BIN)/uv bash benchmarks/environments.sh
	$(BIN)/glisson benchmark solver
	$(BIN)/glisson benchmark lift
	$(BIN)/glisson benchmark segmentation

verify: $(VENV)/.ready
	$(BIN)/glisson verify

check: $(VENV)/.ready
	$(BIN)/ruff check . && $(BIN)/ruff format --check . && $(BIN)/mypy && $(BIN)/lint-imports

lock:
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --all-extras --group dev \
		--generate-hashes --no-emit-index-url --no-header pyproject.toml -o requirements.lock

clean:
	rm -rf $(VENV) .venv-bench .venv-dolfinx demo studies
