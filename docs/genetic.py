"""The genetic algorithm's searches that come with the package, made again: `python docs/genetic.py [TARGET ...]`.

All values are kept in out/genetic-searches, so that a run that was stopped goes on; without them it takes about an hour
of one processor. `make paper` then writes the table and the pictures.
"""

import sys
from pathlib import Path

from rodshell.cli.reporting import Progress
from rodshell.paper.fig6 import CASES
from rodshell.paper.genetic import KEPT, SEED, find

DATA = Path(__file__).parents[1] / "src" / "rodshell" / "paper" / "data"


def main() -> None:
    DATA.mkdir(exist_ok=True)
    for case in CASES:
        name = case.target.name
        if name in (sys.argv[1:] or name):
            with Progress(quiet=False) as progress:
                text = find(case, KEPT, seed=SEED, progress=progress).text()
            (DATA / f"genetic-{name}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
