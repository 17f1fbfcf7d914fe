"""Kernels of the table compiled by Numba at once, and kept: before the first job, or by `rodshell warmup`.

Two processes share the work where there are two processors: this one begins with the first kernel of the list, a helper
with the last, and both leave out what is kept already; so they meet. The helper only fills the cache, and ends with
this process, however that ends: its input is closed then.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from time import monotonic
from typing import Any

from rodshell.kernels import PACKAGE, Kernel
from rodshell.kernels.jit import arguments_of
from rodshell.kernels.table import KERNELS, OF_SOME_JOBS

LONG_ENOUGH = 0.1  # share of the work after which the time that is left is estimated


def compile_kernels(progress: Callable[[int, int, float | None], None], *, every: bool) -> int:
    """Compile the kernels that are not kept; how many they were.

    Parameters
    ----------
    progress : called with how many of them are done, how many there are, and about how many seconds the rest takes,
        None while that is not known.
    every : those of some jobs as well, which Numba otherwise compiles at their first call.
    """
    missing = [row for row in _rows(every) if not _is_kept(*row)]
    work = [_size(kernel) for kernel, _ in missing]
    waiting, begun = set(range(len(missing))), monotonic()
    progress(0, len(missing), None)
    with _helper(len(missing), every):
        for k, (kernel, arguments) in enumerate(missing):
            if k in waiting and not _is_kept(kernel, arguments):
                kernel.compile(arguments)
            waiting -= {other for other in waiting if other <= k or _is_kept(*missing[other])}
            left = sum(work[other] for other in waiting) / sum(work)
            seconds = (monotonic() - begun) * left / (1.0 - left)
            progress(len(missing) - len(waiting), len(missing), seconds if left < 1.0 - LONG_ENOUGH else None)
            if not waiting:
                break
    return len(missing)


def _rows(every: bool) -> list[tuple[Any, tuple[Any, ...]]]:
    """Each kernel of the table, with the types of its arguments."""
    return [
        (getattr(import_module(f"{PACKAGE}{module}"), name), arguments_of(row))
        for module, rows in KERNELS.items()
        for name, row in rows.items()
        if every or OF_SOME_JOBS.isdisjoint((module, f"{module}.{name}"))
    ]


def _is_kept(kernel: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether Numba's cache holds a kernel for these types; asked of its index, without loading the kernel."""
    cache = kernel._cache
    key = cache._index_key(arguments, kernel.targetctx.codegen())
    return key in cache._cache_file._load_index()


def _size(kernel: Any, known: frozenset[Kernel] = frozenset()) -> int:
    """Bytes of Python's code of a kernel and of those that it calls: about what it takes to compile."""
    function = kernel.py_func
    called = (function.__globals__.get(name) for name in function.__code__.co_names)
    inner = [callee for callee in called if hasattr(callee, "py_func") and callee not in known]
    return len(function.__code__.co_code) + sum(_size(callee, known | {kernel, *inner}) for callee in inner)


@contextmanager
def _helper(kernels: int, every: bool) -> "Iterator[subprocess.Popen[bytes] | None]":
    """A process that compiles from the end of the list, while the block runs; none where it would not help."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if processors < 2 or kernels < 2 or not sys.executable:
        yield None
        return
    nothing = subprocess.DEVNULL
    with subprocess.Popen(
        [sys.executable, "-m", __name__, *(["every"] if every else [])],
        stdin=subprocess.PIPE,
        stdout=nothing,
        stderr=nothing,
    ) as helper:
        try:
            yield helper
        finally:
            helper.kill()  # what it wrote is whole: Numba renames files into place


def _help() -> None:
    """What the helper does."""

    def end_with_the_other() -> None:
        sys.stdin.buffer.read()  # until the input is closed
        os._exit(0)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_the_other, daemon=True).start()
    for kernel, arguments in reversed(_rows("every" in sys.argv)):
        if not _is_kept(kernel, arguments):
            kernel.compile(arguments)


if __name__ == "__main__":
    _help()
