"""Schedules as tables and as CSV: what to cut, where to drill, where each end goes. Millimetres, degrees, kg, MPa.

In CSV, a spreadsheet must not take a text for a formula [OWASP, "CSV Injection"]: cells that begin with = + - @ (also
as full-width letters), a tab or a line break are run by Excel, LibreOffice and Google Sheets. They get an apostrophe,
which tells a spreadsheet that what follows is text.
"""

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from math import ceil, isnan, log, pi

import numpy as np

from rodshell.arrays import Floats
from rodshell.figures.form import Meeting, Stiffness
from rodshell.figures.loads import LoadedShell
from rodshell.figures.records import Ends, printable
from rodshell.geometry.frames import unit
from rodshell.output.grid import GridRod, joints_of, lies_flat, node_stations, rods_of
from rodshell.results import Archive, Results
from rodshell.results.archive import made_once
from rodshell.results.states import POPPED
from rodshell.results.wording import FINEST, Rounding, rounding_of
from rodshell.rods.supports import finals_first

Rows = list[list[str]]
Table = tuple[list[str], Rows]
UNITS = {
    "Nm2": "N m\N{SUPERSCRIPT TWO}",
    "mm": "mm",
    "kg": "kg",
    "MPa": "MPa",
    "deg": "\N{DEGREE SIGN}",
    "N": "N",
    "Nm": "N m",
}
UNKNOWN = np.full(3, np.nan)  # tangent
GROWTH = 1.3  # of EI along a segment at most: half way a size that is linear, a root of EI, is less by .8 % in EI
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


def rods_table(archive: Archive, *, brief: bool = False) -> Table:
    """One row a rod; `joints_from_cut_end_mm` lists every joint (ends: 0, 1).

    Splices and joints are measured from the cut end of the rod's start, as on the strips.

    Bending is that of the final shape; in columns named `pop_up` it is the worst of all shapes of the deployment.

    Args:
        brief: only the columns that have room on a sheet.
    """
    final, mm = archive.final, rounding_of(archive.results).mm
    columns: list[tuple[str, bool, Callable[[GridRod], str]]] = [
        ("id", True, lambda rod: rod.id),
        ("family", False, lambda rod: rod.family),
        ("layer", True, lambda rod: "" if rod.record.layer is None else str(rod.record.layer)),
        ("offset_mm", False, lambda rod: mm(rod.record.offset)),
        ("start_mm", False, lambda rod: mm(rod.record.start)),
        ("end_mm", False, lambda rod: mm(rod.record.end)),
        ("length_mm", True, lambda rod: mm(rod.length)),
        ("cut_length_mm", True, lambda rod: mm(rod.cut_length)),
        ("mass_kg", True, lambda rod: _significant(rod.record.mass)),
        ("joints", True, lambda rod: str(len(rod.joints))),
        ("min_radius_mm", True, lambda rod: _significant(rod.record.min_radius, 1e3)),
        ("max_normal_curvature_per_m", False, lambda rod: _significant(rod.record.normal_curvature)),
        ("max_geodesic_curvature_per_m", False, lambda rod: _significant(rod.record.geodesic_curvature)),
        ("max_twist_deg_per_m", False, lambda rod: _significant(rod.record.twist_rate, 180 / pi)),
        ("max_strain", True, lambda rod: _number(rod.record.max_strain, 6)),
        ("max_stress_MPa", True, lambda rod: _mpa(rod.record.max_stress)),
        ("max_torsion_stress_MPa", False, lambda rod: _mpa(rod.record.torsion_stress)),
        ("max_stress_pop_up_MPa", True, lambda rod: _mpa(rod.record.pop_up.max_stress if rod.record.pop_up else None)),
        ("utilisation_pop_up", True, lambda rod: _number(_utilisation(rod), 3)),
        ("splices_from_cut_end_mm", True, lambda rod: "; ".join(mm(rod.from_cut_end(at)) for at in rod.record.splices)),
        ("second_laths_mm", True, lambda rod: "; ".join(mm(stop - start) for start, stop in rod.laths)),
        (
            "second_laths_splices_from_cut_end_mm",
            True,
            lambda rod: "; ".join(mm(rod.from_cut_end(at)) for at in _on(rod)),
        ),
        *_ends(mm, "flat", 2, lambda rod: rod.flat if lies_flat(archive) else None),
        ("final_state", False, lambda rod: final or "" if len(rod.nodes) else ""),
        *_ends(
            mm, "final", 3, lambda rod: archive.states[final][rod.nodes[[0, -1]]] if final and len(rod.nodes) else None
        ),
        ("joints_from_cut_end_mm", False, lambda rod: _joints_at(rod, mm)),
    ]
    chosen = [column for column in columns if column[1] or not brief]
    rows = [[cell(rod) for _, _, cell in chosen] for rod in rods_of(archive)]
    return _pruned(([name for name, _, _ in chosen], rows), brief)


