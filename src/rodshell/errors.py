"""Every error that a user can meet. Each says what is wrong, which value, and what would do."""


class RodshellError(Exception):
    """Base of all errors raised on purpose by rodshell; `exit_code` is the command line's."""

    exit_code = 2


class InputError(RodshellError, ValueError):
    """A value given by the user cannot be used."""


class NetLimitError(RodshellError):
    """No inextensible net exists on this target for this anchor and heading: a crossing angle reaches 0."""


class StabilityError(RodshellError):
    """A time step is beyond the limit of an explicit scheme, whose motion would blow up."""


class OutputError(RodshellError, OSError):
    """A result cannot be written or read."""


class OutputWarning(UserWarning):
    """A written file does not show all that it should; the command line prints it as one sentence."""


class OutOfTimeError(RodshellError):
    """A job took longer than its time limit; nothing was found that could be kept."""

    exit_code = 3


class ConvergenceError(RodshellError):
    """A solve stopped short of its tolerance; `report` holds what was reached."""

    exit_code = 3

    def __init__(self, message: str, report: object = None) -> None:
        super().__init__(message)
        self.report = report
