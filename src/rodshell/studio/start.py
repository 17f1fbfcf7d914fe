"""The case with which the studio opens, where it keeps sessions, and the secret that its pages keep."""

import os
import re
import secrets
import stat
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from rodshell.case.link import LARGEST_UPLOAD, page_case
from rodshell.case.load import BUILT_IN, load_case
from rodshell.errors import InputError, OutputError
from rodshell.studio.session import presets
from rodshell.untrusted import read_bytes, read_text

_KEY = re.compile("[0-9a-f]{48}")


def first_case(name: str) -> tuple[dict[str, Any], dict[str, bytes]]:
    """A case for the page, and the files that it names, as if they had been uploaded.

    Args:
        name: a built-in case, a case file or a surface.

    Raises:
        InputError: as of `load_case`.
    """
    if name in BUILT_IN:
        return presets()[name], {}
    tables, paths = page_case(load_case(name))
    return tables, {plain: read_bytes(path, LARGEST_UPLOAD) for plain, path in paths.items()}


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


def own_folder(folder: Path) -> str:
    """Make the folder of a server, for nobody else on this machine to read; the secret in the cookies of its pages.

    It is kept there, so that pages continue when the server is started again.

    Raises:
        OutputError: nothing can be kept there.
    """
    key = folder / "key"
    try:
        for part in (folder / "sessions", folder / "jobs"):
            part.mkdir(parents=True, exist_ok=True)
            part.chmod(0o700)
        if key.is_file() and stat.S_IMODE(key.stat().st_mode) == 0o600:
            with suppress(InputError):
                if _KEY.fullmatch(secret := read_text(key, 1000)):
                    return secret
        key.unlink(missing_ok=True)
        secret = secrets.token_hex(24)
        with os.fdopen(os.open(key, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(secret)
    except OSError as reason:
        raise OutputError(f"cannot keep sessions in {folder} ({reason.strerror}): give another --folder") from None
    return secret
