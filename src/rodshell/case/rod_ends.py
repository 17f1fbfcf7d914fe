"""Rods given by where their ends lie flat and where they go: read from a table, or from an earlier result."""

from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.case.csv_rows import csv_rows
from rodshell.errors import InputError
from rodshell.figures.form import Stiffness
from rodshell.layout import FlatGrid, Profile, straight_rods
from rodshell.units import length_text, parse_quantity, read_unit, shown
from rodshell.validation import instance, positive

COLUMNS = (
    "flat_x0", "flat_y0", "flat_x1", "flat_y1",
    "final_x0", "final_y0", "final_z0", "final_x1", "final_y1", "final_z1",
)  # fmt: skip
MILLIMETRE = 1e-3
MOST_RODS = 10_000
LONGEST_STRETCH = 1.02  # of a rod between its final ends; a rod drawn further is a mistake in the table


@dataclass(frozen=True, eq=False)
class RodEnds:
    """Rods by both their ends, flat and popped up; two tables are equal that have the same numbers.

    Args:
        grid: m rods in the plane.
        final: (m, 2, 3), where the start and the end of each rod go [m].
        edge: longest edge of their mesh [m]; None: a sixth of the usual distance between joints.

    Raises:
        InputError: `final` does not fit `grid`, or a rod would be stretched.
    """

    grid: FlatGrid
    final: Floats
    edge: float | None = None

    def __post_init__(self) -> None:
        instance("grid", self.grid, FlatGrid)
        if self.edge is not None:
            positive("edge", self.edge, "m")
        points = np.asarray(self.final, dtype=float)
        object.__setattr__(self, "final", points)
        if points.shape != (len(self.grid.rods), 2, 3) or not np.isfinite(points).all():
            wanted = (len(self.grid.rods), 2, 3)
            raise InputError(f"final ends must be finite and of the shape {wanted}, not {points.shape}")
        distances = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
        for rod, distance in zip(self.grid.rods, distances, strict=True):
            if distance > LONGEST_STRETCH * rod.length:
                raise InputError(
                    f"rod {rod.name} is {rod.length:.4g} m long, but its final ends lie {distance:.4g} m apart: "
                    "move them closer, or give a longer rod"
                )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RodEnds):
            return NotImplemented
        same = self.grid.rods == other.grid.rods and self.edge == other.edge
        return same and np.array_equal(self.final, other.final)

    def __hash__(self) -> int:
        return hash((self.grid.rods, self.edge))

    @property
    def lengths(self) -> Floats:
        """(m,) lengths of the rods [m]."""
        return np.array([rod.length for rod in self.grid.rods])


@dataclass(frozen=True)
class ResultRods:
    """The rods of an earlier result.

    Args:
        ends: where they lie flat and popped up.
        rod, joint: what they are and what joins them, as in a case file; empty where the result does not say.
    """

    ends: RodEnds
    rod: dict[str, Any]
    joint: dict[str, Any]


def read_table(path: Path, unit: str | None) -> RodEnds:
    """The rods of a CSV table with the columns `COLUMNS` and, if it likes, `id`; coordinates in `unit`.

    A table whose columns end in _mm, as those of schedule/rods.csv do, says its unit itself. Cells are parted by
    commas, semicolons or tabs; unless by commas, a comma is a decimal point.

    Raises:
        InputError: no such file, no rods, a missing column, a cell without a finite number, an id used twice;
            no unit, or another than the columns'; rods that span less than 1 mm or more than 1 km.
    """
    try:
        scale = None if unit is None else float(read_unit(unit, "length"))
    except ValueError as reason:
        raise InputError(f"unit = {shown(unit)}: {reason}") from None
    header, rows = csv_rows(path, MOST_RODS)
    columns = _columns(path, header)
    if columns != COLUMNS:
        if scale not in (None, MILLIMETRE):
            raise InputError(f"unit = {shown(unit)}: the columns of {path} are in mm: leave it out")
        scale = MILLIMETRE
    if scale is None:
        raise InputError("unit is missing: give the unit of the table's coordinates, such as m (--unit m)")
    names, numbers = list[str](), list[list[float]]()
    for where, row in rows:
        numbers.append([parse_quantity(row[column], "number", f"{where}, {column}") for column in columns])
        names.append(row.get("id", "").strip())
    if not numbers:
        raise InputError(f"{path} has no rods: give one row for each rod under the header")
    from rodshell.targets.mesh_files import ANOTHER_UNIT, require_size  # here, as most cases have no such table

    values = np.array(numbers)
    instead = ANOTHER_UNIT if columns == COLUMNS else "check its columns, which are in mm"
    for ends in (values[:, :4].reshape(-1, 2), values[:, 4:].reshape(-1, 3)):
        require_size(path, np.ptp(ends, axis=0), scale, instead=instead)
    values *= scale
    grid = straight_rods(values[:, :4].reshape(-1, 2, 2), names=_labels(path, names))
    return RodEnds(grid, values[:, 4:].reshape(-1, 2, 3))


