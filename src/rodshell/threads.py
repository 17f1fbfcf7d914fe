"""Work that threads share. Kernels declared with `nogil` run at the same time; results never depend on the threads."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import RLock, Thread

PROCESSORS = os.cpu_count() or 1  # asked once: the answer takes as long as a small front
MOST_THREADS = 4  # parts of a factorisation stay one thread's work, and memory is as fast as it is
_BLAS = RLock()


def threads() -> int:
    """Number of threads: NUMBA_NUM_THREADS, by default one per processor, at most `MOST_THREADS`."""
    asked = os.environ.get("NUMBA_NUM_THREADS", "")
    return max(1, min(int(asked) if asked.isdigit() else PROCESSORS, PROCESSORS, MOST_THREADS))


def in_threads(work: Callable[[int, int], object], count: int, *, most: int | None = None) -> None:
    """Do `count` pieces of work, each in whichever thread is free.

    Parameters
    ----------
    work : called with the number of a piece and that of the thread, from 0.
    count : number of pieces.
    most : number of threads; by default `threads()`.

    Raises
    ------
    BaseException : what a piece of work raised; of several one.
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


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """While this lasts, the BLAS has one thread, as on the command line: after each small product its others would keep
    waiting for more, on the processors on which our own are to run. It is one setting for the whole process, so that
    other threads that ask for it wait.
    """
    from threadpoolctl import threadpool_limits  # here, as few jobs need it

    with _BLAS, threadpool_limits(limits=1, user_api="blas"):
        yield
