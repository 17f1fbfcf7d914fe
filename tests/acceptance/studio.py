"""The acceptance table of the studio: the server as a program, its pages as another, and a browser before it."""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from threading import Thread
from typing import Any

import httpx2 as httpx
import numpy as np
import psutil
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import ClientConnection, connect

import rodshell as rs
from rodshell.case.load import BY_SUFFIX
from rodshell.studio.worker import News, Order, _Worker
from tests.acceptance.rows import FOLDER, Row, print_table
from tests.acceptance.studio_browser import browser_rows, notebook_rows, report_rows
from tests.acceptance.targets_broken import broken_files

DOME: dict[str, Any] = {
    "target": {"kind": "hemisphere"},
    "layout": {"rods": [17, 17], "spacing": "30 mm", "length": "1.2 m", "edge": "15 mm"},
    "rod": {"section": {"radius": "1 mm"}, "material": {"youngs_modulus": "1 MPa"}},
    "checks": {"stages": 0},
}
INPUTS = 300
LATENCY = 0.5  # s that a message may take on a busy machine; a queue of inputs would be seconds long
Kept = list[dict[str, Any]]


def dragged(k: int) -> dict[str, Any]:
    """The case after input k of a drag: of the spacing, then of the heading, then of the anchor."""
    spacing, turn, anchor = min(k, 100), min(max(k - 100, 0), 100), max(k - 200, 0)
    layout = {**DOME["layout"], "spacing": f"{30 + 0.02 * spacing:.3f} mm", "rotate": 0.002 * turn}
    return {**DOME, "layout": layout, "drape": {"anchor": [0.0002 * anchor, 0.0]}}


@contextmanager
def server(folder: Path, *options: str, token: bool = False) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The address of a studio of its own, with its token if there is one, and its process."""
    command = [sys.executable, "-c", "from rodshell.cli import entry; entry()", "studio", "--no-browser", "--port", "0"]
    command += ["--folder", str(folder), *options, *(() if token else ("--no-token",))]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.search(r"http://\S+", line)
        assert found, line
        address = found[0]
        for _ in range(600):
            try:
                httpx.get(address, timeout=30)
                break
            except httpx.TransportError:
                time.sleep(0.1)
        yield address, process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()


class Page:
    """What the page does: it sends cases, and hears what is found."""

    def __init__(self, address: str, session: str = "") -> None:
        self.address = address.partition("?")[0]
        self.session = session or httpx.post(f"{self.address}api/sessions", timeout=60).json()["id"]
        self.heard: Kept = []
        self.sent = dict[int, float]()  # when, by serial
        self.serial = 0
        place = f"{self.address.replace('http', 'ws')}api/sessions/{self.session}/live"
        self.socket: ClientConnection = connect(place, max_size=None)
        self.state = json.loads(self.socket.recv(timeout=60))

    def show(self, case: dict[str, Any], *, live: bool = False) -> int:
        """Send a case."""
        self.serial += 1
        self.sent[self.serial] = time.monotonic()
        self.order(kind="case", serial=self.serial, case=case, live=live)
        return self.serial

    def order(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def hear(self, seconds: float) -> dict[str, Any] | None:
        """The next message within some seconds; a scene is left out."""
        try:
            content = self.socket.recv(timeout=seconds)
        except TimeoutError:
            return None
        if isinstance(content, bytes):
            return None
        message: dict[str, Any] = json.loads(content)
        self.heard.append(message | {"at": time.monotonic()})
        return message

    def until(self, *kinds: str, serial: int = 0, seconds: float = 240) -> dict[str, Any]:
        """The next message of such a kind, of an order."""
        stop = time.monotonic() + seconds
        while time.monotonic() < stop:
            message = self.hear(1.0)
            if message and message["kind"] in kinds and serial in (0, message.get("serial")):
                return message
        raise AssertionError(f"no {kinds} in {seconds} s")

    def found(self, case: dict[str, Any]) -> dict[str, Any]:
        """How the search for a form ends: "done", or "failed" with its sentence."""
        return self.until("done", "failed", serial=self.show(case))

    def form(self) -> dict[str, np.ndarray]:
        """The states of the session's form, as downloaded."""
        from zipfile import ZipFile

        packed = httpx.get(f"{self.address}api/sessions/{self.session}/files.zip", timeout=240).content
        with ZipFile(BytesIO(packed)) as files:
            return dict(np.load(BytesIO(files.read("states.npz"))))

    def upload(self, path: Path) -> httpx.Response:
        with path.open("rb") as file:
            place = f"{self.address}api/sessions/{self.session}/uploads"
            return httpx.post(place, params={"name": path.name}, content=file, timeout=120)

    def passed(self, heard: Kept) -> list[int]:
        """Inputs that were begun although a newer one had been sent some time before."""
        begun = [message for message in heard if message["kind"] == "taken"]
        return [
            message["serial"]
            for message in begun
            if (newer := self.sent.get(message["serial"] + 1)) is not None and message["at"] - newer > LATENCY
        ]


