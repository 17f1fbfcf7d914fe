"""Kernels compiled by Numba before the first job: each by the types of its row, and by two processes."""

import importlib
import operator
import os
import pkgutil
import re
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodshell
from rodshell.kernels import COMPILED
from rodshell.kernels.table import KERNELS

jit_only = pytest.mark.skipif(
    COMPILED is not None or bool(os.environ.get("NUMBA_DISABLE_JIT")), reason="kernels by Numba: RODSHELL_KERNELS=jit"
)
INLINED = {"spread", "subtract_product"}  # never compiled on their own
PARENT = """
import time
from rodshell.kernels import ahead
with ahead._helper(True) as helper:
    print(helper.pid, flush=True)
    time.sleep(60)
"""

LATER = """
from importlib import import_module
from rodshell.kernels.table import KERNELS, OF_SOME_JOBS
from tests.kernels.jobs import JOBS
list(JOBS["commands"]())
for module, rows in KERNELS.items():
    for name in rows:
        kernel = getattr(import_module(f"rodshell.{module}"), name)
        if OF_SOME_JOBS & {module, f"{module}.{name}"} and kernel.signatures:
            print(module, name)
"""


@pytest.mark.slow
@jit_only
def test_a_form_of_a_ball_jointed_shell_compiles_no_kernel_of_other_jobs() -> None:
    done = subprocess.run([sys.executable, "-c", LATER], check=True, capture_output=True, text=True)
    assert done.stdout == ""


@pytest.mark.slow
@jit_only
def test_jobs_call_every_kernel_with_the_types_of_its_row() -> None:
    """With these alone: a second signature would be compiled again, and refused by a compiled kernel, except that this
    one takes arrays that are read only."""
    from numba.core.dispatcher import Dispatcher

    from rodshell.kernels.jit import arguments_of
    from tests.kernels.jobs import JOBS

    for package in pkgutil.walk_packages(rodshell.__path__, "rodshell."):
        importlib.import_module(package.name)
    kernels = {
        value.py_func: value
        for name, module in list(sys.modules.items())
        if name.startswith("rodshell.")
        for value in vars(module).values()
        if isinstance(value, Dispatcher)
    }
    for job in JOBS.values():
        list(job())
    for module, rows in KERNELS.items():
        for name, row in rows.items():
            kernel = getattr(sys.modules[f"rodshell.{module}"], name)
            assert {*kernel.signatures} <= {arguments_of(row)}, f"{module}.{name}"
    assert not_reached(kernels) <= INLINED


def not_reached(kernels: dict[Any, Any]) -> set[str]:
    """Kernels that neither a job calls nor a kernel that is reached; Numba asks a function that is called from a kernel
    for its types."""
    reached = [function for function, kernel in kernels.items() if kernel.signatures]
    while reached:
        names = reached.pop().__code__.co_names
        inner = [one for one in kernels if one.__name__ in names and not kernels[one].signatures]
        for one in inner:
            kernels.pop(one)
        reached += inner
    return {function.__name__ for function, kernel in kernels.items() if not kernel.signatures}


@jit_only
def test_types_are_found_once_and_the_code_is_the_same() -> None:
    """A sum of floats is asked for once, not at each place; what allocates an array is asked for again, since Numba
    compiles it by the options of the kernel that calls it. After it, Numba is as before."""
    from numba.core.types import functions

    from rodshell.kernels.jit import arguments_of, dispatcher, types_found_once

    def total(a, n):  # type: ignore[no-untyped-def]
        sums = np.empty(n)
        for k in range(n):
            sums[k] = (a[0] + a[1]) * (a[2] + a[3]) / (a[k] + n) + float(k) * float(n)
        return np.empty(n), sums

    def compiled(options: dict[str, object]) -> tuple[str, list[object]]:
        asked = list[object]()

        def find(function, context, arguments, named):  # type: ignore[no-untyped-def]
            asked.append(function.typing_key)
            return as_numba_does(function, context, arguments, named)

        functions.BaseFunction.get_call_type = find
        try:
            with types_found_once() if options.pop("once") else nullcontext():
                kernel: Any = dispatcher(total, "total", options)
                kernel.compile(arguments_of("f1 i"))
            assert functions.BaseFunction.get_call_type is find
        finally:
            functions.BaseFunction.get_call_type = as_numba_does
        code = kernel.overloads[arguments_of("f1 i")].library.get_asm_str()
        return re.sub(r"B\d+v\d+", "", code), asked  # without the numbers of versions in names

    as_numba_does = functions.BaseFunction.get_call_type
    for fast in (False, True):
        code, asked = compiled({"fastmath": fast, "once": True})
        code_before, asked_before = compiled({"fastmath": fast, "once": False})
        assert code == code_before
        assert asked.count(operator.add) == 2 < asked_before.count(operator.add)  # floats, and a float and an integer
        assert asked.count(np.empty) == asked_before.count(np.empty) > 1


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_the_helper_ends_when_its_process_is_killed(tmp_path: Path) -> None:
    """At once: it would compile for more than the time that it is given."""
    environment = os.environ | {"RODSHELL_KERNELS": "jit", "NUMBA_DISABLE_JIT": "0", "NUMBA_CACHE_DIR": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", PARENT], env=environment, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        helper = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        try:
            os.kill(helper, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    os.kill(helper, signal.SIGKILL)
    pytest.fail("the helper outlives the process that it helps")