def sections_table(archive: Archive) -> Table:
    """One row a segment of a rod whose section changes: its EI at both ends, and the length of the section that changes
    or the number of laths on each other.

    EI is linear between stations, sizes are not: segments are so short that a rod built with sizes that are linear
    between them has its EI within 1 %. They are measured from the cut end of the rod's start; allowances have the
    section of their end.
    """
    mm, known = rounding_of(archive.results).mm, archive.results.rod
    unchanged = None if known is None else known.EI if known.EI is not None else known.EI1
    columns = ["rod", "varies", "from_mm", "to_mm", "EI_from_Nm2", "EI_to_Nm2"]
    columns += ["size_from_mm", "size_to_mm", "laths"]
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
            row = [rod.id, along.varies or "", mm(stops[k]), mm(stops[k + 1]), *stiffness, *cut, laths]
            rows.append(row)
    return columns, rows


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


def joints_table(archive: Archive, *, brief: bool = False) -> Table:
    """One row a joint: where it is on both rods, in plan and in space, the angle between them, and the upper rod.

    The angle runs from the direction of rod a to that of rod b, 0 to 180 degrees, by the polylines.

    Args:
        brief: only the columns that have room on a sheet.
    """
    columns, rows = _all_of_joints(archive)
    kept = [k for k, name in enumerate(columns) if not (brief and name in _NOT_BRIEF)]
    return [columns[k] for k in kept], [[row[k] for k in kept] for row in rows]


@made_once
def _all_of_joints(archive: Archive) -> Table:
    """All columns. Each entry of `columns` is a name and what it says of a joint: more may be added there."""
    rods, final, mm = rods_of(archive), archive.final, rounding_of(archive.results).mm
    placed = [_joints_in_space(archive, rod, final) for rod in rods]
    joints, is_flat = joints_of(rods), lies_flat(archive)
    in_space = [(placed[i].get(rods[j].id), placed[j].get(rods[i].id)) for i, j in (joint.rods for joint in joints)]
    along = [rods[k].heading(at) for joint in joints for k, at in zip(joint.rods, joint.at, strict=True)]
    flats = _degrees(*np.array(along).reshape(-1, 2, 2).transpose(1, 0, 2))
    tangents = np.array([[UNKNOWN if on is None else on[1] for on in pair] for pair in in_space]).reshape(-1, 2, 3)
    angles = _degrees(tangents[:, 0], tangents[:, 1])
    loads = _joint_loads(archive, final)
    rows, columns = list[list[str]](), dict[str, str]()
    for joint, (on_a, _), flat, angle in zip(joints, in_space, flats.tolist(), angles.tolist(), strict=True):
        a, b = (rods[k] for k in joint.rods)
        x, y = a.point(joint.at[0])
        space = map(mm, on_a[0]) if on_a else ("", "", "")
        columns = {
            "id": joint.id,
            "rod_a": a.id,
            "rod_b": b.id,
            "at_a_from_cut_end_mm": mm(a.from_cut_end(joint.at[0])),
            "at_b_from_cut_end_mm": mm(b.from_cut_end(joint.at[1])),
            "over": joint.over(rods),
            "flat_x_mm": mm(x) if is_flat else "",
            "flat_y_mm": mm(y) if is_flat else "",
            "final_state": (final or "") if on_a else "",
            **dict(zip(("final_x_mm", "final_y_mm", "final_z_mm"), space, strict=True)),
            "flat_deg": f"{flat:.2f}" if is_flat else "",
            "final_deg": "" if isnan(angle) else f"{angle:.2f}",
            "scissor_deg": "" if isnan(angle) or not is_flat else f"{round(angle - flat, 2) + 0.0:.2f}",
            **loads.get((a.id, b.id), dict.fromkeys(_LOADS, "") if loads else {}),
        }  # fmt: skip
        rows.append(list(columns.values()))
    return list(columns), rows


