"""Which files of a folder were written by rodshell: manifest.json lists them with size and SHA-256.

A file that is not listed, or whose content is no longer the listed one, belongs to the user.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

FILE, FORMAT, VERSION = "manifest.json", "rodshell-manifest", 1

Mark = dict[str, object]
"""What stands at a name: {"size", "sha256"} of a file, {"link"} of a symbolic link, {"folder"} or {"other"}; {"behind"}
of a name whose folder is none, but a link, a file or another mount."""


def mark(folder: Path, name: str) -> Mark | None:
    """What stands at a name in a folder, links not followed; None where nothing does."""
    path = folder / name
    behind = next((part for part in above(name) if _is_no_folder(folder / part)), None)
    if behind is not None:
        return {"behind": behind}
    if path.is_symlink():
        return {"link": str(path.readlink())}
    if path.is_file():
        with path.open("rb") as stream:
            return {"size": path.stat().st_size, "sha256": hashlib.file_digest(stream, "sha256").hexdigest()}
    if path.is_dir():
        return {"folder": True}
    return {"other": True} if path.exists() else None


def read_manifest(folder: Path) -> dict[str, Mark]:
    """What was written to `folder`, by name; empty where there is no manifest of ours."""
    try:
        content = json.loads((folder / FILE).read_text(encoding="utf-8"))
        if content["format"] != FORMAT:
            return {}
        return {name: found for name, found in content["files"].items() if _inside(name) and isinstance(found, dict)}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def manifest_text(files: Mapping[str, Mark]) -> str:
    """The content of manifest.json, a line for each file."""
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(files[name])}" for name in sorted(files))
    head = f' "format": {json.dumps(FORMAT)},\n "version": {VERSION},\n "files": {{\n'
    return "{\n" + head + lines + "\n }\n}\n"


def above(name: str) -> list[str]:
    """The folders that a name stands in, the outermost first."""
    return [str(folder) for folder in reversed(PurePosixPath(name).parents)][1:]


def foreign(folder: Path, marks: Mapping[str, Mark | None]) -> list[str]:
    """Of names and what stands there, those that rodshell did not write, or that stand in the way of such a name."""
    listed = read_manifest(folder)
    found = list[str]()
    for name, here in marks.items():
        if here is None or (bool(listed) if name == FILE else here == listed.get(name)):
            continue
        found.append(str(here.get("behind", name)))
    return list(dict.fromkeys(found))


def _is_no_folder(path: Path) -> bool:
    """Whether something else stands there; another mount too, into which files cannot be moved in one step."""
    if path.is_dir() and not path.is_symlink():
        return path.stat().st_dev != path.parent.stat().st_dev
    return path.is_symlink() or path.exists()


def _inside(name: object) -> bool:
    """Whether a name cannot lead out of the folder."""
    path = PurePosixPath(str(name))
    return isinstance(name, str) and not path.is_absolute() and ".." not in path.parts and "\\" not in name
