"""Where jobs run: processes of this machine, or a dask cluster; both take tasks and return futures.

In both, a job runs in a process of `watched`, so that limits, crashes and results are the same: dask decides only on
which machine.
"""

import json
import logging
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from rodshell.errors import InputError, needs_package
from rodshell.sweeps.plan import Settings
from rodshell.sweeps.watched import TICK, EngineError, Reply, Task, Workers, lost
from rodshell.untrusted import PATIENCE, read_text
from rodshell.validation import instance

_QUEUED = 2  # tasks for each worker: one that runs, one that waits
_HERE = "127.0.0.1:0"  # where a local cluster shows its state: dask would have it seen from everywhere
_COUNTED = 5.0  # s between two looks at the size of a cluster
HERE = Workers()  # of a process of dask


class Engine:
    """Runs tasks, at the same time `slots` at most.

    Args:
        run: what the executor does with a task and its limits, as `Workers.run`.
        settings: with the limits of a job.
    """

    def __init__(self, executor: Executor, run: Callable[..., Reply], settings: Settings) -> None:
        self._executor, self._run, self._settings = executor, run, settings

    def submit(self, task: Task) -> "Future[Reply]":
        return self._executor.submit(self._run, task, self._settings.time_limit, self._settings.memory_limit)

    def reply(self, future: "Future[Reply]") -> Reply:
        """What a task that has finished came to.

        Raises:
            EngineError: no task can be run any more. OutputError : a form cannot be saved.
        """
        return future.result()

    @property
    def slots(self) -> int:
        """Number of tasks that it takes at the same time."""
        return _QUEUED * self._settings.workers


class DaskEngine(Engine):
    """As `Engine`, on a cluster whose workers may come and go."""

    def __init__(self, client: Any, settings: Settings) -> None:
        super().__init__(client.get_executor(pure=False, retries=0), _run_here, settings)
        self._client = client
        self._slots, self._counted = 0, -_COUNTED

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
        if monotonic() - self._counted > _COUNTED:
            self._slots, self._counted = _QUEUED * max(sum(self._client.nthreads().values()), 1), monotonic()
        return self._slots


def _run_here(task: Task, time_limit: float | None, memory_limit: float | None) -> Reply:
    """Run a task in a process that belongs to this thread."""
    return HERE.run(task, time_limit, memory_limit)


@contextmanager
def opened_engine(settings: Settings, address: str | None = None) -> Iterator[Engine]:
    """The engine of a sweep; when it is left, jobs that still run are stopped.

    Args:
        address: of a dask scheduler, or its scheduler file, which implies that engine; None: the scheduler that dask's
            own settings name (DASK_SCHEDULER_ADDRESS), else a local one. It can run any program here.

    Raises:
        InputError: dask is not installed, or not reached. EngineError : no process can be started.
    """
    if address is not None:
        instance("address", address, str, 'text such as "tls://10.0.0.1:8786" or "scheduler.json"')
    with ExitStack() as stack:
        if settings.engine == "dask" or address is not None:
            yield DaskEngine(_dask_client(settings, address, stack), settings)
            return
        workers = Workers()
        executor = ThreadPoolExecutor(settings.workers, "rodshell-worker")
        stack.callback(executor.shutdown, cancel_futures=True)
        stack.callback(workers.stop)
        yield Engine(executor, workers.run, settings)


def _dask_client(settings: Settings, address: str | None, stack: ExitStack) -> Any:
    """A client of the scheduler of `opened_engine`, which is closed with the stack."""
    with needs_package("the engine dask", "distributed", "cluster"):
        import dask
        from distributed import Client, LocalCluster
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    given = dask.config.get("scheduler-address", None) if address is None else address
    if given is None:
        HERE.open()
        cluster = LocalCluster(
            n_workers=1, threads_per_worker=settings.workers, processes=False, memory_limit=0,
            dashboard_address=_HERE, worker_dashboard_address=_HERE, scheduler_kwargs={"dashboard": False},
        )  # fmt: skip
        place = stack.enter_context(cluster)
    else:
        place = _address_in(given) if given.endswith(".json") else given
    try:
        client = stack.enter_context(Client(place, timeout=10))  # with TLS as dask's own settings say
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"no dask scheduler answers at {given}: {error}") from None
    if given is None:
        stack.callback(HERE.stop)
    return client


def _address_in(file: str) -> str:
    """The address in a scheduler file, which is waited for: the scheduler may be about to write it."""
    end = monotonic() + PATIENCE
    while True:
        try:
            return str(json.loads(read_text(Path(file)))["address"])
        except (ValueError, LookupError, TypeError, RecursionError) as error:
            if monotonic() > end:
                raise InputError(f"{file} is not a scheduler file of dask: {error}") from None
            sleep(TICK)
