"""Search: the values of some keys for which objectives are smallest, where constraints hold.

The designs of each generation are computed as those of a sweep, into the same store. The algorithm depends on its seed
and on what was found, so that an interrupted search continues, and a longer one begins with the same designs.
"""

import csv
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import ceil
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.errors import InputError, OutputError, RodshellError
from rodshell.formfinding.progress import Progress, silent
from rodshell.sweeps.asktell import AskTell
from rodshell.sweeps.axes import drawn_shares
from rodshell.sweeps.columns import CONVERGED, STANDARD, read_column
from rodshell.sweeps.computing import ARCHIVES, Computation, Wanted
from rodshell.sweeps.engines import opened_engine
from rodshell.sweeps.identity import job_identity
from rodshell.sweeps.plan import Source
from rodshell.sweeps.report import SHAPES, Page, require_plotly, write_report
from rodshell.sweeps.run import COPY, require_own
from rodshell.sweeps.search_plan import FAR, GENERATION, SearchPlan, read_search
from rodshell.sweeps.store import FOUND, Finished, Store
from rodshell.sweeps.table import CSV, Table, note_header, write_parquet
from rodshell.validation import instance

FRONT = "front.csv"
DIFFERENCE, CROSSED = 0.6, 0.9


@dataclass(frozen=True)
class Optimised:
    """What a search has come to.

    Parameters
    ----------
    folder : of the search.
    designs : their number; computed : jobs that were computed now.
    feasible : number of designs that converged and keep all constraints.
    front : of those, the ones that no other is better than in all objectives: values of the keys and the objectives, by
        name, the smallest first objective first.
    """

    folder: Path
    designs: int
    computed: int
    feasible: int
    front: tuple[dict[str, Any], ...]

    def summary(self) -> str:
        """A few lines of text."""
        lines = [f"{self.designs} designs, {self.computed} computed now; {self.feasible} keep all constraints"]
        if not self.front:
            return "\n".join([*lines, "NO DESIGN keeps all constraints and converged; table.csv says why"])
        name = "best design" if len(self.front) == 1 else f"front of {len(self.front)} designs, first"
        shown_values = ", ".join(f"{key} {_short(value)}" for key, value in self.front[0].items())
        return "\n".join([*lines, f"{name}: {shown_values}"])


def optimise(
    source: Source, out: str | PathLike[str], *, retry: bool = False, report: bool = False, progress: Progress = silent
) -> Optimised:
    """Search for the values of some keys for which objectives are smallest.

    With one objective by differential evolution, with several by NSGA-II, both of pymoo.

    Parameters
    ----------
    source : path of a search file, or its content as a mapping, see docs/sweeps.md.
    out : folder of the search. What an earlier run has finished there is not computed again.
    retry : run jobs again that were stopped by a limit, or whose process died.
    report : also write report.html, and keep the results of up to twelve designs of the front.
    progress : called as progress(stage, detail, 0.0).

    Returns
    -------
    The best designs, also in front.csv; all are in table.csv, see `read_sweep`.

    Raises
    ------
    InputError : the search cannot be used, or pymoo is not installed. OutputError : the folder cannot be written, or is
        in use. KeyboardInterrupt : the same call continues.
    """
    plan = read_search(source)
    instance("out", out, str | PathLike, "the path of a folder")
    folder = Path(out).expanduser()
    if report:
        require_plotly()
    algorithm = _algorithm(plan)
    require_own(folder)
    with Store(folder, writing=True) as store:
        note_header(store, [GENERATION, *plan.keys], plan.columns)
        store.plan(())
        if plan.text:
            (folder / COPY).write_text(plan.text, encoding="utf-8")
        shown_table = Table(store)
        try:
            with opened_engine(plan.settings) as engine:
                computation = Computation(store, shown_table, engine, plan.settings, progress, retry=retry)
                for generation in range(1, plan.generations + 1):
                    _generation(plan, generation, algorithm, store, computation)
                computed, front, feasible = computation.computed, *front_of(plan, store)
                best = [design.job for design in front]
                shapes = _some(best, SHAPES) if report else []
                kept = best if plan.settings.keep == "best" else shapes
                computation.compute(_archived(plan, store, folder, kept), "best designs", len(kept))
        except RodshellError:
            with suppress(OutputError):
                shown_table.write()
            raise
        except KeyboardInterrupt:
            shown_table.write()
            raise KeyboardInterrupt(
                f"{sum(store.outcomes().values())} designs are in {folder / CSV}; the same command continues from there"
            ) from None
        shown_table.write()
        write_parquet(store)
        rows = tuple(_front_row(plan, design) for design in front)
        _write_front(folder / FRONT, [*plan.keys, *(objective.column for objective in plan.objectives)], rows)
        found = Optimised(folder, store.count(), computed, feasible, rows)
        if report:
            names = [objective.column for objective in plan.objectives]
            caption = "Designs of the front, in the order of the first objective. Click one for its report."
            first = (names[0], names[1]) if len(names) > 1 else (GENERATION, names[0])
            page = Page(
                "rodshell optimise", plan.name, found.summary().splitlines(), first, len(names) > 1, shapes, caption,
                plan.command,
            )  # fmt: skip
            write_report(store, page)
        return found


