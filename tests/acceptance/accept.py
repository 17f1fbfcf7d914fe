"""Prints the acceptance table: `python -m tests.acceptance.accept`; exit 1 where a figure is missed."""

import sys

from benchmarks.startup import startup_ratio
from tests.acceptance.rows import Row, all_rows


def main() -> int:
    missed = 0
    for row in all_rows():
        print(row, flush=True)
        missed += not row.reached
    whole, bare, solve = startup_ratio(fresh=True)
    note = f"whole process {whole:.2f} s, bare imports {bare:.2f} s, solve {solve:.2f} s (medians of one group of runs)"
    row = Row(
        "pip install ., hemisphere twice", "(whole - solve) / bare imports", (whole - solve) / bare, 3.0, note=note
    )
    print(row)
    missed += not row.reached
    print(f"{missed} figures missed" if missed else "every figure reached")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
