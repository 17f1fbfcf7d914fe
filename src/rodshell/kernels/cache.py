"""Where Numba keeps kernels that it compiled."""

import os


def kernels_are_kept() -> bool:
    """Whether Numba finds a writable folder for its cache: by its settings, in the package, or in the home folder."""
    named = [os.environ.get(name, "") for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")]
    folders = [*filter(None, named), os.path.dirname(os.path.dirname(__file__)), os.path.expanduser("~")]
    return any(_writable(os.path.abspath(folder)) for folder in folders)


def _writable(folder: str) -> bool:
    """Whether a folder is writable, or can be made."""
    while not os.path.exists(folder):
        folder = os.path.dirname(folder)
    return os.path.isdir(folder) and os.access(folder, os.W_OK | os.X_OK)
