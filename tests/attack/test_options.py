"""Command lines drawn at random: each ends with a code of the documented set, with at most one sentence."""

import os
import random
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import psutil
import pytest

from rodshell.case import case_keys
from rodshell.cli import main
from rodshell.cli.app import COMMANDS
from rodshell.errors import InputError
from rodshell.output.files import save
from tests.output.sample_archive import sample_archive

pytestmark = pytest.mark.attack
TRIES = 300 * int(os.environ.get("RODSHELL_ATTACK", "1"))
CODES = (0, 2, 3, 4)
STRANGE = (
    "", " ", "-", "--", "---", "-x", "--=", "=", "--out=", "-o", "\x1b]0;t\x07", "\u202e", "\ud800", "x" * 10_000,
    "9" * 5000, "../x", "~nobody/x", "/dev/zero", "/proc/self/mem", "nan", "inf", "-1", "1e400", "0", "1", "30 mm",
    "[]", "[" * 300,
    "{}", ",", "a,b", "\n", "\n[run]\n", "é", "屋", "*", "%s%n", "{0.__class__}", "$(id)", "true", "hemisphere", "dome",
    "dome/result.json", "sweep.toml", "all", "fig1", "-h", "--help", "--version", "csv", "pinned",
)  # fmt: skip
OPTIONS = (
    "--out", "--only", "--time-limit", "--force", "--json", "-q", "--dry-run", "--report", "--retry", "--address",
    "--loads", "--ends", "--unit", "--seed", "--jobs", "--target", "--generations", "--host", "--port", "--folder",
    "--no-browser", "--schema", "--most", *(f"--{key}" for key in case_keys()),
)  # fmt: skip
BEGINS = (
    *(f"{command}.run_and_deliver" for command in ("form", "refine", "check", "popup")),
    *(f"{command}.compile_before_first" for command in ("paper", "sweep", "optimise", "warmup", "advise")),
)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("options")
    save(sample_archive(3, 2), folder / "dome", [])
    (folder / "sweep.toml").write_text('base = "hemisphere"\n[axes]\n"layout.spacing" = ["30 mm"]\n')
    return folder


@pytest.fixture(autouse=True)
def _bounded() -> Iterator[None]:
    """Of memory: 3 GB more than there is."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (psutil.Process().memory_info().vms + 3_000_000_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.fixture(autouse=True)
def _nothing_is_computed(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: Any, **__: Any) -> int:
        raise InputError("here a job would begin")

    monkeypatch.chdir(place)
    for name in BEGINS:
        import_module(f"rodshell.cli.{name.partition('.')[0]}")
        monkeypatch.setattr(f"rodshell.cli.{name}", stop)
    monkeypatch.setattr("rodshell.output.files.export", stop)
    monkeypatch.setattr("socket.socket.bind", stop)


def command_line(draw: random.Random) -> list[str]:
    """A command, mostly with what it takes; options repeated, or of other commands; values that nobody gives."""
    words = [draw.choice((*COMMANDS, *COMMANDS, draw.choice(STRANGE)))]
    words += [draw.choice(("hemisphere", "dome", "sweep.toml", draw.choice(STRANGE)))] if draw.random() < 0.9 else []
    for _ in range(draw.randrange(4)):
        option = draw.choice(OPTIONS)
        value = draw.choice(STRANGE)
        words += draw.choice(([option, value], [f"{option}={value}"], [option], [option, value] * 2, [value]))
    return words


@pytest.mark.parametrize("seed", range(TRIES // 20))
def test_any_command_line_ends_in_one_sentence(seed: int, capsys: pytest.CaptureFixture[str]) -> None:
    draw = random.Random(seed)
    for _ in range(20):
        words = command_line(draw)
        code = main(words)
        said = capsys.readouterr().err
        assert code in CODES, words
        assert "Traceback" not in said, words
        assert code == 0 or said.startswith("rodshell: error: "), words
        assert said.count("\n") <= 1, (words, said)
        assert said.removesuffix("\n").isprintable(), words
        assert len(said) < 2100, words
