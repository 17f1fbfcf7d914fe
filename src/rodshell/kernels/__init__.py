"""Kernels: functions of plain loops that run as machine code.

`njit` declares one. Where the wheel was built with compiled kernels, they were made then, for one or more levels of
the processor, and `njit` returns the compiled function of the highest level that this processor has; Numba is not
needed. Elsewhere Numba compiles a kernel when it is first called. RODSHELL_KERNELS=jit chooses Numba in any case, and
RODSHELL_KERNELS=FOLDER compiled libraries that are elsewhere.

Kernels that are called from Python are declared with the types of their arguments: those are what is compiled when a
wheel is built. The others are part of those; one that a single kernel calls is declared with inline="always": Numba
then compiles it there only, and not on its own as well.
"""

import os
import re
from collections import defaultdict
from collections.abc import Callable
from functools import wraps
from importlib import import_module
from importlib.machinery import ExtensionFileLoader, ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from typing import Any

from rodshell.errors import InputError, OutOfMemoryError

Kernel = Callable[..., Any]

PACKAGE = "rodshell."
KERNELS = defaultdict[str, dict[str, str]](dict)
"""The types of each kernel that Python calls, by its module and its name: of the modules imported so far."""
LEVELS = ("x86-64-v3", "generic")  # of processors, from the highest
NO_MEMORY = "exceptions must derive from BaseException"  # what compiled kernels make of Numba's MemoryError
UNCHOSEN = ("", "compiled")  # values of RODSHELL_KERNELS: nothing was set, or what counts when a wheel is built


def levels_here() -> list[str]:
    """The levels that this processor has, from the highest."""
    features = import_module("numpy._core._multiarray_umath").__cpu_features__  # as numpy.show_runtime finds them
    wide = features.get("X86_V3", False) or (features.get("AVX2", False) and features.get("FMA3", False))
    return [level for level in LEVELS if level == "generic" or wide]


def njit(types: str = "", /, **options: object) -> Callable[[Kernel], Kernel]:
    """Declare a kernel: its machine code if it was compiled with the wheel, else what Numba makes of it when it is
    called.

    Args:
        types: of its arguments, if Python calls it: each a letter and a number of dimensions, in C order: f float64, i
            int64, b bool, c complex128; f2 is an array (n, m) of float64, f alone a number; ff is a pair of numbers.
        options: of numba.njit, such as nogil=True.
    """

    def declared(function: Kernel) -> Kernel:
        if types:
            KERNELS[function.__module__.removeprefix(PACKAGE)][function.__name__] = types
        if COMPILED is None:
            from rodshell.kernels.jit import dispatcher

            return dispatcher(function, options, kept=bool(types))
        kernel = COMPILED.get(name_of(function))
        return function if kernel is None else _taking_any_array(kernel)

    return declared


def _taking_any_array(kernel: Kernel) -> Kernel:
    """A compiled kernel that also takes arrays which are not contiguous, or of other numbers, as Numba's do: it then
    works on copies, which are copied back."""

    @wraps(kernel, assigned=("__doc__",))
    def call(*given: Any) -> Any:
        try:
            return kernel(*given)
        except TypeError as error:
            if str(error) == NO_MEMORY:
                raise OutOfMemoryError from None
            taken = [_plain(value) for value in given]
            changed = [k for k, value in enumerate(given) if taken[k] is not value]
            if not changed:
                raise
            result = call(*taken)
            for k in changed:
                if given[k].flags.writeable:
                    given[k][...] = taken[k]
            return result

    return call


def _plain(value: Any) -> Any:
    """An array in C order, of the numbers that kernels have; anything else as it is."""
    import numpy as np  # here, so that the command line's help need not wait for it

    if not isinstance(value, np.ndarray):
        return value
    kinds = {"f": np.float64, "i": np.int64, "u": np.int64, "b": np.bool_, "c": np.complex128}
    return np.require(value, kinds.get(value.dtype.kind, value.dtype), ["C", "A"])


def name_of(function: Kernel) -> str:
    """Its module and name, within the package."""
    return f"{function.__module__.removeprefix(PACKAGE)}.{function.__name__}"


def modules() -> list[str]:
    """Those of the package, without its name, that declare kernels which Python calls."""
    root = Path(__file__).parents[1]
    sources = [path for path in root.rglob("*.py") if re.search(r'^@njit\(\s*"', path.read_text("utf-8"), re.MULTILINE)]
    return sorted(".".join(path.relative_to(root).with_suffix("").parts) for path in sources)


def library_name(level: str, unit: int) -> str:
    """The module of one of the libraries for a level."""
    return f"compiled_{level.replace('-', '_')}_{unit}"


def description() -> str:
    """How kernels are compiled here: for which level of the processor, or by which version of Numba."""
    if COMPILED is not None:
        return f"compiled for {LEVEL}"
    numba = import_module("numba")
    return "plain Python" if numba.config.DISABLE_JIT else f"numba {numba.__version__}"


def _compiled() -> tuple[dict[str, Kernel] | None, str]:
    """The kernels of all libraries for the highest level that there is, and that level; None: there are none, or they
    are not to be used."""
    chosen = os.environ.get("RODSHELL_KERNELS", "")
    if chosen == "jit" or os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return None, ""
    folder = os.path.dirname(__file__) if chosen in UNCHOSEN else chosen
    found = [
        name for name in (sorted(os.listdir(folder)) if os.path.isdir(folder) else ()) if name.startswith("compiled_")
    ]
    for level in levels_here() if found else ():
        libraries = [name for name in found if name.startswith(library_name(level, 0)[:-1])]
        if libraries:
            loaded = (_load(os.path.join(folder, file)) for file in libraries)
            return {name: kernel for library in loaded for name, kernel in library.items()}, level
    if chosen not in UNCHOSEN:
        raise InputError(
            f"RODSHELL_KERNELS={chosen}: no compiled kernels for this processor were found; without it Numba compiles "
            "them"
        )
    return None, ""


def _load(path: str) -> dict[str, Kernel]:
    """The kernels of a library, by their names."""
    module_name = os.path.basename(path).split(".")[0]
    loader = ExtensionFileLoader(module_name, path)
    module = module_from_spec(ModuleSpec(module_name, loader, origin=path))
    loader.exec_module(module)
    return {name: kernel for name, kernel in vars(module).items() if "." in name}


COMPILED, LEVEL = _compiled()
