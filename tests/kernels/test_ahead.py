"""Kernels compiled by Numba before the first job: each by the types that it is declared with."""

import importlib
import os
import pkgutil
import subprocess
import sys
from typing import Any

import pytest

import rodshell
from rodshell.kernels import COMPILED, KERNELS

jit_only = pytest.mark.skipif(
    COMPILED is not None or bool(os.environ.get("NUMBA_DISABLE_JIT")), reason="kernels by Numba: RODSHELL_KERNELS=jit"
)
INLINED = {"spread", "subtract_product"}  # never compiled on their own

LATER = """
from importlib import import_module
from rodshell.kernels import KERNELS
from rodshell.kernels.ahead import OF_SOME_JOBS
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
def test_jobs_call_every_kernel_with_the_types_that_it_is_declared_with() -> None:
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
