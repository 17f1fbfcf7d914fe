"""The coordinator: jobs that are not finished are computed, each once, and recorded as they finish."""

from collections.abc import Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

from rodshell.formfinding.progress import Progress
from rodshell.job import Job
from rodshell.sweeps.engines import Engine
from rodshell.sweeps.identity import program_version
from rodshell.sweeps.plan import Settings
from rodshell.sweeps.store import FOUND, LOST, Store
from rodshell.sweeps.table import Table
from rodshell.sweeps.watched import Reply

ARCHIVES = "archives"
LOOK = 0.2  # s between two calls of progress


@dataclass(frozen=True)
class Wanted:
    """A job that is wanted.

    Parameters
    ----------
    id : its identity; job : itself.
    archive : the folder for its files; None: they are not wanted.
    again : whether it is run even if it is finished.
    """

    id: str
    job: Job
    archive: Path | None = None
    again: bool = False


class Computation:
    """Computes jobs and records them.

    Parameters
    ----------
    store : of finished jobs; table : which shows them; engine : that runs them; settings : how.
    progress : called at least each fifth of a second.
    retry : whether jobs that were stopped by a limit, or died, are run again.
    """

    def __init__(
        self, store: Store, table: Table, engine: Engine, settings: Settings, progress: Progress, *, retry: bool = False
    ) -> None:
        self._store, self._table, self._engine, self._settings = store, table, engine, settings
        self._progress, self._retry = progress, retry
        self._running = dict[Future[Reply], str]()
        self._begun = monotonic()
        self.computed = 0

    def compute(self, wanted: Iterable[Wanted], stage: str, total: int) -> None:
        """Compute those that are not finished.

        Parameters
        ----------
        wanted : jobs, taken one by one as there is room for them; the same job may come twice.
        stage : for the progress; total : number of jobs.

        Raises
        ------
        KeyboardInterrupt : what is finished is recorded. OutputError : it cannot be recorded. EngineError : jobs cannot
            be run.
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

    def is_finished(self, wanted: Wanted) -> bool:
        """Whether nothing has to be computed for a job."""
        outcome = self._store.outcome(wanted.id)
        if outcome is None or wanted.again or (self._retry and outcome in LOST):
            return False
        return wanted.archive is None or outcome != FOUND or (wanted.archive / "result.json").is_file()

    def _task(self, wanted: Wanted) -> dict[str, Any]:
        return {
            "case": wanted.job.to_toml(),
            "until": self._settings.until,
            "archive": None if wanted.archive is None else str(wanted.archive.absolute()),
            "version": program_version(),
        }

    def _collect(self, stage: str, done: int, total: int) -> None:
        """Wait for jobs, and record those that have finished."""
        for future in wait(self._running, LOOK, FIRST_COMPLETED).done:
            self._record(future)
        rate = self.computed / max(monotonic() - self._begun, 1e-9)
        speed = f", {rate:.3g} a second, {_time_text((total - done) / rate)} left" if self.computed else ""
        self._progress(stage, f"{done} of {total}{speed}", 0.0)
        self._table.refresh()

    def _record(self, future: "Future[Reply]") -> None:
        reply = self._engine.reply(future)
        self._store.record(self._running[future], reply["outcome"], reply["row"])
        del self._running[future]
        self.computed += 1


def _time_text(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
