"""The errors that rodshell raises. Each message says what is wrong, with which value, and what to do."""

from collections.abc import Iterator
from contextlib import contextmanager


class RodshellError(Exception):
    """Base of all errors that rodshell raises; `exit_code` is that of the command line."""

    exit_code = 2


class InputError(RodshellError, ValueError):
    """A value given by the user cannot be used."""


class NetLimitError(RodshellError):
    """No inextensible net exists on this target for this anchor and heading: a crossing angle is too small."""


class StabilityError(RodshellError):
    """A time step is above the stability limit of an explicit scheme."""


class OutputError(RodshellError, OSError):
    """A result cannot be written or read."""


class OutputWarning(UserWarning):
    """A written file does not show all that it should; the command line prints it as one sentence."""


class OutOfTimeError(RodshellError):
    """A job reached its time limit before it had a result."""

    exit_code = 3


class OutOfMemoryError(RodshellError, MemoryError):
    """A job needs more memory than it may have.

    Args:
        why: what the system said, if anything.
    """

    def __init__(self, why: object = "") -> None:
        said = f" ({why})" if str(why) else ""
        super().__init__(
            f"out of memory{said}: give fewer rods, a longer edge, or a smaller file; or end other programs"
        )


class ConvergenceError(RodshellError):
    """A solver did not reach its tolerance.

    Args:
        report: what was reached, as the solver reports it.
    """

    exit_code = 3

    def __init__(self, message: str, report: object = None) -> None:
        super().__init__(message)
        self.report = report


@contextmanager
def needs_package(what: str, package: str, extra: str) -> Iterator[None]:
    """InputError where a package that an extra of rodshell brings is not installed."""
    try:
        yield
    except ImportError as error:
        raise InputError(f'{what} needs the package {package}: pip install "rodshell[{extra}]"') from error
