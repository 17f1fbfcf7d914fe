"""states.npz: the arrays of a result, unpacked within stated limits, and checked against each other and the results.

What the file says of itself, the sizes of its arrays, is checked before memory is spent.
"""

from collections.abc import Iterable, Iterator, Mapping
from io import BytesIO
from math import prod
from pathlib import Path
from re import fullmatch
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from rodshell.errors import InputError, OutputError
from rodshell.figures.records import FARTHEST, LARGEST, far_apart
from rodshell.results.results import Results
from rodshell.rods.supports import SUPPORTS
from rodshell.untrusted import limit, raised, read_bytes
from rodshell.validation import NAME

States = Mapping[str, NDArray[Any]]

SIZE = 500e6  # bytes of states.npz, and of all its arrays
DIRECTORY = 1 << 20  # bytes of the list of arrays in it, enough for 10,000
HEADER = 1000  # characters of an array's header; NumPy writes 128
COMPRESSION = 1  # half the time of NumPy's 6, for files that are 6 % longer

DRAPED, POPPED = "draped", "popped_"  # the states in space: the second with the name of a support
GAP = "gap_"  # of a state in space: with the name of its support, or draped
ACTING = "acting_"  # forces on the nodes, of a support and a combination of loads
BENT = ("curvature", "stress")  # known at each entry of `rod_nodes`
INDICES = ("rod_nodes", "rod_start", "target_faces")
DAMAGED = "cannot be read: it is damaged or not written by rodshell; run case.toml again"


def is_shell(name: str) -> bool:
    """Whether a state is one in space."""
    return name == DRAPED or fullmatch(POPPED + NAME, name) is not None


def shells_among(names: Iterable[str]) -> list[str]:
    """The states in space in the order in which they are computed: draped, then popped up by support."""
    known = [DRAPED, *(POPPED + support for support in SUPPORTS)]
    return sorted(filter(is_shell, names), key=lambda name: known.index(name) if name in known else len(known))


def packed(states: States) -> bytes:
    """The content of a states.npz."""
    stream = BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED, compresslevel=COMPRESSION) as stored:
        for name, values in states.items():
            with stored.open(f"{name}.npy", "w", force_zip64=True) as entry:
                npy.write_array(entry, values, allow_pickle=False)
    return stream.getvalue()


def read_states(path: Path, results: Results) -> dict[str, NDArray[Any]]:
    """The arrays of a states.npz, which belong to the results of the same folder.

    Raises:
        OutputError: it is missing, not to be opened, broken, or too large, or an array is not as it should be.
    """
    if not path.exists():
        raise OutputError(f"{path} is missing: run case.toml again")
    try:
        states = dict(_unpacked(path, read_bytes(path, SIZE)))
    except InputError as reason:
        raise OutputError(str(reason)) from None
    except OutputError:
        raise
    except Exception as error:  # numpy and zipfile have many ways to say that a file is broken; some advise pickles
        raise OutputError(f"{path} {DAMAGED}") from error
    for fault in state_faults(states, results):
        raise OutputError(f"{path}: {fault}")
    return {name: values.astype(_kind(name, values), copy=False) for name, values in states.items()}


def _kind(name: str, values: NDArray[Any]) -> np.dtype[Any]:
    """What numbers an array has that is as it should be."""
    return values.dtype.newbyteorder("=") if values.dtype.kind == "f" or name in INDICES else np.dtype(float)


class _Pieces(BytesIO):
    """Gives a megabyte at once: a longer list of arrays, which would take a hundred times its size, is damaged."""

    def read(self, size: int | None = -1, /) -> bytes:
        return super().read(min(size, DIRECTORY) if size is not None and size >= 0 else DIRECTORY)


def _unpacked(path: Path, content: bytes) -> Iterator[tuple[str, NDArray[Any]]]:
    """Names and arrays of a states.npz, not checked."""
    with ZipFile(_Pieces(content)) as stored:
        entries = stored.infolist()
        total, allowed = sum(entry.file_size for entry in entries), limit(SIZE)
        if total > allowed:
            raise OutputError(
                f"{path} holds arrays of {total / 1e6:.4g} MB; at most {allowed / 1e6:.4g} MB are read: "
                f"run the case on a coarser mesh, {raised(SIZE, total)}"
            )
        if len({entry.filename for entry in entries}) < len(entries):
            raise ValueError("two arrays of one name")
        for entry in entries:
            if entry.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
                raise ValueError("compressed in a way that NumPy does not write")
            with stored.open(entry) as stream:
                head = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}[npy.read_magic(stream)]
                shape, _, kind = head(stream, max_header_size=HEADER)
                if stream.tell() + prod(shape) * kind.itemsize != entry.file_size or min(shape, default=0) < 0:
                    raise ValueError("more or less than its header says")
                stream.seek(0)
                values = npy.read_array(stream, allow_pickle=False, max_header_size=HEADER)
                yield entry.filename.removesuffix(".npy"), values


