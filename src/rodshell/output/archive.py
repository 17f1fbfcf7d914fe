"""A result with its states, and the folder that holds it; every file in it is made from the archive."""

import json
import os
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import wraps
from io import BytesIO
from itertools import chain
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rodshell.errors import OutputError
from rodshell.formfinding.progress import Progress, silent
from rodshell.output.folder import ResultFolder, open_folder, read_json, reading
from rodshell.output.inputs import kept_case, opened_case

if TYPE_CHECKING:
    from rodshell.output.verdict import Verdict

ARCHIVE = ("result.json", "case.toml", "states.npz")  # from which every other file can be made again
SHELLS = ("draped", "popped_pinned", "popped_clamped")  # the states in space, in the order they come about
T = TypeVar("T")
GAPS = {"draped": "gap_draped", "popped_pinned": "gap_pinned", "popped_clamped": "gap_clamped"}


@dataclass(frozen=True)
class Archive:
    """A result as it is kept on disk.

    Parameters
    ----------
    result : the content of result.json, SI units.
    states : the content of states.npz: "flat", "draped", "popped_pinned", "popped_clamped" (n, 3) node
        positions [m]; "gap_draped", "gap_pinned", "gap_clamped" (n,) signed distances to the target [m];
        "rod_nodes" (k,) nodes of all rods in a row; "rod_start" (m,) where each rod begins. Some may be
        missing.
    case_toml : the full resolved input; empty if there was none.
    inputs : contents of the files that it names and that are kept with the result, by their path in it.
    """

    result: dict[str, Any]
    states: dict[str, NDArray[Any]]
    case_toml: str = ""
    inputs: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    _made: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def as_stored(self) -> "Archive":
        """The archive as a reader will see it: the result in JSON's own types."""
        return replace(self, result=json.loads(json_text(self.result)))

    def summary(self) -> str:
        """One screen of text."""
        from rodshell.output.summary import summary_text

        return summary_text(self.result)

    def save(
        self,
        folder: str | os.PathLike[str] | ResultFolder,
        kinds: Iterable[str] | None = None,
        *,
        force: bool = False,
        more: Mapping[str, str] | None = None,
        progress: Progress = silent,
    ) -> Path:
        """As `write`."""
        return write(self, folder, kinds, force=force, more=more, progress=progress)

    @property
    def verdict(self) -> "Verdict":
        """What the result is worth: good, check or unbuildable, with the reasons."""
        from rodshell.output.verdict import verdict_of

        return verdict_of(self.result)

    @property
    def name(self) -> str:
        """What the result is called: its own name, else its target's kind."""
        name = self.result.get("name") or (self.result.get("target") or {}).get("kind")
        return printable(str(name or "rodshell"))

    @property
    def final(self) -> str | None:
        """The best state in space that there is: clamped, else pinned, else draped."""
        return next((state for state in reversed(SHELLS) if state in self.states), None)


def made_once(make: Callable[[Archive], T]) -> Callable[[Archive], T]:
    """`make`, its result kept with the archive, and not to be changed: many files are made from the same rods."""

    @wraps(make)
    def kept(archive: Archive) -> T:
        if make not in archive._made:
            archive._made[make] = make(archive)
        found: T = archive._made[make]
        return found

    return kept


def write(
    archive: Archive,
    folder: str | os.PathLike[str] | ResultFolder,
    kinds: Iterable[str] | None = None,
    *,
    force: bool = False,
    more: Mapping[str, str] | None = None,
    progress: Progress = silent,
) -> Path:
    """Write the whole result folder, replacing an older result's files and no others; returns its absolute path.

    Parameters
    ----------
    kinds : of files beside the archive (see `files.KINDS`); default: all that every installation can.
    force : also replace files that rodshell did not write, or that were changed since, where it has to write.
    more : other files, by name.
    progress : called for each file; time limits are none of its business, since what was found is to be kept.

    Raises
    ------
    ForeignFileError : such files are there, and `force` is False. OutputError : the folder cannot be written.
    """
    from rodshell.output.files import files_of, reserved

    text = json_text(archive.result)
    archive = replace(archive, result=json.loads(text))
    wanted = None if kinds is None else list(kinds)
    copies = kept_case(archive.case_toml, archive.inputs, Path())[1]
    names = [name for name in ARCHIVE if name != "case.toml" or archive.case_toml]
    with open_folder(folder, reserved=[*names, *copies, *reserved(wanted), *(more or ())], force=force) as place:
        place.put("result.json", text)
        if archive.case_toml:
            place.put("case.toml", kept_case(archive.case_toml, archive.inputs, place.path)[0])
        stream = BytesIO()
        np.savez_compressed(stream, allow_pickle=False, **archive.states)
        place.put("states.npz", stream.getvalue())
        parts = chain(copies.items(), files_of(archive, wanted), (more or {}).items())
        for number, (name, made) in enumerate(parts, start=1):
            progress("files", f"{number} written, {name}", 0.0)
            place.put(name, made)
        place.commit()
        return place.path


def export(
    archive: Archive,
    folder: str | os.PathLike[str],
    kinds: Iterable[str] | None = None,
    *,
    force: bool = False,
    progress: Progress = silent,
) -> list[str]:
    """Write files of some kinds (see `files.KINDS`) into `folder`, all of them or none; returns their names.

    force, progress : as of `write`.

    Raises
    ------
    InputError : a kind needs a package that is not installed. OutputError : as of `write`.
    """
    from rodshell.output.files import files_of, reserved

    names = list[str]()
    wanted = None if kinds is None else list(kinds)
    with open_folder(folder, reserved=reserved(wanted), force=force) as place:
        for name, content in files_of(archive.as_stored(), wanted):
            progress("files", f"{len(names) + 1} written, {name}", 0.0)
            place.put(name, content)
            names.append(name)
        place.commit(keep_others=True)
    return names


def read(folder: str | os.PathLike[str]) -> Archive:
    """The archive of a result folder.

    Raises
    ------
    OutputError : there is no result, or it cannot be read.
    """
    with reading(folder) as file:
        result = read_json(file("result.json"))
        try:
            with np.load(file("states.npz"), allow_pickle=False) as stored:
                states = {name: stored[name] for name in stored.files}
            case = file("case.toml")
            case_toml, inputs = opened_case(case.read_text(encoding="utf-8") if case.exists() else "", file)
        except Exception as error:  # numpy and zipfile have many ways to say that a file is broken
            raise OutputError(f"cannot read the result in {Path(folder).expanduser()}: {error}") from error
    return Archive(result, states, case_toml, inputs)


def json_text(result: Mapping[str, Any]) -> str:
    """`result` as strict JSON, a key or a rod on each line; what is not a finite number becomes null."""
    lines = []
    for key, value in _plain(result).items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            text = "[\n  " + ",\n  ".join(map(_dumps, value)) + "\n ]"
        else:
            text = _dumps(value)
        lines.append(f" {_dumps(key)}: {text}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def printable(text: str) -> str:
    """`text` on one line, without the control characters and lone surrogates that no file of text can hold."""
    return text if text.isprintable() else "".join(letter if letter.isprintable() else " " for letter in text)


def _dumps(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def _plain(value: Any) -> Any:
    """`value` in JSON's own types; NumPy's arrays and numbers are converted, texts are printable."""
    if isinstance(value, float):  # most are; NumPy's float64 is one
        return float(value) if isfinite(value) else None
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, Mapping):
        return {printable(str(key)): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