_LOADS = ("force_N", "normal_force_N", "shear_moment_Nm", "out_of_plane_moment_Nm")
_NOT_BRIEF = {"rod_a", "rod_b", "flat_x_mm", "flat_y_mm", "final_state", "scissor_deg", *_LOADS}


def _joint_loads(archive: Archive, final: str | None) -> dict[tuple[str, str], dict[str, str]]:
    """By the two rods: what the joint carries, as the second rod feels it."""
    loads = archive.results.joint_loads.get((final or "").removeprefix(POPPED), ())
    found = dict[tuple[str, str], dict[str, str]]()
    for load in loads:
        force = None if load.force is None else float(np.linalg.norm(np.array(load.force, dtype=float)))
        values = (force, load.normal_force, load.shear_moment, load.out_of_plane_moment)
        found[load.rods] = {name: _six(value) for name, value in zip(_LOADS, values, strict=True)}
    return found


def supports_table(archive: Archive, *, brief: bool = False) -> Table:
    """One row a rod end: its place on the final boundary, its outward direction, and its reactions.

    Args:
        brief: only the columns that have room on a sheet, and directions only where they are known.
    """
    results, mm = archive.results, rounding_of(archive.results).mm
    columns = ["id", "rod", "end", *(f"{a}_mm" for a in "xyz"), *(f"tangent_{a}" for a in "xyz")]
    columns += [f"{kind}_{a}_{unit}_{ends}" for ends in results.reactions for kind, unit in _REACTIONS for a in "xyz"]
    names = [(rod.id, end) for rod in rods_of(archive) for end in (0, 1)]
    rows = []
    for k, ((name, end), place) in enumerate(zip(names, results.boundary, strict=False)):
        row = [f"{name}.{end}", name, str(end), *map(mm, place)]
        tangent = results.end_tangents[k] if k < len(results.end_tangents) else (None, None, None)
        row += ["" if t is None else f"{round(t, 5) + 0.0:.5f}" for t in tangent]
        for held in results.reactions.values():
            row += [_six(value) for kind in (held.forces, held.moments) for value in kind[k]]
        rows.append(row)
    if brief:
        stop = 9 if results.end_tangents else 6
        columns, rows = [columns[0], *columns[3:stop]], [[row[0], *row[3:stop]] for row in rows]
    return columns, rows


_REACTIONS = (("force", "N"), ("moment", "Nm"))


def seam_meetings(results: Results) -> Iterator[tuple[str, Meeting]]:
    """Every place where rods of two patches meet, with its number: that of the seam and that along the seam."""
    for number, seam in enumerate(results.seams, start=1):
        for k, meeting in enumerate(seam.meetings, start=1):
            yield f"{number}.{k}", meeting


def seams_table(archive: Archive) -> Table:
    """One row a meeting: the two rod ends (0 start, 1 end), their place, and the sum of both rods' support forces."""
    seams, mm = archive.results.seams, rounding_of(archive.results).mm
    ends = [end for end in finals_first(seams[0].forces if seams else ()) if all(end in seam.forces for seam in seams)]
    columns = ["meeting", "first_end", "second_end", "x_mm", "y_mm", "z_mm"]
    columns += [f"{end}_f{axis}_N" for end in ends for axis in "xyz"]
    rows = [[number, *meeting.ends, *map(mm, meeting.point)] for number, meeting in seam_meetings(archive.results)]
    forces = [
        [_six(force) for end in ends for force in seam.forces[end].each[k]]
        for seam in seams
        for k in range(len(seam.meetings))
    ]
    return columns, [[*row, *of_row] for row, of_row in zip(rows, forces, strict=True)]


