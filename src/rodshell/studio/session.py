"""A session: the list of cases that somebody made, kept on disk, and the process that runs its jobs.

Everything that is worth keeping lies in the session's folder, written as soon as it is known, so that a page that is
loaded again, or a server that is started again, continues where it was.
"""

import asyncio
import json
import logging
import os
import re
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator

from rodshell.case.load import BUILT_IN
from rodshell.errors import InputError
from rodshell.studio.kept import BLOCK, NAME, Room, read_record, write_record
from rodshell.studio.process import Heard, WorkerProcess
from rodshell.studio.worker import News, Order
from rodshell.untrusted import limit, raised

ALONE = 60.0  # s without a page after which a session's process is ended
SESSIONS = 50  # with a page or a process at once
_MOST_CASES = 500  # of a session's history
HISTORY = 10e6  # bytes of these cases
_VARIANTS = 100  # of a session
_SCENE = re.compile("[0-9a-f]{16}")


def _variant(kept: dict[str, Any]) -> dict[str, Any]:
    """A variant as it is kept; its scene is the name of a file in the session's folder."""
    kinds = {"name": str, "case": dict, "scene": str, "figures": list, "verdict": dict}
    if not all(isinstance(kept.get(key), kind) for key, kind in kinds.items()) or not _SCENE.fullmatch(kept["scene"]):
        raise ValueError("a variant is not as it was kept")
    return kept


@dataclass
class State:
    """What is kept of a session.

    Args:
        cases: in their order, for undo and redo; at : the present one.
        variants: kept by name: their case, figures and verdict.
    """

    cases: list[dict[str, Any]] = field(default_factory=list)
    at: int = -1
    variants: list[Annotated[dict[str, Any], AfterValidator(_variant)]] = field(default_factory=list)

    @property
    def case(self) -> dict[str, Any] | None:
        return self.cases[self.at] if self.cases else None


