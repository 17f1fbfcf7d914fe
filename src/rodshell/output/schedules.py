"""Schedules as tables and as CSV: what to cut, where to drill, where each end goes. Millimetres, degrees, kg, MPa.

In CSV, a spreadsheet must not take a text for a formula [OWASP, "CSV Injection"]: cells that begin with = + - @ (also
as full-width letters), a tab or a line break are run by Excel, LibreOffice and Google Sheets. They get an apostrophe,
which tells a spreadsheet that what follows is text.
"""

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import zip_longest
from math import ceil, isnan, log, pi

import numpy as np

from rodshell.arrays import Floats
from rodshell.figures.checks import JointLoad
from rodshell.figures.fabrication import Bar
from rodshell.figures.form import Bent, Meeting, Stiffness
from rodshell.figures.records import printable
from rodshell.geometry.frames import unit
from rodshell.output.blanks import boards_of
from rodshell.output.grid import (
    GridJoint,
    GridRod,
    beams_along_edge,
    end_nodes,
    joints_of,
    lies_flat,
    node_stations,
    rods_of,
)
from rodshell.results import Archive, Results
from rodshell.results.archive import made_once
from rodshell.results.laths import laths_on
from rodshell.results.states import POPPED
from rodshell.results.summary import rod_text
from rodshell.results.wording import FINEST, Rounding, rounding_of
from rodshell.rods.supports import finals_first

Table = dict[str, list[str]]  # the cells of each column, from row to row
UNITS = {"Nm2": "N m\N{SUPERSCRIPT TWO}", "deg": "\N{DEGREE SIGN}", "Nm": "N m"}
UNITS |= {unit: unit for unit in ("mm", "kg", "MPa", "N")}
UNKNOWN = (np.nan, np.nan, np.nan)  # force
FINE, OF_SHORTENING = 0.1, 20.0  # mm, of cables whose shortening is under so many steps of the other lengths
GROWTH = 1.3  # of EI along a segment at most: half way a size that is linear, a root of EI, is less by .8 % in EI
NOT_SAID = "to be given"  # of what a workshop has to know and rodshell does not decide
Show = Callable[[float | None], str]


def head(column: str) -> tuple[str, str]:
    """A column of a schedule as people read it: "cut_length_mm" is ("cut length", "mm"); "" where it has no unit."""
    words = column.split("_")
    unit = next((word for word in words[1:] if word in UNITS), "")
    name = " ".join(word for word in words if word != unit)
    return (f"angle {name}" if unit == "deg" else name), UNITS.get(unit, "")


def heading(column: str) -> str:
    """The same in one line: "cut length [mm]"."""
    name, unit = head(column)
    return f"{name} [{unit}]" if unit else name


def rods_table(archive: Archive) -> Table:
    """One row a rod; `joints_from_cut_end_mm` lists every joint (ends: 0, 1).

    Splices and joints are measured from the cut end of the rod's start, as on the strips.

    `boards_mm` are length x width of the board that each piece of a rod that is curved at rest is cut from.
    Bending is that of the final shape; in columns named `pop_up` it is the worst of all shapes of the deployment.
    """
    rods, final, mm = rods_of(archive), archive.final, rounding_of(archive.results).mm
    columns: dict[str, Callable[[GridRod], str]] = {
        "id": lambda rod: rod.id,
        "family": lambda rod: rod.family,
        "layer": lambda rod: "" if rod.record.layer is None else str(rod.record.layer),
        "offset_mm": lambda rod: mm(rod.record.offset),
        "start_mm": lambda rod: mm(rod.record.start),
        "end_mm": lambda rod: mm(rod.record.end),
        "length_mm": lambda rod: mm(rod.length),
        "cut_length_mm": lambda rod: mm(rod.cut_length),
        "mass_kg": lambda rod: _significant(rod.record.mass),
        "joints": lambda rod: str(len(rod.joints)),
        "min_radius_mm": lambda rod: _significant(rod.record.min_radius, 1e3),
        "max_normal_curvature_per_m": lambda rod: _significant(rod.record.normal_curvature),
        "max_geodesic_curvature_per_m": lambda rod: _significant(rod.record.geodesic_curvature),
        "max_twist_deg_per_m": lambda rod: _significant(rod.record.twist_rate, 180 / pi),
        "max_strain": lambda rod: _number(rod.record.max_strain, 6),
        "max_stress_MPa": lambda rod: _significant(rod.record.max_stress, 1e-6),
        "max_torsion_stress_MPa": lambda rod: _significant(rod.record.torsion_stress, 1e-6),
        "max_stress_pop_up_MPa": lambda rod: _significant((rod.record.pop_up or Bent()).max_stress, 1e-6),
        "utilisation_pop_up": lambda rod: _number((rod.record.pop_up or Bent()).utilisation, 3),
        "splices_from_cut_end_mm": lambda rod: "; ".join(mm(rod.from_cut_end(at)) for at in rod.record.splices),
        "second_laths_mm": lambda rod: "; ".join(mm(stop - start) for start, stop in laths_on(rod.record)),
        "second_laths_splices_from_cut_end_mm": lambda rod: "; ".join(mm(rod.from_cut_end(at)) for at in _on(rod)),
    }
    if any(rod.record.rest_curvature for rod in rods):
        boards = {rod.id: boards_of(archive, rod) for rod in rods}
        columns["boards_mm"] = lambda rod: "; ".join(f"{mm(long)} x {mm(wide)}" for long, wide in boards[rod.id])
    table = {name: [cell(rod) for rod in rods] for name, cell in columns.items()}
    for end in (0, 1):
        table |= _by_axis("flat_", f"{end}_mm", [rod.flat[end] for rod in rods], mm, "xy")
    table["final_state"] = [final or "" if len(rod.nodes) else "" for rod in rods]
    for end in (0, 1):
        points = [archive.states[final][rod.nodes[-end]] if final and len(rod.nodes) else None for rod in rods]
        table |= _by_axis("final_", f"{end}_mm", points, mm)
    table["joints_from_cut_end_mm"] = [_joints_at(rod, mm) for rod in rods]
    return _of_a_flat_grid(table, archive)


