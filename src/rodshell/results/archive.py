"""A result with its states and its inputs, as the folder holds it; every other file is made from the archive."""

import os
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import wraps
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rodshell.errors import OutputError
from rodshell.results.checked import Verdict
from rodshell.results.folder import ResultFolder, reading
from rodshell.results.inputs import kept_case, opened_case
from rodshell.results.results import Results, read_results
from rodshell.results.summary import summary_text
from rodshell.results.verdict import verdict_of

ARCHIVE = ("result.json", "case.toml", "states.npz")  # from which every other file can be made again
SHELLS = ("draped", "popped_pinned", "popped_clamped")  # the states in space, in the order they come about
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

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Archive):
            return NotImplemented
        return (
            (self.results, self.case_toml, self.inputs) == (other.results, other.case_toml, other.inputs)
            and self.states.keys() == other.states.keys()
            and all(np.array_equal(values, other.states[name], equal_nan=True) for name, values in self.states.items())
        )

    __hash__ = None  # type: ignore[assignment]

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
        """What the result is worth: good, check or unbuildable, with the reasons."""
        return verdict_of(self.results)

    @property
    def name(self) -> str:
        """The result's name, or else its target's kind."""
        target = self.results.target
        return self.results.name or (target.kind if target else None) or "rodshell"

    @property
    def final(self) -> str | None:
        """The best state in space that there is: clamped, else pinned, else draped."""
        return next((state for state in reversed(SHELLS) if state in self.states), None)


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

    Raises
    ------
    OutputError : the folder cannot be written.
    """
    place.put("result.json", archive.results.text())
    if archive.case_toml:
        place.put("case.toml", kept_case(archive.case_toml, archive.inputs, place.path)[0])
    stream = BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **archive.states)
    place.put("states.npz", stream.getvalue())
    for name, content in kept_case(archive.case_toml, archive.inputs, Path())[1].items():
        place.put(name, content)


def read(folder: str | os.PathLike[str]) -> Archive:
    """The archive of a result folder, of this version of rodshell or an earlier one, every value checked.

    Raises
    ------
    OutputError : there is no result, or it cannot be read; the sentence names the file and the key.
    """
    where = Path(folder).expanduser()
    with reading(folder) as file:
        results = read_results(file("result.json"))
        try:
            with np.load(file("states.npz"), allow_pickle=False) as stored:
                states = {name: stored[name] for name in stored.files}
            case = file("case.toml")
            case_toml, inputs = opened_case(case.read_text(encoding="utf-8") if case.exists() else "", file)
        except Exception as error:  # numpy and zipfile have many ways to say that a file is broken
            raise OutputError(f"cannot read the result in {where}: {error}") from error
    for fault in state_faults(states, results):
        raise OutputError(f"{where / 'states.npz'}: {fault}")
    return Archive(results, states, case_toml, inputs)


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