def _columns(path: Path, header: list[str]) -> tuple[str, ...]:
    """The `COLUMNS` as in the header: all bare, or all with _mm."""
    in_mm = tuple(f"{column}_mm" for column in COLUMNS)
    if set(in_mm) <= set(header):
        return in_mm
    for column in COLUMNS:
        if column not in header:
            near = get_close_matches(column, header[:100], n=1)
            hint = f" ({near[0]} looks like it)" if near and near[0] not in COLUMNS else ""
            raise InputError(
                f"{path}: the column {column} is missing{hint}; it needs {', '.join(COLUMNS)}, or all of them with _mm"
            )
    return COLUMNS


def _labels(path: Path, names: list[str]) -> list[str] | None:
    if not any(names):
        return None
    known = set[str]()
    for k, name in enumerate(names):
        if not name or name in known:
            fault = f"the id {shown(name)} occurs twice" if name else f"rod {k + 1} has no id"
            raise InputError(f"{path}: {fault}: give each rod its own, or leave the column out")
        known.add(name)
    return names


def read_result(folder: Path) -> ResultRods:
    """The rods of an earlier result: their flat ends, where its shell has them, what they are and their joints.

    Raises:
        OutputError: the folder holds no result that can be read.
        InputError: the result has no rods, or no shell in space; its rods lie in two layers, or have linkers of their
            own.
    """
    from rodshell.output.grid import rods_of
    from rodshell.results.archive import read
    from rodshell.results.states import shells_among

    archive = read(folder)
    results = archive.results
    if results.patches:
        raise InputError(
            f"{folder} holds patches, whose flat grids lie side by side: pop up a table of one patch's rods"
        )
    apart = results.drape.eccentricity if results.drape else None
    if apart:
        raise InputError(
            f"{folder} holds rods in two layers {length_text(apart)} apart, and popup joins its rods at one point: "
            "see the result's own deployment"
        )
    joint = results.joint.plain() if results.joint else {}
    kept = results.rod.plain() if results.rod else {}
    rod = {key: table for key, table in kept.items() if key in ("section", "material")}
    if "rod" in joint:
        raise InputError(
            f"the joints in {folder} are linkers of another rod, which popup cannot take over: use "
            "rodshell.pop_up_table(..., joint=...) in Python"
        )
    try:
        rods = rods_of(archive)
        shell = archive.states[shells_among(archive.states)[0]]
        flat = np.array([rod.flat for rod in rods]).reshape(-1, 2, 2)
        final = np.array([shell[rod.nodes[[0, -1]]] for rod in rods]).reshape(-1, 2, 3)
    except (StopIteration, KeyError, IndexError, TypeError, ValueError):
        raise InputError(f"the result in {folder} lacks its rods or its states: run it again") from None
    if not rods:
        raise InputError(f"the result in {folder} has no rods")
    if bent := next((rod.id for rod in rods if len(rod.course) > 2 or rod.record.rest_curvature), ""):
        raise InputError(
            f"the rods in {folder} do not lie straight in the plane (the first: {bent}), as those that popup takes: "
            f"run its case again (rodshell form {folder / 'case.toml'})"
        )
    edge = results.layout.edge if results.layout else None
    grid = straight_rods(flat, names=[rod.id for rod in rods])
    profiles = [_profile(rod.record.stiffness, rod.length) for rod in rods]
    return ResultRods(RodEnds(grid.with_profiles(profiles), final, edge), rod, joint)


def _profile(known: Stiffness | None, length: float) -> Profile | None:
    """How the section of a rod of this length [m] changes along it."""
    if known is None:
        return None
    inner = [at / length for at in known.at[1:-1]]
    return Profile((0.0, *inner, 1.0), known.factors, known.varies or "size")