def _of_a_flat_grid(table: Table, archive: Archive) -> Table:
    """What is said of the flat grid is left empty where there is none, as the shell is assembled in place."""
    if lies_flat(archive):
        return table
    flat = {name for name in table if name.startswith("flat_")} | {"scissor_deg"}
    return {name: [""] * len(cells) if name in flat else cells for name, cells in table.items()}


def sections_table(archive: Archive) -> Table:
    """One row a segment of a rod whose section changes: its EI at both ends, and the length of the section that changes
    or the number of laths on each other.

    EI is linear between stations, sizes are not: segments are so short that a rod built with sizes that are linear
    between them has its EI within 1 %. They are measured from the cut end of the rod's start; allowances have the
    section of their end.
    """
    mm, known = rounding_of(archive.results).mm, archive.results.rod
    unchanged = None if known is None else known.EI if known.EI is not None else known.EI1
    columns = ("rod", "varies", "from_mm", "to_mm", "EI_from_Nm2", "EI_to_Nm2", "size_from_mm", "size_to_mm", "laths")
    rows = []
    for rod in rods_of(archive):
        along = rod.record.stiffness
        if along is None:
            continue
        at, every, cuts = _segments(along)
        stops = [rod.from_cut_end(place) for place in at]
        stops[0], stops[-1] = 0.0, rod.cut_length
        for k in range(len(stops) - 1):
            if at[k] == at[k + 1]:
                continue
            factors, sizes = every[k : k + 2], cuts[k : k + 2]
            stiffness = ["" if unchanged is None else _six(factor * unchanged) for factor in factors]
            cut = [_significant(size, 1e3) for size in sizes] or ["", ""]
            laths = f"{factors[0]:g}" if along.varies == "laths" else ""
            rows.append([rod.id, along.varies or "", mm(stops[k]), mm(stops[k + 1]), *stiffness, *cut, laths])
    return _in_columns(columns, rows)


def _segments(along: Stiffness) -> tuple[list[float], list[float], list[float]]:
    """Stations [m], factors on EI and sizes [m], with further ones between: a size is a power of EI."""
    if not along.sizes or min(*along.factors, *along.sizes) <= 0:
        return list(along.at), list(along.factors), list(along.sizes)
    found = [(along.at[0], along.factors[0], along.sizes[0])]
    for place, factor, size in zip(along.at[1:], along.factors[1:], along.sizes[1:], strict=True):
        (start, first, before), growth = found[-1], factor / found[-1][1]
        bent = place > start and abs(size / before - growth) > 1e-9
        pieces = ceil(abs(log(growth)) / log(GROWTH)) if bent else 1
        for share in (j / pieces for j in range(1, pieces)):
            along_it = (growth**share - 1) / (growth - 1)
            found.append((start + along_it * (place - start), first * growth**share, before * (size / before) ** share))
        found.append((place, factor, size))
    at, factors, sizes = (list(column) for column in zip(*found, strict=True))
    return at, factors, sizes


