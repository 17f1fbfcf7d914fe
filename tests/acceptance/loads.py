"""Under load, part by part: `python -m tests.acceptance.loads [PART ...]` prints the rows; exit 1 where one is missed.

Without a name every part is run. A further part is a module of rows and an entry of `PARTS`.
"""

import sys
from collections.abc import Callable, Iterator

from tests.acceptance import loads_creteil, loads_shells, loads_stability
from tests.acceptance.rows import Row, print_table

PARTS: dict[str, Callable[[], Iterator[Row]]] = {
    "benchmarks": loads_stability.benchmark_rows,
    "closed-forms": loads_stability.closed_form_rows,
    "vibration": loads_stability.vibration_rows,
    "shells": loads_shells.all_rows,
    "creteil": loads_creteil.rows,
}


def all_rows(names: list[str]) -> Iterator[Row]:
    for name in names or PARTS:
        yield from PARTS[name]()


if __name__ == "__main__":
    wanted = sys.argv[1:]
    if unknown := set(wanted) - set(PARTS):
        sys.exit(f"there is no part {', '.join(sorted(unknown))}: give some of {', '.join(PARTS)}, or none for all")
    sys.exit(print_table("-".join(["loads", *wanted]), all_rows(wanted)))
