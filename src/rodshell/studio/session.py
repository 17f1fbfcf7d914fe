"""A session: the list of cases that somebody made, kept on disk, and the process that runs its jobs.

Everything that is worth keeping lies in the session's folder, written as soon as it is known, so that a page that is
loaded again, or a server that is started again, continues where it was.
"""

import asyncio
import json
import os
import re
import secrets
import threading
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import field, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rodshell.case.link import UPLOAD
from rodshell.case.load import BUILT_IN, FILE_KEYS
from rodshell.dataclass import dataclass
from rodshell.errors import InputError
from rodshell.studio.worker import News, Order, run_worker
from rodshell.units import shown

ENDED = "the job was ended by the system, perhaps for lack of memory: use fewer rods, or longer edges"
ENDS = ("done", "left", "failed")  # kinds of news with which an order ends
GRACE = 30.0  # s beyond the time limit after which a worker that says nothing is ended
MOST_CASES = 500  # of a session's history
NAME = re.compile(r"[\w-]{20,60}")
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
        if self._watch is not None:
            self._watch.cancel()
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
        if self._watch is not None:
            self._watch.cancel()
        over = self._busy is not None and news.serial == self._busy.serial and news.kind in ENDS
        if self._busy is not None and not over:
            self._watch_over(self._busy)
        self._heard(news)
        if over:
            self._next()

    def _ended(self, process: Any) -> None:
        """The process ended although nobody asked it to."""
        if process is self._process:
            self._lose(ENDED)

    def _lose(self, sentence: str) -> None:
        """Without its process an order has failed; what waits is sent to another."""
        lost = self._busy
        self._kill()
        if lost is not None:
            self._heard(News(lost.serial, "failed", {"sentence": sentence}))
        self._next()

    def _watch_over(self, order: Order) -> None:
        if self._watch is not None:
            self._watch.cancel()
        loop = asyncio.get_running_loop()
        self._watch = loop.call_later(order.time_limit + GRACE, self._stop, order)

    def _stop(self, order: Order) -> None:
        self._lose(f"the job was stopped: it said nothing for {order.time_limit + GRACE:g} s")


@dataclass
class State:
    """What is kept of a session.

    Parameters
    ----------
    cases : in their order, for undo and redo; at : the present one.
    variants : kept by name: their case, figures and verdict.
    """

    cases: list[dict[str, Any]] = field(default_factory=list)
    at: int = -1
    variants: list[dict[str, Any]] = field(default_factory=list)

    @property
    def case(self) -> dict[str, Any] | None:
        return self.cases[self.at] if self.cases else None


class Session:
    """A session in its folder.

    Parameters
    ----------
    folder : of the session; made if it is missing.
    time_limit : of a job [s].
    """

    def __init__(self, folder: Path, *, time_limit: float = 120.0) -> None:
        self.folder, self.time_limit = folder.absolute(), time_limit
        self.uploads.mkdir(parents=True, exist_ok=True)
        self.state = State()
        if (folder / "session.json").is_file():
            kept = (folder / "session.json").read_text(encoding="utf-8")
            self.state = State(**json.loads(kept, parse_constant=lambda _: None))  # NaN of an earlier version
        self.listeners: set[Heard] = set()
        self.worker = WorkerProcess(self._hear)
        self._newest: tuple[int, dict[str, Any]] = (0, {})  # serial of the newest order, and its case for the pages
        self._scene = b""  # of the present case, checked
        self._facts: Mapping[str, Any] = {}

    @property
    def uploads(self) -> Path:
        return self.folder / "uploads"

    def show(self, serial: int, case: dict[str, Any], *, live: bool) -> None:
        """Find the form of a case.

        Parameters
        ----------
        serial : of the page's input; what is found carries it.
        live : somebody drags; else the case becomes the present one, for undo and redo.

        Raises
        ------
        InputError : the case names a file that was not uploaded, or asks for frames to be written.
        """
        resolved = with_uploads(case, {path.name: path for path in self.uploads.iterdir()})
        if not live and case != self.state.case:
            self._record(case)
        self._newest, self._facts = (serial, {"case": case, "live": live}), {}
        self.worker.order(Order(serial, "form", resolved, live, self.time_limit))

    def step(self, by: int) -> bool:
        """Undo (-1) or redo (1); whether there was such a case."""
        if not 0 <= self.state.at + by < len(self.state.cases):
            return False
        self.state.at += by
        self._facts = {}
        self._keep()
        return True

    def files(self, serial: int) -> None:
        """Ask for the files of the last form, as ZIP."""
        self.worker.order(Order(serial, "files", time_limit=self.time_limit))

    def keep_variant(self, name: str) -> None:
        """Keep the present case with what was found of it under a name.

        Raises
        ------
        InputError : nothing was checked yet, or the name is empty.
        """
        if not name.strip():
            raise InputError("a variant needs a name")
        if not self._facts or self.state.case is None:
            raise InputError("there is no verdict yet: keep the variant when it is there")
        self._drop(name)
        key = secrets.token_hex(8)
        (self.folder / f"{key}.scene").write_bytes(self._scene)
        kept = {"figures": self._facts["figures"], "verdict": self._facts["verdict"]}
        self.state.variants.append({"name": name.strip()[:80], "case": self.state.case, "scene": key, **kept})
        self._keep()
        self._tell_variants()

    def drop_variant(self, name: str) -> None:
        """Forget a variant."""
        self._drop(name)
        self._keep()
        self._tell_variants()

    def _drop(self, name: str) -> None:
        for variant in [variant for variant in self.state.variants if variant["name"] == name.strip()[:80]]:
            self.state.variants.remove(variant)
            (self.folder / f"{variant['scene']}.scene").unlink(missing_ok=True)

    def _tell_variants(self) -> None:
        """Every page of the session shows the same variants."""
        self._publish(News(0, "variants", {"variants": list(self.state.variants)}))

    def scene_of_variant(self, key: str) -> bytes | None:
        """The scene of a variant by its key."""
        known = any(variant["scene"] == key for variant in self.state.variants)
        return (self.folder / f"{key}.scene").read_bytes() if known else None

    def _record(self, case: dict[str, Any]) -> None:
        state = self.state
        state.cases = [*state.cases[: state.at + 1], case][-MOST_CASES:]
        state.at = len(state.cases) - 1
        self._keep()

    def _keep(self) -> None:
        """Write the state, all of it or nothing."""
        new = self.folder / "session.json.new"
        new.write_text(json.dumps(vars(self.state)), encoding="utf-8")
        new.replace(self.folder / "session.json")

    def _hear(self, news: News) -> None:
        news = replace(news, facts=_with_names(news.facts, f"{self.uploads}{os.sep}"))
        serial, case = self._newest
        if news.serial == serial and news.kind == "stage" and news.facts.get("stage") == "checks":
            self._facts, self._scene = news.facts, news.content
        elif news.serial == serial and news.kind == "taken":  # every page of the session follows
            news = replace(news, facts={**case, "at": self.state.at, "count": len(self.state.cases)})
        self._publish(news)

    def _publish(self, news: News) -> None:
        for listener in list(self.listeners):
            listener(news)


