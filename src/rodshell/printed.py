"""What is printed: control characters show as escapes, and a stream that is closed or full loses words, never work.

Names in a case or a result may be a stranger's, and a terminal obeys what it is sent: its title, the clipboard, the
direction of text.
"""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import TextIOBase
from shutil import get_terminal_size
from threading import RLock
from time import monotonic
from typing import TextIO
from unicodedata import category

LONGEST = 2000  # characters of a sentence
PAUSE = 0.1  # s between two live lines at least


def visible(text: str, kept: str = "\n\t") -> str:
    """Text with escapes, as of TOML and JSON, for control and other invisible characters, except those `kept`."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in kept or category(c) == "Zs" else _escape(c) for c in text)


def _escape(character: str) -> str:
    code = ord(character)
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def say(sentence: str) -> None:
    """Print a sentence on one line of stderr."""
    line = " ".join(sentence.split())
    Printed.of(sys.stderr).write(f"rodshell: {line if len(line) <= LONGEST else line[:LONGEST] + ' ...'}\n")


class Printed(TextIOBase):
    """A stream through which everything to a standard stream goes; writing to it never fails.

    Args:
        stream: what is behind it; None where the process has none.
    """

    encoding, errors = "utf-8", "strict"  # of what it is given, so that click does not go around it

    def __init__(self, stream: TextIO | None) -> None:
        self._stream, self._width, self._shown, self._lock = stream, 0, 0.0, RLock()
        self.failure = ""  # why words were lost, unless their reader went away

    @classmethod
    def of(cls, stream: TextIO | None) -> "Printed":
        """The stream itself, if it is one already."""
        return stream if isinstance(stream, Printed) else cls(stream)

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        try:
            return self._stream is not None and self._stream.isatty()
        except ValueError:  # it is closed
            return False

    def writable(self) -> bool:
        """True."""
        return True

    def write(self, text: str, /) -> int:
        """Print text."""
        self._send(visible(text), 0)
        return len(text)

    def live(self, text: str) -> None:
        """Show text on the last line of a terminal, until something else is printed; "" removes it."""
        if not text or monotonic() - self._shown >= PAUSE:
            self._shown = monotonic()
            line = visible(text, kept="")[: get_terminal_size().columns - 1]
            self._send(line, len(line))

    def _send(self, text: str, width: int) -> None:
        with self._lock:
            if self._stream is None:
                return
            cleared = f"\r{' ' * self._width}\r" if self._width else ""
            self._width = width
            encoding = getattr(self._stream, "encoding", None) or "utf-8"
            try:
                self._stream.write(cleared + text.encode(encoding, "backslashreplace").decode(encoding))
                self._stream.flush()
            except (OSError, ValueError) as error:  # full, closed, its reader gone
                self._stream = None
                if getattr(error, "errno", None) != errno.EPIPE:
                    self.failure = getattr(error, "strerror", None) or str(error)


@contextmanager
def printed_streams() -> Iterator[None]:
    """While it is entered, stdout and stderr are `Printed`."""
    out, err = Printed.of(sys.stdout), Printed.of(sys.stderr)
    with redirect_stdout(out), redirect_stderr(err):
        try:
            yield
        finally:
            if out.failure:
                say(f"not all could be printed: {out.failure}")
            out.failure = ""  # it is said once


def hold_closed_descriptors() -> None:
    """Open the null device in place of standard streams that are closed: else the next file that is opened takes their
    number, and what is meant for stderr is written into it."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
