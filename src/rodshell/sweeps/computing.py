"""The coordinator: jobs that are not finished are computed, each once, and recorded as they finish."""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import Any

from rodshell.errors import OutputError, RodshellError
from rodshell.job import Job
from rodshell.progress import Progress, require_progress
from rodshell.sweeps.engines import Engine, opened_engine
from rodshell.sweeps.identity import job_identity, program_version
from rodshell.sweeps.plan import Plan
from rodshell.sweeps.report import REPORT
from rodshell.sweeps.store import ARCHIVES, FOUND, LOST, STORE, Store, replaced
from rodshell.sweeps.table import CSV, PARQUET, Table, write_parquet
from rodshell.sweeps.watched import Reply

_COPY = "sweep.toml"
CHECKED = "fabrication"  # the stage after all checks
_LOOK = 0.2  # s between two calls of progress


@dataclass(frozen=True)
class Wanted:
    """A job that is wanted.

    Args:
        archive: the folder for its files; None: they are not wanted.
        again: whether it is run even if it is finished.
        until: its last stage; None: that of the plan.
    """

    id: str
    job: Job
    archive: Path | None = None
    again: bool = False
    until: str | None = None


class Computation:
    """Computes jobs and records them; see `opened_computation`.

    Args:
        progress: called at least each fifth of a second.
        retry: whether jobs that were stopped by a limit, or died, are run again.
    """

    def __init__(
        self, plan: Plan, store: Store, table: Table, engine: Engine, progress: Progress, *, retry: bool
    ) -> None:
        self.store, self.computed = store, 0
        self._plan, self._table, self._engine = plan, table, engine
        self._progress, self._retry = progress, retry
        self._running = dict[Future[Reply], str]()
        self._begun = monotonic()

    def wanted(self, job: Job, *, kept: bool) -> Wanted:
        """A job, perhaps with its result folder in archives/; InputError where a file of its case cannot be read."""
        name = job_identity(job, self._plan.settings.until)
        return Wanted(name, job, self.store.inside(f"{ARCHIVES}/{name}") if kept else None)

    def compute(self, wanted: Iterable[Wanted], stage: str, total: int) -> None:
        """Compute those that are not finished.

        Args:
            wanted: jobs, taken one by one as there is room for them; the same job may come twice.

        Raises:
            KeyboardInterrupt: what is finished is recorded. OutputError : it cannot be recorded. EngineError : jobs
                cannot be run.
        """
        done = 0
        try:
            for each in wanted:
                done += 1
                if each.id in self._running.values() or self.is_finished(each):
                    continue
                while len(self._running) >= self._engine.slots:
                    self._collect(stage, done - len(self._running), total)
                self._running[self._engine.submit(self._task(each))] = each.id
            while self._running:
                self._collect(stage, total - len(self._running), total)
        except BaseException:
            for future in [future for future in self._running if future.done() and not future.cancelled()]:
                if future.exception() is None:
                    self._record(future)  # what has finished meanwhile
            self._running.clear()
            raise

    def archived(self, jobs: Sequence[str]) -> list[Wanted]:
        """Finished jobs, in this order, wanted with their result folders in archives/."""
        return [self.wanted(job, kept=True) for job in self._finished(jobs)]

    def checked(self, jobs: Sequence[str]) -> list[Wanted]:
        """Finished jobs that have no verdict, wanted with all checks."""
        unchecked = [job for job in jobs if not self.store.row(job).get("verdict")]
        found = (self.wanted(job, kept=False) for job in self._finished(unchecked))
        return [replace(each, again=True, until=CHECKED) for each in found]

    def _finished(self, jobs: Sequence[str]) -> list[Job]:
        keys = {design.job: design.keys for design in self.store.finished() if design.job in jobs}
        return [self._plan.job(keys[job]) for job in jobs]

    def is_finished(self, wanted: Wanted) -> bool:
        """Whether nothing has to be computed for a job."""
        outcome = self.store.outcome(wanted.id)
        if outcome is None or wanted.again or (self._retry and outcome in LOST):
            return False
        return wanted.archive is None or outcome != FOUND or (wanted.archive / "result.json").is_file()

    def _task(self, wanted: Wanted) -> dict[str, Any]:
        return {
            "case": wanted.job.to_toml(),
            "until": wanted.until or self._plan.settings.until,
            "archive": None if wanted.archive is None else str(wanted.archive.absolute()),
            "version": program_version(),
        }

    def _collect(self, stage: str, done: int, total: int) -> None:
        """Wait for jobs, and record those that have finished."""
        for future in wait(self._running, _LOOK, FIRST_COMPLETED).done:
            self._record(future)
        rate = self.computed / max(monotonic() - self._begun, 1e-9)
        speed = f", {rate:.3g} a second, {_time_text((total - done) / rate)} left" if self.computed else ""
        self._progress(stage, f"{done} of {total}{speed}", 0.0)
        self._table.refresh()

    def _record(self, future: "Future[Reply]") -> None:
        reply = self._engine.reply(future)
        self.store.record(self._running[future], reply["outcome"], reply["row"])
        del self._running[future]
        self.computed += 1


def _time_text(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


@contextmanager
def opened_computation(
    plan: Plan, folder: Path, progress: Progress, *, retry: bool, address: str | None
) -> Iterator[Computation]:
    """A `Computation` by an `opened_engine` into a folder, whose table shows what is finished however this is left.

    Raises:
        InputError, EngineError: the engine cannot be used. OutputError : the folder cannot be written, is in use, or
            has files that are not of a sweep. KeyboardInterrupt : with what is finished, in a sentence.
    """
    require_progress(progress)
    _require_own(folder)
    with Store(folder, writing=True) as store:
        if plan.origin.text:
            with replaced(folder / _COPY) as part:
                part.write_text(plan.origin.text, encoding="utf-8")
        table = Table(store)
        try:
            with opened_engine(plan.settings, address) as engine:
                yield Computation(plan, store, table, engine, progress, retry=retry)
        except RodshellError:
            with suppress(OutputError):
                table.write()
            raise
        except KeyboardInterrupt:
            table.write()
            done = f"{sum(store.outcomes().values())} of {store.count()} designs are in {folder / CSV}"
            raise KeyboardInterrupt(f"{done}; the same command continues from there") from None
        table.write()
        write_parquet(store)


def _require_own(folder: Path) -> None:
    """OutputError where there are files of these names that a sweep did not write."""
    if not (folder / STORE).exists():
        for name in (CSV, PARQUET, REPORT, _COPY):
            if (folder / name).exists():
                raise OutputError(
                    f"will not replace {folder / name}, which is not of a sweep: choose another folder, or move it"
                )
