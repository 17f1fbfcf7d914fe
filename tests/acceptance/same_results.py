"""Two results of one job, compared: `states.npz` array by array, `result.json` field by field."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

RELATIVE = 1e-9  # of numbers in result.json, against the largest number of the same list
ROUND_OFF = 1e-8  # below this, residuals and imbalances (relative, by their definition) are round-off
STRAIGHT = 1e9  # [m] a radius of curvature beyond which a rod is straight
UNTIMED = frozenset({"seconds", "version", "versions", "version_rodshell"})  # differ from run to run, or by intention
RESIDUALS = frozenset({"force_residual", "force_imbalance", "moment_imbalance", "max_gap", "max_strain"})
SUMS = frozenset({"force_sum", "moment_sum"})  # zero but for round-off; *_imbalance is their relative size
REWORDED = frozenset({"warnings", "reasons", "searched", "status"})  # sentences: the same count and the same numbers
RENAMED: dict[str, str] = {}  # key in result.json of c7aa8f6 -> its name now, wherever it stands
NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Difference:
    """A field that differs: its path within the file, and both values."""

    path: str
    before: object
    after: object

    def __str__(self) -> str:
        return f"{self.path}: {str(self.before)[:60]} -> {str(self.after)[:60]}"


def state_difference(before: Path, after: Path, size: float) -> tuple[float, list[str]]:
    """Largest difference of all arrays, and the names of arrays that only one of both has or that changed their shape.

    Positions and gaps are compared over the target's size, all other arrays over their own largest value.
    """
    worst, unlike = 0.0, list[str]()
    with np.load(before / "states.npz") as old, np.load(after / "states.npz") as new:
        for name in sorted({*old.files, *new.files}):
            if name not in old.files or name not in new.files or old[name].shape != new[name].shape:
                unlike.append(name)
                continue
            a, b = old[name].astype(float), new[name].astype(float)
            if not a.size:
                continue
            length = (a.ndim > 1 and a.shape[-1] == 3) or name.startswith("gap")
            scale = size if length else max(float(np.abs(a[np.isfinite(a)]).max(initial=0.0)), 1e-300)
            apart = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, np.abs(a - b))
            worst = max(worst, float(np.nan_to_num(apart, nan=np.inf).max()) / scale)
    return worst, unlike


def result_differences(before: Path, after: Path) -> list[Difference]:
    """Fields of result.json that differ, keys renamed as the table `RENAMED` says."""
    old, new = (json.loads((folder / "result.json").read_text()) for folder in (before, after))
    return list(_differences(old, new, "", "", 0.0))


def _differences(old: Any, new: Any, path: str, key: str, scale: float) -> Iterator[Difference]:
    if isinstance(old, dict) and isinstance(new, dict):
        yield from _of_tables({RENAMED.get(name, name): value for name, value in old.items()}, new, path)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        scale = max(scale, _largest(old))
        for index, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from _differences(a, b, f"{path}[{index}]", key, scale)
    elif not _same(old, new, key, scale):
        yield Difference(path, old, new)


def _of_tables(old: Mapping[str, Any], new: Mapping[str, Any], path: str) -> Iterator[Difference]:
    for name in sorted({*old, *new} - UNTIMED):
        if name not in old or name not in new:
            yield Difference(f"{path}.{name}", old.get(name, "(no such key)"), new.get(name, "(no such key)"))
        else:
            yield from _differences(old[name], new[name], f"{path}.{name}", name, 0.0)


def _largest(values: list[Any]) -> float:
    """The largest number of a list of numbers, or of lists of them."""
    found = [_largest(value) if isinstance(value, list) else _size(value) for value in values]
    return max(found, default=0.0)


def _size(value: object) -> float:
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
        return abs(old - new) <= RELATIVE * max(scale, abs(old), abs(new))
    return type(old) is type(new) and old == new
