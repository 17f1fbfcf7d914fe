"""What stands in a result folder, and which of it rodshell wrote.

manifest.json lists the files that rodshell wrote with size and SHA-256. A file that is not listed, or whose content is
no longer the listed one, belongs to the user. The folder may be a stranger's: a name that leads out of it, or through
a link, is not that of a file in it.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from rodshell.errors import InputError, OutputError
from rodshell.untrusted import TEXT, read_text

MANIFEST, FORMAT, VERSION = "manifest.json", "rodshell-manifest", 1
HASHED = 1_000_000_000  # bytes of a file whose content is compared, in about a second; of larger ones their size is
LONGEST_NAME = 255  # bytes of a file's name, as of usual file systems

Mark = dict[str, object]
"""What stands at a name: {"size", "sha256"} of a file, {"link"} of a symbolic link, {"folder"} or {"other"}; {"behind"}
of a name whose folder is in fact a link, a file or another mount."""


def mark(folder: Path, name: str) -> Mark | None:
    """What stands at a name in a folder, a path with slashes, links not followed; None where nothing does."""
    path, behind = folder / name, _behind(folder, name)
    if behind is not None:
        return {"behind": behind}
    if is_own_file(folder, name):
        with path.open("rb") as stream:
            size = path.stat().st_size
            digest = hashlib.file_digest(stream, "sha256").hexdigest() if size <= HASHED else ""
            return {"size": size, "sha256": digest}
    if path.is_symlink():
        return {"link": str(path.readlink())}
    if path.is_dir():
        return {"folder": True}
    return {"other": True} if os.path.lexists(path) else None


def is_mark(found: object) -> bool:
    """Whether it is the mark of a file or a link."""
    kinds = {name: type(value) for name, value in found.items()} if isinstance(found, dict) else {}
    return kinds in ({"size": int, "sha256": str}, {"link": str})


def read_manifest(folder: Path) -> dict[str, Mark]:
    """What was written to `folder`, by name; empty where there is no manifest of ours."""
    try:
        content = own_table(folder, MANIFEST)
    except OutputError:
        return {}
    files = content.get("files")
    if content.get("format") != FORMAT or not isinstance(files, dict):
        return {}
    return {name: found for name, found in files.items() if inside(name) and is_mark(found)}


def own_table(folder: Path, name: str) -> dict[str, Any]:
    """The keys of a JSON file that is written by this module, and therefore no link."""
    if not is_own_file(folder, name):
        raise OutputError(f"{name} is not a file")
    return read_table(folder / name, TEXT)


def read_table(path: Path, most: float) -> dict[str, Any]:
    """The keys of a JSON file of `most` bytes at most, see `read_bytes`.

    Raises:
        OutputError: it cannot be read, is too large, or holds no table of keys.
    """
    try:
        content = json.loads(read_text(path, most, instead="it is damaged"))
    except InputError as reason:
        raise OutputError(str(reason)) from None
    except (ValueError, RecursionError) as reason:
        raise OutputError(f"cannot read {path}: {reason}") from None
    if not isinstance(content, dict):
        raise OutputError(f"{path} is not a rodshell result: it is not a table of keys")
    return content


def manifest_text(files: Mapping[str, Mark]) -> str:
    """The content of manifest.json, a line for each file."""
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(files[name])}" for name in sorted(files))
    head = f' "format": {json.dumps(FORMAT)},\n "version": {VERSION},\n "files": {{\n'
    return "{\n" + head + lines + "\n }\n}\n"


def above(name: str) -> list[str]:
    """The folders that a name stands in, the outermost first."""
    return [str(folder) for folder in reversed(PurePosixPath(name).parents)][1:]


def foreign(folder: Path, marks: Mapping[str, Mark | None]) -> list[str]:
    """Of names and their marks, those that rodshell did not write, or that conflict with such a name."""
    listed = read_manifest(folder)
    found = list[str]()
    for name, here in marks.items():
        if here is None or (bool(listed) if name == MANIFEST else here == listed.get(name)):
            continue
        found.append(str(here.get("behind", name)))
    return list(dict.fromkeys(found))


def _behind(folder: Path, name: str) -> str | None:
    """The first of the folders above a name that is in fact something else; another mount too, into which files cannot
    be moved in one step."""
    return next((part for part in above(name) if is_no_folder(folder / part)), None)


def is_no_folder(path: Path) -> bool:
    if path.is_dir() and not path.is_symlink():
        return path.stat().st_dev != path.parent.stat().st_dev
    return os.path.lexists(path)


def is_own_file(folder: Path, name: str) -> bool:
    """Whether a file stands at a name, without any link."""
    return _behind(folder, name) is None and not (folder / name).is_symlink() and (folder / name).is_file()


def inside(name: object) -> bool:
    """Whether a name is that of a file within the folder, in the one way in which it is written."""
    if not isinstance(name, str) or not name.isprintable() or max(map(len, name.encode().split(b"/"))) > LONGEST_NAME:
        return False
    path = Path(name)
    return path.as_posix() == name and not path.anchor and ".." not in path.parts and path != Path()
