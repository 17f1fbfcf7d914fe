"""The process of a session, and the queue before it."""

import asyncio
import os
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context
from typing import Any

from rodshell.studio.worker import News, Order, run_worker

_ENDED = "the job was ended by the system, perhaps for lack of memory: use fewer rods, or longer edges"
ENDS = ("done", "left", "failed")  # kinds of news with which an order ends
_GRACE = 15.0  # s beyond the time limit after which a worker that says nothing is ended
Heard = Callable[[News], None]


class WorkerProcess:
    """The process of one session, started when it is first needed, and again after it was ended.

    It has one order at a time, and one waits here, the newest: nothing lies in the pipe but a word that one waits.
    Files are asked for in turn, and end no search for a form.
    """

    def __init__(self, heard: Heard) -> None:
        self._heard = heard
        self._process: Any = None
        self._busy: Order | None = None
        self._waiting: Order | None = None  # to be sent next; a newer one takes its place
        self._files = deque[Order]()
        self._told = False  # that one waits
        self._watch: asyncio.TimerHandle | None = None

    @property
    def is_running(self) -> bool:
        return self._process is not None

    def order(self, order: Order) -> None:
        """Send an order, or keep it until the process has ended the one before."""
        if order.kind == "files":
            self._files.append(order)
        else:
            self._waiting = order
        if self._busy is None:
            self._next()
        elif self._waiting is not None and not self._told:
            self._told = True
            self._send(None)

    def end(self) -> None:
        """Kill the process, and forget what waits."""
        self._kill()
        self._waiting = None
        self._files.clear()

    def _kill(self) -> None:
        self._watch_over(None)
        if self._process is not None:
            self._process.kill()
            self._process.join()
        self._process = self._busy = None

    def _next(self) -> None:
        """Send what waits."""
        if self._files and self._waiting is None:
            self._busy = self._files.popleft()
        else:
            self._busy, self._waiting = self._waiting, None
        self._told = False
        if self._busy is not None:
            self._start()
            self._send(self._busy)
            self._watch_over(self._busy)

    def _send(self, message: Order | None) -> None:
        with suppress(OSError):  # it ended just now: see _ended
            self._connection.send(message)

    def _start(self) -> None:
        if self._process is not None and self._process.is_alive():
            return
        context = get_context("spawn")
        self._connection, theirs = context.Pipe()
        process = context.Process(target=run_worker, args=(theirs,), daemon=True, name="rodshell-studio-worker")
        environment = {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
        os.environ |= dict.fromkeys(environment, "1")
        process.start()
        for name, value in environment.items():
            os.environ.pop(name) if value is None else os.environ.__setitem__(name, value)
        theirs.close()
        self._process = process
        loop = asyncio.get_running_loop()
        threading.Thread(target=self._listen, args=(process, self._connection, loop), daemon=True).start()

    def _listen(self, process: Any, connection: Any, loop: asyncio.AbstractEventLoop) -> None:
        """In a thread: what the process sends, until it ends."""
        with suppress(RuntimeError):  # the loop is closed
            try:
                while True:
                    loop.call_soon_threadsafe(self._hear, process, connection.recv())
            except (EOFError, OSError):
                loop.call_soon_threadsafe(self._ended, process)

    def _hear(self, process: Any, news: News) -> None:
        if process is not self._process:
            return
        over = self._busy is not None and news.serial == self._busy.serial and news.kind in ENDS
        self._watch_over(None if over else self._busy)
        self._heard(news)
        if over:
            self._next()

    def _ended(self, process: Any) -> None:
        """The process ended although nobody asked it to."""
        if process is self._process:
            self._lose(_ENDED)

    def _lose(self, sentence: str) -> None:
        """Without its process an order has failed; what waits is sent to another."""
        lost = self._busy
        self._kill()
        if lost is not None:
            self._heard(News(lost.serial, "failed", {"sentence": sentence}))
        self._next()

    def _watch_over(self, order: Order | None) -> None:
        """From now on, stop this order if it says nothing for too long, and none before it."""
        if self._watch is not None:
            self._watch.cancel()
        if order is not None:
            longest = order.time_limit + _GRACE
            late = f"out of time: the job was stopped, since it said nothing for {longest:g} s"
            self._watch = asyncio.get_running_loop().call_later(longest, self._lose, late)
