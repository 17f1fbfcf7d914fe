"""What a sweep has found: one row a job in an SQLite file, which the coordinator alone writes.

Each job is a transaction of its own, so that whatever is killed, what is finished stays. The designs of the present
sweep are a second table, which names a job for each position: when the sweep changes, only they are written again.
"""

import json
import os
import re
import sqlite3
import stat
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, Self

from rodshell.errors import OutputError, RodshellError
from rodshell.untrusted import limit, raised

STORE, LOCK, ARCHIVES = "sweep.sqlite", "sweep.lock", "archives"  # in the folder of a sweep
FORMAT = 1
_CACHE = 500  # kB of the coordinator's memory
_LOG = 200  # pages of SQLite's log, which is then merged into the file
PAGE = 8192  # B: some rows fit on each, so that little of it is left empty
TABLES = """
CREATE TABLE jobs (id TEXT PRIMARY KEY, outcome TEXT NOT NULL, row BLOB NOT NULL);
CREATE TABLE designs (position INTEGER PRIMARY KEY, job TEXT NOT NULL, keys TEXT NOT NULL);
CREATE INDEX design_of_job ON designs (job);
CREATE TABLE notes (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
"""
FOUND = "found"
LOST = ("stopped", "crashed")  # by a limit or with its process: another try may end differently
_OUTCOMES = (FOUND, "refused", "failed", *LOST)
JOB = re.compile(r"\w+")  # that was found: the name of its folder
KINDS = {"status": str, "verdict": str, "findings": str | None, "results": dict}  # kept of a job; all else are numbers
ROW = 20e6  # bytes of what is kept of a job
_MOST_OF_SQLITE = 1e9  # bytes of a value that SQLite can be asked for
REMEDY = "move it to compute all designs again, or choose another folder"


Designs = Iterable[tuple[Sequence[Any], str]]  # values of the keys, and the identity of the job


@dataclass(frozen=True)
class Finished:
    """A design whose job is finished.

    Args:
        keys: values of the axes' keys, in JSON's types.
        outcome: "found", "refused" (bad input), "failed" (an error of the program), "stopped" (by a limit) or
            "crashed".
        row: what is kept of it, see `columns.row_of`; of a job that found no form its status alone.
    """

    position: int
    job: str
    keys: list[Any]
    outcome: str
    row: Mapping[str, Any]