class Session:
    """A session in its folder.

    Args:
        folder: of the session; made if it is missing.
        time_limit: of a job [s].
        room: makes room for so many bytes.
        left: called when the process was ended since there is no page; the session can then be opened again.

    Raises:
        InputError: what was kept of it is damaged.
    """

    def __init__(
        self,
        folder: Path,
        *,
        time_limit: float = 120.0,
        room: Callable[[float], None] = lambda _: None,
        left: Callable[[], object] = lambda: None,
    ) -> None:
        self.folder, self.time_limit, self.room, self._left = folder.absolute(), time_limit, room, left
        self.uploads.mkdir(parents=True, exist_ok=True)
        self.state = State()
        if os.path.lexists(folder / "session.json"):
            self.state = read_record(folder / "session.json", State)
            if not (0 <= self.state.at < len(self.state.cases) or self.state == State()):
                raise InputError(f"{folder / 'session.json'} is damaged: it has no case {self.state.at}")
        self.listeners: set[Heard] = set()
        self.pages = count(1)  # numbers of the pages that come to it
        self._leaving: asyncio.TimerHandle | None = None
        self.worker = WorkerProcess(self._hear)
        self._newest: tuple[int, dict[str, Any]] = (0, {})  # serial of the newest order, and its case for the pages
        self._scene = b""  # of the present case, checked
        self._facts: Mapping[str, Any] = {}

    @property
    def uploads(self) -> Path:
        return self.folder / "uploads"

    @contextmanager
    def listening(self, heard: Heard) -> Iterator[None]:
        """Hear the news. The process of a session is ended when nobody has heard them for some time."""
        self.listeners.add(heard)
        self.leave_later()
        try:
            yield
        finally:
            self.listeners.discard(heard)
            self.leave_later()

    def leave_later(self) -> None:
        """End the process after some time, unless somebody listens."""
        if self._leaving is not None:
            self._leaving.cancel()
        self._leaving = None if self.listeners else asyncio.get_running_loop().call_later(ALONE, self._leave)

    def _leave(self) -> None:
        self.worker.end()
        self._left()

    def show(self, serial: int, case: dict[str, Any], *, live: bool) -> None:
        """Find the form of a case, which may name uploaded files.

        Args:
            serial: of the page's input; what is found carries it.
            live: somebody drags; else the case becomes the present one, for undo and redo.
        """
        if not live and case != self.state.case:
            self._record(case)
        self._newest, self._facts = (serial, {"case": case, "live": live}), {}
        self.worker.order(Order(serial, "form", case, live, self.time_limit, uploads=str(self.uploads)))

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

        Raises:
            InputError: nothing was checked yet, the name is empty, or there are too many.
        """
        if not name.strip():
            raise InputError("a variant needs a name")
        if not self._facts or self.state.case is None:
            raise InputError("there is no verdict yet: keep the variant when it is there")
        self._drop(name)
        if len(self.state.variants) >= limit(_VARIANTS):
            raise InputError(
                f"a session keeps {limit(_VARIANTS):g} variants at most: forget one first, "
                f"{raised(_VARIANTS, len(self.state.variants) + 1)}"
            )
        self.room(len(self._scene))
        key = secrets.token_hex(8)
        (self.folder / f"{key}.scene").write_bytes(self._scene)
        kept = {"figures": self._facts["figures"], "verdict": self._facts["verdict"]}
        self.state.variants.append({"name": name.strip()[:80], "case": self.state.case, "scene": key, **kept})
        self._keep_variants()

    def drop_variant(self, name: str) -> None:
        """Forget a variant."""
        self._drop(name)
        self._keep_variants()

    def _drop(self, name: str) -> None:
        for variant in [variant for variant in self.state.variants if variant["name"] == name.strip()[:80]]:
            self.state.variants.remove(variant)
            (self.folder / f"{variant['scene']}.scene").unlink(missing_ok=True)

    def _keep_variants(self) -> None:
        """Every page of the session shows the same variants."""
        self._keep()
        self._publish(News(0, "variants", {"variants": list(self.state.variants)}))

    def scene_of_variant(self, key: str) -> bytes | None:
        """The scene of a variant by its key."""
        file = self.folder / f"{key}.scene"
        known = any(variant["scene"] == key for variant in self.state.variants)
        return file.read_bytes() if known and file.is_file() else None

    def _record(self, case: dict[str, Any]) -> None:
        self.room(len(json.dumps(case)))
        state = self.state
        state.cases = [*state.cases[: state.at + 1], case][-_MOST_CASES:]
        sizes = [len(json.dumps(case)) for case in state.cases]
        while sum(sizes) > limit(HISTORY) and len(sizes) > 1:
            del sizes[0], state.cases[0]
        state.at = len(state.cases) - 1
        self._keep()

    def _keep(self) -> None:
        write_record(self.folder / "session.json", vars(self.state))

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


class Sessions:
    """All sessions of a server, by their ids.

    Args:
        first: the case with which a new session begins, and files that it names, by name.
    """

    def __init__(
        self, folder: Path, first: dict[str, Any], files: Mapping[str, bytes], time_limit: float, room: Room
    ) -> None:
        self.folder, self.first, self._files, self._time_limit, self._room = folder, first, files, time_limit, room
        self._open: dict[str, Session] = {}
        room.users.append(lambda: set(self._open))

    def new(self) -> str:
        """A new session's id.

        Raises:
            InputError: there is no room for it.
        """
        name = secrets.token_urlsafe(18)
        self._room.make(2 * BLOCK + sum(map(len, self._files.values())))
        uploads = self.folder / name / "uploads"
        uploads.mkdir(parents=True)
        for file, content in self._files.items():
            (uploads / file).write_bytes(content)
        return name

    def get(self, name: str) -> Session | None:
        """A session by its id, also one that an earlier server left on disk; None: there is none."""
        if name not in self._open and NAME.fullmatch(name) and (self.folder / name).is_dir():
            left = partial(self._open.pop, name, None)
            try:
                session = Session(self.folder / name, time_limit=self._time_limit, room=self._room.make, left=left)
            except (InputError, OSError) as reason:
                logging.getLogger(__name__).warning("a session is lost: %s", reason)
                return None
            self._open[name] = session
            session.leave_later()
        return self._open.get(name)

    def hearing(self, session: Session, heard: Heard) -> AbstractContextManager[None]:
        """Hear a session's news, as `Session.listening`.

        Raises:
            InputError: too many others have a page or a process.
        """
        others = [other for other in self._open.values() if other.listeners or other.worker.is_running]
        count = len(others) - (session in others)
        if count >= limit(SESSIONS):
            raise InputError(f"{count} others use this server: try again later, {raised(SESSIONS, count + 1)}")
        return session.listening(heard)

    def end(self) -> None:
        """End all processes."""
        for session in self._open.values():
            session.worker.end()


def presets() -> dict[str, dict[str, Any]]:
    """The built-in cases, as cases."""
    return {name: {"target": {"kind": name}, **tables} for name, tables in BUILT_IN.items()}