def bracing_table(archive: Archive, *, brief: bool = False) -> Table:
    """One row a diagonal: its length flat and in the final shape, of cables also free of stress; where loads were
    checked its axial force under each combination, tension positive, and which leave it slack.

    Args:
        brief: only the columns that have room on a sheet.
    """
    results, mm = archive.results, rounding_of(archive.results).mm
    braces = results.fabrication.bracing if results.fabrication else ()
    columns = ["from", "to", "flat_mm", "final_mm"]
    is_flat = lies_flat(archive)
    rows = [[brace.start, brace.end, mm(brace.flat) if is_flat else "", mm(brace.final)] for brace in braces]
    cables = any(brace.cut is not None for brace in braces)
    if cables:
        columns.append("cut_mm")
        rows = [[*row, mm(brace.cut)] for row, brace in zip(rows, braces, strict=True)]
    loaded = {(name, ends): shell.bracing for name, ends, shell in loaded_shells(results) if shell.bracing}
    if loaded and not brief:
        columns += [f"force_N_{ends}_{name}" for name, ends in loaded]
        rows = [[*row, *(_six(forces[k]) for forces in loaded.values())] for k, row in enumerate(rows)]
    if loaded and cables:
        columns.append("slack_under")
        slack = [
            [f"{name} ({ends})" for (name, ends), forces in loaded.items() if forces[k] == 0] for k in range(len(rows))
        ]
        rows = [[*row, "; ".join(names)] for row, names in zip(rows, slack, strict=True)]
    return columns, rows


def foundations_table(archive: Archive) -> Table:
    """One row a rod end: its place, and what its support exerts on the shell under each combination of loads, with what
    it exerts on the unloaded shell; the foundation carries the opposite.
    """
    results, mm = archive.results, rounding_of(archive.results).mm
    columns = ["id", *(f"{axis}_mm" for axis in "xyz")]
    names = [f"{rod.id}.{end}" for rod in rods_of(archive) for end in (0, 1)]
    rows = [[name, *map(mm, place)] for name, place in zip(names, results.boundary, strict=True)]
    for name, ends, shell in loaded_shells(results):
        held = {"force": ("N", shell.support_forces)}
        if np.nan_to_num(shell.support_moments).any():
            held["moment"] = ("Nm", shell.support_moments)
        columns += [f"{what}_{axis}_{unit}_{ends}_{name}" for what, (unit, _) in held.items() for axis in "xyz"]
        rows = [[*row, *(_six(value) for _, each in held.values() for value in each[k])] for k, row in enumerate(rows)]
    return columns, rows


def loaded_shells(results: Results) -> Iterator[tuple[str, Ends, LoadedShell]]:
    """Every combination of loads with each end condition, and the shell under it."""
    for name, by_ends in results.loads.items():
        for ends, shell in by_ends.items():
            yield name, ends, shell


def stock_table(archive: Archive) -> Table:
    """One row a bar of stock: its pieces, named rod.number from the datum end, those of a lath on it
    rod-2.number, and what is left of it."""
    stock = archive.results.fabrication.stock if archive.results.fabrication else None
    mm = rounding_of(archive.results).mm
    rows = [
        [str(k), "; ".join(f"{piece.piece} {mm(piece.length)}" for piece in bar.pieces), mm(bar.left)]
        for k, bar in enumerate(stock.bars if stock else (), start=1)
    ]
    return ["bar", "pieces_mm", "left_mm"], rows


def end_paths_table(archive: Archive) -> Table:
    """Where each rod end is at each stage of the deployment, and how far it moved.

    It is read by finite element programs, in which a rounded displacement is a stress: it has all digits to 0.001 mm.
    """
    mm = Rounding(FINEST).mm
    history, shares = archive.states["history"], archive.states["history_share"]
    columns = ["share", "rod", "end", *(f"{a}_mm" for a in "xyz"), *(f"u{a}_mm" for a in "xyz")]
    ends = [(rod.id, end) for rod in rods_of(archive) for end in "01"]
    nodes = np.concatenate([rod.nodes[[0, -1]] for rod in rods_of(archive)])
    points = history[:, nodes]
    rows = [
        [f"{share:.6f}", *end, *map(mm, point), *map(mm, way)]
        for share, here, moved in zip(shares.tolist(), points.tolist(), (points - points[0]).tolist(), strict=True)
        for end, point, way in zip(ends, here, moved, strict=True)
    ]
    return columns, rows


