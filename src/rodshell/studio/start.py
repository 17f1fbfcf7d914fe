"""The case with which the studio opens, and where it keeps sessions."""

import os
import sys
from pathlib import Path
from typing import Any

from rodshell.case.load import BUILT_IN, FILE_KEYS, load_case
from rodshell.studio.session import UPLOAD, presets, upload_name


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
    case = load_case(name).absolute()
    tables: dict[str, Any] = case.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    tables.setdefault("target", {})["kind"] = case.target.kind
    contents = {}
    for table, keys in FILE_KEYS.items():
        for key in keys:
            if (path := tables.get(table, {}).get(key)) is not None:
                plain = upload_name(path)
                contents[plain] = Path(path).read_bytes()
                tables[table][key] = UPLOAD + plain
    return tables, contents


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
