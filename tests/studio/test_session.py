"""The queue before a session's process: one order is worked on, and one waits, the newest."""

import asyncio
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rodshell.errors import InputError
from rodshell.studio import kept, session
from rodshell.studio.jobs import Jobs
from rodshell.studio.kept import Room
from rodshell.studio.process import WorkerProcess
from rodshell.studio.session import Session, Sessions
from rodshell.studio.worker import News, Order, _Worker


class Scripted(WorkerProcess):
    """A process that does what a test says, and keeps what was sent to it."""

    def __init__(self, heard: Callable[[News], None]) -> None:
        super().__init__(heard)
        self.sent: list[Order | None] = []
        self.starts = 0

    def _start(self) -> None:
        if self._process is None:
            self.starts += 1
            self._process = type("Process", (), {"kill": lambda _: None, "join": lambda _: None})()
            self._connection = type("Pipe", (), {"send": lambda _, message: self.sent.append(message)})()

    def says(self, kind: str, serial: int) -> None:
        self._hear(self._process, News(serial, kind))

    def dies(self) -> None:
        self._ended(self._process)

    @property
    def serials(self) -> list[int | None]:
        return [None if order is None else order.serial for order in self.sent]


def scripted(play: Callable[[Scripted], None]) -> list[tuple[int, str]]:
    """What a session hears of a play."""
    heard: list[tuple[int, str]] = []

    async def run() -> None:
        worker = Scripted(lambda news: heard.append((news.serial, news.kind)))
        play(worker)
        worker.end()

    asyncio.run(run())
    return heard


def form(serial: int, **more: Any) -> Order:
    return Order(serial, "form", **more)


def test_of_many_inputs_only_the_newest_is_sent_on() -> None:
    def play(worker: Scripted) -> None:
        for serial in range(1, 301):
            worker.order(form(serial, live=True))
        assert worker.serials == [1, None]  # one order, and once the word that one waits
        worker.says("stage", 1)
        worker.says("left", 1)
        assert worker.serials == [1, None, 300]
        worker.says("done", 300)
        assert worker.serials == [1, None, 300]

    scripted(play)


def test_an_input_that_comes_between_is_told_of_again() -> None:
    def play(worker: Scripted) -> None:
        for serial in (1, 2):
            worker.order(form(serial))
        worker.says("left", 1)
        worker.order(form(3))
        assert worker.serials == [1, None, 2, None]
        worker.says("done", 2)
        assert worker.serials == [1, None, 2, None, 3]

    scripted(play)


class Quiet:
    """A pipe in which a newer order waits, or none."""

    def __init__(self, waits: bool) -> None:
        self.waits, self.sent = waits, list[News]()

    def poll(self) -> bool:
        return self.waits

    def send(self, news: News) -> None:
        self.sent.append(news)


@pytest.mark.parametrize("live", [True, False])
def test_an_input_that_is_superseded_before_it_is_begun_is_never_begun(live: bool) -> None:
    pipe = Quiet(waits=True)
    _Worker(pipe).obey(form(1, live=live, case={"target": {"kind": "hemisphere"}}))  # type: ignore[arg-type]
    assert [news.kind for news in pipe.sent] == ["left"]


def test_files_that_were_asked_for_are_packed_although_an_input_waits() -> None:
    pipe = Quiet(waits=True)
    _Worker(pipe).obey(Order(-1, "files"))  # type: ignore[arg-type]
    assert [news.kind for news in pipe.sent] == ["taken", "failed"]
    assert "no form yet" in pipe.sent[-1].facts["sentence"]


def test_files_wait_their_turn_and_displace_nothing() -> None:
    def play(worker: Scripted) -> None:
        worker.order(form(1))
        worker.order(Order(-1, "files"))
        worker.order(Order(-2, "files"))
        assert worker.serials == [1]  # no word: files end no search
        worker.order(form(2))
        worker.says("left", 1)
        for serial in (2, -1, -2):
            worker.says("done", serial)
        assert worker.serials == [1, None, 2, -1, -2]

    scripted(play)


def test_when_the_process_dies_the_order_has_failed_and_what_waits_is_sent_to_another() -> None:
    def play(worker: Scripted) -> None:
        worker.order(form(1))
        worker.order(form(2))
        worker.dies()
        assert worker.serials == [1, None, 2]
        assert worker.starts == 2
        worker.says("done", 2)

    assert scripted(play) == [(1, "failed"), (2, "done")]


def test_a_variant_is_kept_after_a_download_but_not_of_a_case_without_its_verdict(tmp_path: Path) -> None:
    checks = {"stage": "checks", "figures": [], "verdict": {"level": "good", "headline": "it stands", "reasons": []}}

    async def run() -> None:
        session = Session(tmp_path)
        session.worker = worker = Scripted(session._hear)
        session.show(1, {"layout": {"spacing": 1.0}}, live=False)
        worker._hear(worker._process, News(1, "stage", checks))
        worker.says("done", 1)
        session.files(-1)
        for kind in ("taken", "files", "done"):
            worker.says(kind, -1)
        session.keep_variant("first")
        session.show(2, {"layout": {"spacing": 2.0}}, live=False)
        worker._hear(worker._process, News(1, "stage", checks))  # late
        with pytest.raises(InputError, match="no verdict yet"):
            session.keep_variant("second")
        assert [(kept["name"], kept["case"]) for kept in session.state.variants] == [
            ("first", {"layout": {"spacing": 1.0}})
        ]
        worker.end()

    asyncio.run(run())


def sessions_in(folder: Path, **files: bytes) -> Sessions:
    return Sessions(folder / "sessions", {}, files, 120.0, Room(folder))


