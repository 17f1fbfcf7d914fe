"""A result with its states and its inputs, as the folder holds it; every other file is made from the archive.

Inputs are the files that the case names. They are kept with the result so that its folder can be moved, zipped and run
again: a file of up to LARGEST bytes is copied to inputs/; a larger one stays where it is and is named relative to the
folder, as is a glTF file in parts, which names others itself.
"""

import hashlib
import json
import os
import re
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import field
from functools import wraps
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
from numpy.typing import NDArray

from rodshell.dataclass import dataclass
from rodshell.errors import OutputError
from rodshell.results.folder import ResultFolder, reading
from rodshell.results.results import Results, Verdict, read_results
from rodshell.results.summary import summary_text
from rodshell.results.verdict import CONVERGED, verdict_of
from rodshell.validation import instance, mapping

LARGEST = 20_000_000  # bytes of a file that is copied
FOLDER = "inputs"
NAMED = re.compile(r'^(file|boundary) = (".*")$', re.MULTILINE)  # in the text of a resolved case
PARTS = ".gltf"
COMPRESSION = 1  # of states.npz: half the time of NumPy's 6, for files that are 6 % longer


def read_inputs(case_toml: str, where: Callable[[str], Path] = Path) -> dict[str, bytes]:
    """The contents of the files that a case names and that are to be kept with its result, by the path in the case.

    Parameters
    ----------
    case_toml : text of the case.
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
    copies, new_names = dict[str, bytes](), dict[str, str]()
    for name in dict.fromkeys(_names(case_toml)):
        if name in inputs:
            new_names[name] = f"{FOLDER}/{_free_name(Path(name).name, copies)}"
            copies[new_names[name]] = inputs[name]
        else:
            new_names[name] = _relative(name, folder)
    return _renamed(case_toml, new_names), copies


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

    Parameters
    ----------
    case_toml : text of the case.
    where : the place of a file by its path in the case.
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
SHELLS = ("draped", "popped_pinned", "popped_clamped")  # the states in space, in the order in which they are computed
GAPS = {"draped": "gap_draped", "popped_pinned": "gap_pinned", "popped_clamped": "gap_clamped"}
BENT = ("curvature", "stress")  # known at each entry of `rod_nodes`
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Archive:
    """A result as it is kept on disk.

    Parameters
    ----------
    results : the content of result.json, SI units.
    states : the content of states.npz: "flat", "draped", "popped_pinned", "popped_clamped" (n, 3) node
        positions [m]; "gap_draped", "gap_pinned", "gap_clamped" (n,) signed distances to the target [m];
        "rod_nodes" (k,) nodes of all rods in a row; "rod_start" (m,) where each rod begins. Some may be
        missing.
    case_toml : the full resolved input; empty if there was none.
    inputs : contents of the files that it names and that are kept with the result, by their path in it.
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
        return self.__dict__ | {
            "_made": {}
        }  # which is made again, and whose keys are functions that pickle does not find

    def __repr__(self) -> str:
        shells = [name for name in SHELLS if name in self.states]
        return (
            f"<Archive {self.name}: {self.verdict.level}, {len(self.results.rods)} rods, "
            f"{', '.join(shells) or 'no shell in space'}>"
        )

    def summary(self) -> str:
        """One screen of text."""
        return summary_text(self.results)

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
        """The best state in space that there is: clamped, else pinned, else draped; where a solve stopped before it
        converged only if there is no other."""
        shells = [state for state in SHELLS if state in self.states]
        return max(shells, key=lambda state: (not self.is_lost(state), SHELLS.index(state)), default=None)

    def is_lost(self, state: str) -> bool:
        """Whether a state is where the solve of a shell stopped before it converged.

        Parameters
        ----------
        state : of `states`, such as "popped_pinned".
        """
        shells = {f"popped_{ends}": shell for ends, shell in self.results.pop_up.items()}
        return state in shells and shells[state].status not in (None, CONVERGED)


def made_once(make: Callable[[Archive], T]) -> Callable[[Archive], T]:
    """`make`, whose result is kept with the archive and must not be changed: many files are made from the same rods.

    Parameters
    ----------
    make : a function of an archive alone.
    """

    @wraps(make)
    def kept(archive: Archive) -> T:
        if make not in archive._made:
            archive._made[make] = make(archive)
        found: T = archive._made[make]
        return found

    return kept


def archive_names(archive: Archive) -> list[str]:
    """The names of the files that `put_archive` writes.

    Parameters
    ----------
    archive : with or without a case.
    """
    copies = kept_case(archive.case_toml, archive.inputs, Path())[1]
    return [*(name for name in ARCHIVE if name != "case.toml" or archive.case_toml), *copies]