def state_faults(states: States, results: Results) -> Iterator[str]:
    """What is wrong with states: shapes that do not fit each other or the results, indices and numbers out of range."""
    if not results.rods:
        yield "there are no rods in result.json"
        return
    for name, values in states.items():
        if values.dtype.kind not in ("iu" if name in INDICES else "fiu") or values.dtype.itemsize not in (4, 8):
            yield f"{name} must be an array of {'whole ' if name in INDICES else ''}numbers of 32 or 64 bits"
            return
    for name, needed in (("rod_nodes", "rod_start"), ("rod_start", "rod_nodes"), ("history", "history_share"),
                         ("history_share", "history"), ("target_points", "target_faces")):  # fmt: skip
        if name in states and needed not in states:
            yield f"{name} is there, but {needed} is missing"
            return
    shapes = [name for name in ("flat", *shells_among(states)) if name in states]
    count = next((len(states[name]) for name in shapes if states[name].ndim), 0)
    for name, shape in _shapes(states, count, results):
        if states[name].shape != shape:
            yield f"{name} has the shape {states[name].shape}, not {shape}"
            return
    for name, values in states.items():
        if fault := _out_of_range(name, values):
            yield f"{name} holds {fault}"
    for name, points in (("rod_nodes", count), ("target_faces", len(states.get("target_points", ())))):
        nodes = states.get(name, np.empty(0, dtype=int))
        if nodes.size and not (nodes.min() >= 0 and nodes.max() < points):
            yield f"{name} holds {nodes.min()} to {nodes.max()}, but there are {points} nodes"
            return
    if "rod_start" in states:
        size = states["rod_nodes"].size
        starts = np.append(np.minimum(states["rod_start"], size).astype(np.intp), size)
        if starts[0] != 0 or np.diff(starts).min(initial=2) < 2:
            yield f"rod_start must ascend from 0 to below the {size} entries of rod_nodes, by two or more for each rod"


def _shapes(states: States, count: int, results: Results) -> Iterator[tuple[str, tuple[int, ...]]]:
    """The shapes that the arrays must have, of `count` nodes."""
    entries = states["rod_nodes"].size if "rod_nodes" in states else 0
    stages = len(results.deployment.stages) if results.deployment else 0
    wanted: dict[str, tuple[int, ...]] = dict.fromkeys(("flat", *shells_among(states)), (count, 3))
    wanted |= {"rod_nodes": (entries,), "rod_start": (len(results.rods),)}
    wanted |= {"history": (stages, count, 3), "history_share": (stages,)}
    wanted |= {f"history_{what}": (stages, entries) for what in BENT}
    for name, values in states.items():
        if name in wanted:
            yield name, wanted[name]
        elif name in ("target_points", "target_faces"):
            yield name, (len(values) if values.ndim else 0, 3)
        elif name.startswith(GAP):
            yield name, (count,)
        elif name.partition("_")[0] in (*BENT, "force"):
            yield name, (entries,)
        elif name.startswith(("loaded_", ACTING)):
            yield name, (entries,) if name.startswith("loaded_stress_") else (count, 3)


def _out_of_range(name: str, values: NDArray[Any]) -> str:
    """What numbers of an array cannot be, or nothing."""
    if name.startswith(GAP):
        values = values[~np.isnan(values)]  # no point of the target is near
    if not values.size:
        return "" if name != "flat" and not is_shell(name) else "no node"
    if not np.isfinite(values).all():
        return "a number that is not finite"
    if name in ("flat", "history", "target_points") or is_shell(name) or name.startswith("loaded_"):
        return far_apart(values)
    low, high = float(values.min()), float(values.max())
    most = FARTHEST if name.startswith(GAP) else 1.0 if name == "history_share" else LARGEST
    return f"{low:.4g} to {high:.4g}: it must lie from {-most:g} to {most:g}" if max(-low, high) > most else ""
