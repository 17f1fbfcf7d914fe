"""`rodshell warmup`, and what a first job says: kernels are compiled once, and the second run has nothing to do."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rodshell.cli import main

FEW = """
import sys
from rodshell.kernels import ahead
ahead.KERNELS = {"targets.quadric": {"_level": "f2 f1 f f"}, "solve.implicit_euler": {"_mass_norm": "f1 f1"}}
ahead.modules = lambda: list(ahead.KERNELS)
from rodshell.cli import main
sys.exit(main(sys.argv[1:]))
"""


def run(folder: Path, *arguments: str) -> tuple[str, list[str]]:
    """What a command says on stdout and on stderr, with a table of two kernels, which are kept in `folder`."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder), "NUMBA_DISABLE_JIT": "0", "RODSHELL_KERNELS": "jit"}
    done = subprocess.run(
        [sys.executable, "-c", FEW, *arguments],
        env=environment,
        check=True,
        capture_output=True,
        text=True,
        timeout=300,
    )
    return done.stdout, done.stderr.splitlines()


@pytest.mark.slow
def test_the_first_warm_up_compiles_and_the_second_has_nothing_to_do(tmp_path: Path) -> None:
    said, told = run(tmp_path, "warmup")
    assert re.fullmatch(r"compiled 2 kernels in \d+ s\n", said)
    assert told == ["rodshell: compiling kernels, once, a minute or two"]
    kept = sorted(tmp_path.rglob("*.nbc"))
    assert kept
    assert run(tmp_path, "warmup") == ("nothing to do: all kernels were compiled before\n", [])
    assert sorted(tmp_path.rglob("*.nbc")) == kept


def test_quiet_says_nothing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert main(["warmup", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
