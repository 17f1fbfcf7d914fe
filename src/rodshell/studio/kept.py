"""What the studio keeps on disk: records that are written whole and read with care, and folders bounded in sum."""

import json
import os
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from rodshell.errors import InputError
from rodshell.untrusted import limit, raised, read_bytes

RECORD = 200e6  # bytes of a session's or a job's record
FOLDER = 4e9  # bytes of all sessions and jobs of a server
BLOCK = 4096  # bytes that a small file or a folder takes
NAME = re.compile(r"[\w-]{20,60}", re.ASCII)  # of a session or a job


def write_record(path: Path, value: Any) -> None:
    """Write a record, all of it or nothing."""
    new = path.with_name(f"{path.name}.new")
    new.write_text(json.dumps(value), encoding="utf-8")
    new.replace(path)


def read_record(path: Path, kind: Any) -> Any:
    """What a file holds as JSON; null in the place of NaN and infinities, which cases of earlier versions had.

    Args:
        kind: the type that it has, such as a TypedDict.

    Raises:
        InputError: it is not a file, too large, damaged, or something else.
    """
    if not path.is_file():  # a pipe would be waited for
        raise InputError(f"{path} is not a file")
    content = read_bytes(path, RECORD)
    try:
        value = json.loads(content, parse_constant=lambda _: None, parse_float=_finite)
        return TypeAdapter(kind).validate_python(value)
    except (ValueError, RecursionError) as error:
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else error
        raise InputError(f"{path} is damaged: {reason}") from None


def _finite(text: str) -> float | None:
    number = float(text)
    return number if isfinite(number) else None


class Room:
    """Keeps what lies in a server's folder below a limit: those sessions and jobs go that nobody used for longest.

    Args:
        folder: of the server; with a folder for each session in sessions/, for each job in jobs/, and perhaps with what
            is not the server's, which stays.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._left = 0.0  # bytes that can be written before sizes are looked at again
        self.users: list[Callable[[], set[str]]] = []  # give the names of those that are in use

    def make(self, needed: float) -> None:
        """Make room for so many bytes.

        Raises:
            InputError: what is in use leaves none.
        """
        if needed > self._left:
            self._left = limit(FOLDER) - self._sweep(limit(FOLDER) - needed)
        if needed > self._left:
            all_together = limit(FOLDER) - self._left + needed
            raise InputError(
                f"the server keeps {limit(FOLDER) / 1e9:.4g} GB at most, and all of it is in use: try again later, "
                f"{raised(FOLDER, all_together)}"
            )
        self._left -= needed

    def forget(self) -> None:
        """Look at sizes again before anything else is written: something was that no room was made for."""
        self._left = 0.0

    def _sweep(self, allowed: float) -> float:
        """Remove the oldest of what is not in use until the rest is as small; its bytes."""
        used = set[str]().union(*(names() for names in self.users))
        found = [*self._folder.glob("sessions/*/uploads"), *self._folder.glob("jobs/*/status.json")]
        ours = [path.parent for path in found if NAME.fullmatch(path.parent.name) and not path.parent.is_symlink()]
        kept = sorted((path.stat().st_mtime, _size(path), path) for path in ours)
        total = float(sum(size for _, size, _ in kept))
        for _, size, path in kept:
            if total <= allowed:
                break
            if path.name not in used:
                shutil.rmtree(path, ignore_errors=True)
                total -= size - _size(path)
        return total


def _size(path: Path) -> int:
    """Bytes of a folder with all in it, and of links alone."""
    found = 0
    for place, folders, files in os.walk(path):
        found += BLOCK * (1 + len(folders))
        for name in files:
            with suppress(OSError):
                found += max(BLOCK, Path(place, name).lstat().st_size)
    return found