def test_the_process_of_a_session_without_a_page_ends_and_its_cases_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session, "ALONE", 0.02)
    monkeypatch.setattr(session, "WorkerProcess", Scripted)

    async def run() -> None:
        sessions = sessions_in(tmp_path)
        name = sessions.new()
        first = sessions.get(name)
        assert first is not None
        with first.listening(lambda _: None):
            first.show(1, {"layout": {"spacing": 1.0}}, live=False)
            with first.listening(lambda _: None):  # another tab, which is closed
                pass
            await asyncio.sleep(0.1)
            assert sessions.get(name) is first
            assert first.worker._process is not None
        with first.listening(lambda _: None):  # the page is loaded again
            await asyncio.sleep(0.1)
            assert first.worker._process is not None
        await asyncio.sleep(0.1)
        assert first.worker._process is None
        again = sessions.get(name)
        assert again is not None
        assert again is not first
        assert again.state.cases == [{"layout": {"spacing": 1.0}}]
        await asyncio.sleep(0.1)  # one that was only looked at is closed too
        assert sessions.get(name) is not again

    asyncio.run(run())


def test_so_many_sessions_have_a_page_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "SESSIONS", 2)

    async def run() -> None:
        sessions = sessions_in(tmp_path)
        first, second, third = (sessions.get(sessions.new()) for _ in range(3))
        assert first is not None
        assert second is not None
        assert third is not None
        hearing = [sessions.hearing(one, print) for one in (first, second)]
        with hearing[0], hearing[1]:
            with sessions.hearing(first, repr):  # another tab
                pass
            with pytest.raises(InputError, match=r"2 others use this server: .*, or set RODSHELL_LIMITS=2"):
                sessions.hearing(third, print)
        with sessions.hearing(third, print):
            pass

    asyncio.run(run())


def test_a_history_is_bounded_in_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "HISTORY", 3000)

    async def run() -> None:
        opened = Session(tmp_path)
        opened.worker = Scripted(opened._hear)
        for k in range(40):
            opened.show(k, {"drawings": {"name": f"{k:0500}"}}, live=False)
        assert [case["drawings"]["name"][-2:] for case in opened.state.cases] == ["35", "36", "37", "38", "39"]
        assert opened.state.at == 4
        opened.show(40, {"drawings": {"name": "x" * 5000}}, live=False)
        assert len(opened.state.cases) == 1
        assert Session(tmp_path).state == opened.state

    asyncio.run(run())


def test_what_was_unused_longest_makes_room_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "FOLDER", 100_000)
    theirs = [
        tmp_path / "sessions" / "a_folder_of_somebody_else" / "roof.obj",
        tmp_path / "jobs" / "mine" / "status.json",
    ]
    for path in (*theirs, tmp_path / "house" / ("a" * 24) / "uploads" / "roof.obj"):
        path.parent.mkdir(parents=True)
        path.write_bytes(b"v" * 200_000)
    (tmp_path / "sessions" / ("b" * 24)).symlink_to(tmp_path / "house" / ("a" * 24))

    async def run() -> None:
        sessions = sessions_in(tmp_path, **{"roof.obj": b"v" * 30_000})
        names = [sessions.new() for _ in range(2)]
        for second, name in enumerate(names):
            os.utime(tmp_path / "sessions" / name, (second, second))
        used = sessions.get(names[0])
        assert used is not None
        last = sessions.new()
        assert sessions.get(names[1]) is None  # not the oldest, but not in use
        assert sessions.get(names[0]) is used
        assert sessions.get(last)
        with pytest.raises(InputError, match=r"keeps 0\.0001 GB at most, and all of it is in use: .*RODSHELL_LIMITS=2"):
            sessions.new()

    asyncio.run(run())
    assert all(path.stat().st_size == 200_000 for path in (*theirs, *tmp_path.glob("house/*/uploads/*")))


DAMAGE = {
    "empty": b"",
    "cut off": b'{"cases": [{',
    "not UTF-8": b"\xff\xfe\x00",
    "a list": b"[]",
    "deep": b"[" * 100_000,
    "a number of many digits": b'{"cases": [], "variants": [], "at": ' + b"9" * 10_000 + b"}",
    "a case that is text": b'{"cases": ["x"], "at": 0, "variants": []}',
    "the present case beyond the last": b'{"cases": [{}], "at": 7, "variants": []}',
    "a scene elsewhere": b'{"cases": [{}], "at": 0, "variants": '
    b'[{"name": "", "case": {}, "scene": "../../x", "figures": [], "verdict": {}}]}',
}


def damaged(path: Path, how: str) -> None:
    path.parent.mkdir(parents=True)
    match how:
        case "a folder":
            path.mkdir()
        case "a pipe":
            os.mkfifo(path)
        case "a device":
            path.symlink_to("/dev/zero")
        case "a link to nothing":
            path.symlink_to("nothing")
        case _:
            path.write_bytes(DAMAGE[how])


@pytest.mark.parametrize("how", [*DAMAGE, "a folder", "a pipe", "a device", "a link to nothing"])
def test_a_damaged_record_is_not_read_and_not_lost(how: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    name = "a" * 24
    for place in ("sessions/{}/session.json", "jobs/{}/status.json"):
        damaged(tmp_path / place.format(name), how)

    async def run() -> None:
        sessions, jobs = sessions_in(tmp_path), Jobs(tmp_path / "jobs", 120.0, Room(tmp_path))
        assert sessions.get(name) is None
        assert sessions.new()
        jobs.run_next()
        found = jobs.get(name)
        assert found is not None
        assert found["status"] == "failed"

    asyncio.run(run())
    assert len(caplog.messages) == 2 - (how == "a link to nothing")
    assert all("\n" not in message for message in caplog.messages)
    assert os.path.lexists(tmp_path / "sessions" / name / "session.json")
