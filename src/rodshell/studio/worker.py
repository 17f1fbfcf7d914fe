"""The process that runs the jobs of one session, one after the other.

It takes orders from a pipe and sends back what it finds as it is found: first the grid on its target, then the
popped-up shells, then checks and verdict. While somebody drags, each order starts from the form before; the last one,
after the release, is run as the command line runs it, from nothing.

A newer order ends an older one, which a word in the pipe asks for (None): before it is begun or at any iteration, but
while somebody drags only once the grid of the older one was shown, so that every order that is begun is seen.
"""

import os
import resource
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from multiprocessing.connection import Connection
from pathlib import Path
from time import monotonic, process_time
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

from rodshell.case.link import UPLOAD
from rodshell.case.load import load_case
from rodshell.errors import InputError, RodshellError
from rodshell.form import Form
from rodshell.job import Job
from rodshell.progress import Progress
from rodshell.studio.preview import Preview, checked
from rodshell.threads import work_for_parent

_TOO_LARGE = "this job needs more memory than a session may have: use fewer rods, or longer edges"
PAUSE = 0.1  # s between two messages of progress at least
MEMORY = 3_000_000_000  # bytes of a worker's data at most


@dataclass(frozen=True)
class Order:
    """What a worker is to do.

    Args:
        serial: numbers the orders of a session.
        kind: "form": find the form of a case; "files": the last form's files as a ZIP archive; "job": find the form and
            write its folder.
        case: tables as in a case file, in which "upload:NAME" stands for a file.
        uploads: folder of the files that it may name; "": it may name none.
        live: somebody drags: start from the form before, and leave refinement and checks out.
        time_limit: of form finding [s].
        folder: of the result of a "job".
    """

    serial: int
    kind: str
    case: Mapping[str, Any] = field(default_factory=dict)
    live: bool = False
    time_limit: float = 120.0
    folder: str = ""
    uploads: str = ""


@dataclass(frozen=True)
class News:
    """What a worker sends.

    Args:
        serial: of the order; kind : "taken", "progress", "stage", "files"; at its end "done", "failed", or "left", for
            a newer one.
        facts: plain values for the page; content : a scene, or a file.
    """

    serial: int
    kind: str
    facts: Mapping[str, Any] = field(default_factory=dict)
    content: bytes = b""


class _Superseded(Exception):
    """A newer order waits."""


def run_worker(connection: Connection, memory: int = MEMORY) -> None:
    """Obey orders until the other end of the connection is closed.

    Args:
        connection: receives `Order`, sends `News`.
        memory: bytes of data that the process may have.
    """
    work_for_parent()
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    worker = _Worker(connection)
    while True:
        try:
            order = connection.recv()
        except (EOFError, OSError):
            return
        if order is not None:  # else a word about an order that came after the one that it was to end
            worker.obey(order)


def job_of(order: Order) -> Job:
    """The job of an order's case, which reads no file of the server but uploads, whatever its keys are.

    Raises:
        InputError: the case names another file, or cannot be used.
    """

    def uploaded(value: object) -> str:
        name = value.removeprefix(UPLOAD) if isinstance(value, str) and value.startswith(UPLOAD) else ""
        if not (name and os.path.isdir(order.uploads) and name in os.listdir(order.uploads)):
            raise InputError("the studio reads only files that were uploaded: upload it first")
        return str(Path(order.uploads) / name)

    return Job.of_case(load_case(dict(order.case), files=uploaded))


class _Worker:
    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._form: Form | None = None  # the last form, from which the next drag starts
        self._preview = Preview()

    def obey(self, order: Order) -> None:
        if order.kind == "form" and self._connection.poll():
            self._send(order, "left")
            return
        self._send(order, "taken")
        start, kind, facts = process_time(), "failed", dict[str, Any]()
        try:
            {"form": self._find, "files": self._files, "job": self._job}[order.kind](order)
            kind, facts = "done", {"cpu": process_time() - start}
        except _Superseded:
            kind = "left"
        except RodshellError as error:
            facts = {"sentence": str(error)}
        except MemoryError:
            self._form, facts = None, {"sentence": _TOO_LARGE}
        except Exception as error:
            said = f"the program failed ({type(error).__name__}: {error}): please report this case"
            facts = {"sentence": said}
        self._send(order, kind, facts)

    def _find(self, order: Order) -> None:
        show, job = self._preview, job_of(order)
        plain = job.changed(refine__vary="") if job.case.refine.vary else job
        earlier, shown = self._form if order.live else None, False
        progress = self._progress(order, lambda: shown or not order.live)
        grid = plain.run(warm_start=earlier, progress=progress, time_limit=order.time_limit, until="drape")
        self._show(order, "drape", *show.of(grid))
        shown = True
        form = plain.run(warm_start=grid, progress=progress, time_limit=order.time_limit, until="pop-up")
        self._form = form
        self._show(order, "pop-up", *show.of(form))
        if plain is not job and not order.live:
            form = job.run(warm_start=form, progress=progress, time_limit=order.time_limit, until="pop-up")
            self._show(order, "refinement", *show.of(form))
        if not order.live:
            self._form = form = form.finished(progress)
            self._show(order, "checks", *checked(form, job))

    def _progress(self, order: Order, may_leave: Callable[[], bool]) -> Progress:
        """Progress that is sent now and then, and leaves the order for a newer one where it may."""
        said = monotonic() if order.live else 0.0

        def progress(stage: str, detail: str, residual: float) -> None:
            nonlocal said
            if may_leave() and self._connection.poll():
                raise _Superseded
            if monotonic() > said + PAUSE:
                said = monotonic()
                self._send(order, "progress", {"stage": stage, "detail": detail})

        return progress

    def _show(self, order: Order, stage: str, facts: dict[str, Any], scene: bytes) -> None:
        self._send(order, "stage", {"stage": stage, **facts}, scene)
        if self._connection.poll():
            raise _Superseded

    def _files(self, order: Order) -> None:
        """The last form's folder, as `rodshell form --all` writes it."""
        if self._form is None:
            raise InputError("there is no form yet: wait for the verdict")
        packed = BytesIO()
        with tempfile.TemporaryDirectory() as folder:
            written = self._form.save(Path(folder) / "result", kinds="all")
            with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
                for path in sorted(written.rglob("*")):
                    if path.is_file():
                        archive.write(path, path.relative_to(written))
        self._send(order, "files", content=packed.getvalue())

    def _job(self, order: Order) -> None:
        """Find a form and write its folder, as `rodshell form --all` does."""
        progress = self._progress(order, lambda: False)
        job_of(order).run(progress=progress, time_limit=order.time_limit).save(order.folder, kinds="all", force=True)

    def _send(self, order: Order, kind: str, facts: Mapping[str, Any] | None = None, content: bytes = b"") -> None:
        self._connection.send(News(order.serial, kind, facts or {}, content))
