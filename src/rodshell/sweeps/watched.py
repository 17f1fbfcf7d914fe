"""Processes that run jobs, each watched: one that takes too long or too much memory is stopped alone.

A process that dies while it starts is started again, and a job whose process dies is run again, both once.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from rodshell.errors import OutputError, RodshellError

TICK = 0.1  # s between two looks at a process
PROGRAM = "from rodshell.sweeps.worker import main; main()"
TRIES = 2  # to start a process, and to run a job
PATIENCE = 600.0  # s that a process may take to start, compilation of kernels included
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS")

Task = dict[str, Any]
Reply = dict[str, Any]


class EngineError(RodshellError):
    """No process can run jobs."""


class Stopped(Exception):
    """The sweep has ended; nobody waits for the job."""


class Worker:
    """One process, started when it is first needed."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._replies = SimpleQueue[str | None]()
        self._errors = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        self._over = False

    def run(self, task: Task, time_limit: float | None, memory_limit: float | None) -> Reply:
        """Run a job, and again if its process dies; the reply of `worker.reply_to`, or what became of it.

        Args:
            time_limit, memory_limit: [s], [B]; None: no limit.

        Raises:
            EngineError: no process can be started, or it is of another version. OutputError : a form cannot be saved.
            Stopped: by `stop`.
        """
        ended = []
        for _ in range(TRIES):
            self._start()
            begun = monotonic()
            self._send(task)
            while True:
                line = self._next(TICK)
                if line == "":
                    if excess := self._excess(monotonic() - begun, time_limit, memory_limit):
                        self._kill()
                        return lost("stopped", f"stopped: {excess}", monotonic() - begun)
                elif line is None:
                    ended.append(self._end())
                    break
                else:
                    return self._checked(json.loads(line), task)
        return lost("crashed", f"its process died twice: {ended[-1]}")

    def stop(self) -> None:
        """End the process, and with it `run` in another thread."""
        self._over = True
        self._kill()

    def _start(self) -> None:
        """A process that is ready."""
        if self._process is not None and self._process.poll() is None:
            return
        for _ in range(TRIES):
            if self._over:
                raise Stopped
            self._process, self._replies = self._spawned()
            begun = monotonic()
            late = False
            while (line := self._next(TICK)) == "":
                if monotonic() - begun > PATIENCE:
                    late = True
                    self._kill()
            if line is not None:  # it is ready
                return
            why = f"it was not ready after {PATIENCE:g} s" if late else self._end()
        raise EngineError(f"a process for jobs cannot be started: {why}")

    def _spawned(self) -> "tuple[subprocess.Popen[str], SimpleQueue[str | None]]":
        home = str(Path(__file__).parents[2])
        path = os.pathsep.join([home, *filter(None, [os.environ.get("PYTHONPATH")])])
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", PROGRAM],  # modules of the current folder may be a stranger's
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, encoding="utf-8",
            env={**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": path},
            start_new_session=True,  # Ctrl-C of a terminal does not reach it
        )  # fmt: skip
        replies = SimpleQueue[str | None]()
        threading.Thread(target=_pass_on, args=(process, replies), daemon=True).start()
        if self._over:
            process.kill()
        return process, replies

    def _send(self, task: Task) -> None:
        assert self._process is not None
        assert self._process.stdin is not None
        with suppress(OSError):  # it has died, which the next look finds
            self._process.stdin.write(json.dumps(task) + "\n")
            self._process.stdin.flush()

    def _next(self, seconds: float) -> str | None:
        """The next line of the process: "" if there is none yet, None when it has ended."""
        try:
            line = self._replies.get(timeout=seconds)
        except Empty:
            return ""
        if line is None and self._over:
            raise Stopped
        return line

    def _excess(self, seconds: float, time_limit: float | None, memory_limit: float | None) -> str:
        """Which limit is exceeded, in words; "" if none is."""
        assert self._process is not None
        if time_limit is not None and seconds > time_limit:
            return f"it took longer than the time limit of {time_limit:g} s"
        if memory_limit is not None:
            import psutil

            try:
                used = psutil.Process(self._process.pid).memory_info().rss
            except psutil.Error:
                return ""
            if used > memory_limit:
                return f"it took more memory than the limit of {memory_limit / 1e6:.0f} MB"
        return ""

    def _checked(self, reply: Reply, task: Task) -> Reply:
        if "mismatch" in reply:
            raise EngineError(
                f"a worker has rodshell {reply['mismatch']}, the coordinator {task['version']}: install the same"
            )
        if "unwritten" in reply:
            raise OutputError(reply["unwritten"])
        return reply

    def _end(self) -> str:
        """How the process ended, and its last words."""
        assert self._process is not None
        code = self._process.wait()
        how = f"exit code {code}"
        if code < 0:
            name = signal.Signals(-code).name
            how = f"{name}, as for lack of memory" if name == "SIGKILL" else name
        self._errors.seek(0)
        words = self._errors.read()[-2000:].strip().splitlines()
        self._errors.seek(0)
        self._errors.truncate()
        return f"{how} ({words[-1].strip()})" if words else how

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()


class Workers:
    """A process for each thread that runs jobs."""

    def __init__(self) -> None:
        self._own = threading.local()
        self._all = list[Worker]()
        self._over = False

    def run(self, task: Task, time_limit: float | None, memory_limit: float | None) -> Reply:
        """Run a job in the process of this thread; see `Worker.run`."""
        if getattr(self._own, "worker", None) not in self._all:
            self._own.worker = Worker()
            self._all.append(self._own.worker)
        if self._over:
            raise Stopped
        worker: Worker = self._own.worker
        return worker.run(task, time_limit, memory_limit)

    def stop(self) -> None:
        """End all processes; tasks that come later are refused, until `open`."""
        self._over = True
        while self._all:
            self._all.pop().stop()

    def open(self) -> None:
        """Accept tasks again."""
        self._over = False


def _pass_on(process: "subprocess.Popen[str]", replies: "SimpleQueue[str | None]") -> None:
    assert process.stdout is not None
    for line in process.stdout:
        if line.endswith("\n"):  # a line without an end is of a process that died while it wrote
            replies.put(line)
    replies.put(None)


def lost(outcome: str, status: str, seconds: float = 0.0) -> Reply:
    """The reply of a job that was "stopped" or "crashed", with the sentence why, and the time that it took [s]."""
    return {"outcome": outcome, "row": {"status": status, "seconds": seconds}}