class Store:
    """The file of a sweep; use it in a `with`.

    Args:
        writing: whether jobs are recorded; then the folder is made, and no other sweep can use it.

    Raises:
        OutputError: it cannot be opened, or another sweep is writing there.
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
        with self.errors():
            if self.writing:
                self._take()
            elif not os.path.lexists(self.path):
                raise OutputError(f"{self.folder} holds no sweep: it has no {STORE}")
            _require_plain(self.path)
            if os.path.lexists(journal := f"{self.path}-journal"):  # SQLite would obey it: it may name files to delete
                raise OutputError(f"{journal} is not of a sweep: move it, or choose another folder")
            if not self.path.exists():
                self._create()
            self._connection = _opened(self.path, "rw" if self.writing else "ro")
            with closing(sqlite3.connect(":memory:")) as like:
                like.executescript(TABLES)
                if _schema(self._connection) != _schema(like):
                    raise OutputError(f"{self.path} is not of a sweep: choose another folder, or move it")
            if self.note("format") != str(FORMAT):
                raise OutputError(f"{self.path} was written by another version of rodshell: choose another folder")
            if self.writing:
                self._connection.execute("PRAGMA synchronous = NORMAL")
                self._connection.execute(f"PRAGMA cache_size = -{_CACHE}")
                self._connection.execute(f"PRAGMA wal_autocheckpoint = {_LOG}")

    def __exit__(self, *_: object) -> None:
        for connection in (self._connection, self._lock):
            if connection is not None:
                connection.close()

    def _create(self) -> None:
        """An empty store, which is there in one step and never has a journal."""
        with replaced(self.path) as part, closing(_opened(part, "rwc")) as connection:
            connection.execute(f"PRAGMA page_size = {PAGE}")
            connection.executescript(TABLES)
            connection.execute("INSERT INTO notes VALUES ('format', ?)", (str(FORMAT),))
            connection.execute("PRAGMA journal_mode = WAL")

    def _take(self) -> None:
        """Make the folder and lock it, until this process ends in whatever way."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"cannot write {self.folder}: {error.strerror}; choose another folder") from None
        _require_plain(self.folder / LOCK, most=0)  # the journal of an empty database counts for nothing
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
    def errors(self) -> Iterator[None]:
        """Errors of the database, and of its content, in one sentence."""
        try:
            yield
        except RodshellError:
            raise
        except sqlite3.Error as error:
            if "full" in str(error) or "I/O" in str(error):
                raise OutputError(
                    f"cannot write {self.path}: {error}; what was finished before is kept: make room, and start the "
                    "same sweep again"
                ) from None
            raise OutputError(f"cannot use {self.path}: {error}; {REMEDY}") from None
        except (ValueError, LookupError, TypeError, OverflowError, RecursionError, zlib.error) as error:
            raise OutputError(f"{self.path} is damaged ({error}): {REMEDY}") from None

    def inside(self, name: str) -> Path:
        """A path in the folder.

        Raises:
            OutputError: it leads outside by a link.
        """
        path = self.folder / name
        if not path.resolve().is_relative_to(self.folder.resolve()):
            raise OutputError(f"{path} leads out of the sweep's folder, to {path.resolve()}: remove that link")
        return path

    # Notes

    def note(self, name: str) -> str | None:
        """What was noted under a name."""
        with self.errors():
            found = self._connection.execute("SELECT value FROM notes WHERE name = ?", (name,)).fetchone()
        return None if found is None else str(found[0])

    def take_note(self, name: str, value: str) -> None:
        """Note something about the sweep."""
        with self.errors():
            self._connection.execute("INSERT OR REPLACE INTO notes VALUES (?, ?)", (name, value))

    # Designs

    def plan(self, designs: Designs, *, notes: Mapping[str, str] | None = None, more: bool = False) -> None:
        """Write the designs of the sweep, all or none, with notes by their names.

        Args:
            more: behind those that there are, and not in their place.
        """
        with self.errors():
            self._connection.execute("BEGIN")
            try:
                if not more:
                    self._connection.execute("DELETE FROM designs")
                first = self.count()
                rows = ((first + k, job, json.dumps(list(keys))) for k, (keys, job) in enumerate(designs))
                self._connection.executemany("INSERT INTO designs VALUES (?, ?, ?)", rows)
                self._connection.executemany("INSERT OR REPLACE INTO notes VALUES (?, ?)", (notes or {}).items())
                self._connection.execute("COMMIT")
            except BaseException:
                with suppress(sqlite3.Error):
                    self._connection.execute("ROLLBACK")
                raise

    def count(self) -> int:
        """Number of designs."""
        with self.errors():
            return int(self._connection.execute("SELECT count(*) FROM designs").fetchone()[0])

    def outcomes(self) -> dict[str, int]:
        """Number of designs that are finished, by outcome."""
        query = "SELECT outcome, count(*) FROM designs JOIN jobs ON job = id GROUP BY outcome"
        with self.errors():
            return dict(self._connection.execute(query).fetchall())

    def finished(self) -> Iterator[Finished]:
        """The designs whose jobs are finished, in their order."""
        query = "SELECT position, job, keys, outcome, row FROM designs JOIN jobs ON job = id ORDER BY position"
        with self.errors():
            for position, job, keys, outcome, row in self._connection.execute(query):
                if outcome not in _OUTCOMES or (outcome == FOUND and not JOB.fullmatch(job)):
                    raise ValueError(f"its design {position} is of no job")
                yield Finished(position, job, read_json(keys, list), outcome, _read_row(row))

    # Jobs

    def outcome(self, job: str) -> str | None:
        """How a job ended; None if it is not finished."""
        with self.errors():
            found = self._connection.execute("SELECT outcome FROM jobs WHERE id = ?", (job,)).fetchone()
        return None if found is None else str(found[0])

    def row(self, job: str) -> dict[str, Any]:
        """What is kept of a finished job."""
        with self.errors():
            (row,) = self._connection.execute("SELECT row FROM jobs WHERE id = ?", (job,)).fetchone()
            return _read_row(row)

    def record(self, job: str, outcome: str, row: Mapping[str, Any]) -> None:
        """A job is finished, see `Finished`; OutputError where that cannot be written."""
        try:
            content = json.dumps(row, separators=(",", ":"), allow_nan=False)
        except ValueError:
            self.record(job, "failed", {"status": "its result has numbers that are not finite"})
            return
        kept = zlib.compress(content.encode(), 9)
        with self.errors():
            self._connection.execute("INSERT OR REPLACE INTO jobs VALUES (?, ?, ?)", (job, outcome, kept))


