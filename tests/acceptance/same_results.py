"""Two results of one job, compared: `states.npz` array by array, `result.json` field by field, and the case."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

LOOSER = {"force": 1e2, "loaded": 1e2, "load_factor": 10.0, "figure": 10.0}
"""Differences of large axial forces; buckling modes, whose values may be close; the end of a path of equilibria."""
STRAIGHT = 1e9  # [m] a radius of curvature beyond which a rod is straight
UNTIMED = frozenset({"seconds", "version", "versions", "version_rodshell"})  # differ from run to run, or by intention
RESIDUALS = frozenset({"force_residual", "force_imbalance", "moment_imbalance", "max_gap", "max_strain"})
SUMS = frozenset({"force_sum", "moment_sum"})  # zero but for round-off; *_imbalance is their relative size
REWORDED = frozenset({"warnings", "reasons", "status", "text"})  # sentences: the same count and the same numbers
PLACES = frozenset({"rod", "rods", "at", "where", "min_angle_at"})  # of a largest value
COUNTS = frozenset({"iterations", "factorizations"})  # of solves
RENAMED = {"own_ends": "net_deviation"}  # key in an earlier result.json -> its name now, wherever it stands
NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Tolerances:
    """How far two results may be apart that are the same.

    Parameters
    ----------
    positions : of nodes, and gaps, over the size; `LOOSER` multiplies this and both that follow.
    derived : curvature, stress and forces along rods, over the largest of their array.
    fields : numbers in result.json, against the largest number of the same list.
    residuals : residuals and imbalances, which are relative by their definition.
    counts : whether solves take the same number of iterations.
    """

    positions: float
    derived: float
    fields: float
    residuals: float
    counts: bool


HERE = Tolerances(1e-12, 1e-10, 1e-9, 1e-7, True)
SOLVED_ANEW = Tolerances(1e-9, 1e-7, 1e-6, 1e-7, False)  # the same equations, solved in another way
ELSEWHERE = SOLVED_ANEW
"""Another processor. With kernels for Nehalem, without wide registers, and the BLAS of four other processors, the kept
jobs had shells 1.3e-13 apart, modes 8e-12, forces 3e-9, all else 2e-11, fields 4e-9 (a load factor)."""


@dataclass(frozen=True)
class Difference:
    """A value that differs: its path, and both values."""

    path: str
    before: object
    after: object

    def __str__(self) -> str:
        return f"{self.path}: {str(self.before)[:60]} -> {str(self.after)[:60]}"


def differences(before: Path, after: Path, within: Tolerances, *, symmetric: bool = False) -> list[Difference]:
    """What the result in folder `after` has otherwise than the one in `before`, keys renamed as `RENAMED` says.

    Parameters
    ----------
    symmetric : the shell has mirror images of every place; round-off decides at which of them a largest value is.
    """
    old, new = (json.loads((folder / "result.json").read_text()) for folder in (before, after))
    fields = list(_Fields(within).differences(old, new, "", "", {}))
    if symmetric:
        fields = [field for field in fields if field.path.rpartition(".")[2].partition("[")[0] not in PLACES]
    size = (old.get("target") or {}).get("reference_size") or 1.0
    return [*state_differences(before, after, size, within), *fields, *_case_differences(before, after)]


def state_differences(before: Path, after: Path, size: float, within: Tolerances) -> Iterator[Difference]:
    """Arrays of two files states.npz that only one of both has, or that are farther apart than `within` allows."""
    with np.load(before / "states.npz") as old, np.load(after / "states.npz") as new:
        for name in sorted({*old.files, *new.files}):
            path = f".states.{name}"
            if name not in old.files or name not in new.files or old[name].shape != new[name].shape:
                yield Difference(path, *(each[name].shape if name in each.files else "none" for each in (old, new)))
                continue
            a, b = old[name].astype(float), new[name].astype(float)
            apart = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, np.abs(a - b))
            worst = float(np.nan_to_num(apart, nan=np.inf).max(initial=0.0))
            placed = (a.ndim > 1 and a.shape[-1] == 3) or name.startswith("gap")
            scale = size if placed else float(np.abs(a[np.isfinite(a)]).max(initial=0.0))
            bound = (within.positions if placed else within.derived) * LOOSER.get(name.partition("_")[0], 1.0)
            if old[name].dtype == np.float32:  # the last digit of one of them may change
                bound = max(bound, float(np.finfo(np.float32).eps))
            if worst > bound * scale:
                yield Difference(path, f"{'size' if placed else 'largest'} {scale:.3g}", f"{worst:.2g} apart")


def _case_differences(before: Path, after: Path) -> Iterator[Difference]:
    """Keys of the case that are missing or have another value; a job may have learnt more keys."""
    if (before / "case.toml").exists():
        old, new = (tomllib.loads((folder / "case.toml").read_text()) for folder in (before, after))
        for path, value in _leaves(old):
            found: Any = new
            for key in path:
                found = _rows(found).get(key, {})
            if found != value:
                yield Difference(".".join(("", "case", *path)), value, found)


def _leaves(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], object]]:
    for key, value in table.items():
        if inner := _rows(value):
            yield from _leaves(inner, (*path, key))
        else:
            yield (*path, key), value


def _rows(value: object) -> dict[str, Any]:
    """A table, or tables in a row by their number; of anything else none."""
    if isinstance(value, list) and all(isinstance(row, dict) for row in value):
        return {str(k): row for k, row in enumerate(value)}
    return value if isinstance(value, dict) else {}


Scales = Mapping[str, float]  # the largest number that a list of records holds under each key


@dataclass(frozen=True)
class _Fields:
    """The comparison of result.json."""

    within: Tolerances

    def differences(self, old: Any, new: Any, path: str, key: str, scales: Scales) -> Iterator[Difference]:
        if isinstance(old, dict) and isinstance(new, dict):
            old = {RENAMED.get(name, name): value for name, value in old.items()}
            for name in sorted({*old, *new} - UNTIMED):
                if name not in old or name not in new:
                    yield Difference(f"{path}.{name}", old.get(name, "(no such key)"), new.get(name, "(no such key)"))
                else:
                    yield from self.differences(old[name], new[name], f"{path}.{name}", name, scales)
        elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
            records = [entry for entry in old if isinstance(entry, dict)]
            lists = {name: max(_largest(entry.get(name)) for entry in records) for name in set().union(*records)}
            lists = lists or {key: max(_largest(old), scales.get(key, 0.0))}
            for index, (a, b) in enumerate(zip(old, new, strict=True)):
                yield from self.differences(a, b, f"{path}[{index}]", key, lists)
        elif not self.same(old, new, key, scales.get(key, 0.0)):
            yield Difference(path, old, new)

    def same(self, old: object, new: object, key: str, scale: float) -> bool:
        if isinstance(old, str) and isinstance(new, str) and key in REWORDED:
            return NUMBER.findall(old) == NUMBER.findall(new)
        if isinstance(old, str) and isinstance(new, str) and key == "file":  # wherever the checkout is
            return Path(old).name == Path(new).name
        if isinstance(old, float) and isinstance(new, float):
            if key in SUMS:
                return True
            if key in RESIDUALS and abs(old - new) <= self.within.residuals:
                return True
            if key == "min_radius" and min(old, new) > STRAIGHT:
                return True
            return abs(old - new) <= LOOSER.get(key, 1.0) * self.within.fields * max(scale, abs(old), abs(new))
        if key in COUNTS and not self.within.counts:
            return True
        return type(old) is type(new) and old == new


def _largest(value: object) -> float:
    """The largest number of a list, of lists of them, or the number itself; 0 of anything else."""
    if isinstance(value, list):
        return max(map(_largest, value), default=0.0)
    return abs(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else 0.0