def put_archive(archive: Archive, place: ResultFolder) -> None:
    """Stage result.json, case.toml, states.npz and the copied inputs in a folder.

    Parameters
    ----------
    archive : the result.
    place : the folder in which the files are staged.

    Raises
    ------
    OutputError : the folder cannot be written.
    """
    place.put("result.json", archive.results.text())
    if archive.case_toml:
        place.put("case.toml", kept_case(archive.case_toml, archive.inputs, place.path)[0])
    stream = BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED, compresslevel=COMPRESSION) as states:
        for name, values in archive.states.items():
            with states.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, values, allow_pickle=False)
    place.put("states.npz", stream.getvalue())
    for name, content in kept_case(archive.case_toml, archive.inputs, Path())[1].items():
        place.put(name, content)


def read(folder: str | os.PathLike[str]) -> Archive:
    """The archive of a result folder, of this version of rodshell or an earlier one, every value checked.

    Raises
    ------
    InputError : `folder` is not a path. OutputError : there is no result, or it cannot be read; the sentence names the
        file and the key.
    """
    instance("folder", folder, str | os.PathLike, "the path of a folder")
    where = Path(folder).expanduser()
    if where.is_file():
        raise OutputError(f"{where} is a file: give the folder of a rodshell result")
    with reading(folder) as file:
        results = read_results(file("result.json"))
        states = _read_states(file("states.npz"))
        try:
            case = file("case.toml")
            case_toml, inputs = opened_case(case.read_text(encoding="utf-8") if case.exists() else "", file)
        except (OSError, ValueError) as error:
            raise OutputError(f"cannot read the result in {where}: {error}") from error
    for fault in state_faults(states, results):
        raise OutputError(f"{where / 'states.npz'}: {fault}")
    return Archive(results, states, case_toml, inputs)


def _read_states(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of a states.npz, not checked.

    Raises
    ------
    OutputError : it is missing, not to be opened, or broken.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except FileNotFoundError:
        raise OutputError(f"{path} is missing: run case.toml again") from None
    except (PermissionError, IsADirectoryError) as error:
        raise OutputError(f"cannot read {path}: {error.strerror}") from None
    except Exception as error:  # numpy and zipfile have many ways to say that a file is broken; some advise pickles
        raise OutputError(
            f"{path} cannot be read: it is damaged or not written by rodshell; run case.toml again"
        ) from error


def state_faults(states: Mapping[str, NDArray[Any]], results: Results) -> Iterator[str]:
    """What is wrong with states: shapes that do not fit each other or the results, indices out of range, places that
    are not finite.

    Parameters
    ----------
    states : arrays by name, see `Archive`.
    results : by which the number of rods and stages is known.
    """
    for name, values in states.items():
        if values.dtype.kind not in ("iu" if name in ("rod_nodes", "rod_start") else "fiu"):
            yield f"{name} must be an array of {'whole ' if name.startswith('rod_') else ''}numbers"
            return
    count = next((len(states[name]) for name in ("flat", *SHELLS) if name in states and states[name].ndim), 0)
    wanted: dict[str, tuple[int, ...]] = dict.fromkeys(("flat", *SHELLS), (count, 3))
    wanted |= dict.fromkeys(GAPS.values(), (count,))
    if "rod_nodes" in states:
        entries = states["rod_nodes"].size
        wanted |= {"rod_nodes": (entries,), "rod_start": (len(results.rods),)}
        wanted |= {f"{what}_{ends}": (entries,) for what in BENT for ends in ("pinned", "clamped")}
    if "history" in states:
        stages = len(results.deployment.stages) if results.deployment else 0
        wanted |= {"history": (stages, count, 3), "history_share": (stages,)}
        wanted |= {f"history_{what}": (stages, states["rod_nodes"].size) for what in BENT if "rod_nodes" in states}
    for name, shape in wanted.items():
        if name in states and states[name].shape != shape:
            yield f"{name} has the shape {states[name].shape}, not {shape}"
            return
    for name in ("flat", *SHELLS, "history", "history_share"):
        if name in states and not np.isfinite(states[name]).all():
            yield f"{name} holds a number that is not finite"
    if "rod_nodes" in states:
        nodes, starts = states["rod_nodes"], states.get("rod_start")
        if nodes.size and not (nodes.min() >= 0 and nodes.max() < count):
            yield f"rod_nodes holds {nodes.min()} to {nodes.max()}, but there are {count} nodes"
        if starts is None:
            yield "rod_nodes is there, but rod_start is missing"
        elif starts.size and (starts[0] != 0 or np.any(starts[1:] <= starts[:-1]) or starts[-1] >= nodes.size):
            yield f"rod_start must ascend from 0 to below the {nodes.size} entries of rod_nodes"
