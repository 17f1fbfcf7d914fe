"""A result with its states and its inputs, as the folder holds it; every other file is made from the archive.

Inputs are the files that the case names. They are kept with the result so that its folder can be moved, zipped and run
again: a file of up to LARGEST bytes is copied to inputs/; a larger one stays where it is and is named relative to the
folder, as is a glTF file in parts, which names others itself.
"""

import hashlib
import json
import os
import re
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from rodshell.errors import InputError, OutputError
from rodshell.results.folder import ResultFolder, reading
from rodshell.results.judged.shape import CONVERGED
from rodshell.results.manifest import inside
from rodshell.results.results import Results, Verdict, read_results
from rodshell.results.states import DRAPED, POPPED, packed, read_states, shells_among
from rodshell.results.summary import summary_text
from rodshell.results.verdict import verdict_of
from rodshell.rods.supports import PINNED, finals_first
from rodshell.untrusted import limit, raised, read_text
from rodshell.validation import file_path, instance, mapping

LARGEST = 20_000_000  # bytes of a file that is copied
ALL_COPIES = 100_000_000  # bytes of all files that are copied
MOST_FILES = 100  # that a case names
FOLDER = "inputs"
NAMED = re.compile(r'^(file|boundary) = (".*")$', re.MULTILINE)  # in the text of a resolved case
PARTS = ".gltf"


def read_inputs(case_toml: str, where: Callable[[str], Path | None] = Path) -> dict[str, bytes]:
    """The contents of the files that a case names and that are to be kept with its result, by the path in the case;
    `where` gives the place of a file by that path, or None for one that is not read."""
    found, left = dict[str, bytes](), ALL_COPIES
    for name in _names(case_toml):
        path = where(name)
        if path is None or not path.is_file() or path.suffix.lower() == PARTS:
            continue
        if path.stat().st_size <= min(LARGEST, left):
            found[name] = path.read_bytes()
            left -= len(found[name])
    return found


def kept_case(case_toml: str, inputs: Mapping[str, bytes], folder: Path) -> tuple[str, dict[str, bytes]]:
    """The case as it is kept in a result folder, its paths relative to that, and the files to be written with it."""
    copies, new_names = dict[str, bytes](), dict[str, str]()
    for name in _names(case_toml):
        if name in inputs:
            new_names[name] = f"{FOLDER}/{_free_name(Path(name).name, copies)}"
            copies[new_names[name]] = inputs[name]
        else:
            new_names[name] = _relative(name, folder)
    return _renamed(case_toml, new_names), copies


def shown_case(case_toml: str, inputs: Mapping[str, bytes]) -> str:
    """The case on a page that goes to others: paths as they are kept, of files that are not copied the names alone."""
    kept, copies = kept_case(case_toml, inputs, Path.cwd())
    return _renamed(kept, {name: Path(name).name for name in _names(kept) if name not in copies})


def opened_case(case_toml: str, folder: Path, file: Callable[[str], Path]) -> tuple[str, dict[str, bytes]]:
    """The case of a result folder and the contents of its inputs; files that were not copied are named absolutely, and
    not read: a case may come from somebody who wants to have them in a report.

    Args:
        file: the place of a file in the folder by its name.
    """
    inputs = read_inputs(case_toml, lambda name: file(name) if inside(name) and name.startswith(f"{FOLDER}/") else None)
    outside = {name: str((folder / name).absolute()) for name in _names(case_toml) if name not in inputs}
    return _renamed(case_toml, outside), inputs


def input_hash(case_toml: str, inputs: Mapping[str, bytes]) -> str:
    """Twelve digits of SHA-256 of a case and the contents of its files, wherever these are and however called; one that
    is not copied counts as empty."""
    names = _names(case_toml)
    digest = hashlib.sha256(_renamed(case_toml, {name: str(k) for k, name in enumerate(names)}).encode())
    for name in names:
        digest.update(inputs.get(name, b""))
    return digest.hexdigest()[:12]


def _names(case_toml: str) -> list[str]:
    """The files that a case names, each once."""
    try:
        names = list(dict.fromkeys(json.loads(text) for _, text in NAMED.findall(case_toml)))
    except ValueError as error:
        raise InputError(f"the path of a file cannot be read: {error}") from None
    if len(names) > limit(MOST_FILES):
        raise InputError(f"it names {len(names)} files: give fewer, {raised(MOST_FILES, len(names))}")
    return names


def _renamed(case_toml: str, new_names: Mapping[str, str]) -> str:
    """The case with other names of its files."""

    def line(found: re.Match[str]) -> str:
        name = json.loads(found[2])
        return f"{found[1]} = {json.dumps(new_names.get(name, name), ensure_ascii=False)}"

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


ARCHIVE = ("result.json", "case.toml", "states.npz")  # from which every other file can be made again
T = TypeVar("T")
P = ParamSpec("P")