def drag(page: Page, *, pause: float, count: int = INPUTS) -> None:
    """All inputs of a drag, without the release."""
    for k in range(count):
        page.show(dragged(k), live=True)
        stop = time.monotonic() + pause
        while (left := stop - time.monotonic()) > 0:
            page.hear(left)


def drag_rows(folder: Path) -> Iterator[Row]:
    """300 inputs, then the release."""
    with server(folder) as (address, _):
        page = Page(address)
        page.found(DOME)
        before = len(page.heard)
        drag(page, pause=0.03)
        last = page.show(dragged(INPUTS - 1))
        page.until("done", serial=last)
        heard = page.heard[before:]
        taken = [message["serial"] for message in heard if message["kind"] == "taken"]
        stages = [message["serial"] for message in heard if message["kind"] == "stage"]
        wrong = sum(a > b for serials in (taken, stages) for a, b in pairwise(serials))
        note = f"{len(taken)} of {INPUTS} begun"
        passed = len(page.passed(heard))
        yield Row("drag of 300 inputs", "begun although a newer one waited", passed, 0, note=note)
        yield Row("", "shown or begun out of order", wrong, 0)
        unseen = len(set(taken) - set(stages))
        yield Row("", "begun, and nothing shown of it", unseen, 0)
        runs = sum(message["kind"] == "stage" and message.get("stage") == "checks" for message in heard)
        yield Row("", "cold runs after the release, beyond one", abs(runs - 1), 0)
        expected = command_line(dragged(INPUTS - 1), folder / "case")
        states = page.form()
        apart = [name for name, values in expected.items() if not np.array_equal(states[name], values)]
        yield Row("", "arrays that are not the command line's", len(apart), 0, note=", ".join(apart))
        rude = Page(address)
        rude.found(DOME)
        before = len(rude.heard)
        for k in range(INPUTS):
            rude.order(kind="case", serial=1000 + k, case=dragged(k), live=True)
        rude.until("done", serial=1000 + INPUTS - 1)
        begun = sum(message["kind"] == "taken" for message in rude.heard[before:])
        yield Row("300 inputs at once", "inputs begun", begun, INPUTS / 3, note="a page that does not wait")


def command_line(case: dict[str, Any], folder: Path) -> dict[str, np.ndarray]:
    """The states that `rodshell form` writes."""
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text(rs.Job.load(case).to_toml())
    command = [sys.executable, "-c", "from rodshell.cli import entry; entry()", "form", "case.toml", "--quiet"]
    done = subprocess.run([*command, "--out", "out", "--force"], cwd=folder, capture_output=True, text=True)
    assert done.returncode in (0, 3, 4), done.stderr
    return dict(np.load(folder / "out" / "states.npz"))


