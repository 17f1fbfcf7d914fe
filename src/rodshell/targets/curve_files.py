"""Curves in files: polylines of OBJ, curves of DXF and 3dm."""

from pathlib import Path

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.geometry.curves import closed_loops, join_end_to_end
from rodshell.targets.apart import read_apart
from rodshell.targets.mesh_files import file_bytes, read_with, recoded
from rodshell.targets.nurbs_files import RHINO_UNITS, rhino_content
from rodshell.targets.polygon_files import obj_content
from rodshell.targets.trianglemesh import FARTHEST
from rodshell.untrusted import limit, raised

_CURVE_FILES = (".obj", ".dxf", ".3dm")
MOST_STROKES = 5_000  # curves of a drawing: they are joined end to end
_SAG = 2e-5  # of a curve's extent: how finely arcs and splines of a DXF are divided


def read_curves(path: Path, unit: float) -> list[Floats]:
    """Read closed curves from an OBJ, DXF or 3dm file.

    Args:
        unit: length of the file's unit [m]; a 3dm file that states its own is read in that.

    Returns:
        Closed polylines (n, 3) [m], the longest first: the edge of the shell, then its openings.

    Raises:
        InputError: the file is missing or damaged, or has no closed curve.
    """
    loops = closed_loops(read_strokes(path, unit))
    if not loops or not all(np.isfinite(loop).all() for loop in loops):
        raise InputError(f"{path} has no closed curve with finite coordinates: draw one polyline around the shell")
    return loops


def read_lines(path: Path, unit: float) -> list[Floats]:
    """Read open and closed curves from an OBJ, DXF or 3dm file; those that touch end to end are joined.

    Args:
        unit: length of the file's unit [m]; a 3dm file that states its own is read in that.

    Returns:
        Polylines (n, 3) [m].

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
    if kind == ".3dm":
        strokes, unit = _of_3dm(path, data, unit)
    else:
        strokes = _of_dxf(path, data, FARTHEST / unit) if kind == ".dxf" else _lines_of_obj(path, data)
    far = max((float(np.abs(stroke).max()) * unit for stroke in strokes if len(stroke)), default=0.0)
    _require_near(path, far)
    return [stroke * unit for stroke in strokes if len(stroke) > 1]


def _require_few_strokes(path: Path, count: int) -> None:
    if count > limit(MOST_STROKES):
        raise InputError(
            f"{path} has {count} curves, and at most {limit(MOST_STROKES):.0f} are read: draw one polyline around the "
            f"shell, {raised(MOST_STROKES, count)}"
        )


def _require_near(path: Path, far: float) -> None:
    if not far <= FARTHEST:
        raise InputError(f"{path} has curves with coordinates up to {far:.3g} m: draw them near the origin")


def _lines_of_obj(path: Path, data: bytes) -> list[Floats]:
    """The `l` elements of an OBJ."""
    content = read_with(path, "a drawing of curves", lambda: obj_content(recoded(data)))
    _require_few_strokes(path, len(content.lines))
    return read_with(path, "a drawing of curves", lambda: [content.polygons.points[line] for line in content.lines])


def _of_dxf(path: Path, data: bytes, farthest: float) -> list[Floats]:
    request = {"sag": _SAG, "most": limit(MOST_STROKES), "farthest": farthest}
    found = read_apart(Path(__file__).with_name("dxf_curves.py"), path, data, "a drawing of curves", **request)
    _require_few_strokes(path, int(found["count"]))
    if "points" not in found:
        _require_near(path, float(found["far"]) * FARTHEST / farthest)
    return np.split(found["points"], found["ends"][1:-1])


def _of_3dm(path: Path, data: bytes, unit: float) -> tuple[list[Floats], float]:
    """The curves of a 3dm file, and the length of its unit [m]."""
    found = rhino_content(path, data, most=limit(MOST_STROKES))
    _require_few_strokes(path, int(found["count"]))
    return np.split(found["points"], found["ends"][1:-1]), RHINO_UNITS.get(str(found["unit"]), unit)
