"""Kernels where no folder can keep them: compiled anew in each run, where Numba by itself would refuse to go on."""

import os
from contextlib import suppress


def kernels_are_kept() -> bool:
    """Whether Numba finds a folder that can be written: its own setting's, the package's, or one at home."""
    named = [os.environ.get(name, "") for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")]
    places = [*filter(None, named), os.path.dirname(__file__), os.path.expanduser("~")]
    return any(_writable(os.path.abspath(place)) for place in places)


def allow_uncached() -> None:
    """Let Numba declare kernels that it cannot keep; without effect, and without its import, where it can."""
    if kernels_are_kept():
        return
    from numba.core.dispatcher import Dispatcher

    enable = Dispatcher.enable_caching

    def enable_if_possible(self: Dispatcher) -> None:
        with suppress(RuntimeError):  # "cannot cache function ...: no locator available"
            enable(self)

    Dispatcher.enable_caching = enable_if_possible  # type: ignore[method-assign]


def _writable(place: str) -> bool:
    """Whether a folder can be written, or made."""
    while not os.path.exists(place):
        place = os.path.dirname(place)
    return os.path.isdir(place) and os.access(place, os.W_OK | os.X_OK)
