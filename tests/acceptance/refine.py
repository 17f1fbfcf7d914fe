"""Prints the table of refinement: `python -m tests.acceptance.refine [PART ...]`; exit 1 where one is missed.

Each part of the table is a module of its own in this folder, `refine_PART.py`, with a function `rows`.
"""

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from tests.acceptance.rows import Row, print_table

PARTS = sorted(path.stem.removeprefix("refine_") for path in Path(__file__).parent.glob("refine_*.py"))


def all_rows(parts: list[str]) -> Iterator[Row]:
    for part in parts:
        yield from import_module(f"tests.acceptance.refine_{part}").rows()


if __name__ == "__main__":
    sys.exit(print_table("refine", all_rows(sys.argv[1:] or PARTS)))
