"""`rodshell warmup`: every kernel is compiled by it, it says what it does, and does it once."""

import importlib
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rodshell
from rodshell.cli import main

SHORT = """
import sys
import numpy as np
from rodshell.cli import main, warmup
from rodshell.targets.rim import EllipseDomain
warmup.JOBS = {"an oval": lambda: EllipseDomain(0.2, 0.1).distance(np.array([[0.1, 0.1]]))}
sys.exit(main(["warmup"]))
"""
INLINED = {"spread", "subtract_product"}  # never compiled on their own


def warm_up(folder: Path) -> tuple[str, list[str]]:
    """What a warm-up of one kernel, with kernels kept in `folder`, says on stdout and on stderr."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder), "NUMBA_DISABLE_JIT": "0"}
    done = subprocess.run(
        [sys.executable, "-c", SHORT], env=environment, check=True, capture_output=True, text=True, timeout=300
    )
    return done.stdout, done.stderr.splitlines()


@pytest.mark.slow
def test_the_first_warm_up_compiles_and_the_second_has_nothing_to_do(tmp_path: Path) -> None:
    said, told = warm_up(tmp_path)
    assert re.fullmatch(r"compiled 1 kernels in \d+ s\n", said)
    assert told == ["rodshell: warm-up 1 of 1, an oval"]
    kept = sorted(tmp_path.rglob("*.nbc"))
    assert kept
    assert warm_up(tmp_path)[0] == "nothing to do: all kernels were compiled before\n"
    assert sorted(tmp_path.rglob("*.nbc")) == kept


@pytest.mark.slow
@pytest.mark.skipif(bool(os.environ.get("NUMBA_DISABLE_JIT")), reason="no kernels: unset NUMBA_DISABLE_JIT")
def test_every_kernel_is_called_by_some_job() -> None:
    """By a job itself or by a kernel that is; numba asks a function that is called from a kernel for its types."""
    from numba.core.dispatcher import Dispatcher

    for package in pkgutil.walk_packages(rodshell.__path__, "rodshell."):
        importlib.import_module(package.name)
    kernels = {
        value.py_func: value
        for name, module in list(sys.modules.items())
        if name.startswith("rodshell.")
        for value in vars(module).values()
        if isinstance(value, Dispatcher)
    }
    from rodshell.cli.reporting import Progress
    from rodshell.cli.warmup import warm_up as run_all

    run_all(Progress(quiet=True))
    reached = [function for function, kernel in kernels.items() if kernel.signatures]
    while reached:
        names = reached.pop().__code__.co_names
        inner = [one for one in kernels if one.__name__ in names and not kernels[one].signatures]
        for one in inner:
            kernels.pop(one)
        reached += inner
    left = {function.__name__ for function, kernel in kernels.items() if not kernel.signatures}
    assert left <= INLINED


def test_quiet_says_nothing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    from rodshell.cli import warmup

    monkeypatch.setattr(warmup, "JOBS", {})
    assert main(["warmup", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
