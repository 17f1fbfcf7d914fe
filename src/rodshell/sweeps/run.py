"""A sweep: all designs of a plan, each computed once, into one folder."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from rodshell.errors import OutputError
from rodshell.formfinding.progress import Progress, silent
from rodshell.sweeps.columns import CONVERGED, STANDARD
from rodshell.sweeps.computing import ARCHIVES, Computation, Wanted
from rodshell.sweeps.engines import opened_engine
from rodshell.sweeps.identity import job_identity
from rodshell.sweeps.plan import Plan, Source, read_plan
from rodshell.sweeps.store import FOUND, STORE, Store
from rodshell.sweeps.table import CSV, PARQUET, Table, header_of, note_header, table_rows, write_parquet
from rodshell.validation import instance

BEST = "best"
COPY = "sweep.toml"
REPORT = "report.html"


@dataclass(frozen=True)
class Swept:
    """What a sweep has come to.

    Parameters
    ----------
    folder : of the sweep; None: nothing was written.
    designs : their number; computed : jobs that were computed now.
    verdicts : number of designs by verdict, "not checked" and "no form" among them.
    not_converged : number of forms that did not converge.
    failures : sentences of designs without a form, with their number, the most frequent first.
    """

    folder: Path | None
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
        lines += [f"no form ({count} designs): {sentence}" for sentence, count in self.failures[:MOST_FAILURES]]
        return "\n".join(lines)


MOST_FAILURES = 5
NO_FORM, NOT_CHECKED = "no form", "not checked"


def sweep(
    source: Source,
    out: str | PathLike[str],
    *,
    retry: bool = False,
    progress: Progress = silent,
) -> Swept:
    """Compute all designs of a sweep that are not finished yet, and write their table.

    Parameters
    ----------
    source : path of a sweep file, or its content as a mapping: {"base": "hemisphere", "axes": {"layout.spacing":
        ["25 mm", "30 mm"]}}. A base may also be a `Job`.
    out : folder of the sweep. What an earlier run has finished there is not computed again.
    retry : run jobs again that were stopped by a limit, or whose process died.
    progress : called as progress(stage, detail, 0.0).

    Returns
    -------
    What was found, in numbers; the table is table.csv in the folder, see also `read_sweep`.

    Raises
    ------
    InputError : the sweep, or the case of one of its designs, cannot be used; nothing was computed. OutputError : the
        folder cannot be written, or another sweep is writing there. KeyboardInterrupt : the table shows what is
        finished; the same call continues.
    """
    plan = read_plan(source)
    instance("out", out, str | PathLike, "the path of a folder")
    folder = Path(out).expanduser()
    check_designs(plan)
    require_own(folder)
    with Store(folder, writing=True) as store:
        note_header(store, plan.keys, plan.columns)
        store.plan((design.values, job_identity(design.job, plan.settings.until)) for design in plan.designs())
        if plan.text:
            (folder / COPY).write_text(plan.text, encoding="utf-8")
        table = Table(store)
        try:
            with opened_engine(plan.settings) as engine:
                computation = Computation(store, table, engine, plan.settings, progress, retry=retry)
                computation.compute(_wanted(plan, folder), "sweep", plan.count)
                if plan.settings.keep == "best":
                    _keep_best(plan, store, computation, folder)
        except KeyboardInterrupt:
            table.write()
            done = sum(store.outcomes().values())
            raise KeyboardInterrupt(
                f"{done} of {plan.count} designs are in {folder / CSV}; the same command continues from there"
            ) from None
        table.write()
        write_parquet(store)
        return swept(store, computation.computed)


def check_designs(plan: Plan) -> None:
    """Make the case of each design, one by one.

    Raises
    ------
    InputError : a case cannot have its values.
    """
    for _ in plan.designs():
        pass


def planned(plan: Plan, out: str | PathLike[str]) -> tuple[int, int]:
    """Number of different jobs of a sweep, and of those that are finished in a folder already; nothing is written.

    Parameters
    ----------
    plan : of the sweep; out : its folder, which may be missing.
    """
    jobs = {job_identity(design.job, plan.settings.until) for design in plan.designs()}
    folder = Path(out).expanduser()
    if not (folder / STORE).is_file():
        return len(jobs), 0
    with Store(folder, writing=False) as store:
        return len(jobs), sum(store.outcome(job) is not None for job in jobs)


def require_own(folder: Path) -> None:
    """OutputError where there are files of these names that a sweep did not write."""
    if not (folder / STORE).exists():
        for name in (CSV, PARQUET, REPORT, COPY):
            if (folder / name).exists():
                raise OutputError(
                    f"will not replace {folder / name}, which is not of a sweep: choose another folder, or move it"
                )


def swept(store: Store, computed: int) -> Swept:
    """What is in a store, in numbers."""
    verdicts, failures, lost = Counter[str](), Counter[str](), 0
    for design in store.finished():
        if design.outcome == FOUND:
            verdicts[design.row["verdict"] or NOT_CHECKED] += 1
            lost += design.row["status"] != CONVERGED
        else:
            verdicts[NO_FORM] += 1
            failures[design.row["status"]] += 1
    return Swept(store.folder, store.count(), computed, dict(verdicts), lost, tuple(failures.most_common()))


def _wanted(plan: Plan, folder: Path) -> Iterator[Wanted]:
    for design in plan.designs():
        job = job_identity(design.job, plan.settings.until)
        yield Wanted(job, design.job, folder / ARCHIVES / job if plan.settings.keep == "all" else None)


def _keep_best(plan: Plan, store: Store, computation: Computation, folder: Path) -> None:
    """The result folder of the best design, in best/."""
    best = best_job(store, plan.settings.best)
    if best is None or (store.note(BEST) == best and (folder / BEST / "result.json").is_file()):
        return
    job = next(each.job for each in _wanted(plan, folder) if each.id == best)
    computation.compute([Wanted(best, job, folder / BEST, again=True)], "best design", 1)
    store.take_note(BEST, best)


def best_job(store: Store, measure: str) -> str | None:
    """The job with the smallest value of a column, of those that converged and can be built; None: there is none.

    Parameters
    ----------
    store : of the sweep; measure : a column of its table.
    """
    keys, columns = header_of(store)
    names = [*keys, *STANDARD, *(column.name for column in columns)]
    best: tuple[float, str] | None = None
    for design, row in zip(store.finished(), table_rows(store, columns), strict=True):
        value = row[names.index(measure)]
        usable = design.row.get("status") == CONVERGED and design.row.get("verdict") != "unbuildable"
        if usable and isinstance(value, int | float) and (best is None or value < best[0]):
            best = (float(value), design.job)
    return best[1] if best else None