def _algorithm(plan: SearchPlan) -> AskTell:
    dimensions, violations = len(plan.variables), 1 + len(plan.constraints)
    first = drawn_shares("latin-hypercube", dimensions, plan.population, plan.seed)
    lower, upper = np.zeros(dimensions), np.ones(dimensions)
    try:
        if len(plan.objectives) == 1:
            return AskTell.differential_evolution(
                lower, upper, first, constraints=violations, seed=plan.seed, difference=DIFFERENCE, crossed=CROSSED
            )
        return AskTell.nsga2(
            lower, upper, first, objectives=len(plan.objectives), constraints=violations, seed=plan.seed
        )
    except ImportError:
        raise InputError('optimise needs the package pymoo: pip install "rodshell[optimise]"') from None


def _generation(plan: SearchPlan, number: int, algorithm: AskTell, store: Store, computation: Computation) -> None:
    """Compute the designs of a generation, and pass on their values."""
    designs = [plan.values(point) for point in algorithm.ask()]
    names, wanted = list[str](), list[Wanted]()
    for values in designs:
        try:
            job = plan.job(values)
        except InputError as error:  # values that no case can have together
            names.append(f"no case {json.dumps(values)}")
            store.record(names[-1], "refused", {"status": str(error), "seconds": 0.0})
        else:
            names.append(job_identity(job, plan.settings.until))
            archive = store.folder / ARCHIVES / names[-1] if plan.settings.keep == "all" else None
            wanted.append(Wanted(names[-1], job, archive))
    store.plan((([number, *values], name) for values, name in zip(designs, names, strict=True)), more=True)
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


def _value(row: Mapping[str, Any], column: str) -> Any:
    return row.get(column) if column in STANDARD else read_column(column).of(row.get("results", {}))


def front_of(plan: SearchPlan, store: Store) -> tuple[list[Finished], int]:
    """The designs that keep all constraints and that no other is better than, and the number that keep them.

    Of designs that are as good in every objective, the first is taken.

    Parameters
    ----------
    plan : of the search; store : with its designs.
    """
    kept = list[tuple[list[float], Finished]]()
    for design in store.finished():
        values, violations = _judged(plan, design.outcome, design.row)
        if max(violations) <= 0:
            kept.append((values, design))
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


def _archived(plan: SearchPlan, store: Store, folder: Path, jobs: Sequence[str]) -> Iterator[Wanted]:
    keys = {design.job: design.keys[1:] for design in store.finished() if design.job in jobs}
    for name in jobs:
        yield Wanted(name, plan.job(keys[name]), folder / ARCHIVES / name)


def _front_row(plan: SearchPlan, design: Finished) -> dict[str, Any]:
    values = {objective.column: _value(design.row, objective.column) for objective in plan.objectives}
    return dict(zip(plan.keys, design.keys[1:], strict=True)) | values


def _write_front(file: Path, names: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    part = file.with_name(f".{file.name}.part")
    try:
        with part.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(names)
            writer.writerows([_cell(row[name]) for name in names] for row in rows)
        os.replace(part, file)
    except OSError as error:
        raise OutputError(f"cannot write {file}: {error.strerror}") from error


def _cell(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, list | tuple | dict) else value


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(_cell(value))
