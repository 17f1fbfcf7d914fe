"""Where jobs run: processes of this machine, or a dask cluster; both take tasks and return futures.

In both, a job runs in a process of `watched`, so that limits, crashes and results are the same: dask decides only on
which machine.
"""

import logging
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from time import monotonic
from typing import Any

from rodshell.errors import InputError
from rodshell.sweeps.plan import Settings
from rodshell.sweeps.watched import EngineError, Reply, Task, Workers, lost

QUEUED = 2  # tasks for each worker: one that runs, one that waits
COUNTED = 5.0  # s between two looks at the size of a cluster
HERE = Workers()  # of a process of dask


class Engine:
    """Runs tasks; `full` says when to wait.

    Parameters
    ----------
    executor : that runs them; workers : of this process; None: those of dask.
    settings : with the limits of a job.
    """

    def __init__(self, executor: Executor, workers: Workers | None, settings: Settings) -> None:
        self._executor, self._workers, self._settings = executor, workers, settings

    def submit(self, task: Task) -> "Future[Reply]":
        """Run a task."""
        limits = (self._settings.time_limit, self._settings.memory_limit)
        run = run_here if self._workers is None else self._workers.run
        return self._executor.submit(run, task, *limits)

    def reply(self, future: "Future[Reply]") -> Reply:
        """What a task that has finished came to.

        Raises
        ------
        EngineError : no task can be run any more. OutputError : a form cannot be saved.
        """
        return future.result()

    @property
    def slots(self) -> int:
        """Number of tasks that it takes at the same time."""
        return QUEUED * self._settings.workers


class DaskEngine(Engine):
    """As `Engine`, on a cluster whose workers may come and go."""

    def __init__(self, client: Any, settings: Settings) -> None:
        super().__init__(client.get_executor(pure=False, retries=0), None, settings)
        self._client = client
        self._slots, self._counted = 0, -COUNTED

    def reply(self, future: "Future[Reply]") -> Reply:
        """As of `Engine`; dask has tried a task several times whose workers went away."""
        from distributed.scheduler import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            return lost("crashed", f"its workers went away: {' '.join(str(error).split())}")
        except CancelledError:
            raise EngineError("the dask scheduler has gone; what is finished is kept") from None

    @property
    def slots(self) -> int:
        """Number of tasks that the cluster takes now."""
        if monotonic() - self._counted > COUNTED:
            self._slots, self._counted = QUEUED * max(sum(self._client.nthreads().values()), 1), monotonic()
        return self._slots


def run_here(task: Task, time_limit: float | None, memory_limit: float | None) -> Reply:
    """Run a task in a process that belongs to this thread."""
    return HERE.run(task, time_limit, memory_limit)


@contextmanager
def opened_engine(settings: Settings) -> Iterator[Engine]:
    """The engine of a sweep; when it is left, jobs that still run are stopped.

    Raises
    ------
    InputError : dask is not installed, or not reached. EngineError : no process can be started.
    """
    with ExitStack() as stack:
        if settings.engine == "dask":
            yield stack.enter_context(_dask(settings))
            return
        workers = Workers()
        executor = ThreadPoolExecutor(settings.workers, "rodshell-worker")
        stack.callback(executor.shutdown, cancel_futures=True)
        stack.callback(workers.stop)
        yield Engine(executor, workers, settings)


@contextmanager
def _dask(settings: Settings) -> Iterator[Engine]:
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise InputError('run.engine = "dask" needs the package distributed: pip install "rodshell[cluster]"') from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        address = settings.address
        if address is None:
            HERE.open()
            cluster = LocalCluster(
                n_workers=1, threads_per_worker=settings.workers, processes=False, dashboard_address=None,
                memory_limit=0,
            )  # fmt: skip
            address = stack.enter_context(cluster)
        try:
            place = {"scheduler_file": address} if isinstance(address, str) and address.endswith(".json") else {}
            client = stack.enter_context(Client(None if place else address, timeout=10, **place))
        except (OSError, ValueError, TypeError) as error:
            raise InputError(f'run.address = "{address}": no dask scheduler answers there: {error}') from None
        if settings.address is None:
            stack.callback(HERE.stop)
        yield DaskEngine(client, settings)