@made_once
def joints_table(archive: Archive) -> Table:
    """One row a joint: where it is on both rods, in plan and in space, the angle between them, and the upper rod.

    The angle runs from the direction of rod a to that of rod b, 0 to 180 degrees, by the polylines.
    """
    rods, final, mm = rods_of(archive), archive.final, rounding_of(archive.results).mm
    joints = joints_of(rods)
    pairs = [(rods[i], rods[j]) for i, j in (joint.rods for joint in joints)]
    ways = np.array([[rods[k].heading(s) for k, s in zip(joint.rods, joint.at, strict=True)] for joint in joints])
    ways = ways.reshape(-1, 2, 2)
    points, tangents = _in_space(archive, rods, joints, final)
    flats, angles = _degrees(ways[:, 0], ways[:, 1]), _degrees(tangents[:, 0], tangents[:, 1])
    known = np.isfinite(points[:, 0, 0]).tolist()
    at = [[rods[k].from_cut_end(s) for k, s in zip(joint.rods, joint.at, strict=True)] for joint in joints]
    table = {
        "id": [joint.id for joint in joints],
        **_in_columns(("rod_a", "rod_b"), [(a.id, b.id) for a, b in pairs]),
        **_by_axis("at_", "_from_cut_end_mm", at, mm, "ab"),
        "over": [joint.over(rods) for joint in joints],
        **_by_axis("flat_", "_mm", [rods[joint.rods[0]].point(joint.at[0]) for joint in joints], mm, "xy"),
        "final_state": [(final or "") if there else "" for there in known],
        **_by_axis("final_", "_mm", points[:, 0].tolist(), mm),
        "flat_deg": [_number(angle, 2) for angle in flats.tolist()],
        "final_deg": [_number(angle, 2) for angle in angles.tolist()],
        "scissor_deg": [_number(angle, 2) for angle in (angles - flats).tolist()],
    }
    slots = {(rod.id, on.other): on.slot for rod in rods for on in rod.record.joints if on.slot}
    if slots:
        table["slot_mm"] = [mm(slots.get((a.id, b.id))) for a, b in pairs]
    loads = {load.rods: load for load in archive.results.joint_loads.get((final or "").removeprefix(POPPED), ())}
    if loads:
        joint_loads = [loads.get((a.id, b.id), JointLoad(rods=(a.id, b.id))) for a, b in pairs]
        forces = np.array([load.force or UNKNOWN for load in joint_loads], dtype=float).reshape(-1, 3)
        table["force_N"] = [_six(force) for force in np.linalg.norm(forces, axis=1).tolist()]
        table["normal_force_N"] = [_six(load.normal_force) for load in joint_loads]
        table["shear_moment_Nm"] = [_six(load.shear_moment) for load in joint_loads]
        table["out_of_plane_moment_Nm"] = [_six(load.out_of_plane_moment) for load in joint_loads]
    return _of_a_flat_grid(table, archive)


def supports_table(archive: Archive) -> Table:
    """One row a rod end: its place on the final boundary, its outward direction, and its reactions."""
    results, mm = archive.results, rounding_of(archive.results).mm
    names = [(rod.id, end) for rod in rods_of(archive) for end in "01"][: len(results.boundary)]
    table = {"id": [f"{rod}.{end}" for rod, end in names]} | _in_columns(("rod", "end"), names)
    table |= _by_axis("", "_mm", results.boundary, mm)
    tangents = results.end_tangents[: len(names)] or [None] * len(names)
    table |= _by_axis("tangent_", "", tangents, lambda share: _number(share, 5))
    for ends, held in results.reactions.items():
        table |= _by_axis("force_", f"_N_{ends}", held.forces[: len(names)], _six)
        table |= _by_axis("moment_", f"_Nm_{ends}", held.moments[: len(names)], _six)
    return table


def seam_meetings(results: Results) -> Iterator[tuple[str, Meeting]]:
    """Every place where rods of two patches meet, with its number: that of the seam and that along the seam."""
    for number, seam in enumerate(results.seams, start=1):
        for k, meeting in enumerate(seam.meetings, start=1):
            yield f"{number}.{k}", meeting


