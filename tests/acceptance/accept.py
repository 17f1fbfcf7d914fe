"""Prints the acceptance table: `python -m tests.acceptance.accept`; exit 1 where a figure is missed."""

import sys
from collections.abc import Iterator

from benchmarks.startup import startup_ratio
from tests.acceptance.rows import Row, all_rows, print_table


def rows() -> Iterator[Row]:
    yield from all_rows()
    whole, bare, solve = startup_ratio(fresh=True)
    note = f"whole process {whole:.2f} s, bare imports {bare:.2f} s, solve {solve:.2f} s (medians of one group of runs)"
    ratio = (whole - solve) / bare
    yield Row("pip install ., hemisphere twice", "(whole - solve) / bare imports", ratio, 3.0, note=note)


if __name__ == "__main__":
    sys.exit(print_table("accept", rows()))
