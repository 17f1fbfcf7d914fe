"""Curves in files: polylines of OBJ, curves of DXF and 3dm."""

from pathlib import Path

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.geometry.curves import closed_loops, join_end_to_end
from rodshell.targets.apart import read_apart
from rodshell.targets.mesh_files import file_bytes, read_with, recoded
from rodshell.targets.nurbs_files import READERS, RHINO_UNITS, rhino_content
from rodshell.targets.polygon_files import obj_content
from rodshell.targets.trianglemesh import FARTHEST
from rodshell.untrusted import limit, raised

_DRAWING = "a drawing of curves"  # in messages
_CURVE_FILES = (".obj", ".dxf", ".3dm")
MOST_STROKES = 5_000  # curves of a drawing: they are joined end to end
_SAG = 2e-5  # of a curve's extent: how finely arcs and splines of a DXF are divided


def read_curves(path: Path, unit: float) -> list[Floats]:
    """Closed polylines (n, 3) [m] of an OBJ, DXF or 3dm file, the longest first: the edge of the shell, then its
    openings.

    Args:
        unit: length of the file's unit [m]; a 3dm file that states its own is read in that.

    Raises:
        InputError: the file is missing or damaged, or has no closed curve.
    """
    loops = closed_loops(read_strokes(path, unit))
    if not loops or not all(np.isfinite(loop).all() for loop in loops):
        raise InputError(f"{path} has no closed curve with finite coordinates: draw one polyline around the shell")
    return loops


def read_lines(path: Path, unit: float) -> list[Floats]:
    """Open and closed polylines (n, 3) [m] as `read_curves`; those that touch end to end are joined.

    Raises:
        InputError: the file is missing or damaged, or has no curve.
    """
    lines = join_end_to_end(read_strokes(path, unit))
    if not lines or not all(np.isfinite(line).all() for line in lines):
        raise InputError(f"{path} has no line with finite coordinates: draw a polyline along each seam")
    return lines


def read_strokes(path: Path, unit: float) -> list[Floats]:
    """Read the curves of an OBJ, DXF or 3dm file one by one, as polylines (n, 3) in the order of the file [m].

    Args:
        unit: length of the file's unit [m]; a 3dm file that states its own is read in that.

    Raises:
        InputError: the file is missing or damaged, of another kind, or leads too far.
    """
    data, kind = file_bytes(path), path.suffix.lower()
    if kind not in _CURVE_FILES:
        raise InputError(f"{path}: curves are read from {', '.join(_CURVE_FILES)} files")
    if kind == ".obj":
        content = read_with(path, _DRAWING, lambda: obj_content(recoded(data)))
        _require_few(path, len(content.lines))
        strokes = read_with(path, _DRAWING, lambda: [content.polygons.points[line] for line in content.lines])
    else:
        if kind == ".3dm":
            found = rhino_content(path, data, most=limit(MOST_STROKES))
            unit = RHINO_UNITS.get(str(found["unit"]), unit)
        else:
            request = {"sag": _SAG, "most": limit(MOST_STROKES), "farthest": FARTHEST / unit}
            found = read_apart(READERS / "dxf_curves.py", path, data, _DRAWING, **request)
        _require_few(path, int(found["count"]))
        if "points" not in found:
            _require_near(path, float(found["far"]) * unit)
        strokes = np.split(found["points"], found["ends"][1:-1])
    _require_near(path, max((float(np.abs(stroke).max()) * unit for stroke in strokes if len(stroke)), default=0.0))
    return [stroke * unit for stroke in strokes if len(stroke) > 1]


def _require_few(path: Path, count: int) -> None:
    if count > limit(MOST_STROKES):
        raise InputError(
            f"{path} has {count} curves, and at most {limit(MOST_STROKES):.0f} are read: draw one polyline around the "
            f"shell, {raised(MOST_STROKES, count)}"
        )


def _require_near(path: Path, far: float) -> None:
    if not far <= FARTHEST:
        raise InputError(f"{path} has curves with coordinates up to {far:.3g} m: draw them near the origin")
