"""Kernels of the table compiled by Numba at once, and kept: before the first job, or by `rodshell warmup`.

Two processes share the work where there are two processors: this one begins with the first kernel of the list, a helper
with the last, and both leave out what is kept already; so they meet. The helper only fills the cache, and ends with
this process, however that ends: its input is closed then.
"""

import gc
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

from rodshell.kernels import PACKAGE
from rodshell.kernels.jit import arguments_of, types_found_once
from rodshell.kernels.table import KERNELS, OF_SOME_JOBS, Kernel

LONG_ENOUGH = 0.1  # share of the work after which the time that is left is estimated
EACH = 300  # bytes of code that compile about as long as what Numba does for each kernel, however short


def compile_kernels(progress: Callable[[int, int, float | None], None], *, every: bool) -> int:
    """Compile the kernels that are not kept; how many they were.

    Parameters
    ----------
    progress : called with how many of them are done, how many there are, and about how many seconds the rest takes,
        None while that is not known.
    every : those of some jobs as well, which Numba otherwise compiles at their first call.
    """
    missing = [row for row in _rows(every) if not _is_kept(*row)]
    if not missing:
        return 0
    begun = monotonic()
    with _helper(every) as helper, _without_collector(), types_found_once():
        work = [_work(kernel) for kernel, _ in missing]
        waiting, made = set(range(len(missing))), 0
        progress(0, len(missing), None)
        for k, (kernel, arguments) in enumerate(missing):
            if k in waiting and not _is_kept(kernel, arguments):
                _compile(kernel, arguments)
                made += work[k]
            waiting -= {other for other in waiting if other <= k or _is_kept(*missing[other])}
            left = sum(work[other] for other in waiting)
            if helper is not None and helper.poll() is None:  # as far as this one, maybe within a long kernel
                left = max(min(left, sum(work) - 2 * made), left // 2)
            done = sum(work) - left
            known = done > LONG_ENOUGH * sum(work)
            seconds = (monotonic() - begun) * left / done if known else None
            progress(len(missing) - len(waiting), len(missing), seconds)
            if not waiting:
                break
    return len(missing)


def _rows(every: bool) -> list[tuple[Any, tuple[Any, ...]]]:
    """Each kernel of the table, with the types of its arguments: module by module, since kernels of a module share what
    they call; those of long kernels at both ends, so that little is compiled twice where two processes meet."""
    modules = list[list[tuple[Any, tuple[Any, ...]]]]()
    for module, rows in KERNELS.items():
        if every or module not in OF_SOME_JOBS:
            loaded = import_module(f"{PACKAGE}{module}")
            names = (name for name in rows if every or f"{module}.{name}" not in OF_SOME_JOBS)
            modules.append([(getattr(loaded, name), arguments_of(rows[name])) for name in names])
    modules.sort(key=lambda kernels: -max((_work(kernel) for kernel, _ in kernels), default=0))
    return [row for kernels in modules[::2] + modules[1::2][::-1] for row in kernels]


def _compile(kernel: Any, arguments: tuple[Any, ...]) -> None:
    """Compile a kernel, without Python's collector: then only what this kernel left is searched for garbage."""
    kernel.compile(arguments)
    gc.collect(0)


@contextmanager
def _without_collector() -> Iterator[None]:
    """It searches all that Numba knows again and again, a sixth of the work."""
    on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if on:
            gc.enable()


def _is_kept(kernel: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether Numba's cache holds a kernel for these types; asked of its index, without loading the kernel."""
    cache = kernel._cache
    key = cache._index_key(arguments, kernel.targetctx.codegen())
    return key in cache._cache_file._load_index()


def _work(kernel: Any) -> int:
    """About what it takes to compile a kernel, as bytes of code."""
    return EACH + _size(kernel)


def _size(kernel: Any, known: frozenset[Kernel] = frozenset()) -> int:
    """Bytes of Python's code of a kernel and of those that it calls."""
    function = kernel.py_func
    called = (function.__globals__.get(name) for name in function.__code__.co_names)
    inner = [callee for callee in called if hasattr(callee, "py_func") and callee not in known]
    return len(function.__code__.co_code) + sum(_size(callee, known | {kernel, *inner}) for callee in inner)


@contextmanager
def _helper(every: bool) -> "Iterator[subprocess.Popen[bytes] | None]":
    """A process that compiles from the end of the list, while the block runs; none where it would not help."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if processors < 2 or not sys.executable:
        yield None
        return
    nothing = subprocess.DEVNULL
    with subprocess.Popen(
        [sys.executable, "-P", "-m", __name__, *(["every"] if every else [])],
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
    with _without_collector(), types_found_once():
        for kernel, arguments in reversed(_rows("every" in sys.argv)):
            if not _is_kept(kernel, arguments):
                _compile(kernel, arguments)


if __name__ == "__main__":
    _help()
