"""The genetic algorithm and the direct method: both shells popped up, their cost, and the distance of their G0.

The paper compares its G0 with that of a genetic algorithm [HQK 3.2, ref 30]. Ours is in `genetic_search`; the searches
that come with the package, of five seeds for each target, are in its data; those of other seeds are run, or continued,
here. The algorithm looks for the best popped-up shape, the direct method for the net: so the two differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.formfinding import Agreement, Stages, agreement, find_stages
from rodshell.paper.figure import CASES, INK, ROD, TARGET_COLOURS, Case, Chart, Figure, Part, Row, Series, charts_svg
from rodshell.paper.genetic_records import History, stored
from rodshell.paper.genetic_search import MOST, POPULATION, Design, search
from rodshell.progress import Progress, silent
from rodshell.rods.supports import PINNED

SEED = 1
SEARCHES = Path("out") / "genetic-searches"
AGAIN = 3e-3  # relative difference allowed in the rms of a shell popped up again; 2e-3 of the kept searches measured
REPEATS = 3  # of the direct method; the least time counts
COLUMNS = (
    "target", "G0 by", "values sought", "forward runs", "processor time [s]", "popped shape, rms [mm]", "max [mm]",
    "G0 off the direct one, max [mm]", "rms [mm]", "how it ended",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Sought(Part):
    """What one search found.

    Args:
        best: agreement of its best footprint, popped up again; None if that is not stable.
        apart: (2m,) distance of its rod ends from those of the direct method's G0 [m].
    """

    history: History
    best: Agreement | None
    apart: Floats

    @property
    def status(self) -> str:
        """ "converged", or the problem."""
        history = self.history
        search = f"seed {history.seed} on the {history.target}"
        if self.best is None or abs(self.best.rms / history.best - 1) > AGAIN:
            return f"the best footprint of {search} does not pop up again as it did"
        return "converged" if history.converged else f"{search} has not converged: {history.ending}"

    def rows(self) -> list[Row]:
        history, apart = self.history, 1e3 * self.apart
        row = (
            history.target, f"genetic algorithm, seed {history.seed}", str(len(history.variables)), str(history.runs),
            f"{history.seconds:.0f}", *_shape(self.best), f"{apart.max():.2f}", f"{np.sqrt(np.mean(apart**2)):.2f}",
            f"{'converged' if history.converged else 'NOT CONVERGED'}: {history.ending}",
        )  # fmt: skip
        return [row]

    def result(self) -> dict[str, Any]:
        history, best = self.history, self.best
        return {
            "seed": history.seed, "status": self.status, "forward_runs": history.runs, "seconds": history.seconds,
            "best": None if best is None else {"rms": best.rms, "max": best.max},
            "apart_max": float(self.apart.max()), "apart_rms": float(np.sqrt(np.mean(self.apart**2))),
            "generations": len(history.generations), "last_gain": history.last_gain,
            "variables": history.variables.tolist(),
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class Comparison(Part):
    """One target by both methods.

    Args:
        direct: agreement of the direct method, pinned.
        searches: from the best to the worst.
    """

    case: Case
    direct: Agreement
    searches: tuple[Sought, ...]

    @property
    def status(self) -> str:
        return next((search.status for search in self.searches if search.status != "converged"), "converged")

    @property
    def direct_seconds(self) -> float:
        """Processor time of the direct method on the machine of the best search [s]."""
        return self.searches[0].history.direct_seconds

    def rows(self) -> list[Row]:
        direct = (self.case.target.name, "direct method", "-", "1", f"{self.direct_seconds:.2g}", *_shape(self.direct))
        return [(*direct, "-", "-", "-"), *(row for search in self.searches for row in search.rows())]

    def spread(self) -> str:
        """The popped shapes of the searches in a clause."""
        found = [search.best.rms for search in self.searches if search.best is not None]
        if not found:
            return f"{self.case.target.name}: no search's best is stable"
        runs = sum(search.history.runs for search in self.searches)
        best, median, worst = (self.direct.rms / rms for rms in (min(found), np.median(found), max(found)))
        ratios = f"{best:.2f}" if len(found) == 1 else f"best {best:.2f}, median {median:.2f}, worst {worst:.2f}"
        return f"{self.case.target.name}: {ratios}, for {runs} times the runs"

    def result(self) -> dict[str, Any]:
        return {
            "target": self.case.target.parameters(), "status": self.status, "direct_seconds": self.direct_seconds,
            "direct": {"rms": self.direct.rms, "max": self.direct.max},
            "searches": [search.result() for search in self.searches],
        }  # fmt: skip


@dataclass(frozen=True)
class Genetic(Figure):
    """All targets."""

    parts: tuple[Comparison, ...]
    name, columns, key = "genetic", COLUMNS, "comparisons"
    title = "The genetic algorithm [HQK 3.2] and the direct method: ends pinned, 15 mm edges, every run from flat"

    def footing(self) -> str:
        gains = "; ".join(comparison.spread() for comparison in self.parts)
        return f"rms of the direct method over that of the genetic algorithm: {gains}"

    def pictures(self) -> dict[str, str]:
        """The convergence."""
        return {"genetic": convergence_svg(self.parts)}

    def texts(self) -> dict[str, str]:
        """Each history."""
        histories = [search.history for comparison in self.parts for search in comparison.searches]
        return {f"{history.target}-{history.seed}.json": history.json() for history in histories}


def make(
    progress: Progress,
    *,
    seed: int | None = None,
    jobs: int | None = None,
    generations: int | None = None,
    target: str | None = None,
    cases: Sequence[Case] = CASES,
    folder: Path = SEARCHES,
) -> Genetic:
    """Compare both methods, with the searches that come with the package, or with new ones.

    Args:
        seed: of searches that are run, or continued, now; None: those of the package.
        jobs: number of processes of new searches.
        generations: largest number of generations of new searches.
        target: name of the only target; None: all.
        folder: of the values of new searches.

    Raises:
        InputError: jobs or generations without a seed; an unknown target; pymoo is needed and not installed; a file of
            values is broken or of a different search.
    """
    if seed is None and (jobs is not None or generations is not None):
        raise InputError("jobs and generations belong to a new search: give its seed, too")
    chosen = [case for case in cases if target in (None, case.target.name)]
    if not chosen:
        names = ", ".join(case.target.name for case in cases)
        raise InputError(f"there is no target {target} in the paper: use one of {names}")
    comparisons = []
    for case in chosen:
        histories = stored(case.target.name) if seed is None else ()
        if not histories:
            new_seed = SEED if seed is None else seed
            histories = (
                find(case, folder, seed=new_seed, jobs=jobs or 1, most=generations or MOST, progress=progress),
            )
        progress(f"{case.target.name}, again", "pop-up", 0.0)
        comparisons.append(compare(case, histories))
    return Genetic(tuple(comparisons))


def find(
    case: Case, folder: Path, *, seed: int, jobs: int = 1, population: int = POPULATION, most: int = MOST,
    progress: Progress = silent,
) -> History:  # fmt: skip
    """A whole search, whose values are written to `folder`; all else is as of `search`."""
    times = []
    for _ in range(REPEATS):
        begun = process_time()
        direct = _direct(case)
        times.append(process_time() - begun)
    design, name = Design.of(direct), case.target.name
    file = folder / f"{name}-seed{seed}.json"
    generations, variables = search(
        design, file, seed=seed, jobs=jobs, population=population, most=most, progress=progress
    )
    rods, footprint = tuple(line.name for line in design.lines), design.footprint(variables).points
    return History(name, seed, population, generations, variables, rods, footprint, min(times))


def compare(case: Case, histories: Sequence[History]) -> Comparison:
    """The shell of the direct method, and the best of each history popped up again."""
    direct = _direct(case)
    design = Design.of(direct)

    def again(history: History) -> Sought:
        popped = design.pop_up(history.variables)
        best = agreement(popped, case.target) if popped is not None and popped.report.stable else None
        return Sought(history, best, np.linalg.norm(history.footprint - direct.footprint.points, axis=1))

    ordered = sorted(histories, key=lambda history: history.best)
    return Comparison(case, direct.agreement[PINNED.name], tuple(again(history) for history in ordered))


def convergence_svg(comparisons: Sequence[Comparison]) -> str:
    """The best of each search against its forward runs, and the direct method's error as a level."""
    series, legend = list[Series](), list[tuple[str, str]]()
    for comparison in comparisons:
        colour = TARGET_COLOURS.get(comparison.case.target.name, INK)
        courses = [search.history.generations for search in comparison.searches]
        for course in courses:
            best = [1e3 * generation.best for generation in course]
            series.append(Series([generation.runs for generation in course], best, colour, "", lined=True))
        ends = [min(course[0].runs for course in courses), max(course[-1].runs for course in courses)]
        series.append(Series(ends, [1e3 * comparison.direct.rms] * 2, colour, "\N{WHITE DIAMOND}", lined=True))
        legend.append((comparison.case.target.name, colour))
    chart = Chart(series, "forward runs", "best popped shape off the target, rms [mm]", legend)
    return charts_svg([chart], "\N{WHITE DIAMOND} the direct method, one run")


def _direct(case: Case) -> Stages:
    return find_stages(case.target, case.layout, ROD, ends=PINNED)


def _shape(gap: Agreement | None) -> tuple[str, str]:
    return ("-", "-") if gap is None else (f"{1e3 * gap.rms:.3f}", f"{1e3 * gap.max:.2f}")
