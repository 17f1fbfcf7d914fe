"""What a sweep has found: one row a job in an SQLite file, which the coordinator alone writes.

Each job is a transaction of its own, so that whatever is killed, what is finished stays. The designs of the present
sweep are a second table, which names a job for each position: when the sweep changes, only they are written again.
"""

import json
import sqlite3
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Self

from rodshell.dataclass import dataclass
from rodshell.errors import OutputError

STORE, LOCK, ARCHIVES = "sweep.sqlite", "sweep.lock", "archives"  # in the folder of a sweep
FORMAT = 1
CACHE = 500  # kB of the coordinator's memory
LOG = 200  # pages of SQLite's log, which is then merged into the file
PAGE = 8192  # B: some rows fit on each, so that little of it is left empty
TABLES = """
CREATE TABLE IF NOT EXISTS jobs (id TEXT PRIMARY KEY, outcome TEXT NOT NULL, row BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS designs (position INTEGER PRIMARY KEY, job TEXT NOT NULL, keys TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS design_of_job ON designs (job);
CREATE TABLE IF NOT EXISTS notes (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
"""
FOUND = "found"
LOST = ("stopped", "crashed")  # by a limit or with its process: another try may end differently


@dataclass(frozen=True)
class Finished:
    """A design whose job is finished.

    Parameters
    ----------
    position : of the design; job : its identity.
    keys : values of the axes' keys, in JSON's types.
    outcome : "found", "refused" (bad input), "failed" (an error of the program), "stopped" (by a limit) or "crashed".
    row : what is kept of it, see `columns.row_of`; of a job that found no form its status alone.
    """

    position: int
    job: str
    keys: list[Any]
    outcome: str
    row: Mapping[str, Any]


