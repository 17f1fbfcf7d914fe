"""Two pieces of work at once, where a core is free."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def beside(work: Callable[[], object]) -> Iterator[None]:
    """Do `work`, which leaves nothing but files, in a child process while the block runs; or else after it.

    The child begins as a copy of this process, so that nothing is loaded twice. Its failure is not reported: the work
    is then done here, where errors are told. There is no child but on Linux, with a second core, and where no threads
    run, which are not copied and may hold locks.
    """
    if not _may_fork():
        yield
        work()
        return
    child = os.fork()
    if child == 0:
        code = 1
        try:
            work()
            code = 0
        finally:
            os._exit(code)
    try:
        yield
    except BaseException:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise
    if os.waitpid(child, 0)[1] != 0:
        work()


def _may_fork() -> bool:
    return sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1 and threading.active_count() == 1