def seams_table(archive: Archive) -> Table:
    """One row a meeting: the two rod ends (0 start, 1 end), their place, and the sum of both rods' support forces."""
    seams, mm = archive.results.seams, rounding_of(archive.results).mm
    meetings = list(seam_meetings(archive.results))
    table = {"meeting": [number for number, _ in meetings]}
    table |= _in_columns(("first_end", "second_end"), [meeting.ends for _, meeting in meetings])
    table |= _by_axis("", "_mm", [meeting.point for _, meeting in meetings], mm)
    for ends in finals_first(seams[0].forces if seams else ()):
        if all(ends in seam.forces for seam in seams):
            forces = [force for seam in seams for force in seam.forces[ends].each]
            table |= _by_axis(f"{ends}_f", "_N", forces, _six)
    return table


def edge_beams_table(archive: Archive) -> Table:
    """One row a rod end on a beam: how far along it, from rod end to rod end, and where that is."""
    mm, columns = rounding_of(archive.results).mm, ("beam", "kind", "rod_end", "along_mm", "x_mm", "y_mm", "z_mm", "of")
    rows = []
    for beam, points in beams_along_edge(archive):
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        ends = (*beam.ends, *beam.ends[: len(points) - len(beam.ends)])
        for end, at, point in zip(ends, along.tolist(), points.tolist(), strict=True):
            rows.append(
                [beam.name or "", beam.kind or "", end, *map(mm, (at, *point)), rod_text(beam.rod) if beam.rod else ""]
            )
    return _in_columns(columns, rows)


def bracing_table(archive: Archive) -> Table:
    """One row a diagonal: its length flat and in the final shape, of cables also free of stress; where loads were
    checked the force that a cable is to be stressed to, its axial force under each combination, tension positive, and
    which leave it slack."""
    results, rounding = archive.results, rounding_of(archive.results)
    mm, braces = rounding.mm, results.bracing
    table = {
        "from": [brace.start for brace in braces],
        "to": [brace.end for brace in braces],
        "flat_mm": [mm(brace.flat) for brace in braces],
        "final_mm": [mm(brace.final) for brace in braces],
    }
    cables = any(brace.cut is not None for brace in braces)
    if cables:
        shortened = [(brace.final or 0.0) - brace.cut for brace in braces if brace.cut is not None]
        fine = 1e3 * min(shortened) < OF_SHORTENING * rounding.step
        to_cut = Rounding(min(FINE, rounding.step)) if fine else rounding
        table["cut_mm"] = [to_cut.mm(brace.cut) for brace in braces]
        before = {ends: shell.bracing_unloaded for _, ends, shell in results.loaded_shells() if shell.bracing_unloaded}
        table |= {f"stress_to_N_{ends}": [_six(force) for force in forces] for ends, forces in before.items()}
    loaded = {(name, ends): shell.bracing for name, ends, shell in results.loaded_shells() if shell.bracing}
    for (name, ends), forces in loaded.items():
        table[f"force_N_{ends}_{name}"] = [_six(force) for force in forces]
    if loaded and cables:
        slack = [[f"{name} ({ends})" for (name, ends), forces in loaded.items() if forces[k] == 0]
                 for k in range(len(braces))]  # fmt: skip
        table["slack_under"] = ["; ".join(names) for names in slack]
    return _of_a_flat_grid(table, archive)


def foundations_table(archive: Archive) -> Table:
    """One row a rod end: its place, and what its support exerts on the shell under each combination of loads, with what
    it exerts on the unloaded shell; the foundation carries the opposite."""
    results = archive.results
    table = {"id": results.rod_ends}
    table |= _by_axis("", "_mm", results.boundary, rounding_of(results).mm)
    for name, ends, shell in results.loaded_shells():
        table |= _by_axis("force_", f"_N_{ends}_{name}", shell.support_forces, _six)
        if np.nan_to_num(shell.support_moments).any():
            table |= _by_axis("moment_", f"_Nm_{ends}_{name}", shell.support_moments, _six)
    return table


def splices_table(archive: Archive) -> Table:
    """One row a splice: where it is, between which joints, and the bending moment and the axial force, tension
    positive, that it passes on in the final shape without loads, where the rod has one section."""
    mm, rows = rounding_of(archive.results).mm, list[list[str]]()
    for rod in rods_of(archive):
        met, record = sorted(rod.joints, key=lambda joint: joint[1]), rod.record
        passed = zip_longest(record.splices, record.splice_moments, record.splice_forces)
        for k, (at, moment, force) in enumerate(passed, start=1):
            before = [other for other, there in met if there < at][-1:]
            after = [other for other, there in met if there > at][:1]
            between = " and ".join(f"{rod.id}/{other}" for other in (*before, *after))
            rows.append([f"{rod.id}.{k}", mm(rod.from_cut_end(at)), between, _six(moment), _six(force), NOT_SAID])
    columns = ("after_piece", "from_cut_end_mm", "between_joints", "moment_Nm", "axial_force_N", "type")
    return _in_columns(columns, rows)


