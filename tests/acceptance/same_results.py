"""Two results of one job, compared: `states.npz` array by array, `result.json` field by field."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

RELATIVE = 1e-9  # of numbers in result.json, against the largest number of the same list
LOOSER = {"force": 1e-8, "load_factor": 1e-8}  # differences of large axial forces; the end of a path of equilibria
ROUND_OFF = 1e-7  # below this, residuals and imbalances (relative, by their definition) are round-off
STRAIGHT = 1e9  # [m] a radius of curvature beyond which a rod is straight
UNTIMED = frozenset({"seconds", "version", "versions", "version_rodshell"})  # differ from run to run, or by intention
RESIDUALS = frozenset({"force_residual", "force_imbalance", "moment_imbalance", "max_gap", "max_strain"})
SUMS = frozenset({"force_sum", "moment_sum"})  # zero but for round-off; *_imbalance is their relative size
BUDGETS = frozenset({"tried", "searched"})  # how far a search came within its share of the factorisations
REWORDED = frozenset({"warnings", "reasons", "status"})  # sentences: the same count and the same numbers
PLACES = frozenset({"rod", "rods", "at", "where"})  # of a largest value
RENAMED = {"own_ends": "net_deviation"}  # key in result.json of c7aa8f6 -> its name now, wherever it stands
NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Difference:
    """A field that differs: its path within the file, and both values."""

    path: str
    before: object
    after: object

    def __str__(self) -> str:
        return f"{self.path}: {str(self.before)[:60]} -> {str(self.after)[:60]}"


@dataclass(frozen=True)
class StateDifference:
    """How far two files states.npz are apart.

    Parameters
    ----------
    positions : largest difference of positions and gaps, over the target's size.
    derived : the same of all other arrays (curvature, stress), each over its own largest value.
    unlike : arrays that only one of both has, or whose shape changed.
    """

    positions: float
    derived: float
    unlike: tuple[str, ...]


def state_difference(before: Path, after: Path, size: float) -> StateDifference:
    """The arrays of two results' states.npz, compared."""
    positions, derived, unlike = 0.0, 0.0, list[str]()
    with np.load(before / "states.npz") as old, np.load(after / "states.npz") as new:
        for name in sorted({*old.files, *new.files}):
            if name not in old.files or name not in new.files or old[name].shape != new[name].shape:
                unlike.append(name)
                continue
            a, b = old[name].astype(float), new[name].astype(float)
            apart = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, np.abs(a - b))
            worst = float(np.nan_to_num(apart, nan=np.inf).max(initial=0.0))
            if (a.ndim > 1 and a.shape[-1] == 3) or name.startswith("gap"):
                positions = max(positions, worst / size)
            elif worst:
                derived = max(derived, worst / float(np.abs(a[np.isfinite(a)]).max(initial=0.0)))
    return StateDifference(positions, derived, tuple(unlike))


def result_differences(before: Path, after: Path, *, symmetric: bool = False) -> list[Difference]:
    """Fields of result.json that differ, keys renamed as the table `RENAMED` says.

    Parameters
    ----------
    symmetric : the shell has mirror images of every place; round-off decides at which of them a largest value is.
    """
    old, new = (json.loads((folder / "result.json").read_text()) for folder in (before, after))
    found = _differences(old, new, "", "", {})
    return [field for field in found if not (symmetric and field.path.rpartition(".")[2].partition("[")[0] in PLACES)]


Scales = Mapping[str, float]  # the largest number that a list of records holds under each key


def _differences(old: Any, new: Any, path: str, key: str, scales: Scales) -> Iterator[Difference]:
    if isinstance(old, dict) and isinstance(new, dict):
        old = {RENAMED.get(name, name): value for name, value in old.items()}
        for name in sorted({*old, *new} - UNTIMED - BUDGETS):
            if name not in old or name not in new:
                yield Difference(f"{path}.{name}", old.get(name, "(no such key)"), new.get(name, "(no such key)"))
            else:
                yield from _differences(old[name], new[name], f"{path}.{name}", name, scales)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        records = [entry for entry in old if isinstance(entry, dict)]
        within = {name: max(_largest(entry.get(name)) for entry in records) for name in set().union(*records)}
        within = within or {key: max(_largest(old), scales.get(key, 0.0))}
        for index, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from _differences(a, b, f"{path}[{index}]", key, within)
    elif not _same(old, new, key, scales.get(key, 0.0)):
        yield Difference(path, old, new)


def _largest(value: object) -> float:
    """The largest number of a list, of lists of them, or the number itself; 0 of anything else."""
    if isinstance(value, list):
        return max(map(_largest, value), default=0.0)
    return abs(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else 0.0


def _same(old: object, new: object, key: str, scale: float) -> bool:
    if isinstance(old, str) and isinstance(new, str) and key in REWORDED:
        return NUMBER.findall(old) == NUMBER.findall(new)
    if isinstance(old, float) and isinstance(new, float):
        if key in SUMS:
            return True
        if key in RESIDUALS and max(abs(old), abs(new)) <= ROUND_OFF:
            return True
        if key == "min_radius" and min(old, new) > STRAIGHT:
            return True
        return abs(old - new) <= LOOSER.get(key, RELATIVE) * max(scale, abs(old), abs(new))
    return type(old) is type(new) and old == new
