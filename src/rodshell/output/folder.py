"""A result folder that is replaced as a whole: a kill leaves the old result or the new one."""

import ctypes
import json
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from rodshell.errors import OutputError

FORMAT = "rodshell-result"
FORMATS = (FORMAT, "gridshell-result")  # what is read: the second was written until November 2026
VERSION = 1
FORGOTTEN = 3600.0  # s; writing takes seconds, so an older temporary folder has lost its process


def check_folder(folder: str | os.PathLike[str]) -> Path:
    """The absolute path of `folder` if a result can be written there; worth asking before a long computation.

    Raises
    ------
    OutputError : it is a file, another folder's content, the working folder, or it cannot be made.
    """
    path = Path(folder).expanduser().resolve()
    if path.exists():
        _check_replaceable(path)
    parent = _existing_parent(path)
    try:  # asking for permission is not enough: to root everything is permitted, even in /proc
        os.rmdir(tempfile.mkdtemp(prefix=_prefix(path), dir=parent))
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror} in {parent}; choose another folder") from error
    return path


@contextmanager
def replacing(folder: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary folder beside `folder`, which takes its place when the block ends without an error."""
    path = check_folder(folder)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _sweep(path)
        temporary = Path(tempfile.mkdtemp(prefix=_prefix(path), dir=path.parent))
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}; choose another folder") from error
    try:
        temporary.chmod(0o777 & ~_umask())  # mkdtemp's folder is private, a result is not
        yield temporary
        _take_place(temporary, path)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(f"cannot write {path}: {error.strerror or error}; nothing was changed") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def put(file: Path, content: str | bytes) -> None:
    """Write a file as a whole: a kill leaves the old one or the new one."""
    beside = file.with_name(f".{file.name}.new")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        beside.write_bytes(content if isinstance(content, bytes) else content.encode())
        beside.replace(file)
    except OSError as error:
        with suppress(OSError):
            beside.unlink()
        raise OutputError(f"cannot write {file}: {error.strerror}; choose another folder") from error


def read_json(path: Path) -> dict[str, Any]:
    """The table in `path`, checked to be a result that this version understands."""
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise OutputError(f"{path.parent} holds no rodshell result: it has no {path.name}") from error
    except (OSError, ValueError) as error:
        raise OutputError(f"cannot read {path}: {error}") from error
    if not isinstance(result, dict) or result.get("format") not in FORMATS:
        raise OutputError(f'{path} is not a rodshell result: its "format" is not "{FORMAT}"')
    version = result.get("version")
    if not isinstance(version, int) or version > VERSION:
        raise OutputError(f"{path} has version {version}, this rodshell reads {VERSION}: install a newer one")
    if "version_gridshell" in result:
        result["version_rodshell"] = result.pop("version_gridshell")
    return result


def _check_replaceable(path: Path) -> None:
    if not path.is_dir():
        raise OutputError(f"cannot write {path}: it is a file; choose a folder")
    if Path.cwd().is_relative_to(path):
        raise OutputError(f"cannot replace {path} while working in it: choose a folder inside, or leave it first")
    if any(path.iterdir()):
        try:
            read_json(path / "result.json")
        except OutputError as error:
            raise OutputError(
                f"will not replace {path}: it is not empty and holds no rodshell result; choose another folder"
            ) from error


def _existing_parent(path: Path) -> Path:
    parent = path.parent
    while not parent.exists():
        parent = parent.parent
    if not parent.is_dir():
        raise OutputError(f"cannot write {path}: {parent} is a file; choose another folder")
    return parent


def _take_place(temporary: Path, path: Path) -> None:
    """Move `temporary` to `path`; what was there is left at `temporary`, or is gone."""
    if not path.exists():
        temporary.rename(path)
    elif not _exchange(temporary, path):
        backup = Path(tempfile.mkdtemp(prefix=f".{path.name[:100]}.old-", dir=path.parent))
        path.rename(backup / path.name)
        try:
            temporary.rename(path)
        except OSError:
            (backup / path.name).rename(path)
            raise
        finally:
            with suppress(OSError):
                shutil.rmtree(backup)


def _exchange(one: Path, other: Path) -> bool:
    """Swap two folders in one step (Linux); False where the system cannot."""
    try:
        renameat2 = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError, TypeError):
        return False
    here, exchange = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    return bool(renameat2(here, os.fsencode(one), here, os.fsencode(other), exchange) == 0)


def _sweep(path: Path) -> None:
    """Remove what runs that were killed left beside `path`."""
    for left in path.parent.iterdir():
        with suppress(OSError):
            if left.name.startswith(_prefix(path)) and time.time() - left.stat().st_mtime > FORGOTTEN:
                shutil.rmtree(left)


def _prefix(path: Path) -> str:
    return f".{path.name[:100]}.rodshell-"


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
