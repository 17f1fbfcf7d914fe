"""Prints the table of harm and verdicts: `python -m tests.acceptance.verdict [PART ...]`; exit 1 where one is missed.

Each part of the table is a module of its own in this folder, `verdict_PART.py`, with a function `rows`.
"""

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from tests.acceptance.rows import Row, print_table

PARTS = sorted(path.stem.removeprefix("verdict_") for path in Path(__file__).parent.glob("verdict_*.py"))


def all_rows(parts: list[str]) -> Iterator[Row]:
    for part in parts:
        yield from import_module(f"tests.acceptance.verdict_{part}").rows()


if __name__ == "__main__":
    sys.exit(print_table("verdict", all_rows(sys.argv[1:] or PARTS)))
