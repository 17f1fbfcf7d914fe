"""Compiled kernels where no folder for Numba's cache is writable.

Numba refuses to declare a cached kernel there. After `allow_uncached` it is compiled in each run instead.
"""

import os
from contextlib import suppress


def kernels_are_kept() -> bool:
    """Whether Numba finds a writable folder for its cache: by its settings, in the package, or in the home folder."""
    named = [os.environ.get(name, "") for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")]
    folders = [*filter(None, named), os.path.dirname(__file__), os.path.expanduser("~")]
    return any(_writable(os.path.abspath(folder)) for folder in folders)


def allow_uncached() -> None:
    """Let Numba declare kernels that it cannot cache. Does nothing, and does not import Numba, where it can."""
    if kernels_are_kept():
        return
    from numba.core.dispatcher import Dispatcher

    enable = Dispatcher.enable_caching

    def enable_if_possible(self: Dispatcher) -> None:
        with suppress(RuntimeError):  # "cannot cache function ...: no locator available"
            enable(self)

    Dispatcher.enable_caching = enable_if_possible  # type: ignore[method-assign]


def _writable(folder: str) -> bool:
    """Whether a folder is writable, or can be made."""
    while not os.path.exists(folder):
        folder = os.path.dirname(folder)
    return os.path.isdir(folder) and os.access(folder, os.W_OK | os.X_OK)