class Store:
    """The file of a sweep; use it in a `with`.

    Parameters
    ----------
    folder : of the sweep.
    writing : whether jobs are recorded; then the folder is made, and no other sweep can use it.

    Raises
    ------
    OutputError : it cannot be opened, or another sweep is writing there.
    """

    def __init__(self, folder: Path, *, writing: bool) -> None:
        self.folder, self.path, self.writing = folder, folder / STORE, writing
        self._lock: sqlite3.Connection | None = None
        self._connection: sqlite3.Connection = None  # type: ignore[assignment]  # until it is entered

    def __enter__(self) -> Self:
        try:
            self._begin()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _begin(self) -> None:
        with self._errors():
            if self.writing:
                self._take()
                self._open(str(self.path))
                self._connection.execute(f"PRAGMA page_size = {PAGE}")
                self._connection.execute("PRAGMA journal_mode = WAL")
                self._connection.execute("PRAGMA synchronous = NORMAL")
                self._connection.execute(f"PRAGMA cache_size = -{CACHE}")
                self._connection.execute(f"PRAGMA wal_autocheckpoint = {LOG}")
                self._connection.executescript(TABLES)
                self._connection.execute("INSERT OR IGNORE INTO notes VALUES ('format', ?)", (str(FORMAT),))
            elif not self.path.is_file():
                raise OutputError(f"{self.folder} holds no sweep: it has no {STORE}")
            else:
                self._open(f"{self.path.absolute().as_uri()}?mode=ro")
            if self.note("format") != str(FORMAT):
                raise OutputError(f"{self.path} was written by another version of rodshell: choose another folder")

    def __exit__(self, *_: object) -> None:
        for connection in (self._connection, self._lock):
            if connection is not None:
                connection.close()

    def _open(self, where: str) -> None:
        self._connection = sqlite3.connect(where, isolation_level=None, uri=where.startswith("file:"), timeout=30)

    def _take(self) -> None:
        """Make the folder and lock it, until this process ends in whatever way."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"cannot write {self.folder}: {error.strerror}; choose another folder") from None
        self._lock = sqlite3.connect(self.folder / LOCK, isolation_level=None, timeout=0)
        try:
            self._lock.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError as error:
            if "locked" not in str(error):
                raise
            raise OutputError(
                f"another sweep is writing into {self.folder}: wait for its end, stop it, or choose another folder"
            ) from None

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """Errors of the database in one sentence."""
        try:
            yield
        except sqlite3.Error as error:
            if "full" in str(error) or "I/O" in str(error):
                raise OutputError(
                    f"cannot write {self.path}: {error}; what was finished before is kept: make room, and start the "
                    "same sweep again"
                ) from None
            raise OutputError(f"cannot use {self.path}: {error}") from None

    # Notes

    def note(self, name: str) -> str | None:
        """What was noted under a name."""
        with self._errors():
            found = self._connection.execute("SELECT value FROM notes WHERE name = ?", (name,)).fetchone()
        return None if found is None else str(found[0])

    def take_note(self, name: str, value: str) -> None:
        """Note something about the sweep."""
        with self._errors():
            self._connection.execute("INSERT OR REPLACE INTO notes VALUES (?, ?)", (name, value))

    # Designs

    def plan(self, designs: Iterable[tuple[Sequence[Any], str]], *, notes: Mapping[str, str] | None = None) -> None:
        """Write the designs of the sweep in place of earlier ones, all or none.

        Parameters
        ----------
        designs : values of the keys, and the identity of the job.
        notes : by name, to be noted with them.
        """
        self._write(designs, notes or {}, more=False)

    def add(self, designs: Iterable[tuple[Sequence[Any], str]]) -> None:
        """Write designs behind those that there are, all or none; `designs` as of `plan`."""
        self._write(designs, {}, more=True)

    def _write(self, designs: Iterable[tuple[Sequence[Any], str]], notes: Mapping[str, str], *, more: bool) -> None:
        with self._errors():
            self._connection.execute("BEGIN")
            try:
                if not more:
                    self._connection.execute("DELETE FROM designs")
                first = self.count()
                rows = ((first + k, job, json.dumps(list(keys))) for k, (keys, job) in enumerate(designs))
                self._connection.executemany("INSERT INTO designs VALUES (?, ?, ?)", rows)
                self._connection.executemany("INSERT OR REPLACE INTO notes VALUES (?, ?)", notes.items())
                self._connection.execute("COMMIT")
            except BaseException:
                with suppress(sqlite3.Error):
                    self._connection.execute("ROLLBACK")
                raise

    def count(self) -> int:
        """Number of designs."""
        return int(self._connection.execute("SELECT count(*) FROM designs").fetchone()[0])

    def outcomes(self) -> dict[str, int]:
        """Number of designs that are finished, by outcome."""
        query = "SELECT outcome, count(*) FROM designs JOIN jobs ON job = id GROUP BY outcome"
        with self._errors():
            return dict(self._connection.execute(query).fetchall())

    def finished(self) -> Iterator[Finished]:
        """The designs whose jobs are finished, in their order."""
        query = "SELECT position, job, keys, outcome, row FROM designs JOIN jobs ON job = id ORDER BY position"
        with self._errors():
            for position, job, keys, outcome, row in self._connection.execute(query):
                yield Finished(position, job, json.loads(keys), outcome, json.loads(zlib.decompress(row)))

    # Jobs

    def outcome(self, job: str) -> str | None:
        """How a job ended; None if it is not finished."""
        with self._errors():
            found = self._connection.execute("SELECT outcome FROM jobs WHERE id = ?", (job,)).fetchone()
        return None if found is None else str(found[0])

    def row(self, job: str) -> dict[str, Any]:
        """What is kept of a finished job."""
        with self._errors():
            (row,) = self._connection.execute("SELECT row FROM jobs WHERE id = ?", (job,)).fetchone()
        content: dict[str, Any] = json.loads(zlib.decompress(row))
        return content

    def record(self, job: str, outcome: str, row: Mapping[str, Any]) -> None:
        """A job is finished.

        Parameters
        ----------
        job : its identity; outcome, row : see `Finished`.

        Raises
        ------
        OutputError : it cannot be written.
        """
        kept = zlib.compress(json.dumps(row, separators=(",", ":")).encode(), 9)
        with self._errors():
            self._connection.execute("INSERT OR REPLACE INTO jobs VALUES (?, ?, ?)", (job, outcome, kept))
