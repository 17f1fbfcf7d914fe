"""The genetic algorithm's searches that come with the package, made again: `python docs/genetic.py [TARGET ...]`.

Five seeds for each target. All values are kept in out/genetic-searches, so that an interrupted run continues; without
them it takes some four hours of one processor. `make paper` then writes the table and the pictures.
"""

import sys
from pathlib import Path

from rodshell.cli.reporting import Progress
from rodshell.paper.figure import CASES
from rodshell.paper.genetic import SEARCHES, find

DATA = Path(__file__).parents[1] / "src" / "rodshell" / "paper" / "data"
SEEDS = range(1, 6)


def main() -> None:
    DATA.mkdir(exist_ok=True)
    for case in CASES:
        name = case.target.name
        if name in (sys.argv[1:] or name):
            for seed in SEEDS:
                with Progress(quiet=False) as progress:
                    text = find(case, SEARCHES, seed=seed, progress=progress).json()
                (DATA / f"genetic-{name}-{seed}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