def stock_table(archive: Archive) -> Table:
    """One row for equal bars: their numbers, the lengths cut from each in their order, the offcut, and the marks of the
    pieces, bar by bar. A piece is named rod.number from the datum end, that of a lath on it rod-2.number."""
    made, mm, rows = archive.results.fabrication, rounding_of(archive.results).mm, list[list[str]]()
    first, patterns = 1, dict[tuple[str, ...], list[Bar]]()
    for bar in made.stock.bars if made and made.stock else ():
        patterns.setdefault(tuple(mm(piece.length) for piece in bar.pieces), []).append(bar)
    for lengths, bars in patterns.items():
        last = first + len(bars) - 1
        marks = (" + ".join(piece.piece for piece in bar.pieces) for bar in bars)
        numbers = str(first) if first == last else f"{first} to {last}"
        cut = (mm(made.stock_length), "; ".join(lengths), mm(made.kerf), mm(bars[0].left)) if made else ()
        rows.append([numbers, str(len(bars)), *cut, "; ".join(marks)])
        first = last + 1
    return _in_columns(("bars", "times", "stock_mm", "pieces_mm", "saw_cut_mm", "offcut_mm", "marks"), rows)


def end_paths_table(archive: Archive) -> Table:
    """Where each rod end is at each stage of the deployment, and how far it moved.

    It is read by finite element programs, in which a rounded displacement is a stress: it has all digits to 0.001 mm.
    """
    mm, shares = Rounding(FINEST).mm, archive.states["history_share"].tolist()
    ends = [(rod.id, end) for rod in rods_of(archive) for end in "01"]
    points = archive.states["history"][:, end_nodes(rods_of(archive))]
    table = _in_columns(("share", "rod", "end"), [(f"{share:.6f}", *end) for share in shares for end in ends])
    table |= _by_axis("", "_mm", points.reshape(-1, 3).tolist(), mm)
    return table | _by_axis("u", "_mm", (points - points[0]).reshape(-1, 3).tolist(), mm)


def _by_axis(
    before: str, after: str, vectors: Iterable[Sequence[float | None] | Floats | None], show: Show, axes: str = "xyz"
) -> Table:
    """A column for each component of vectors, named by its axis; None: not known."""
    rows = [[""] * len(axes) if vector is None else [*map(show, vector)] for vector in vectors]
    return _in_columns([before + axis + after for axis in axes], rows)


