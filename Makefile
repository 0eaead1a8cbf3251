# Needs make, Python >= 3.11 and a C++20 compiler. Everything else is installed into .venv.

PYTHON      ?= python3
JOBS        ?= 2
OUT         ?= reproduction
PYTEST_ARGS ?=
SITE_ARGS   ?=

VENV := .venv
BIN  := $(VENV)/bin
# Byte code is written when a module is first imported: most of what is installed never is.
PIP  := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile

# What the installed package depends on. Directories are listed too: they change when a file goes.
SOURCES := pyproject.toml CMakeLists.txt README.md LICENSE \
           $(shell find include src -not -name '*.py[co]' -not -name __pycache__)
PAPERS  := $(shell find papers -type f -not -name '*.py[co]')
HEADERS := $(shell find include src/decouple -name '*.hpp')
CXXCODE := $(shell find include src tests benchmarks -name '*.[ch]pp' 2>/dev/null)

# The package is imported by hundreds of processes: what is compiled for the first is kept for the others.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help build explorer reproduce test test-all sanitize docs lint format stubs bench clean
ifeq ($(MAKELEVEL),0)
.NOTPARALLEL: # but for what `build` says
endif

help:
	@echo 'make reproduce   build, then redo every figure and number of the paper, into $(OUT)/'
	@echo 'make test        build, then run the tests, but for the slow ones'
	@echo 'make test-all    build, then run every test'
	@echo 'make sanitize    run the tests of the kernel under the sanitizers for addresses and undefined behaviour'
	@echo 'make docs        build, then write the documentation site into site/'
	@echo 'make build       make .venv and install the package into it'
	@echo 'make lint        check format, style and types'
	@echo 'make format      reformat the sources'
	@echo 'make stubs       rewrite the type stubs of the extension module, the observers and the machines'
	@echo 'make explorer    build the page of `vibroimpact explore`; needs Node.js and npm'
	@echo 'make bench       measure speed against other programs'
	@echo 'make clean       remove .venv, caches, site/ and $(OUT)/'
	@echo
	@echo 'Variables: PYTHON=$(PYTHON)  JOBS=$(JOBS)  OUT=$(OUT)  CXX=...  PYTEST_ARGS="-k chatter"'

# Dependencies are downloaded while the package is compiled; installs at the same time share no package.
build: $(VENV)/.made
	@$(MAKE) --silent -j3 $(VENV)/.package $(VENV)/.needs $(VENV)/.papers

reproduce: build
	@echo '== reproduce: into $(OUT)/'
	@$(BIN)/vibroimpact reproduce impact-damper --out '$(OUT)'

test: QUICK := -m 'not slow'
test test-all: build $(VENV)/.test
	@echo '== test: $(JOBS) processes'
	@$(BIN)/python -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder $(QUICK) $(PYTEST_ARGS)

docs: build $(VENV)/.docs
	@echo '== docs: into site/'
	@$(BIN)/python tools/site.py $(SITE_ARGS)

# A kernel of its own beside .venv's, for g++; what Python itself does not give back is no fault of it.
SANITIZED := $(VENV)/sanitized
SANITIZER := -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -g1
sanitize: build $(VENV)/.test $(SANITIZED)/.made
	@echo '== sanitize: $(JOBS) processes'
	@LD_PRELOAD="$$(g++ -print-file-name=libasan.so) $$(g++ -print-file-name=libstdc++.so)" \
	  ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 PYTHONPATH=$(SANITIZED) \
	  $(BIN)/python -m pytest -n $(JOBS) --dist loadfile -m 'not slow' tests/kernel tests/simulation tests/attractors \
	  tests/orbits/test_units_of_orbits.py $(PYTEST_ARGS)

$(SANITIZED)/.made: $(SOURCES) | $(VENV)/.made
	@echo '== package: build for the sanitizers (some ten minutes)'
	@CXX=g++ CXXFLAGS='$(SANITIZER)' $(PIP) --no-deps --upgrade --target $(SANITIZED) .
	@touch $@

# The page is one file of the package, which `make build` installs where it is there. Its kernel is compiled twice: with
# the instruction for fma that newer browsers have, and without.
explorer: src/vibroimpact/explorer/page.html
	@$(MAKE) --silent build

WASM := -target wasm32-wasi -mexec-model=reactor -std=c++20 -Os -fno-exceptions -fno-rtti -ffp-contract=off \
        -fno-math-errno -Iinclude -Isrc -Wl,--no-entry -Wl,--strip-all -Wl,-z,stack-size=1048576
WASM_CPU := generic+simd128+bulk_memory+sign_ext+nontrapping_fptoint
web/build/plain.wasm: CPU := $(WASM_CPU)
web/build/fast.wasm: CPU := $(WASM_CPU)+relaxed_simd
web/build/plain.wasm web/build/fast.wasm: web/kernel/page.cpp $(HEADERS) | $(VENV)/.test
	@mkdir -p web/build
	@echo '== explorer: $@'
	@$(BIN)/python -m ziglang c++ $(WASM) -mcpu=$(CPU) $< -o $@

