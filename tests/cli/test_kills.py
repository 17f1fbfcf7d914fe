"""Signals in real processes: the old result or the new one, one line, the right code, and nothing left over."""

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from rodshell.cli import main
from rodshell.cli.interruption import Interruption
from tests.acceptance.kills import CODES, FOUND, OLD, Job, foreign_touched, lay_foreign_files, orphans

FEW = ("--rods", "5x5", "--spacing", "80mm", "--edge", "40mm", "--length", "900mm", "--only", "csv")
JOB = Job("few", ("form", "hemisphere", *FEW))
HELD = """
import sys, time
from rodshell import progress
from rodshell.cli import reporting as shown, entry
{patch}
entry()
"""
IN_A_STAGE = """
call = shown.Progress.__call__
def slowly(self, stage, detail, residual):
    if stage == {stage!r}:
        print("here", flush=True)
        time.sleep(30)
    call(self, stage, detail, residual)
shown.Progress.__call__ = slowly
"""
LOST = """
class Careless:
    def __del__(self):
        print("here", flush=True)
        time.sleep(3)
call = shown.Progress.__call__
def lost(self, stage, detail, residual):
    Careless()
    call(self, stage, detail, residual)
shown.Progress.__call__ = lost
"""
IN_AN_IMPORT = """
import builtins
wanted = builtins.__import__
def slowly(name, *rest, **more):
    if name == "rodshell.job":
        print("here", flush=True)
        try:
            time.sleep(30)
        except KeyboardInterrupt as error:
            raise ImportError("half imported") from error
    return wanted(name, *rest, **more)
builtins.__import__ = slowly
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result with files of the user's in it."""
    folder = tmp_path_factory.mktemp("results") / "dome"
    assert main([*JOB.arguments, *JOB.old, "--out", str(folder), "-q"]) in FOUND
    lay_foreign_files(folder)
    return folder


@pytest.fixture
def dome(made: Path, tmp_path: Path) -> Path:
    """A copy of that."""
    return shutil.copytree(made, tmp_path / "dome")


def contents(folder: Path) -> dict[str, bytes | None]:
    return {str(one.relative_to(folder)): one.read_bytes() if one.is_file() else None for one in folder.rglob("*")}


def interrupted(patch: str, how: signal.Signals, *arguments: str, times: int = 1) -> tuple[int, str]:
    """Exit code and stderr of a process that is sent a signal where it says that it is there."""
    token = f"{os.getpid()} {time.monotonic()}"
    process = subprocess.Popen(
        [sys.executable, "-c", HELD.format(patch=patch), *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "RODSHELL_TEST": token},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "here\n"
    for _ in range(times):
        process.send_signal(how)
        time.sleep(0.01)
    said = process.communicate(timeout=60)[1]
    assert orphans(token) == 0
    return process.returncode, said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("patch", "how", "times"),
    [
        (IN_A_STAGE.format(stage="drape"), signal.SIGINT, 1),
        (IN_A_STAGE.format(stage="files"), signal.SIGTERM, 1),
        (IN_A_STAGE.format(stage="files"), signal.SIGINT, 3),
        (LOST, signal.SIGINT, 1),
        (IN_AN_IMPORT, signal.SIGTERM, 1),
    ],
    ids=["in a solve", "while writing", "three times", "where Python discards it", "as another error"],
)
def test_an_interrupt_ends_in_one_line_and_leaves_the_folder_as_it_was(
    patch: str, how: signal.Signals, times: int, dome: Path
) -> None:
    before = contents(dome)
    code, said = interrupted(patch, how, *JOB.arguments, *JOB.new, "--out", str(dome), "-q", times=times)
    assert (code, said) == (CODES[how], "rodshell: interrupted\n")
    assert contents(dome) == before


@pytest.mark.slow
def test_a_fall_that_is_interrupted_is_no_result(tmp_path: Path) -> None:
    """Its last state was once written as a drape that had not come to rest."""
    arguments = ("form", "hemisphere", *FEW, "--method", "paper", "--out", str(tmp_path / "dome"), "-q")
    code, said = interrupted(IN_A_STAGE.format(stage="drape"), signal.SIGINT, *arguments)
    assert (code, said) == (130, "rodshell: interrupted\n")
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
def test_what_a_kill_leaves_is_removed_by_the_next_run(dome: Path) -> None:
    before = contents(dome)
    interrupted(IN_A_STAGE.format(stage="files"), signal.SIGKILL, *JOB.arguments, *JOB.new, "--out", str(dome), "-q")
    assert list(dome.glob(".rodshell-stage-*"))
    assert main(["export", str(dome), "--only", "csv", "-q"]) == 0
    assert contents(dome) == before
    assert OLD in (dome / "case.toml").read_text()
    assert foreign_touched(dome) == 0


def test_an_interrupt_at_the_very_start_is_one_line_too() -> None:
    code = "import os, signal\nfrom rodshell.cli.interruption import end_at_once\nend_at_once()\n"
    ended = subprocess.run(
        [sys.executable, "-c", code + "os.kill(os.getpid(), signal.SIGTERM)"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (143, "rodshell: interrupted\n")


def test_an_interrupt_that_was_lost_is_raised_at_the_next_check() -> None:
    with Interruption() as interruption:
        Interruption.check()
        with suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)  # does not disturb what the first began
        with pytest.raises(KeyboardInterrupt):
            Interruption.check()
        assert interruption.code == 143
    Interruption.check()