def _in_columns(names: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    columns = list(zip(*rows, strict=True)) or [()] * len(names)
    return {name: list(cells) for name, cells in zip(names, columns, strict=True)}


def _on(rod: GridRod) -> list[float]:
    """Splices of the laths that lie on a rod, from its start [m]."""
    along = rod.record.stiffness
    return [at for lath in along.splices for at in lath] if along is not None else []


def _joints_at(rod: GridRod, mm: Show) -> str:
    return "; ".join(
        f"{other} {mm(rod.from_cut_end(at))}" for other, at in sorted(rod.joints, key=lambda joint: joint[1])
    )


def _in_space(
    archive: Archive, rods: Sequence[GridRod], joints: Sequence[GridJoint], state: str | None
) -> tuple[Floats, Floats]:
    """Position (c, 2, 3) [m] of both rods at each joint, and a tangent (c, 2, 3); NaN where they are not known."""
    on = np.array([joint.rods for joint in joints], dtype=np.intp).reshape(-1, 2)
    at = np.array([joint.at for joint in joints]).reshape(-1, 2)
    points, tangents = np.full((2, len(joints), 2, 3), np.nan)
    for k, rod in enumerate(rods if state in archive.states and "flat" in archive.states else ()):
        x, stations = archive.states[state or ""][rod.nodes], node_stations(archive, rod)
        if len(x):
            here, step = on == k, 0.5 * np.diff(stations).min()  # stays within the edges on both sides
            before, points[here], after = (
                np.column_stack([np.interp(s, stations, x[:, axis]) for axis in range(3)])
                for s in (at[here] - step, at[here], at[here] + step)
            )
            tangents[here] = after - before
    return points, tangents


def _degrees(a: Floats, b: Floats) -> Floats:
    """(n,) angles between vectors (n, d), exact also near 0 and 180 [degrees]."""
    a, b = unit(a), unit(b)
    apart, together = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    return np.asarray(np.degrees(2.0 * np.arctan2(apart, together)))


def _significant(value: float | None, unit: float = 1.0) -> str:
    """What is weighed or computed, over a unit: four figures, never as 2.55e+04."""
    return "" if value is None else f"{float(f'{unit * value:.4g}'):.10f}".rstrip("0").rstrip(".")


def _number(value: float | None, digits: int) -> str:
    """With so many decimals, and no minus before a zero."""
    return "" if value is None or isnan(value) else f"{round(value, digits) + 0.0:.{digits}f}"


def _six(value: float | None) -> str:
    """Forces and moments, to six figures."""
    return "" if value is None or isnan(value) else f"{value:.6g}"


# Where they are shown


@dataclass(frozen=True)
class Schedule:
    """A schedule: all of it in its file, and the columns for which sheets and pages have room.

    Args:
        wide: patterns of the columns that only the file has.
        optional: patterns of those that only the file has where they say nothing.
        known: whether a result has it.
    """

    title: str
    table: Callable[[Archive], Table]
    wide: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    known: Callable[[Archive], bool] = lambda archive: True

    def brief(self, archive: Archive) -> Table:
        """The columns that have room on a sheet."""

        def shown(name: str, cells: list[str]) -> bool:
            left_out = self.wide if any(cells) else (*self.wide, *self.optional)
            return not any(fnmatchcase(name, pattern) for pattern in left_out)

        return {name: cells for name, cells in self.table(archive).items() if shown(name, cells)}


SCHEDULES = {
    "rods": Schedule(
        "Rods", rods_table, ("family", "offset_mm", "start_mm", "end_mm", "max_*_curvature_per_m", "max_twist_*",
        "max_torsion_*", "flat_*", "final_*", "joints_from_*"), ("*",),
    ),
    "joints": Schedule("Joints", joints_table, ("rod_?", "flat_?_mm", "final_state", "scissor_deg", "*_N", "*_Nm")),
    "supports": Schedule("Supports", supports_table, ("rod", "end", "force_*", "moment_*"), ("tangent_*",)),
    "bracing": Schedule("Bracing", bracing_table, ("force_*",), known=lambda archive: bool(archive.results.bracing)),
    "edge_beams": Schedule(
        "Edge beams", edge_beams_table, ("of",), known=lambda archive: bool(archive.results.edge_beams)
    ),
    "foundations": Schedule("Foundations", foundations_table, known=lambda archive: bool(archive.results.loads)),
    "stock": Schedule(
        "Cutting list", stock_table,
        known=lambda archive: bool(archive.results.fabrication and archive.results.fabrication.stock),
    ),
    "splices": Schedule(
        "Splices, moments and forces without loads", splices_table,
        known=lambda archive: any(rod.splices for rod in archive.results.rods),
    ),
    "sections": Schedule(
        "Sections along the rods", sections_table,
        known=lambda archive: any(rod.stiffness for rod in archive.results.rods),
    ),
    "seams": Schedule("Seams", seams_table, known=lambda archive: bool(archive.results.seams)),
    "end_paths": Schedule("End paths", end_paths_table, known=lambda archive: "history" in archive.states),
}  # fmt: skip


# CSV

NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
RUN = frozenset("=+-@\uff1d\uff0b\uff0d\uff20")  # what a formula begins with, the last four full-width
WHOLE = re.compile(NUMBER)
FORMULA = re.compile(rf'(^[\s"]*|[;,][\s"]*(?!{NUMBER}\s*(?:[;,]|$)))(?=[{re.escape("".join(sorted(RUN)))}])')


def table_csv(table: Table) -> str:
    """A schedule as CSV."""
    return csv_text([list(table), *zip(*table.values(), strict=True)])


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Rows as CSV; a number stays as `str` writes it, a text that a spreadsheet would run gets an apostrophe."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([[safe_cell(str(cell)) for cell in row] for row in rows])
    return stream.getvalue()


def safe_cell(cell: str) -> str:
    """A cell that no spreadsheet takes for a formula, whether it parts cells by commas or by semicolons."""
    if RUN.isdisjoint(cell):
        return printable(cell)
    return cell if WHOLE.fullmatch(cell) else FORMULA.sub(r"\1'", printable(cell))