src/vibroimpact/explorer/page.html: web/build/plain.wasm web/build/fast.wasm $(wildcard web/src/* web/*.*)
	@echo '== explorer: page'
	@cd web && npm ci --silent && npm run --silent check && npm run --silent build
	@cp web/dist/index.html $@

bench: build $(VENV)/.bench
	@echo '== bench'
	@$(BIN)/python -m benchmarks

lint: build $(VENV)/.lint
	@echo '== lint: ruff'
	@$(BIN)/ruff check --quiet
	@$(BIN)/ruff format --quiet --check || { echo 'Run: make format'; exit 1; }
	@echo '== lint: clang-format'
	@$(BIN)/clang-format --dry-run --Werror $(CXXCODE)
	@echo '== lint: clang-tidy'
# All headers as one program: each is read once, not with every other that includes it.
	@printf '#include "%s"\n' $(HEADERS) > $(VENV)/headers.cpp
	@$(BIN)/clang-tidy --quiet --config-file=.clang-tidy $(VENV)/headers.cpp -- \
	  -std=c++20 -I. -Iinclude -Xclang -analyzer-opt-analyze-headers 2>$(VENV)/tidy.log || { \
	  cat $(VENV)/tidy.log; exit 1; }
	@echo '== lint: imports'
	@PYTHONPATH=src:papers/src $(BIN)/lint-imports --no-logo > $(VENV)/imports.log || { cat $(VENV)/imports.log; exit 1; }
	@echo '== lint: mypy'
	@$(BIN)/mypy --no-error-summary
	@echo '== lint: type stub of the extension'
	@$(STUBGEN) -o $(VENV)/_kernel.pyi
	@diff src/vibroimpact/_kernel.pyi $(VENV)/_kernel.pyi || { echo 'Run: make stubs'; exit 1; }
	@echo '== lint: codespell'
	@$(BIN)/codespell

format: $(VENV)/.lint
	@$(BIN)/ruff check --quiet --select I --fix
	@$(BIN)/ruff format --quiet
	@$(BIN)/clang-format -i $(CXXCODE)

STUBGEN = $(BIN)/python -m nanobind.stubgen --quiet -m \
  $$($(BIN)/python -c 'from vibroimpact import _kernel; print(_kernel._module.__name__)')
stubs: build $(VENV)/.lint
	@$(STUBGEN) -o src/vibroimpact/_kernel.pyi
	@$(BIN)/python tools/name_stubs.py

clean:
	@rm -rf $(VENV) build dist site '$(OUT)' .pytest_cache .mypy_cache .ruff_cache .hypothesis
	@find src papers tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true

# ---- the environment ---------------------------------------------------------------------------

$(VENV)/.made:
	@command -v '$(PYTHON)' >/dev/null || { \
	  echo 'PYTHON = $(PYTHON): not found. Install Python >= 3.11, or: make PYTHON=/path/to/python3'; exit 2; }
	@'$(PYTHON)' -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "PYTHON = $(PYTHON) is $$('$(PYTHON)' --version 2>&1 | head -n 1): needs >= 3.11. Use: make PYTHON=python3.11"; exit 2; }
	@'$(PYTHON)' -c 'import venv, ensurepip' 2>/dev/null || { \
	  echo 'PYTHON = $(PYTHON): has no venv module. On Debian and Ubuntu: apt install python3-venv'; exit 2; }
	@echo '== environment: $(VENV)'
	@'$(PYTHON)' -m venv $(VENV)
	@touch $@

$(VENV)/.package: $(SOURCES) | $(VENV)/.made
	@.ci/check-compiler $(BIN)/python
	@echo '== package: build and install (a minute or two the first time)'
	@$(PIP) --no-deps .
	@touch $@

$(VENV)/.papers: $(PAPERS) | $(VENV)/.made
	@$(PIP) --no-deps ./papers
	@touch $@

# What the package needs, or one extra in pyproject.toml, without building the package again.
NEEDS = import sys, tomllib; \
  project = tomllib.load(open("pyproject.toml", "rb"))["project"]; \
  print(*{"needs": project["dependencies"], **project["optional-dependencies"]}[sys.argv[1]], sep="\n")

$(VENV)/.needs $(VENV)/.test $(VENV)/.lint $(VENV)/.bench $(VENV)/.docs: $(VENV)/.%: pyproject.toml | $(VENV)/.made
	@echo '== environment: packages for $(subst needs,the package,$*)'
	@$(BIN)/python -c '$(NEEDS)' $* > $(VENV)/$*.txt
	@$(PIP) -r $(VENV)/$*.txt
	@touch $@
