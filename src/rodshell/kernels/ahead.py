"""Kernels of the table compiled by Numba at once, and kept: before the first job, or by `rodshell warmup`."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from rodshell.kernels import PACKAGE
from rodshell.kernels.jit import arguments_of, is_kept
from rodshell.kernels.table import KERNELS, OF_SOME_JOBS


def compile_kernels(progress: Callable[[int, int], None], *, every: bool) -> int:
    """Compile the kernels that are not kept; how many they were.

    Args:
        progress: called with how many of them are done, and how many there are.
        every: those of some jobs as well, which Numba otherwise compiles at their first call.
    """
    missing = [row for row in _rows(every) if not is_kept(*row)]
    for done, (kernel, arguments) in enumerate(missing):
        progress(done, len(missing))
        kernel.compile(arguments)
    return len(missing)


def _rows(every: bool) -> list[tuple[Any, tuple[Any, ...]]]:
    """Each kernel of the table, with the types of its arguments."""
    return [
        (getattr(import_module(f"{PACKAGE}{module}"), name), arguments_of(row))
        for module, rows in KERNELS.items()
        if every or module not in OF_SOME_JOBS
        for name, row in rows.items()
        if every or f"{module}.{name}" not in OF_SOME_JOBS
    ]
