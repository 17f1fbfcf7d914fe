"""Kernels compiled by Numba when they are first called; those of the table are kept where a folder can be written."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rodshell.errors import RodshellError
from rodshell.kernels.cache import kernels_are_kept
from rodshell.kernels.table import KERNELS, Kernel

try:
    from numba import config, njit, types
    from numba.core.registry import CPUDispatcher
    from numba.core.types.functions import BaseFunction
except ModuleNotFoundError as error:
    raise RodshellError(
        "no compiled kernels for this processor are installed, nor Numba, which would compile them: pip install numba"
    ) from error

# Numba reads settings from a file in the current folder, such as where it keeps kernels, as pickles: whose is it?
config._config_fname = ""
config.reload_config()


def dispatcher(function: Kernel, kernel_name: str, options: dict[str, object]) -> Kernel:
    """The kernel of a function, which is compiled at its first call; `kernel_name` is its module and name.

    Divisions are those of NumPy, and floating-point numbers are rounded as written, unless it has an option for that.
    By Numba's defaults a kernel takes such options from the kernel that calls it first, and its bits would depend on
    the order of calls. Numba refuses to declare a kernel that is to be kept where no folder can be written. Those that
    only kernels call are not kept: they are part of these, and to write them takes a twentieth of the time.
    """
    module, _, name = kernel_name.rpartition(".")
    from_python = name in KERNELS.get(module, {})
    kept = from_python and kernels_are_kept()
    of_its_own: dict[str, object] = {"error_model": "numpy", "fastmath": False, "cache": kept}
    of_its_own["no_cfunc_wrapper"] = True  # for calls from C, of which there are none
    kernel: Kernel = njit(**of_its_own | options)(function)
    return kernel if from_python or config.DISABLE_JIT else _Inner(kernel)


class _Inner(CPUDispatcher):  # type: ignore[misc, unused-ignore]
    """A kernel that only kernels call, compiled without what a call from Python needs: a thirtieth of the work.

    Such a call would end the process. It goes to the kernel as Numba declares it, which is compiled for that.
    """

    def __init__(self, kernel: Any) -> None:
        super().__init__(kernel.py_func, targetoptions=kernel.targetoptions | {"no_cpython_wrapper": True})
        self._from_python = kernel

    def __call__(self, *given: Any) -> Any:
        return self._from_python(*given)


@contextmanager
def types_found_once() -> Iterator[None]:
    """Numba tries all its rules for `a + b` again wherever two floats are added: a fifth of the time that it takes to
    compile the kernels. While the block runs, it tries them once for each function and types of arguments.

    Functions that Numba writes as kernels of its own, such as `np.empty`, are not among them: it compiles them by the
    options of the kernel that calls them.
    """
    numba: Any = BaseFunction
    find = numba.get_call_type
    found = dict[Any, Any]()

    def find_once(function: Any, context: Any, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        key = context, function, arguments, *named.items()
        signature = found.get(key)
        if signature is None:
            signature = find(function, context, arguments, named)
            if signature is not None and function.get_impl_key(signature) is function.typing_key:
                found[key] = signature
        return signature

    numba.get_call_type = find_once
    try:
        yield
    finally:
        numba.get_call_type = find


def arguments_of(row: str) -> tuple[types.Type, ...]:
    """Numba's types of the arguments in a row of the table."""
    return tuple(_type_of(code) for code in row.split())


def _type_of(code: str) -> types.Type:
    scalar = _SCALARS[code[0]]
    if code[1:].isdigit():
        return types.Array(scalar, int(code[1:]), "C")
    return scalar if len(code) == 1 else types.UniTuple(scalar, len(code))


_SCALARS = {"f": types.float64, "i": types.int64, "b": types.boolean, "c": types.complex128}
