"""Files that may come from a stranger: read up to a stated size, never from a device, never waited for without end.

A limit stands where it is needed, as `limit(300e6)`; the environment variable RODSHELL_LIMITS multiplies all of them
(docs/limits.md lists them).
"""

import os
import stat
from collections.abc import Iterator
from math import isfinite
from pathlib import Path
from select import select
from time import monotonic

from rodshell.errors import InputError
from rodshell.units import shown

FACTOR = "RODSHELL_LIMITS"
PATIENCE = 30.0  # s until a pipe must have given all its content
TEXT = 20e6  # bytes of a text, such as a table of rods
_CHUNK = 1 << 20  # bytes


def limit(usual: float) -> float:
    """A limit as it holds in this process: the usual one times RODSHELL_LIMITS.

    Raises:
        InputError: RODSHELL_LIMITS is not a number above 0.
    """
    text = os.environ.get(FACTOR, "1")
    try:
        factor = float(text)
    except ValueError:
        factor = 0.0
    if not (isfinite(factor) and factor > 0):
        raise InputError(f"the environment variable {FACTOR} must be a number above 0, not {shown(text)}")
    return usual * factor


def raised(usual: float, needed: float) -> str:
    """How the limit is raised so far that `needed` is allowed: the end of a sentence that refuses.

    Args:
        needed: what was refused, in the same unit.
    """
    return f"or set {FACTOR}={max(2, int(-(-needed // usual)))} to allow it"


def read_bytes(path: Path, most: float, *, smaller: str = "") -> bytes:
    """The content of a file, or of a pipe that somebody writes into.

    Args:
        most: bytes that it may have, before RODSHELL_LIMITS.
        smaller: what makes such a file smaller, for the message.

    Raises:
        InputError: it is missing, a folder, a device or too large, cannot be read, or a pipe that gives nothing.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise InputError(f"there is no file named {shown(str(path))}: check the path") from None
    except OSError as reason:
        if os.path.isdir(path):  # as Windows says; unlike `Path.is_dir`, it takes any name
            raise InputError(f"{path} is a folder: give a file") from None
        raise InputError(f"{path} cannot be read: {reason.strerror}") from None
    try:
        return b"".join(_parts(path, descriptor, most, smaller))
    finally:
        os.close(descriptor)


def _parts(path: Path, descriptor: int, most: float, smaller: str) -> Iterator[bytes]:
    """What a file holds, piece by piece; see `read_bytes`."""
    what = os.fstat(descriptor)
    is_pipe = stat.S_ISFIFO(what.st_mode)
    if stat.S_ISDIR(what.st_mode):
        raise InputError(f"{path} is a folder: give a file")
    if not (is_pipe or stat.S_ISREG(what.st_mode)):
        raise InputError(f"{path} is a device, not a file: give a file or a pipe")
    size, end, allowed = what.st_size, monotonic() + PATIENCE, limit(most)
    read = 0
    while True:
        if max(size, read) > allowed:  # a pipe does not state its size, nor does a file of /proc
            raise InputError(
                f"{path} has {max(size, read) / 1e6:.4g} MB or more; at most {allowed / 1e6:.4g} MB are read: "
                f"{smaller or 'give a smaller file'}, {raised(most, max(size, read))}"
            )
        if is_pipe and not select([descriptor], (), (), max(0.0, end - monotonic()))[0]:
            raise InputError(f"{path} is a pipe that was not written to its end within {PATIENCE:g} s")
        try:
            part = os.read(descriptor, _CHUNK)
        except BlockingIOError:
            continue
        except OSError as reason:
            raise InputError(f"{path} cannot be read: {reason.strerror}") from None
        if not part:
            return
        read += len(part)
        yield part


def read_text(path: Path, most: float = TEXT, *, instead: str = "save it as UTF-8") -> str:
    """The content of a text file in UTF-8, with or without its byte order mark; see `read_bytes`.

    Args:
        instead: what can be done where it is something else.
    """
    try:
        return read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not text in UTF-8: {instead}") from None
