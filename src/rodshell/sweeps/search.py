"""Search: the values of some keys for which objectives are smallest, where constraints hold.

The designs of each generation are computed as those of a sweep, into the same store. The algorithm depends on its seed
and on what was found, so that an interrupted search continues, and a longer one begins with the same designs.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.errors import InputError, needs_package
from rodshell.progress import Progress, silent
from rodshell.sweeps.asktell import AskTell
from rodshell.sweeps.axes import drawn_shares
from rodshell.sweeps.columns import CONVERGED, JOB, STANDARD, read_column
from rodshell.sweeps.computing import Computation, Wanted, opened_computation
from rodshell.sweeps.plan import GENERATION, Source
from rodshell.sweeps.report import SHAPES, Page, require_plotly, write_report
from rodshell.sweeps.search_plan import FAR, SearchPlan, read_search
from rodshell.sweeps.store import FOUND, Finished, Store
from rodshell.sweeps.table import header_notes, in_short, write_csv
from rodshell.validation import file_path

FRONT = "front.csv"
_MOST_SHOWN = 10  # designs of the front in text


@dataclass(frozen=True)
class Optimised:
    """What a search has come to.

    Args:
        computed: number of jobs that were computed now.
        feasible: number of designs that converged and keep all constraints.
        front: of those, the ones that no other is better than in all objectives, the smallest first objective first: by
            name the values of the variables' keys, objectives, verdict, further columns, and the job.
    """

    folder: Path
    designs: int
    computed: int
    feasible: int
    front: tuple[dict[str, Any], ...]

    def summary(self) -> str:
        """A line of text, and another where nothing was found."""
        found = f"{self.designs} designs, {self.computed} computed now; {self.feasible} keep all constraints"
        return found if self.front else f"{found}\nNO DESIGN keeps all constraints and converged; table.csv says why"

    def front_text(self) -> str:
        """The front as a table of text, its first designs where it is long."""
        if not self.front:
            return ""
        names = [name for name in self.front[0] if name != JOB]
        cells = [names, *([in_short(design[name]) for name in names] for design in self.front[:_MOST_SHOWN])]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in cells]
        more = [f"and {len(self.front) - _MOST_SHOWN} more in {FRONT}"] if len(self.front) > _MOST_SHOWN else []
        title = "the best of them" if len(self.front) == 1 else "those that no other is better than in all objectives"
        return "\n".join([f"{title}:", *lines, *more])


def optimise(
    source: Source | SearchPlan,
    out: str | PathLike[str],
    *,
    retry: bool = False,
    report: bool = False,
    address: str | None = None,
    progress: Progress = silent,
) -> Optimised:
    """Search for the values of some keys for which objectives are smallest.

    With one objective by differential evolution, with several by NSGA-II, both of pymoo.

    Args:
        source: path of a search file, or its content as a mapping, see docs/sweeps.md.
        out: folder of the search. What an earlier run has finished there is not computed again.
        report: also write report.html, and keep the results of up to twelve designs of the front.
        retry, address, progress: as of `sweep`.

    Returns:
        The best designs, also in front.csv; all are in table.csv, see `read_sweep`.

    Raises:
        InputError: the search cannot be used, or pymoo is not installed. OutputError : the folder cannot be written, or
            is in use. KeyboardInterrupt : the same call continues.
    """
    plan = source if isinstance(source, SearchPlan) else read_search(source)
    folder = file_path("out", out)
    if report:
        require_plotly()
    algorithm = _algorithm(plan)
    objectives = [objective.column for objective in plan.objectives]
    with opened_computation(plan, folder, progress, retry=retry, address=address) as computation:
        store = computation.store
        store.plan((), notes=header_notes(plan.keys, plan.columns))
        for generation in range(1, plan.generations + 1):
            _generation(plan, generation, algorithm, computation)
        front, feasible = front_of(plan, store)
        if plan.checks_last:
            unchecked = computation.checked([design.job for design in front])
            computation.compute(unchecked, "checks of the best designs", len(unchecked))
            front, feasible = front_of(plan, store)
        computed = computation.computed
        best = [design.job for design in front]
        shapes = _some(best, SHAPES) if report else []
        kept = best if plan.settings.keep == "best" else shapes
        computation.compute(computation.archived(kept), "best designs", len(kept))
        names = list(dict.fromkeys([*plan.keys[1:], *objectives, "verdict", *(c.name for c in plan.columns), JOB]))
        rows = tuple(dict(zip(names, _cells(plan, design, names), strict=True)) for design in front)
        write_csv(folder / FRONT, names, rows)
        found = Optimised(folder, store.count(), computed, feasible, rows)
        if report:
            page = Page(
                kind="rodshell optimise",
                plan=plan,
                summary=found.summary().splitlines(),
                first=(objectives[0], objectives[1]) if len(objectives) > 1 else (GENERATION, objectives[0]),
                measures=objectives,
                larger=[objective.column for objective in plan.objectives if objective.sign < 0],
                counts=lambda design: _is_feasible(plan, design),
                shapes=shapes,
                caption="Designs of the front, in the order of the first objective. Click one for its report.",
            )
            write_report(store, page)
    return found


def _algorithm(plan: SearchPlan) -> AskTell:
    dimensions, violations = len(plan.variables), 1 + len(plan.constraints)
    first = drawn_shares("latin-hypercube", dimensions, plan.population, plan.seed)
    cube = np.zeros(dimensions), np.ones(dimensions)
    with needs_package("optimise", "pymoo", "optimise"):
        return AskTell(*cube, first, objectives=len(plan.objectives), constraints=violations, seed=plan.seed)


def _generation(plan: SearchPlan, number: int, algorithm: AskTell, computation: Computation) -> None:
    """Compute the designs of a generation, and pass on their values."""
    store = computation.store
    designs = [plan.values(number, point) for point in algorithm.ask()]
    names, wanted = list[str](), list[Wanted]()
    for values in designs:
        try:
            wanted.append(computation.wanted(plan.job(values), kept=plan.settings.keep == "all"))
            names.append(wanted[-1].id)
        except InputError as error:  # values that no case can have together
            names.append(f"no case {json.dumps(values[1:])}")
            store.record(names[-1], "refused", {"status": str(error), "seconds": 0.0})
    store.plan(zip(designs, names, strict=True), more=True)
    computation.compute(wanted, f"generation {number} of {plan.generations}", len(wanted))
    found = [_judged(plan, store.outcome(name), store.row(name)) for name in names]
    algorithm.tell(np.array([values for values, _ in found]), np.array([violations for _, violations in found]))


def _judged(plan: SearchPlan, outcome: str | None, row: Mapping[str, Any]) -> tuple[list[float], list[float]]:
    """Objectives, all to be small, and violations; the first violation is that there is no converged form."""
    values = [_value(row, objective.column) for objective in plan.objectives]
    known_values = all(isinstance(value, int | float) for value in values)
    if outcome != FOUND or row["status"] != CONVERGED or not known_values:
        return [0.0] * len(values), [FAR] * (1 + len(plan.constraints))
    signed = [objective.sign * float(value) for objective, value in zip(plan.objectives, values, strict=True)]
    broken = [constraint.violation(_value(row, constraint.column)) for constraint in plan.constraints]
    return signed, [0.0, *broken]


def _is_feasible(plan: SearchPlan, design: Finished) -> bool:
    """Whether a design converged and keeps all constraints."""
    return max(_judged(plan, design.outcome, design.row)[1]) <= 0


def _value(row: Mapping[str, Any], column: str) -> Any:
    return row.get(column) if column in STANDARD else read_column(column).of(row.get("results", {}))


def front_of(plan: SearchPlan, store: Store) -> tuple[list[Finished], int]:
    """The designs that keep all constraints and that no other is better than, and the number that keep them.

    Of designs that are as good in every objective, the first is taken.
    """
    judged = ((*_judged(plan, design.outcome, design.row), design) for design in store.finished())
    kept = [(values, design) for values, violations, design in judged if max(violations) <= 0]
    if not kept:
        return [], 0
    all_values = np.array([values for values, _ in kept])
    front = []
    for k, (mine, design) in enumerate(kept):
        no_worse = (all_values <= np.array(mine)).all(axis=1)
        better = no_worse & (all_values < np.array(mine)).any(axis=1)
        if not better.any() and int(np.argmax(no_worse)) == k:
            front.append((mine, design))
    return [design for _, design in sorted(front, key=lambda pair: pair[0])], len(kept)


def _some(jobs: Sequence[str], most: int) -> list[str]:
    """At most so many, evenly spread."""
    step = max(1, ceil(len(jobs) / most))
    return list(jobs[::step])


def _cells(plan: SearchPlan, design: Finished, names: Sequence[str]) -> list[Any]:
    """Values of a design by the names of keys and columns."""
    known = dict(zip(plan.keys, design.keys, strict=True)) | {JOB: design.job}
    return [known[name] if name in known else _value(design.row, name) for name in names]
