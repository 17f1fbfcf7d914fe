"""The case with which the studio opens, and where it keeps sessions."""

import os
import sys
from pathlib import Path
from typing import Any

from rodshell.case.link import page_case
from rodshell.case.load import BUILT_IN, load_case
from rodshell.studio.session import presets


def first_case(name: str) -> tuple[dict[str, Any], dict[str, bytes]]:
    """A case for the page, and the files that it names, as if they had been uploaded.

    Parameters
    ----------
    name : a built-in case, a case file or a surface.

    Raises
    ------
    InputError : as of `load_case`.
    """
    if name in BUILT_IN:
        return presets()[name], {}
    tables, paths = page_case(load_case(name))
    return tables, {plain: path.read_bytes() for plain, path in paths.items()}


def sessions_folder() -> Path:
    """The folder for sessions in the user's cache."""
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", home / ".cache"))
    return base / "rodshell" / "studio"
