"""Jobs of the programming interface: a case goes in, a result folder comes out."""

import logging
import os
import secrets
import shutil
from collections import deque
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator

from rodshell.errors import InputError
from rodshell.studio.kept import BLOCK, NAME, Room, read_record, write_record
from rodshell.studio.process import WorkerProcess
from rodshell.studio.worker import News, Order
from rodshell.untrusted import limit, raised

UPLOADS = "uploads"  # folder of a job's files
WAITING = 100  # jobs that wait at once


def _status(kept: dict[str, Any]) -> dict[str, Any]:
    """What became of a job, as it is kept."""
    if kept.get("status") not in ("queued", "running", "done", "failed") or not isinstance(kept.get("case"), dict):
        raise ValueError("it does not say what became of a case")
    return kept


_STATUS = Annotated[dict[str, Any], AfterValidator(_status)]


class Jobs:
    """A queue of jobs with one process, and what became of them, in a folder each.

    Args:
        folder: in which each job has a folder with status.json and, when it is done, result/.
        time_limit: of a job [s].
    """

    def __init__(self, folder: Path, time_limit: float, room: Room) -> None:
        self.folder, self._time_limit, self._room = folder, time_limit, room
        self._queue: deque[tuple[str, dict[str, Any]]] = deque()
        self._running: tuple[str, int, dict[str, Any]] | None = None
        self._serial = 0
        self._worker = WorkerProcess(self._hear)
        room.users.append(lambda: {name for name, *_ in self._queue} | ({self._running[0]} if self._running else set()))
        for path in folder.glob("*/status.json"):  # what an earlier server left unfinished
            if not NAME.fullmatch(path.parent.name):
                continue
            try:
                status = read_record(path, _STATUS)
            except InputError as reason:
                logging.getLogger(__name__).warning("a job is lost: %s", reason)
                continue
            if status["status"] in ("queued", "running"):
                self._queue.append((path.parent.name, status["case"]))

    def add(self, case: dict[str, Any], size: int, uploads: Path | None = None) -> str:
        """Queue a case; the id of its job.

        Args:
            size: of the case [bytes].
            uploads: folder of the files that it may name, of which the job keeps copies; None: it may name none.

        Raises:
            InputError: too many jobs wait, or there is no room for another.
        """
        if len(self._queue) >= limit(WAITING):
            raise InputError(
                f"{limit(WAITING):g} jobs wait already: try again later, {raised(WAITING, len(self._queue) + 1)}"
            )
        files = [] if uploads is None else [path for path in uploads.iterdir() if path.is_file()]
        self._room.make((2 + len(files)) * BLOCK + size + sum(path.stat().st_size for path in files))
        name = secrets.token_urlsafe(18)
        (self.folder / name / UPLOADS).mkdir(parents=True)
        for path in files:
            shutil.copyfile(path, self.folder / name / UPLOADS / path.name)
        write_record(self.folder / name / "status.json", {"status": "queued", "case": case})
        self._queue.append((name, case))
        self.run_next()
        return name

    def get(self, name: str) -> dict[str, Any] | None:
        """Status of a job, its result.json and the names of its files when it is done; None: there is none."""
        folder = self.folder / name
        if not NAME.fullmatch(name) or not os.path.lexists(folder / "status.json"):
            return None
        result = folder / "result"
        try:
            status: dict[str, Any] = read_record(folder / "status.json", _STATUS)
            if status["status"] == "done":
                status["result"] = read_record(result / "result.json", dict[str, Any])
                files = [path for path in sorted(result.rglob("*")) if path.is_file() and not path.is_symlink()]
                status["files"] = [path.relative_to(result).as_posix() for path in files]
        except InputError:
            return {"id": name, "status": "failed", "sentence": "what was kept of this job is damaged: send it again"}
        return {"id": name} | status

    def file(self, name: str, path: str) -> Path | None:
        """A file of a job's result by its name; None: there is none."""
        job = self.get(name)
        return self.folder / name / "result" / path if job and path in job.get("files", ()) else None

    def end(self) -> None:
        """End the process; what it was doing is run again by the next server."""
        self._worker.end()

    def run_next(self) -> None:
        """Run the job that has waited longest, unless one runs; the first may be of an earlier server."""
        if self._running is None and self._queue:
            name, case = self._queue.popleft()
            self._serial += 1
            self._running = (name, self._serial, case)
            self._write(name, {"status": "running", "case": case})
            folder, uploads = (str(self.folder / name / part) for part in ("result", UPLOADS))
            order = Order(self._serial, "job", case, time_limit=self._time_limit, folder=folder, uploads=uploads)
            self._worker.order(order)

    def _hear(self, news: News) -> None:
        if self._running is None or news.serial != self._running[1] or news.kind not in ("done", "failed"):
            return
        name, _, case = self._running
        status = {"status": news.kind, "case": case}
        if news.kind == "failed":
            status["sentence"] = news.facts["sentence"].replace(f"{self.folder / name}{os.sep}", "")
        self._write(name, status)
        self._running = None
        self._room.forget()
        self.run_next()

    def _write(self, name: str, status: dict[str, Any]) -> None:
        """Keep what became of a job; where that cannot be written, the next server runs it again."""
        try:
            write_record(self.folder / name / "status.json", status)
        except OSError as reason:
            logging.getLogger(__name__).warning("what became of a job is not kept: %s", reason)