class Quiet:
    """A connection without another end, in which a newer order waits for each that was begun, or none."""

    def __init__(self) -> None:
        self.waits, self._begun = False, False

    def send(self, news: News) -> None:
        self._begun = news.kind not in ("left", "done", "failed")

    def poll(self) -> bool:
        return self.waits and self._begun


def drift_rows() -> Iterator[Row]:
    """How near a dragged form is to a cold one."""
    worker, apart = _Worker(Quiet()), 0.0  # type: ignore[arg-type]
    for k in (0, 40, 100, 150, 200, 250, 299):
        worker.obey(Order(k, "form", dragged(k), True))
        warm, cold = worker._form, rs.Job.load(dragged(k)).run(until="pop-up")
        pairs = [(warm.draped.positions, cold.draped.positions)]
        pairs += [(warm.popped[end].positions, cold.popped[end].positions) for end in cold.popped]
        apart = max(apart, *(float(np.abs(a - b).max()) / cold.target.size for a, b in pairs))
    yield Row("while dragging", "off the cold run, over the size", apart, 1e-6)


def fairness_rows(folder: Path) -> Iterator[Row]:
    """Five sessions drag at once."""
    with server(folder) as (address, process):
        pages = [Page(address) for _ in range(5)]
        for page in pages:
            page.found(DOME)
        threads = [Thread(target=drag, args=(page,), kwargs={"pause": 0.05, "count": 150}) for page in pages]
        marks = [len(page.heard) for page in pages]
        for thread in threads:
            thread.start()
        memory = 0.0
        while any(thread.is_alive() for thread in threads):
            children = psutil.Process(process.pid).children(recursive=True)
            for child in children:
                try:
                    memory = max(memory, child.memory_full_info().uss / 1e6)
                except psutil.Error:
                    continue
            time.sleep(0.3)
        served = [
            sum(message["kind"] == "taken" for message in page.heard[mark:])
            for page, mark in zip(pages, marks, strict=True)
        ]
        ended = [page.until("done", serial=page.show(dragged(150))) for page in pages]
        note = f"updates: {', '.join(map(str, served))}"
        yield Row("5 sessions at once", "most updates over fewest", max(served) / max(1, min(served)), 2, "times", note)
        yield Row("", "sessions that were not served to the end", 5 - len(ended), 0)
        yield Row("", "memory of a session", memory, 400, "MB")


def interruption_rows(folder: Path) -> Iterator[Row]:
    """Worker killed, page reloaded, server restarted, each in the middle of a job."""
    with server(folder) as (address, process):
        page = Page(address)
        page.found(DOME)
        page.order(kind="keep", name="kept")
        page.until("variants")
        job = page.show(dragged(50))
        page.until("progress", serial=job)
        for child in psutil.Process(process.pid).children(recursive=True):
            if "spawn_main" in " ".join(child.cmdline()):
                os.kill(child.pid, signal.SIGKILL)
        said = page.until("failed", "done", serial=job)
        yield Row("worker killed", "said nothing", float("sentence" not in said), 0, note=said.get("sentence", ""))
        again = page.found(dragged(50))
        yield Row("", "the next job is not done", float(again["kind"] != "done"), 0)
        page.show(dragged(60))
        page.until("taken")
        page.socket.close()
        reloaded = Page(address, page.session)
        lost = (reloaded.state["cases"][reloaded.state["at"]] != dragged(60)) + (len(reloaded.state["variants"]) != 1)
        yield Row("page reloaded", "lost", lost, 0)
        reloaded.serial = 100
        found = reloaded.found(reloaded.state["cases"][reloaded.state["at"]])
        yield Row("", "the job is not done", float(found["kind"] != "done"), 0)
        program = httpx.post(f"{address}api/jobs", json=dragged(80), timeout=60).json()["id"]
        reloaded.show(dragged(70))
        reloaded.until("progress")
        workers = psutil.Process(process.pid).children(recursive=True)
        process.kill()
        left = len(psutil.wait_procs(workers, timeout=20)[1])
        yield Row("server killed", "processes left", left, 0, note=f"{len(workers)} in the middle of their jobs")
    with server(folder) as (address, _):
        restarted = Page(address, page.session)
        lost = (restarted.state["cases"][restarted.state["at"]] != dragged(70)) + (
            len(restarted.state["variants"]) != 1
        )
        yield Row("started again", "lost", lost, 0)
        status = ""
        for _ in range(600):
            status = httpx.get(f"{address}api/jobs/{program}", timeout=60).json()["status"]
            if status in ("done", "failed"):
                break
            time.sleep(0.3)
        yield Row("", "a program's job is not done", float(status != "done"), 0, note=status)


