"""The genetic algorithm and the direct method: both shells popped up, their cost, and the distance of their G0.

The paper compares its G0 with that of a genetic algorithm [HQK 3.2, ref 30]. Ours is in `genetic_search`; the searches
that come with the package are in its data, those of other seeds are run, or continued, here. It looks for the best
popped-up shape, the direct method for the net: so the two differ.
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
from rodshell.paper.genetic_records import WINDOW, History, stored
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
class Comparison(Part):
    """One target by both methods.

    Args:
        direct: agreement of the direct method, pinned.
        best: agreement of the genetic algorithm's best, popped up again; None if it is not stable.
        apart: (2m,) distance between the rod ends of the two G0 [m].
    """

    case: Case
    history: History
    direct: Agreement
    best: Agreement | None
    apart: Floats

    @property
    def status(self) -> str:
        """ "converged", or the problem."""
        name, history = self.case.target.name, self.history
        if self.best is None or abs(self.best.rms / history.best - 1) > AGAIN:
            return f"the {name}'s best footprint does not pop up again as it did"
        if not history.converged:
            count = f"{len(history.generations)} of at least {WINDOW + 1} generations"
            gained = f"the best gained {_percent(history.last_gain)} in its last {WINDOW} generations"
            why = count if len(history.generations) <= WINDOW else gained
            return f"the search on the {name} has not converged: {why}"
        return "converged"

    @property
    def ended(self) -> str:
        """How the search ended, in a few words."""
        history = self.history
        count = f"{len(history.generations)} generations of {history.population}"
        outcome = "converged" if history.converged else "NOT CONVERGED"
        if len(history.generations) <= WINDOW:
            return f"{outcome}: {count}"
        return f"{outcome}: {_percent(history.last_gain)} gained in the last {WINDOW} of {count}"

    def rows(self) -> list[Row]:
        """One for each method."""
        name, history, apart = self.case.target.name, self.history, 1e3 * self.apart
        off = (f"{apart.max():.2f}", f"{np.sqrt(np.mean(apart**2)):.2f}")
        direct = (name, "direct method", "-", "1", f"{history.direct_seconds:.2g}", *_shape(self.direct), "-", "-", "-")
        found = (
            name, "genetic algorithm", str(len(history.variables)), str(history.runs), f"{history.seconds:.0f}",
            *_shape(self.best), *off, self.ended,
        )  # fmt: skip
        return [direct, found]

    def result(self) -> dict[str, Any]:
        history, best = self.history, self.best
        return {
            "target": self.case.target.parameters(), "seed": history.seed, "status": self.status,
            "forward_runs": history.runs, "seconds": history.seconds, "direct_seconds": history.direct_seconds,
            "direct": {"rms": self.direct.rms, "max": self.direct.max},
            "best": None if best is None else {"rms": best.rms, "max": best.max},
            "apart_max": float(self.apart.max()), "apart_rms": float(np.sqrt(np.mean(self.apart**2))),
            "generations": len(history.generations), "last_gain": history.last_gain,
            "variables": history.variables.tolist(),
        }  # fmt: skip


@dataclass(frozen=True)
class Genetic(Figure):
    """All targets."""

    parts: tuple[Comparison, ...]
    name, columns, key = "genetic", COLUMNS, "comparisons"
    title = "The genetic algorithm [HQK 3.2] and the direct method: ends pinned, 15 mm edges, every run from flat"

    def footing(self) -> str:
        """The gains."""
        gains = (
            f"{comparison.case.target.name} {comparison.direct.rms / comparison.best.rms:.2f}, "
            f"for {comparison.history.runs} times the runs"
            for comparison in self.parts
            if comparison.best is not None
        )
        return f"rms of the direct method over that of the genetic algorithm: {'; '.join(gains)}"

    def pictures(self) -> dict[str, str]:
        """The convergence."""
        return {"genetic": convergence_svg(self.parts)}

    def texts(self) -> dict[str, str]:
        """Each history."""
        return {f"{comparison.case.target.name}.json": comparison.history.json() for comparison in self.parts}


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
        history = stored(case.target.name) if seed is None else None
        if history is None:
            new_seed = SEED if seed is None else seed
            history = find(case, folder, seed=new_seed, jobs=jobs or 1, most=generations or MOST, progress=progress)
        progress(f"{case.target.name}, again", "pop-up", 0.0)
        comparisons.append(compare(case, history))
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


def compare(case: Case, history: History) -> Comparison:
    """The shell of the direct method, and the best of a `history` popped up again."""
    direct = _direct(case)
    popped = Design.of(direct).pop_up(history.variables)
    best = agreement(popped, case.target) if popped is not None and popped.report.stable else None
    apart = np.linalg.norm(history.footprint - direct.footprint.points, axis=1)
    return Comparison(case, history, direct.agreement[PINNED.name], best, apart)


def convergence_svg(comparisons: Sequence[Comparison]) -> str:
    """The best of each search against its forward runs, and the direct method's error as a level."""
    series, legend = list[Series](), list[tuple[str, str]]()
    for comparison in comparisons:
        colour = TARGET_COLOURS.get(comparison.case.target.name, INK)
        generations = comparison.history.generations
        runs = [generation.runs for generation in generations]
        series.append(Series(runs, [1e3 * generation.best for generation in generations], colour, "", lined=True))
        series.append(
            Series([runs[0], runs[-1]], [1e3 * comparison.direct.rms] * 2, colour, "\N{WHITE DIAMOND}", lined=True)
        )
        legend.append((comparison.case.target.name, colour))
    chart = Chart(series, "forward runs", "best popped shape off the target, rms [mm]", legend)
    return charts_svg([chart], "\N{WHITE DIAMOND} the direct method, one run")


def _direct(case: Case) -> Stages:
    return find_stages(case.target, case.layout, ROD, ends=PINNED)


def _shape(gap: Agreement | None) -> tuple[str, str]:
    return ("-", "-") if gap is None else (f"{1e3 * gap.rms:.3f}", f"{1e3 * gap.max:.2f}")


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
