"""Work that threads share, and processes that work for another. Kernels declared with `nogil` run at the same time;
results never depend on the threads."""

import os
import signal
from collections.abc import Callable
from multiprocessing import parent_process
from threading import Thread

_PROCESSORS = os.cpu_count() or 1  # asked once: the answer takes as long as a small front
_MOST_THREADS = 4  # parts of a factorisation stay one thread's work, and memory is as fast as it is


def threads() -> int:
    """Number of threads: NUMBA_NUM_THREADS, by default one per processor, at most `_MOST_THREADS`."""
    asked = os.environ.get("NUMBA_NUM_THREADS", "")
    return max(1, min(int(asked) if asked.isdigit() else _PROCESSORS, _PROCESSORS, _MOST_THREADS))


def in_threads(work: Callable[[int, int], object], count: int, *, most: int | None = None) -> None:
    """Do `count` pieces of work, each in whichever thread is free.

    Args:
        work: called with the number of a piece and that of the thread, from 0.
        most: number of threads; by default `threads()`.

    Raises:
        BaseException: what a piece of work raised; of several one.
    """
    wanted = 1 if count <= 1 else min(threads() if most is None else most, count)
    if wanted == 1:
        for piece in range(count):
            work(piece, 0)
        return
    waiting, failures = iter(range(count)), list[BaseException]()

    def run(thread: int) -> None:
        try:
            for piece in waiting:
                work(piece, thread)
        except BaseException as failure:  # another thread's must not be lost
            failures.append(failure)

    others = [Thread(target=run, args=(thread,)) for thread in range(1, wanted)]
    for other in others:
        other.start()
    run(0)
    for other in others:
        other.join()
    if failures:
        raise failures[0]


def work_for_parent() -> None:
    """End together with the process that started this one, however it ends; it decides what Ctrl-C, which reaches both,
    ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    if (parent := parent_process()) is not None:
        parent.join()
        os._exit(1)
