"""A sweep: all designs of a plan, each computed once, into one folder."""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from rodshell.figures.records import printable
from rodshell.progress import Progress, silent
from rodshell.sweeps.columns import CONVERGED, is_usable
from rodshell.sweeps.computing import Computation, opened_computation
from rodshell.sweeps.identity import job_identity
from rodshell.sweeps.plan import Settings, Source, SweepPlan, read_plan
from rodshell.sweeps.report import SHAPES, Page, require_plotly, write_report
from rodshell.sweeps.store import FOUND, STORE, Store
from rodshell.sweeps.table import Sheet, header_notes
from rodshell.validation import file_path

_BEST = "best"


@dataclass(frozen=True)
class Swept:
    """What a sweep has come to.

    Args:
        computed: number of jobs that were computed now.
        verdicts: number of designs by verdict, "not checked" and "no form" among them.
        not_converged: number of forms that did not converge.
        failures: sentences of designs without a form, with their number, the most frequent first.
    """

    folder: Path
    designs: int
    computed: int
    verdicts: dict[str, int]
    not_converged: int
    failures: tuple[tuple[str, int], ...]

    @property
    def finished(self) -> int:
        """Number of designs that have a row."""
        return sum(self.verdicts.values())

    def summary(self) -> str:
        """A few lines of text."""
        counts = ", ".join(f"{count} {verdict}" for verdict, count in sorted(self.verdicts.items()))
        lines = [f"{self.finished} of {self.designs} designs are finished, {self.computed} computed now: {counts}"]
        if self.not_converged:
            lines.append(f"NOT CONVERGED: {self.not_converged} forms; their column status says at which stage")
        lines += [
            f"no form ({count} design{'s' if count != 1 else ''}): {sentence}"
            for sentence, count in self.failures[:_MOST_FAILURES]
        ]
        return "\n".join(map(printable, lines))


_MOST_FAILURES = 5
_NO_FORM, _NOT_CHECKED = "no form", "not checked"


def sweep(
    source: Source | SweepPlan,
    out: str | PathLike[str],
    *,
    retry: bool = False,
    report: bool = False,
    address: str | None = None,
    progress: Progress = silent,
) -> Swept:
    """Compute all designs of a sweep that are not finished yet, and write their table.

    Args:
        source: path of a sweep file, or its content as a mapping: {"base": "hemisphere", "axes": {"layout.spacing":
            ["25 mm", "30 mm"]}}. A base may also be a `Job`.
        out: folder of the sweep. What an earlier run has finished there is not computed again.
        retry: run jobs again that were stopped by a limit, or whose process died.
        report: also write report.html, and keep the results of the best designs, whose shapes it shows.
        address: of a dask scheduler that you trust, or its scheduler file; default: as `opened_engine` says.
        progress: called as progress(stage, detail, 0.0).

    Returns:
        What was found, in numbers; the table is table.csv in the folder, see also `read_sweep`.

    Raises:
        InputError: the sweep, or the case of one of its designs, cannot be used; nothing was computed. OutputError :
            the folder cannot be written, or another sweep is writing there. KeyboardInterrupt : the table shows what is
            finished; the same call continues.
    """
    plan = source if isinstance(source, SweepPlan) else read_plan(source)
    folder = file_path("out", out)
    if report:
        require_plotly()
    for _ in plan.designs():  # each case is made, so that none is refused when others were computed
        pass
    with opened_computation(plan, folder, progress, retry=retry, address=address) as computation:
        store, until = computation.store, plan.settings.until
        designs = ((values, job_identity(job, until)) for values, job in plan.designs())
        store.plan(designs, notes=header_notes(plan.keys, plan.columns))
        kept = plan.settings.keep == "all"
        computation.compute((computation.wanted(job, kept=kept) for _, job in plan.designs()), "sweep", plan.count)
        found = swept(store, computation.computed)
        if plan.settings.keep == "best":
            _keep_best(plan, computation)
        if report:
            shapes = best_jobs(store, plan.settings)[:SHAPES]
            computation.compute(computation.archived(shapes), "shapes of the report", len(shapes))
            write_report(store, _page(plan, found, shapes))
    return found


def planned(plan: SweepPlan, out: str | PathLike[str]) -> tuple[int, int]:
    """Number of different jobs of a sweep, and of those that are finished in its folder, if any; nothing is written."""
    jobs = {job_identity(job, plan.settings.until) for _, job in plan.designs()}
    folder = file_path("out", out)
    if not os.path.lexists(folder / STORE):
        return len(jobs), 0
    with Store(folder, writing=False) as store:
        return len(jobs), sum(store.outcome(job) is not None for job in jobs)


def swept(store: Store, computed: int) -> Swept:
    """What is in a store, in numbers."""
    verdicts, failures, lost = Counter[str](), Counter[str](), 0
    for design in store.finished():
        if design.outcome == FOUND:
            verdicts[design.row.get("verdict") or _NOT_CHECKED] += 1
            lost += design.row["status"] != CONVERGED
        else:
            verdicts[_NO_FORM] += 1
            failures[design.row["status"]] += 1
    return Swept(store.folder, store.count(), computed, dict(verdicts), lost, tuple(failures.most_common()))


def _keep_best(plan: SweepPlan, computation: Computation) -> None:
    """The result folder of the best design, in best/."""
    store = computation.store
    best = next(iter(best_jobs(store, plan.settings)), None)
    if best is None or (store.note(_BEST) == best and (store.folder / _BEST / "result.json").is_file()):
        return
    (wanted,) = computation.archived([best])
    computation.compute([replace(wanted, archive=store.inside(_BEST), again=True)], "best design", 1)
    store.take_note(_BEST, best)


def best_jobs(store: Store, settings: Settings) -> list[str]:
    """The jobs that converged, can be built, and are without the findings that are not wanted, the best first."""
    found = dict[str, float]()
    for design, cells in Sheet(store).rows():
        if is_usable(design.row, settings.without) and isinstance(value := cells[settings.best], int | float):
            found[design.job] = float(value)
    return sorted(found, key=lambda job: found[job])


def _page(plan: SweepPlan, found: Swept, shapes: Sequence[str]) -> Page:
    """What the report says."""
    measure = plan.settings.best
    numbers = (key for axis in plan.axes for k, key in enumerate(axis.keys) if _varies([row[k] for row in axis.rows]))
    return Page(
        kind="rodshell sweep",
        plan=plan,
        summary=found.summary().splitlines(),
        first=(next(numbers, "total_length"), measure),
        measures=[measure],
        larger=(),
        counts=lambda design: is_usable(design.row, plan.settings.without),
        shapes=shapes,
        caption=f"The designs with the smallest {measure} that converged and can be built. Click one for its report.",
    )


def _varies(values: Sequence[object]) -> bool:
    """Whether they are different numbers."""
    return all(isinstance(value, int | float) for value in values) and len({*values}) > 1