@dataclass(frozen=True, eq=False)
class Archive:
    """A result as it is kept on disk.

    Args:
        results: the content of result.json, SI units.
        states: the content of states.npz: "flat", "draped", "popped_pinned", "popped_clamped" (n, 3) node
            positions [m]; "gap_draped", "gap_pinned", "gap_clamped" (n,) signed distances to the target [m];
            "rod_nodes" (k,) nodes of all rods in a row; "rod_start" (m,) where each rod begins. Some may be
            missing.
        case_toml: the full resolved input; empty if there was none.
        inputs: contents of the files that it names and that are kept with the result, by their path in it.
    """

    results: Results
    states: Mapping[str, NDArray[Any]]
    case_toml: str = ""
    inputs: Mapping[str, bytes] = field(default_factory=dict)
    _made: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        instance("results", self.results, Results)
        mapping("states", self.states, "arrays by their names")
        instance("case_toml", self.case_toml, str, "text")
        mapping("inputs", self.inputs, "contents of files by their paths")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Archive):
            return NotImplemented
        return (
            (self.results, self.case_toml, self.inputs) == (other.results, other.case_toml, other.inputs)
            and self.states.keys() == other.states.keys()
            and all(np.array_equal(values, other.states[name], equal_nan=True) for name, values in self.states.items())
        )

    __hash__ = None  # type: ignore[assignment]

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_made": {}}  # made again; its keys are functions that pickle does not find

    def __repr__(self) -> str:
        return (
            f"<Archive {self.name}: {self.verdict.level}, {len(self.results.rods)} rods, "
            f"{', '.join(shells_among(self.states)) or 'no shell in space'}>"
        )

    def summary(self, *, verbose: bool = False) -> str:
        """Six lines of text; `verbose`: all that was found."""
        return summary_text(self.results, verbose=verbose)

    @property
    def verdict(self) -> Verdict:
        """What the result is worth: good, check, unbuildable or unknown, with the reasons."""
        return verdict_of(self.results)

    @property
    def name(self) -> str:
        """The result's name, or else its target's kind."""
        target = self.results.target
        return self.results.name or (target.kind if target else None) or "rodshell"

    @property
    def final(self) -> str | None:
        """The best state in space that there is: on supports of one's own, else clamped, else pinned, else draped;
        where a solve stopped before it converged only if there is no other."""
        popped = [name.removeprefix(POPPED) for name in shells_among(self.states) if name != DRAPED]
        shells = [*(POPPED + support for support in finals_first(popped)), *({DRAPED} & self.states.keys())]
        return min(shells, key=self.is_lost, default=None)

    @property
    def deployed(self) -> str:
        """The state that the stages of the deployment lead to."""
        return POPPED + ((self.results.deployment.ends if self.results.deployment else None) or PINNED.name)

    def is_lost(self, state: str) -> bool:
        """Whether a state, such as "popped_pinned", is where the solve of a shell stopped before it converged."""
        shells = {POPPED + ends: shell for ends, shell in self.results.pop_up.items()}
        return state in shells and shells[state].status not in (None, CONVERGED)


def made_once(make: Callable[Concatenate[Archive, P], T]) -> Callable[Concatenate[Archive, P], T]:
    """`make`, whose result is kept with the archive and must not be changed: many files are made from the same rods."""

    @wraps(make)
    def kept(archive: Archive, /, *args: P.args, **options: P.kwargs) -> T:
        key = make, args, *options.items()
        if key not in archive._made:
            archive._made[key] = make(archive, *args, **options)
        found: T = archive._made[key]
        return found

    return kept


def archive_names(archive: Archive) -> list[str]:
    """The names of the files that `put_archive` writes."""
    copies = kept_case(archive.case_toml, archive.inputs, Path())[1]
    return [*(name for name in ARCHIVE if name != "case.toml" or archive.case_toml), *copies]


def put_archive(archive: Archive, place: ResultFolder) -> None:
    """Stage result.json, case.toml, states.npz and the copied inputs in a folder.

    Raises:
        OutputError: the folder cannot be written.
    """
    case, copies = kept_case(archive.case_toml, archive.inputs, place.path)
    place.put("result.json", archive.results.text())
    if case:
        place.put("case.toml", case)
    place.put("states.npz", packed(archive.states))
    for name, content in copies.items():
        place.put(name, content)


def read(folder: str | os.PathLike[str]) -> Archive:
    """The archive of a result folder, of this version of rodshell or an earlier one, every value checked.

    Raises:
        InputError: `folder` is not a path. OutputError : there is no result, or it cannot be read; the sentence names
            the file and the key.
    """
    instance("folder", folder, str | os.PathLike, "the path of a folder")
    where = file_path("folder", folder)
    if where.is_file():
        raise OutputError(f"{where} is a file: give the folder of a rodshell result")
    with reading(where) as file:
        results = read_results(file("result.json"))
        states = read_states(file("states.npz"), results)
        try:
            case = file("case.toml")
            case_toml, inputs = opened_case(read_text(case) if case.exists() else "", where, file)
        except InputError as error:
            raise OutputError(f"cannot read the case in {where}: {error}") from None
    return Archive(results, states, case_toml, inputs)
