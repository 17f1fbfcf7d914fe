"""The command line. Nothing heavy is imported before signals are handled, so that it ends in one line at any moment."""

import gc
import os
import re
import sys
import warnings
from collections.abc import Sequence

from rodshell.cli.interruption import Interrupted, Interruption, end_at_once
from rodshell.printed import hold_closed_descriptors, printed_streams, say

RARELY = 500_000  # objects made since Python last looked for garbage that holds itself


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit code.

    0 found, 2 bad input, 3 not converged or out of time, 4 found but not buildable, 130 interrupted by Ctrl-C, 143 by
    SIGTERM.
    """
    with Interruption() as interruption, warnings.catch_warnings(), printed_streams():
        try:
            from rodshell.cli.app import app, print_warnings

            print_warnings()
            code = app.main(args=argv, prog_name="rodshell", standalone_mode=False)
            return code if isinstance(code, int) else 0
        except BaseException as error:  # an interrupt in the middle of an import, say, becomes an error of any kind
            if interruption.number is None and not isinstance(error, Interrupted | KeyboardInterrupt):
                from rodshell.cli.app import failed

                return failed(error)
            kept = str(error) if isinstance(error, Interrupted) else ""
            say("interrupted" + (f": {kept}" if kept else ""))
            return interruption.code


def entry() -> None:
    """The console script: `main`, then an end without Python's teardown, which costs a fifth of a short run.

    Cycles of garbage are rarely looked for: a form leaves a few hundred small objects in them, and no arrays. The BLAS
    has one thread, unless the environment says otherwise: large matrices are the work of our own threads, and those of
    a BLAS take 0.1 s of processor time to wait for the small ones. No process that it starts looks for modules in the
    current folder, which may be a stranger's.
    """
    end_at_once()
    hold_closed_descriptors()
    gc.set_threshold(RARELY)
    for blas in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(blas, "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # which it looks for in every installed package
    os.environ["PYTHONSAFEPATH"] = "1"
    if not re.fullmatch(r"\d{1,12}", os.environ.get("SOURCE_DATE_EPOCH", "0")):  # libraries read it when they load
        del os.environ["SOURCE_DATE_EPOCH"]
    with printed_streams():
        try:
            code = main()
        except Exception:
            sys.excepthook(*sys.exc_info())
            code = 1
    os._exit(code)