def _opened(path: Path, mode: str) -> sqlite3.Connection:
    """A database; `mode` as of its URIs."""
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", isolation_level=None, uri=True, timeout=30)
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, int(min(limit(ROW), _MOST_OF_SQLITE)))
    return connection


def _schema(connection: sqlite3.Connection) -> list[tuple[Any, ...]]:
    """The tables of a database, as they were declared."""
    return connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_schema ORDER BY type, name").fetchall()


def _require_plain(path: Path, *, most: int | None = None) -> None:
    """OutputError for anything but a file, for a link, and for more bytes than these."""
    if os.path.lexists(path):
        found = path.lstat()
        if not stat.S_ISREG(found.st_mode) or (most is not None and found.st_size > most):
            raise OutputError(f"{path} is not a file of a sweep: move it, or choose another folder")


def read_json(text: str | bytes, kind: type) -> Any:
    """Content of a store.

    Raises:
        ValueError: it is not JSON of this kind; a number is not finite, or a text has half of a character.
    """
    text = text if isinstance(text, str) else text.decode()
    found = json.loads(text, parse_float=_finite, parse_constant=_finite, parse_int=_whole)
    if "\\ud" in text.lower():
        json.dumps(found, ensure_ascii=False).encode()
    if not isinstance(found, kind):
        raise ValueError(f"it has a {type(found).__name__} in place of a {kind.__name__}")
    return found


def _finite(text: str) -> float:
    number = float(text)
    if not isfinite(number):
        raise ValueError(f"{text} is not a finite number")
    return number


def _whole(text: str) -> int:
    number = int(text)
    if number.bit_length() > 63:
        raise ValueError("a number is too large")
    return number


def _read_row(packed: bytes) -> dict[str, Any]:
    """What is kept of a job."""
    unpacking = zlib.decompressobj()
    content = unpacking.decompress(packed, int(min(limit(ROW), _MOST_OF_SQLITE)))
    if unpacking.unconsumed_tail:
        raise ValueError(f"a job has more than {limit(ROW) / 1e6:.4g} MB, {raised(ROW, 2 * limit(ROW))}")
    row: dict[str, Any] = read_json(content, dict)
    for name in ("status", *row):
        kind = KINDS.get(name, float | int | None)
        if not isinstance(row.get(name), kind):
            raise ValueError(f"{name} of a job is a {type(row.get(name)).__name__}")
    return row


@contextmanager
def replaced(file: Path) -> Iterator[Path]:
    """A path to write to, which then takes the place of a file of the sweep in one step.

    Raises:
        OutputError: it cannot be written.
    """
    part = file.with_name(f".{file.name}.part")
    try:
        part.unlink(missing_ok=True)  # it might be a link
        yield part
        os.replace(part, file)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(
            f"cannot write {file}: {error.strerror or error}; the finished designs are kept in {file.parent / STORE}: "
            "make room, and start the same sweep again"
        ) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