def _on(rod: GridRod) -> list[float]:
    """Splices of the laths that lie on a rod, from its start [m]."""
    along = rod.record.stiffness
    return [at for lath in along.splices for at in lath] if along is not None else []


def _joints_at(rod: GridRod, mm: Show) -> str:
    return "; ".join(
        f"{other} {mm(rod.from_cut_end(at))}" for other, at in sorted(rod.joints, key=lambda joint: joint[1])
    )


def _ends(
    mm: Show, name: str, axes: int, coordinates: Callable[[GridRod], Floats | None]
) -> list[tuple[str, bool, Callable[[GridRod], str]]]:
    """Columns of the coordinates of both ends."""

    def cell(end: int, axis: int) -> Callable[[GridRod], str]:
        def show(rod: GridRod) -> str:
            found = coordinates(rod)
            return "" if found is None else mm(found[end][axis])

        return show

    return [(f"{name}_{'xyz'[k]}{end}_mm", False, cell(end, k)) for end in (0, 1) for k in range(axes)]


def _pruned(table: Table, brief: bool) -> Table:
    """A table for paper goes without the columns that say nothing."""
    columns, rows = table
    keep = [k for k in range(len(columns)) if not brief or any(row[k] for row in rows)]
    return [columns[k] for k in keep], [[row[k] for k in keep] for row in rows]


def _joints_in_space(archive: Archive, rod: GridRod, state: str | None) -> dict[str, tuple[Floats, Floats]]:
    """Position (3,) [m] and a tangent (3,) of a rod at its joints, by the rod that is met; empty if not known."""
    if state is None or len(rod.nodes) < 2 or "flat" not in archive.states:
        return {}
    x, stations = archive.states[state][rod.nodes], node_stations(archive, rod)
    at = np.array([at for _, at in rod.joints])
    step = 0.5 * np.diff(stations).min()  # stays within the edges on both sides
    before, position, after = (
        np.column_stack([np.interp(s, stations, x[:, axis]) for axis in range(3)]) for s in (at - step, at, at + step)
    )
    return {other: (position[k], after[k] - before[k]) for k, (other, _) in enumerate(rod.joints)}


def _degrees(a: Floats, b: Floats) -> Floats:
    """(n,) angles between vectors (n, d), exact also near 0 and 180 [degrees]."""
    a, b = unit(a), unit(b)
    apart, together = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    return np.asarray(np.degrees(2.0 * np.arctan2(apart, together)))


def _mpa(value: float | None) -> str:
    return _significant(value, 1e-6)


def _significant(value: float | None, unit: float = 1.0) -> str:
    """What is weighed or computed, over a unit: four figures, never as 2.55e+04."""
    return "" if value is None else f"{float(f'{unit * value:.4g}'):.10f}".rstrip("0").rstrip(".")


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def _six(value: float | None) -> str:
    """Forces and moments, to six figures."""
    return "" if value is None or isnan(value) else f"{value:.6g}"


def _utilisation(rod: GridRod) -> float | None:
    """In all shapes, those of the deployment included."""
    return rod.record.pop_up.utilisation if rod.record.pop_up else None


# CSV

NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
RUN = frozenset("=+-@\uff1d\uff0b\uff0d\uff20")  # what a formula begins with, the last four full-width
WHOLE = re.compile(NUMBER)
FORMULA = re.compile(rf'(^[\s"]*|[;,][\s"]*(?!{NUMBER}\s*(?:[;,]|$)))(?=[{re.escape("".join(sorted(RUN)))}])')


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Rows as CSV; a number stays as it is, a text that a spreadsheet would run gets an apostrophe.

    Args:
        rows: cells; numbers are written by `str`.
    """
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([[safe_cell(str(cell)) for cell in row] for row in rows])
    return stream.getvalue()


def safe_cell(cell: str) -> str:
    """A cell that no spreadsheet takes for a formula, whether it parts cells by commas or by semicolons.

    Args:
        cell: a number or a text.
    """
    if RUN.isdisjoint(cell):
        return printable(cell)
    return cell if WHOLE.fullmatch(cell) else FORMULA.sub(r"\1'", printable(cell))
