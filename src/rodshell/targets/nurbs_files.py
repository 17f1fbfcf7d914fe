"""NURBS surfaces in Rhino's 3dm files and in STEP files: points of the whole surface, and its trims as curves."""

import json
import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.curves import closed_loops
from rodshell.targets.apart import read_apart
from rodshell.targets.mesh_files import file_bytes
from rodshell.units import shown

GRID = 64  # quads each way: the field through them is accurate to 4e-5 of the size on a whole sphere
_PER_SPAN = 4  # quads per span of a NURBS with many knots
FINEST = 400  # quads each way, at most
_ALONG_EDGES = 400  # straight pieces of each trimming edge
_LISTED = 12  # faces named in a message
MOST = 1e15  # of a control point, in the unit of its file

RHINO_FILES = (".3dm",)
RHINO_UNITS = {
    "Microns": 1e-6, "Millimeters": 1e-3, "Centimeters": 1e-2, "Decimeters": 0.1, "Meters": 1.0, "Kilometers": 1e3,
    "Inches": 0.0254, "Feet": 0.3048, "Yards": 0.9144,
}  # fmt: skip

STEP_FILES = (".step", ".stp")
MILLIMETRE = 1e-3  # m: OpenCASCADE converts every unit to millimetres
_LAST_LINE = b"END-ISO-10303-21"
_ABSURD = re.compile(rb"-?\d\.\d*E\+?\d{3,}")  # OpenCASCADE does not terminate with such coordinates
READERS = Path(__file__).parent
_HIGHEST = 25  # degree: of splines beyond it, no digit of a point is known


@dataclass(frozen=True, eq=False)
class Nurbs:
    """A surface of rational B-splines.

    Parameters
    ----------
    degrees : along u and along v.
    knots : (m + degree + 1,) and (n + degree + 1,), ascending.
    controls : (m, n, 4) control points: weight times x, y and z, and the weight, which is positive.
    """

    degrees: tuple[int, int]
    knots: tuple[Floats, Floats]
    controls: Floats

    @property
    def fault(self) -> str:
        """Why there is no such surface; empty for one that is sound."""
        for degree, knots, count in zip(self.degrees, self.knots, self.controls.shape, strict=False):
            if not 1 <= degree <= _HIGHEST:
                return f"its degree is {degree}, and {_HIGHEST} at most is read"
            if len(knots) != count + degree + 1 or count <= degree:
                return f"it has {len(knots)} knots for {count} control points of degree {degree}"
            if not (np.isfinite(knots).all() and (np.diff(knots) >= 0).all() and knots[degree] < knots[-degree - 1]):
                return "its knots do not ascend"
        if not np.isfinite(self.controls).all() or np.abs(self.controls).max() > MOST:
            return f"its control points are not finite, or beyond {MOST:g}"
        return "" if (self.controls[..., 3] > 0).all() else "a control point has no positive weight"

    def points(self, u: Floats, v: Floats) -> Floats:
        """Points (k, l, 3) of the surface at the parameters `u` (k,) and `v` (l,)."""
        along, across = (splines(k, p, t) for k, p, t in zip(self.knots, self.degrees, (u, v), strict=True))
        x = np.einsum("ki,ijd,lj->kld", along, self.controls, across, optimize=True)
        return np.asarray(x[..., :3] / x[..., 3:])

    def triangles(self) -> tuple[Floats, Ints]:
        """The whole surface in triangles: vertices (k, 3) and faces (m, 3)."""
        sides = []
        for knots, degree in zip(self.knots, self.degrees, strict=True):
            within = knots[degree : len(knots) - degree]
            count = min(max(GRID, _PER_SPAN * (len(np.unique(within)) - 1)), FINEST)
            sides.append(np.linspace(within[0], within[-1], count + 1))
        return self.points(*sides).reshape(-1, 3), grid_triangles(len(sides[0]), len(sides[1]))


def splines(knots: Floats, degree: int, t: Floats) -> Floats:
    """Evaluate all B-splines of a degree, by the recursion of Cox and de Boor.

    Parameters
    ----------
    knots : (m + degree + 1,), ascending.
    t : (k,) parameters.

    Returns
    -------
    (k, m) values.
    """
    last = np.flatnonzero(knots < knots[-degree - 1])[-1]  # the end belongs to this span
    span = np.clip(np.searchsorted(knots, t, side="right") - 1, degree, last)
    values: Floats = (np.arange(len(knots) - 1) == span[:, None]).astype(np.float64)
    for p in range(1, degree + 1):
        low, high = knots[: -p - 1], knots[p + 1 :]
        rising, falling = knots[p:-1] - low, high - knots[1:-p]
        up = (t[:, None] - low) / np.where(rising > 0, rising, 1.0)
        down = (high - t[:, None]) / np.where(falling > 0, falling, 1.0)
        values = up * values[:, :-1] + down * values[:, 1:]
    return values