def bad_input_rows(folder: Path) -> Iterator[Row]:
    """Broken files, one too large, and a formula that takes for ever, while another session drags."""
    files = folder / "broken"
    files.mkdir(parents=True)
    with server(folder / "sessions", "--time-limit", "10 s") as (address, _):
        other, page = Page(address), Page(address)
        other.found(DOME)
        wrong: list[str] = []
        count = 0
        for what, arguments in broken_files(files):
            path = Path(arguments[0])
            if path.suffix not in BY_SUFFIX or len(arguments) != 3 or what == "a huge file" or not path.is_file():
                continue
            answer = page.upload(path)
            if answer.status_code != 201:
                said = {"kind": "failed", **answer.json()}
            else:
                table = {"kind": BY_SUFFIX[path.suffix], "file": answer.json()["file"]}
                given = {"target": table | {arguments[1].removeprefix("--").removeprefix("target."): arguments[2]}}
                if "spacing" in given["target"]:
                    given["layout"] = {"spacing": given["target"].pop("spacing")}
                said = page.found(given)
            sentence = said.get("sentence", "")
            count += 1
            if (
                said["kind"] != "failed"
                or not 20 < len(sentence) < 500
                or "\n" in sentence
                or "program failed" in sentence
            ):
                wrong.append(f"{path.name} ({what}): {said['kind']} {sentence[:120]}")
        yield Row(
            "broken uploads", "without one sentence", len(wrong), 0, note=f"{count} files; {'; '.join(wrong[:3])}"
        )
        huge = folder / "huge.obj"
        with huge.open("wb") as file:
            file.truncate(300_000_000)
        try:
            answer = page.upload(huge)
            sentence = answer.json()["sentence"] if answer.status_code == 400 else ""
        except httpx.TransportError as reason:  # the server need not read the rest
            sentence = f"refused: {reason}"
        left = sum(path.stat().st_size for path in (folder / "sessions").rglob("*") if path.is_file())
        yield Row("mesh of 300 MB", "not refused", float(not sentence), 0, note=sentence)
        yield Row("", "left on the disk", left / 1e6, 100, "MB")
        terms = "+".join(f"sin({k}*x)*cos({k}*y)*exp(-x*x*{k})/{k * k}" for k in range(1, 90))
        case = {
            "target": {"kind": "heightfield", "formula": f"0.3*({terms})", "domain": "disc", "radius": 1},
            "layout": {"spacing": "40 mm"},
        }
        serial = page.show(case)
        updates = other.show(dragged(20), live=True)
        disturbed = other.until("stage", "failed", serial=updates)["kind"] != "stage"
        said = page.until("done", "failed", serial=serial, seconds=120)
        shown = [
            message["status"] for message in page.heard if message["kind"] == "stage" and message["serial"] == serial
        ]
        sentence = said.get("sentence", (shown or [said["kind"]])[-1])  # a shape that was not finished is shown
        yield Row(
            "formula that takes for ever", "not ended in time", float("out of time" not in sentence), 0, note=sentence
        )
        yield Row("", "another session was disturbed", float(disturbed), 0)


