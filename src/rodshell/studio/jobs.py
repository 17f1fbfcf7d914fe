"""Jobs of the programming interface: a case goes in, a result folder comes out."""

import json
import secrets
from collections import deque
from pathlib import Path
from typing import Any

from rodshell.errors import InputError
from rodshell.studio.session import NAME, WorkerProcess
from rodshell.studio.worker import News, Order

MOST_WAITING = 100


class Jobs:
    """A queue of jobs with one process, and what became of them, in a folder each.

    Parameters
    ----------
    folder : in which each job has a folder with status.json and, when it is done, result/.
    time_limit : of a job [s].
    """

    def __init__(self, folder: Path, time_limit: float) -> None:
        self.folder, self._time_limit = folder, time_limit
        self._queue: deque[tuple[str, dict[str, Any]]] = deque()
        self._running: tuple[str, int, dict[str, Any]] | None = None
        self._serial = 0
        self._worker = WorkerProcess(self._hear)
        for path in folder.glob("*/status.json"):  # what an earlier server left unfinished
            status = json.loads(path.read_text(encoding="utf-8"))
            if status["status"] in ("queued", "running"):
                self._queue.append((path.parent.name, status["case"]))

    def resume(self) -> None:
        """Run what an earlier server did not finish."""
        self._next()

    def add(self, case: dict[str, Any]) -> str:
        """Queue a case; the id of its job.

        Raises
        ------
        InputError : too many jobs wait.
        """
        if len(self._queue) >= MOST_WAITING:
            raise InputError(f"{MOST_WAITING} jobs wait already: try again later")
        name = secrets.token_urlsafe(18)
        (self.folder / name).mkdir(parents=True)
        self._write(name, {"status": "queued", "case": case})
        self._queue.append((name, case))
        self._next()
        return name

    def get(self, name: str) -> dict[str, Any] | None:
        """Status of a job, its result.json and the names of its files when it is done; None: there is none."""
        path = self.folder / name / "status.json"
        if not NAME.fullmatch(name) or not path.is_file():
            return None
        status: dict[str, Any] = _plain_json(path)
        result = self.folder / name / "result"
        if status["status"] == "done":
            status["result"] = _plain_json(result / "result.json")
            status["files"] = [
                path.relative_to(result).as_posix() for path in sorted(result.rglob("*")) if path.is_file()
            ]
        return {"id": name} | status

    def file(self, name: str, path: str) -> Path | None:
        """A file of a job's result by its name; None: there is none."""
        job = self.get(name)
        return self.folder / name / "result" / path if job and path in job.get("files", ()) else None

    def end(self) -> None:
        """End the process; what it was doing is run again by the next server."""
        self._worker.end()

    def _next(self) -> None:
        if self._running is None and self._queue:
            name, case = self._queue.popleft()
            self._serial += 1
            self._running = (name, self._serial, case)
            self._write(name, {"status": "running", "case": case})
            folder = str(self.folder / name / "result")
            self._worker.order(Order(self._serial, "job", case, time_limit=self._time_limit, folder=folder))

    def _hear(self, news: News) -> None:
        if self._running is None or news.serial != self._running[1] or news.kind not in ("done", "failed"):
            return
        name, _, case = self._running
        sentence = {} if news.kind == "done" else {"sentence": news.facts["sentence"]}
        self._write(name, {"status": news.kind, "case": case, **sentence})
        self._running = None
        self._next()

    def _write(self, name: str, status: dict[str, Any]) -> None:
        new = self.folder / name / "status.json.new"
        new.write_text(json.dumps(status), encoding="utf-8")
        new.replace(self.folder / name / "status.json")


def _plain_json(path: Path) -> Any:
    """What a file holds; null in the place of NaN and infinities, which JSON does not have but cases once held."""
    return json.loads(path.read_text(encoding="utf-8"), parse_constant=lambda _: None)