def grid_triangles(rows: int, columns: int) -> Ints:
    """Triangles (m, 3) between the points of a lattice, row by row."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.intp)


def read_3dm(path: Path, name: str | None = None) -> tuple[Floats, Ints, list[Floats], float | None]:
    """Read one surface of a 3dm file.

    Parameters
    ----------
    name : object or layer name, or the surface's number from 1 on, if the file has several surfaces.

    Returns
    -------
    Vertices (n, 3), triangles (m, 3) and trims (closed polylines) in the file's unit; and that unit [m], or None.

    Raises
    ------
    InputError : the file is missing or damaged; rhino3dm is not installed; the file has no such face, or several.
    """
    found = rhino_content(path, file_bytes(path), name=name)
    if "controls" not in found:
        raise _no_single_surface(path, json.loads(str(found["names"])), name, json.loads(str(found["others"])))
    # OpenNURBS omits the first and the last knot
    knots = [np.concatenate([side[:1], side, side[-1:]]) for side in (found["knots_u"], found["knots_v"])]
    surface = Nurbs(tuple(found["degrees"].tolist()), (knots[0], knots[1]), found["controls"])
    if surface.fault:
        raise InputError(f"{path} is damaged: {surface.fault}: save it again from Rhino")
    return *surface.triangles(), closed_loops(found["trims"]), RHINO_UNITS.get(str(found["unit"]))


def rhino_content(path: Path, data: bytes, **request: object) -> dict[str, Any]:
    """What `opennurbs` finds in a 3dm file.

    Parameters
    ----------
    path : of the file, for messages.
    request : the `name` of a surface; or the `most` curves that are read.

    Raises
    ------
    InputError : the file is damaged; rhino3dm is not installed.
    """
    if find_spec("rhino3dm") is None:
        raise InputError(f'{path}: 3dm files need rhino3dm: pip install "rodshell[rhino]"')
    found = read_apart(READERS / "opennurbs.py", path, data, "3DM", along_edges=_ALONG_EDGES, **request)
    if not found:
        raise InputError(f"{path} cannot be read as 3DM: save it again from Rhino")
    return found


def _no_single_surface(
    path: Path, surfaces: list[tuple[str, str, int]], name: str | None, others: list[int]
) -> InputError:
    if not surfaces:
        kinds = zip(others, ("mesh", "SubD", "curve"), ("meshes", "SubDs", "curves"), strict=True)
        there = ", ".join(f"{count} {single if count == 1 else several}" for count, single, several in kinds if count)
        remedy = "export the mesh as OBJ, or save a surface" if others[0] else "save a surface"
        return InputError(f"{path} has {there or 'nothing'}, and no surface: {remedy}")
    number = int(name) if name and name.isdecimal() else 0
    faces = [count for label, layer, count in surfaces if name in (None, label, layer)]
    if not faces and 0 < number <= len(surfaces):
        faces = [surfaces[number - 1][2]]
    if len(faces) == 1:
        return InputError(f"{path}: the surface has {faces[0]} faces: merge them, or export a mesh")
    listed = [
        f"{k}, {shown(label or layer)}" if label or layer else f"{k}"
        for k, (label, layer, _) in enumerate(surfaces[:_LISTED], start=1)
    ]
    what = "surfaces" if name is None else f"surfaces named {shown(name)}"
    more = "; ..." if len(surfaces) > _LISTED else ""
    return InputError(
        f"{path} has {len(faces)} {what}: choose one by its number, or by its object or layer name (available: "
        f"{'; '.join(listed)}{more})"
    )


def read_step(path: Path, name: str | None = None) -> tuple[Floats, Ints, list[Floats]]:
    """Read one face of a STEP file, in a separate process (see `opencascade`).

    Parameters
    ----------
    name : of the face or of its shell or solid, or the face's number from 1 on, if the file has several.

    Returns
    -------
    Vertices (n, 3) [m], triangles (m, 3) and trims (closed polylines) [m].

    Raises
    ------
    InputError : the file is missing or damaged; OpenCASCADE is not installed; the file has no such face, or several.
    """
    if find_spec("OCP") is None:
        raise InputError(f'{path}: STEP files need OpenCASCADE: pip install "rodshell[step]"')
    data = file_bytes(path)
    if _LAST_LINE not in data[-1000:]:
        raise InputError(f"{path} is truncated: its last line, {_LAST_LINE.decode()}, is missing; export it again")
    if far := _ABSURD.search(data):
        raise InputError(f"{path} is damaged: it has a coordinate {far[0].decode()}; export it again")
    samples = {"grid": GRID, "per_span": _PER_SPAN, "finest": FINEST, "along_edges": _ALONG_EDGES}
    parts = read_apart(READERS / "opencascade.py", path, data, "STEP", name=name, **samples)
    if "points" not in parts:
        raise _no_single_face(path, json.loads(str(parts["names"])), name)
    rows, columns, _ = parts["points"].shape
    vertices, triangles = MILLIMETRE * parts["points"].reshape(-1, 3), grid_triangles(rows, columns)
    return vertices, triangles, closed_loops(MILLIMETRE * parts["trims"])


def _no_single_face(path: Path, faces: list[list[str]], name: str | None) -> InputError:
    if not faces:
        return InputError(f"{path} has no face: export the surface, not its edges or its mesh, as STEP")
    what = f"{len(faces)} faces"
    if name is not None:
        what = f"{sum(name in names for names in faces)} faces named {shown(name)}"
    listed = [", ".join([str(k), *map(shown, names)]) for k, names in enumerate(faces[:_LISTED], start=1)]
    available = "; ".join(listed) + ("; ..." if len(faces) > _LISTED else "")
    return InputError(f"{path} has {what}: choose one by its name or number (available: {available})")
