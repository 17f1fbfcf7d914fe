# Commands of the project; `make` alone lists them.
.PHONY: help lint words types test test-fast test-indices accept accept-targets accept-rods accept-output accept-joints accept-paper accept-verdict accept-refine accept-house accept-loads accept-sweep accept-studio accept-designed accept-advised accept-drawn accept-lattices accept-signed accept-hosts attack release-checks ci-full house paper pictures bench bench-quick bench-rods docs

help:
	@grep -E '^[a-z-]+:.*##' Makefile | sed 's/:.*##/:/'

lint:      ## ruff, format, spelling, and the import contract
	ruff check .
	typos
	ruff format --check .
	lint-imports
	python .ci/words.py

words:     ## words that the project does not use, with what it says instead
	python .ci/words.py

types:     ## mypy
	mypy

test-fast: ## tests that are not marked slow, over every kind of input and output
	python -m pytest -n 2 -m "not slow"

test:      ## all tests
	python -m pytest -n 2

test-indices: ## all tests, with kernels that refuse an index outside of its array (a C compiler; ten minutes)
	mkdir -p build/indices
	NUMBA_BOUNDSCHECK=1 python compile_kernels.py $(CURDIR)/build/indices
	RODSHELL_KERNELS=$(CURDIR)/build/indices python -m pytest -n 2 -k "not the_same_bits_with_compiled_kernels"

accept:    ## print the acceptance table
	python -m tests.acceptance.accept

accept-targets: ## print the table of targets of any kind (some minutes)
	python -m tests.acceptance.targets

accept-rods: ## print the table of the rod alone
	python -m tests.acceptance.rods
	python -m tests.acceptance.rods_dynamics

accept-joints: ## print the table of joints and couplings
	python -m tests.acceptance.joints

accept-output: ## print the table of outputs: drawings, checks, reports
	python -m tests.acceptance.output

accept-paper: ## print the table of the paper's own time stepping (some minutes)
	python -m tests.acceptance.paper

accept-verdict: ## print the table of invalid inputs and verdicts (some minutes)
	python -m tests.acceptance.verdict

accept-loads: ## print the table of loads and stability
	python -m tests.acceptance.loads

accept-advised: ## print the table of shells that are advised, three steps each (an hour)
	python -m tests.acceptance.advised

accept-designed: ## print the table of roofs that are designed to their loads (an hour)
	python -m tests.acceptance.designed

accept-refine: ## print the table of refinement
	python -m tests.acceptance.refine

accept-studio: ## print the table of the studio: dragging, sessions, flows in a browser (some minutes)
	python -m tests.acceptance.studio

accept-drawn: ## print the table of targets as they are drawn
	python -m tests.acceptance.drawn

accept-lattices: ## print the table of lattices along curves of the target
	python -m tests.acceptance.lattices

accept-signed: ## print the table of what an engineer signs
	python -m tests.acceptance.signed

accept-hosts: ## print the table of shells replayed in OpenSees (some minutes; needs `pip install -e ".[opensees]"`)
	python -m tests.acceptance.hosts

attack:    ## hostile input of every kind, a hundred times as many tries as in the tests (an hour)
	RODSHELL_ATTACK=$(or $(TRIES),100) python -m pytest -n 2 -m attack tests
	python -m tests.acceptance.verdict harm

accept-house: ## print the table of kept results, archives of all formats, misuses, the source tree (a minute)
	python -m tests.acceptance.house

accept-sweep: ## print the table of sweeps and searches (an hour; with DESIGNS=1000 ten minutes)
	python -m tests.acceptance.sweep --designs $(or $(DESIGNS),10000)

release-checks: ## licences of all dependencies, the workflow, the container file, the citation, the client's wheel
	.ci/release

ci-full:   ## what .ci/run does, every Python, what a release needs, and every acceptance table (hours; DESIGNS=1000: fewer)
	.ci/run
	.ci/versions
	.ci/release
	$(MAKE) --keep-going test-indices accept accept-targets accept-rods accept-joints accept-output accept-paper accept-verdict \
		accept-house accept-loads accept-refine accept-sweep accept-studio accept-designed accept-advised accept-drawn accept-lattices accept-signed \
		accept-hosts attack

house:     ## print the source by room, before and after: statements, lines, public names, files; circles, long files
	python -m tests.acceptance.house_figures

paper:     ## the paper's figures again, into docs/paper/ and docs/paper.md (some minutes)
	python docs/paper.py

docs:      ## the site, into build/docs/, without a warning (pip install -e ".[docs]")
	python -m sphinx -W --keep-going -q -b html docs build/docs

pictures:  ## the README's pictures, made by the program
	python docs/pictures.py

bench:     ## all benchmarks as one table, into docs/performance.md (some minutes; nothing else should run)
	python benchmarks/run.py

bench-quick: ## the short ones, printed only
	python benchmarks/run.py --quick

bench-rods: ## time of a rod's step against its nodes; a cantilever compared with PyElastica (pip install -e ".[bench]"; ten minutes)
	python benchmarks/rod_scaling.py
	python benchmarks/pyelastica_cantilever.py
