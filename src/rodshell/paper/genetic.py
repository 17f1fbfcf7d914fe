"""The genetic algorithm beside the direct method: both shells popped up, what each cost, and how far their G0 differ.

The paper holds its G0 against that of a genetic algorithm [HQK 3.2, ref 30]. Ours is in `genetic_design` (what is
sought) and `genetic_search` (the run); the searches that came with the package are in its data, those of other seeds
are made, or gone on with, here. It seeks the best popped-up shape, the direct method the net: so the two differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.formfinding import Agreement, PatchForm, agreement, find_stages
from rodshell.formfinding.progress import silent
from rodshell.paper.charts import Chart, Series, charts_svg
from rodshell.paper.drapes import ROD, Case, Progress
from rodshell.paper.fig6 import CASES
from rodshell.paper.fig8_pictures import COLOURS
from rodshell.paper.genetic_design import Design
from rodshell.paper.genetic_history import WINDOW, History, stored, stored_footprint
from rodshell.paper.genetic_search import MOST, POPULATION, search
from rodshell.paper.panels import INK
from rodshell.paper.tables import aligned, result_of, write
from rodshell.results.folder import ResultFolder

__all__ = ["Comparison", "Genetic", "compare", "find", "make", "stored", "stored_footprint"]


SEED = 1
KEPT = Path("out") / "genetic-searches"
AGAIN = 1e-3  # share by which the rms of a shell that is popped up again may be another
REPEATS = 3  # of the direct method; the least time counts
COLUMNS = (
    "target", "G0 by", "values sought", "forward runs", "processor time [s]", "popped shape, rms [mm]", "max [mm]",
    "G0 off the direct one, max [mm]", "rms [mm]", "how it ended",
)  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """One target by both.

    Parameters
    ----------
    direct : of the direct method, pinned; best : of the genetic algorithm's best, popped up again; None where it does
        not stand.
    apart : (2m,) how far the rod ends of the two G0 lie apart [m].
    """

    case: Case
    history: History
    direct: Agreement
    best: Agreement | None
    apart: Floats

    @property
    def status(self) -> str:
        """ "converged", or what is wrong."""
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
        """In a few words."""
        history = self.history
        count = f"{len(history.generations)} generations of {history.population}"
        said = "converged" if history.converged else "NOT CONVERGED"
        if len(history.generations) <= WINDOW:
            return f"{said}: {count}"
        return f"{said}: {_percent(history.last_gain)} gained in the last {WINDOW} of {count}"

    def rows(self) -> list[tuple[str, ...]]:
        """Two of the table."""
        name, history, apart = self.case.target.name, self.history, 1e3 * self.apart
        off = (f"{apart.max():.2f}", f"{np.sqrt(np.mean(apart**2)):.2f}")
        direct = (name, "direct method", "-", "1", f"{history.direct_seconds:.2g}", *_shape(self.direct), "-", "-", "-")
        found = (
            name, "genetic algorithm", str(len(history.variables)), str(history.runs), f"{history.seconds:.0f}",
            *_shape(self.best), *off, self.ended,
        )  # fmt: skip
        return [direct, found]

    def result(self) -> dict[str, Any]:
        """Of result.json, SI."""
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
class Genetic:
    """All targets."""

    comparisons: tuple[Comparison, ...]

    @property
    def status(self) -> str:
        """ "converged", or the first thing that is wrong."""
        return next((one.status for one in self.comparisons if one.status != "converged"), "converged")

    def rows(self) -> list[tuple[str, ...]]:
        """The table, two rows for each target."""
        return [row for one in self.comparisons for row in one.rows()]

    def summary(self) -> str:
        """The table as text."""
        head = "The genetic algorithm [HQK 3.2] beside the direct method: ends pinned, 15 mm edges, every run from flat"
        gains = (
            f"{one.case.target.name} {one.direct.rms / one.best.rms:.2f}, for {one.history.runs} times the runs"
            for one in self.comparisons
            if one.best is not None
        )
        foot = f"rms of the direct method over that of the genetic algorithm: {'; '.join(gains)}"
        return "\n".join([head, "", aligned(COLUMNS, self.rows()), "", foot])

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return result_of("genetic", self.status, comparisons=[one.result() for one in self.comparisons])

    def save(self, folder: str | PathLike[str] | ResultFolder) -> None:
        """Write the table, the convergence as a picture, and each history, to `folder`.

        Raises
        ------
        OutputError : it cannot be written, or holds other things than a result.
        """
        histories = {f"{one.case.target.name}.json": one.history.text() for one in self.comparisons}
        picture = convergence_svg(self.comparisons)
        write(folder, self.result(), self.summary(), COLUMNS, self.rows(), {"genetic": picture}, texts=histories)


def make(
    progress: Progress,
    *,
    seed: int | None = None,
    jobs: int | None = None,
    generations: int | None = None,
    target: str | None = None,
    cases: Sequence[Case] = CASES,
    kept: Path = KEPT,
) -> Genetic:
    """Compare both on all targets, by the searches that came with the package, or by new ones.

    Parameters
    ----------
    seed : of searches that are made now, or gone on with; jobs : processes, generations : the most of these.
    target : the name of the only one.
    kept : folder of the values of the searches that are made.

    Raises
    ------
    InputError : jobs or generations without a seed; an unknown target; pymoo is needed and not installed; a file of
        values is broken or of another search.
    """
    if seed is None and (jobs is not None or generations is not None):
        raise InputError("jobs and generations are those of a new search: give its seed, too")
    chosen = [case for case in cases if target in (None, case.target.name)]
    if not chosen:
        names = ", ".join(case.target.name for case in cases)
        raise InputError(f"there is no target {target} in the paper: use one of {names}")
    comparisons = []
    for case in chosen:
        history = stored(case.target.name) if seed is None else None
        if history is None:
            begun = SEED if seed is None else seed
            history = find(case, kept, seed=begun, jobs=jobs or 1, most=generations or MOST, progress=progress)
        progress(f"{case.target.name}, once more", "pop-up", 0.0)
        comparisons.append(compare(case, history))
    return Genetic(tuple(comparisons))


def find(
    case: Case, kept: Path, *, seed: int, jobs: int = 1, population: int = POPULATION, most: int = MOST,
    progress: Progress = silent,
) -> History:  # fmt: skip
    """A whole search, see `search`; its values are kept in the folder `kept`."""
    times = []
    for _ in range(REPEATS):
        begun = process_time()
        direct = _direct(case)
        times.append(process_time() - begun)
    design, name = Design.of(direct), case.target.name
    file = kept / f"{name}-seed{seed}.json"
    found = search(design, file, seed=seed, jobs=jobs, population=population, most=most, progress=progress)
    rods = tuple(line.name for line in design.lines)
    footprint = design.footprint(found.variables).points
    return History(name, seed, population, found.generations, found.variables, rods, footprint, min(times))


def compare(case: Case, history: History) -> Comparison:
    """The direct method's shell, and a history's best popped up again."""
    direct = _direct(case)
    popped = Design.of(direct).pop_up(history.variables)
    stands = popped is not None and popped.report.stable
    best = agreement(popped, case.target) if popped is not None and stands else None
    apart = np.linalg.norm(history.footprint - direct.footprint.points, axis=1)
    return Comparison(case, history, direct.agreement["pinned"], best, apart)


def convergence_svg(comparisons: Sequence[Comparison]) -> str:
    """The best of each search against its forward runs, and the direct method's error as a level."""
    series, legend = list[Series](), list[tuple[str, str]]()
    for one in comparisons:
        colour = COLOURS.get(one.case.target.name, INK)
        made = one.history.generations
        runs, ends = [g.runs for g in made], [made[0].runs, made[-1].runs]
        series.append(Series(runs, [1e3 * g.best for g in made], colour, "", lined=True))
        series.append(Series(ends, [1e3 * one.direct.rms] * 2, colour, "\N{WHITE DIAMOND}", lined=True))
        legend.append((one.case.target.name, colour))
    chart = Chart(series, "forward runs", "best popped shape off the target, rms [mm]", legend)
    return charts_svg([chart], "\N{WHITE DIAMOND} the direct method, one run")


def _direct(case: Case) -> PatchForm:
    return find_stages(case.target, case.layout, ROD, ends=("pinned",))


def _shape(gap: Agreement | None) -> tuple[str, str]:
    return ("-", "-") if gap is None else (f"{1e3 * gap.rms:.3f}", f"{1e3 * gap.max:.2f}")


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
