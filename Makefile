# The habits of the house. `make` alone shows them.
.PHONY: help lint types test accept accept-rods pictures bench

help:
	@grep -E '^[a-z-]+:.*##' Makefile | sed 's/:.*##/:/'

lint:      ## ruff, format, and the import contract
	ruff check .
	ruff format --check .
	lint-imports

types:     ## mypy
	mypy

test:      ## all tests
	python -m pytest

accept:    ## print the acceptance table (and install into a new environment)
	python -m tests.acceptance.accept

accept-rods: ## print the table of the rod alone
	python -m tests.acceptance.rods
	python -m tests.acceptance.rods_dynamics

pictures:  ## the README's pictures, made by the program
	python docs/pictures.py

bench:     ## start-up of the whole process against the bare imports
	python benchmarks/startup.py
