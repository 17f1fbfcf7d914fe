"""The queue before a session's process: one order is worked on, and one waits, the newest."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rodshell.errors import InputError
from rodshell.studio.session import Session, WorkerProcess
from rodshell.studio.worker import News, Order


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
