"""The files that a case names, kept with the result so that its folder can be moved, zipped and run again.

A file of up to LARGEST bytes is copied to inputs/; a larger one stays where it is and is named relative to the folder,
as is a glTF file in parts, which names others itself.
"""

import hashlib
import json
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path

LARGEST = 20_000_000  # bytes of a file that is copied
FOLDER = "inputs"
NAMED = re.compile(r'^(file|boundary) = (".*")$', re.MULTILINE)  # in the text of a resolved case
PARTS = ".gltf"


def read_inputs(case_toml: str, where: Callable[[str], Path] = Path) -> dict[str, bytes]:
    """The contents of the files that a case names and that are to be kept with its result, by the path in the case.

    where : the place of a file by its path in the case.
    """
    found = {}
    for name in _names(case_toml):
        path = where(name)
        if path.is_file() and path.suffix.lower() != PARTS and path.stat().st_size <= LARGEST:
            found[name] = path.read_bytes()
    return found


def kept_case(case_toml: str, inputs: Mapping[str, bytes], folder: Path) -> tuple[str, dict[str, bytes]]:
    """The case as it is kept in a result folder, its paths relative to that, and the files to be written with it.

    Parameters
    ----------
    case_toml : with paths as they were given.
    inputs : contents of files that are copied, by these paths.
    folder : of the result.
    """
    copies, places = dict[str, bytes](), dict[str, str]()
    for name in dict.fromkeys(_names(case_toml)):
        if name in inputs:
            places[name] = f"{FOLDER}/{_free_name(Path(name).name, copies)}"
            copies[places[name]] = inputs[name]
        else:
            places[name] = _relative(name, folder)
    return _renamed(case_toml, places), copies


def shown_case(case_toml: str, inputs: Mapping[str, bytes]) -> str:
    """The case on a page that goes to others: paths as they are kept, of files that are not copied the names alone.

    Parameters
    ----------
    case_toml, inputs : as of `kept_case`.
    """
    kept, copies = kept_case(case_toml, inputs, Path.cwd())
    return _renamed(kept, {name: Path(name).name for name in _names(kept) if name not in copies})


def opened_case(case_toml: str, where: Callable[[str], Path]) -> tuple[str, dict[str, bytes]]:
    """The case of a result folder and the contents of its inputs; files that were not copied are named absolutely.

    where : as of `read_inputs`.
    """
    inputs = read_inputs(case_toml, where)
    outside = {name: str(where(name).absolute()) for name in _names(case_toml) if name not in inputs}
    return _renamed(case_toml, outside), inputs


def input_hash(case_toml: str, inputs: Mapping[str, bytes]) -> str:
    """Twelve digits of SHA-256 of a case and the contents of its files, wherever these are and however called.

    Parameters
    ----------
    case_toml, inputs : as of `kept_case`; a file that is not copied counts as empty.
    """
    names = list(dict.fromkeys(_names(case_toml)))
    digest = hashlib.sha256(_renamed(case_toml, {name: str(k) for k, name in enumerate(names)}).encode())
    for name in names:
        digest.update(inputs.get(name, b""))
    return digest.hexdigest()[:12]


def _names(case_toml: str) -> list[str]:
    return [json.loads(text) for _, text in NAMED.findall(case_toml)]


def _renamed(case_toml: str, places: Mapping[str, str]) -> str:
    """The case with other names of its files."""

    def line(found: re.Match[str]) -> str:
        name = json.loads(found[2])
        return f"{found[1]} = {json.dumps(places.get(name, name), ensure_ascii=False)}"

    return NAMED.sub(line, case_toml)


def _free_name(name: str, taken: Mapping[str, bytes]) -> str:
    """A file's name that every system can hold and that no other input has."""
    plain = re.sub(r"[^\w.() -]", "_", name)[-100:]
    number = 1
    while f"{FOLDER}/{plain}" in taken:
        number += 1
        plain = f"{number}-{plain.removeprefix(f'{number - 1}-')}"
    return plain


def _relative(name: str, folder: Path) -> str:
    try:
        return Path(os.path.relpath(name, folder)).as_posix()
    except ValueError:  # another drive of Windows
        return name