def refusal_rows(folder: Path) -> Iterator[Row]:
    """Another site, no token, names that climb out of folders, and names that are script."""
    with server(folder / "local") as (address, _):
        evil = {"origin": "https://evil.example"}
        page = Page(address)
        refused = [
            httpx.post(f"{address}api/sessions", headers=evil).status_code == 403,
            httpx.post(f"{address}api/jobs", json=DOME, headers=evil).status_code == 403,
            httpx.get(f"{address}api/version", headers={"host": "evil.example"}).status_code == 403,
            _closed(
                lambda: connect(
                    f"{address.replace('http', 'ws')}api/sessions/{page.session}/live", origin="https://evil.example"
                )
            ),  # type: ignore[arg-type]
        ]
        yield Row("another origin", "let in", refused.count(False), 0, note=f"{len(refused)} tries")
        climbing = [
            "static/..%2f..%2fserver.py",
            "api/jobs/..%2f..",
            f"api/sessions/{page.session}/scenes/..%2fsession.json",
        ]
        climbing += ["api/sessions/..%2f..%2fx/files.zip", "static/%2e%2e/%2e%2e/start.py", "..%2f..%2fetc/passwd"]
        read = [path for path in climbing if httpx.get(address + path).status_code == 200]
        for name in ("/etc/passwd", "upload:../session.json", "../../session.json"):
            found = page.found({"target": {"kind": "mesh", "file": name}})
            read += [name] if "uploaded" not in found.get("sentence", "") else []
        yield Row("../ in names", "read", len(read), 0, note=", ".join(read))
        script = "<img src=x onerror=alert(1)>.obj"
        named = httpx.post(
            f"{address}api/sessions/{page.session}/uploads", params={"name": script}, content=b"v"
        ).json()
        inert = not set("<>&\"'") & set(
            named.get("file", "") + named.get("sentence", "").replace("'", "").replace('"', "")
        )
        yield Row("script in a name", "kept as it is", float("file" in named and not inert), 0, note=str(named))
    for host in ("127.0.0.1", "0.0.0.0"):
        with server(folder / host, "--host", host, token=True) as (address, _):
            plain, _, token = address.replace("0.0.0.0", "127.0.0.1").partition("?token=")
            answers = [httpx.get(plain + path).status_code for path in ("", "api/version", "api/start")]
            answers += [httpx.post(f"{plain}api/{path}", json=DOME).status_code for path in ("jobs", "sessions")]
            answers += [httpx.get(f"{plain}?token=x").status_code]
            right = httpx.get(f"{plain}api/version", headers={"authorization": f"Bearer {token}"}).status_code
            yield Row(f"a missing token, {host}", "let in", sum(code != 403 for code in answers), 0)
            yield Row("", "the right token is refused", float(right != 200), 0)


def _closed(call: Callable[[], Any]) -> bool:
    try:
        call()
    except (InvalidHandshake, ConnectionClosed, OSError):
        return True
    return False


PARTS: dict[str, Callable[[Path], Iterator[Row]]] = {
    "drift": lambda _: drift_rows(),
    "drag": drag_rows,
    "fairness": fairness_rows,
    "interruptions": interruption_rows,
    "bad": bad_input_rows,
    "refusals": refusal_rows,
    "report": report_rows,
    "notebook": notebook_rows,
    "browser": lambda folder: _in_browser(folder),
}


def _in_browser(folder: Path) -> Iterator[Row]:
    with server(folder / "browser") as (address, _):
        yield from browser_rows(address, folder, FOLDER / "studio")


def all_rows(names: list[str]) -> Iterator[Row]:
    """The rows of some parts of the table, or of all."""
    for name in names or PARTS:
        with tempfile.TemporaryDirectory() as folder:
            yield from PARTS[name](Path(folder) / name)


if __name__ == "__main__":
    sys.exit(print_table("studio", all_rows(sys.argv[1:])))
