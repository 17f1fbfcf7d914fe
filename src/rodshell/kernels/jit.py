"""Kernels compiled by Numba when they are first called; those that Python calls are kept where a folder can be written.

All that rests on private names of Numba, for which `pyproject.toml` allows the versions that were tried, is here.
"""

from collections.abc import Callable
from typing import Any

from rodshell.errors import RodshellError
from rodshell.kernels.cache import kernels_are_kept

try:
    from numba import config, njit, types
except ModuleNotFoundError as error:
    raise RodshellError(
        "no compiled kernels for this processor are installed, nor Numba, which would compile them: pip install numba"
    ) from error

# Numba reads settings from a file in the current folder, such as where it keeps kernels, as pickles: whose is it?
config._config_fname = ""
config.reload_config()


def dispatcher(function: Callable[..., Any], options: dict[str, object], *, kept: bool) -> Callable[..., Any]:
    """The kernel of a function, which is compiled at its first call.

    Divisions are those of NumPy, and floating-point numbers are rounded as written, unless it has an option for that.
    By Numba's defaults a kernel takes such options from the kernel that calls it first, and its bits would depend on
    the order of calls. Numba refuses to declare a kernel that is to be kept where no folder can be written. Those that
    only kernels call are not kept: they are part of these.
    """
    of_its_own: dict[str, object] = {"error_model": "numpy", "fastmath": False, "cache": kept and kernels_are_kept()}
    kernel: Callable[..., Any] = njit(**of_its_own | options)(function)
    return kernel


def is_kept(kernel: Any, arguments: tuple[types.Type, ...]) -> bool:
    """Whether Numba's cache holds a kernel for these types; asked of its index, without loading the kernel."""
    cache = kernel._cache
    key = cache._index_key(arguments, kernel.targetctx.codegen())
    return key in cache._cache_file._load_index()


def arguments_of(codes: str) -> tuple[types.Type, ...]:
    """Numba's types of arguments that a kernel is declared with."""
    return tuple(_type_of(code) for code in codes.split())


def _type_of(code: str) -> types.Type:
    scalar = _SCALARS[code[0]]
    if code[1:].isdigit():
        return types.Array(scalar, int(code[1:]), "C")
    return scalar if len(code) == 1 else types.UniTuple(scalar, len(code))


_SCALARS = {"f": types.float64, "i": types.int64, "b": types.boolean, "c": types.complex128}