def _with_names(value: Any, folder: str) -> Any:
    """The same value, in whose texts uploaded files have their names alone: no path of the server leaves it."""
    if isinstance(value, str):
        return value.replace(folder, "")
    if isinstance(value, Mapping):
        return {key: _with_names(inner, folder) for key, inner in value.items()}
    return [_with_names(inner, folder) for inner in value] if isinstance(value, list | tuple) else value


def with_uploads(case: Mapping[str, Any], uploads: Mapping[str, Path]) -> dict[str, Any]:
    """A case with the paths of uploaded files; no other file of the server is read or written.

    Parameters
    ----------
    case : tables as in a case file, in which "upload:NAME" stands for a file.
    uploads : their paths by name.

    Raises
    ------
    InputError : it names another file, or asks for frames to be written.
    """
    found = {key: dict(value) if isinstance(value, Mapping) else value for key, value in case.items()}
    for table, keys in FILE_KEYS.items():
        inner = found.get(table)
        for key in keys:
            if isinstance(inner, dict) and inner.get(key) is not None:
                name = str(inner[key]).removeprefix(UPLOAD)
                if not str(inner[key]).startswith(UPLOAD) or name not in uploads:
                    raise InputError(
                        f"{table}.{key} = {shown(inner[key])}: the studio reads only files that were uploaded: "
                        "upload it first"
                    )
                inner[key] = str(uploads[name])
    dotted = [path for path in found if "." in path]
    frames = found.get("drape")
    if dotted or (isinstance(frames, dict) and frames.get("frames") is not None):
        raise InputError("a case in the studio has tables in place of dotted keys, and no drape.frames")
    return found


class Sessions:
    """All sessions of a server, by their ids.

    Parameters
    ----------
    folder : in which each session has a folder.
    first : the case with which a new session begins, and files that it names, by name.
    """

    def __init__(self, folder: Path, first: dict[str, Any], files: Mapping[str, bytes], time_limit: float) -> None:
        self.folder, self.first, self._files, self._time_limit = folder, first, files, time_limit
        self._open: dict[str, Session] = {}

    def new(self) -> str:
        """A new session's id."""
        name = secrets.token_urlsafe(18)
        session = Session(self.folder / name, time_limit=self._time_limit)
        for file, content in self._files.items():
            (session.uploads / file).write_bytes(content)
        self._open[name] = session
        return name

    def get(self, name: str) -> Session | None:
        """An open session, or one that an earlier server left on disk; None: there is none."""
        if name not in self._open and NAME.fullmatch(name) and (self.folder / name).is_dir():
            self._open[name] = Session(self.folder / name, time_limit=self._time_limit)
        return self._open.get(name)

    def end(self) -> None:
        """End all processes."""
        for session in self._open.values():
            session.worker.end()


def presets() -> dict[str, dict[str, Any]]:
    """The built-in cases, as cases."""
    return {name: {"target": {"kind": name}, **tables} for name, tables in BUILT_IN.items()}
