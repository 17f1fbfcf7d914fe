"""Kernels that cannot be kept or found: a read-only installation without a writable home compiles them in each run, and
says so; compiled ones that were asked for and are missing are an error."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rodshell.cli import main
from rodshell.kernels import cache

DECLARED = """
import numba.core.caching as caching

def no_locator(self, py_func):
    raise RuntimeError(f"cannot cache function {py_func.__name__!r}: no locator available")

caching.CacheImpl.__init__ = no_locator  # as where neither the package nor a home can be written
import os
os.access = lambda path, mode: not mode & os.W_OK
import rodshell.geometry.curves
from rodshell.cli.reporting import compile_before_first
compile_before_first()
"""


def test_kernels_that_cannot_be_kept_are_declared_and_that_is_one_sentence(tmp_path: Path) -> None:
    environment = {**os.environ, "RODSHELL_KERNELS": "jit"}
    ended = subprocess.run([sys.executable, "-c", DECLARED], capture_output=True, text=True, env=environment)
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr.startswith("rodshell: kernels are compiled again")
    assert ended.stderr.count("\n") == 1


def test_a_folder_counts_that_can_be_written_or_made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(cache, "__file__", "/proc/rodshell/cache.py")
    monkeypatch.setenv("HOME", "/proc/nobody")
    monkeypatch.setattr(os, "access", lambda path, mode: str(path).startswith(str(tmp_path)))
    assert not cache.kernels_are_kept()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "made/later"))
    assert cache.kernels_are_kept()


def test_warming_up_what_would_be_lost_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rodshell.cli.warmup.COMPILED", None)
    monkeypatch.setattr("rodshell.cli.warmup.kernels_are_kept", lambda: False)
    assert main(["warmup"]) == 2
    assert "would be lost: no folder" in capsys.readouterr().err


def test_compiled_kernels_that_are_asked_for_and_missing_are_one_sentence(tmp_path: Path) -> None:
    command = [sys.executable, "-c", "from rodshell.cli import entry; entry()", "form", "hemisphere"]
    environment = os.environ | {"RODSHELL_KERNELS": str(tmp_path), "NUMBA_DISABLE_JIT": "0"}
    ended = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path)
    assert ended.returncode == 2
    assert ended.stderr == (
        f"rodshell: error: RODSHELL_KERNELS={tmp_path}: no compiled kernels for this processor were found; without it "
        "Numba compiles them\n"
    )
