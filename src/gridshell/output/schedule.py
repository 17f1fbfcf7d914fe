"""Schedules of rods and joints as CSV: what to cut, where to drill, where each end goes. Millimetres."""

import csv
import io
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from gridshell.output.archive import Archive
from gridshell.output.rods import RodRecord, joints_of, rods_of

Floats = NDArray[np.float64]

_ROD_COLUMNS = (
    "id", "family", "offset_mm", "start_mm", "end_mm", "length_mm", "joints",
    "flat_x0_mm", "flat_y0_mm", "flat_x1_mm", "flat_y1_mm", "final_state",
    "final_x0_mm", "final_y0_mm", "final_z0_mm", "final_x1_mm", "final_y1_mm", "final_z1_mm", "joints_at_mm",
)  # fmt: skip
_JOINT_COLUMNS = (
    "id", "rod_a", "rod_b", "at_a_mm", "at_b_mm", "flat_x_mm", "flat_y_mm", "final_state",
    "final_x_mm", "final_y_mm", "final_z_mm", "flat_deg", "final_deg",
)  # fmt: skip


def rods_csv(archive: Archive) -> str:
    """One line a rod; `joints_at_mm` lists every joint at its distance from the rod's start (ends: 0, 1)."""
    final = archive.final
    rows = []
    for rod in rods_of(archive):
        ends = _ends(rod, archive.states[final]) if final else None
        rows.append([
            rod.id, rod.family, *map(_mm, (rod.offset, rod.start, rod.end, rod.length)), str(len(rod.joints)),
            *map(_mm, rod.flat.ravel()), final if ends is not None else "",
            *([""] * 6 if ends is None else map(_mm, ends.ravel())),
            "; ".join(f"{other} {_mm(at)}" for other, at in sorted(rod.joints, key=lambda joint: joint[1])),
        ])  # fmt: skip
    return _csv(_ROD_COLUMNS, rows)


def joints_csv(archive: Archive) -> str:
    """One line a joint: where it is on both rods, in the plan and in space, and the angle between the rods.

    The angle runs from the direction of rod a to that of rod b, 0 to 180 degrees, by the polylines.
    """
    rods, final = rods_of(archive), archive.final
    placed = [_joints_in_space(archive, rod, final) for rod in rods]
    rows = []
    for joint in joints_of(rods):
        (i, j), (a, b) = joint.rods, (rods[k] for k in joint.rods)
        flat_angle = _degrees(a.flat[1] - a.flat[0], b.flat[1] - b.flat[0])
        on_a, on_b = placed[i].get(b.id), placed[j].get(a.id)
        space = [final or "", *map(_mm, on_a[0])] if on_a else [""] * 4
        final_angle = f"{_degrees(on_a[1], on_b[1]):.4f}" if on_a and on_b else ""
        flat = [*map(_mm, joint.at), *map(_mm, a.point(joint.at[0]))]
        rows.append([joint.id, a.id, b.id, *flat, *space, f"{flat_angle:.4f}", final_angle])
    return _csv(_JOINT_COLUMNS, rows)


def _joints_in_space(archive: Archive, rod: RodRecord, state: str | None) -> dict[str, tuple[Floats, Floats]]:
    """Position (3,) [m] and a tangent (3,) of a rod at its joints, by the rod that is met; empty if not known."""
    if state is None or len(rod.nodes) < 2 or "flat" not in archive.states:
        return {}
    flat, x = archive.states["flat"][rod.nodes], archive.states[state][rod.nodes]
    stations = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(flat, axis=0), axis=1))])
    at = np.array([at for _, at in rod.joints])
    step = 0.5 * np.diff(stations).min()  # stays within the edges on both sides
    before, position, after = (
        np.column_stack([np.interp(s, stations, x[:, axis]) for axis in range(3)]) for s in (at - step, at, at + step)
    )
    return {other: (position[k], after[k] - before[k]) for k, (other, _) in enumerate(rod.joints)}


def _ends(rod: RodRecord, positions: Floats) -> Floats | None:
    return positions[rod.nodes[[0, -1]]] if len(rod.nodes) else None


def _degrees(a: Floats, b: Floats) -> float:
    """Angle between two vectors, exact also near 0 and 180 [degrees]."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return float(np.degrees(2.0 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b))))


def _mm(value: float | None) -> str:
    """A length [m] in mm to 0.001 mm; without a minus before a zero."""
    return "" if value is None else f"{round(1e3 * value, 3) + 0.0:.3f}"


def _csv(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return stream.getvalue()
