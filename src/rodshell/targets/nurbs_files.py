"""NURBS surfaces in Rhino's 3dm files and in STEP files: points of the whole surface, and its trims as curves."""

import json
import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.dataclass import dataclass
from rodshell.errors import InputError
from rodshell.geometry.curves import closed_loops
from rodshell.targets.mesh_files import file_bytes
from rodshell.units import shown

GRID = 64  # quads each way: the field through them is accurate to 4e-5 of the size on a whole sphere
PER_SPAN = 4  # quads per span of a NURBS with many knots
FINEST = 400  # quads each way, at most
ALONG_EDGES = 400  # straight pieces of each trimming edge
LISTED = 12  # faces named in a message

RHINO_FILES = (".3dm",)
RHINO_UNITS = {
    "Microns": 1e-6, "Millimeters": 1e-3, "Centimeters": 1e-2, "Decimeters": 0.1, "Meters": 1.0, "Kilometers": 1e3,
    "Inches": 0.0254, "Feet": 0.3048, "Yards": 0.9144,
}  # fmt: skip

STEP_FILES = (".step", ".stp")
MILLIMETRE = 1e-3  # m: OpenCASCADE converts every unit to millimetres
LAST_LINE = b"END-ISO-10303-21"
ABSURD = re.compile(rb"-?\d\.\d*E\+?\d{3,}")  # OpenCASCADE does not terminate with such coordinates
READER = Path(__file__).with_name("opencascade.py")
LONGEST = 120.0  # seconds that reading may take


@dataclass(frozen=True, eq=False)
class Nurbs:
    """A surface of rational B-splines.

    Parameters
    ----------
    degrees : along u and along v.
    knots : (m + degree + 1,) and (n + degree + 1,), ascending.
    controls : (m, n, 4) control points: weight times x, y and z, and the weight.
    """

    degrees: tuple[int, int]
    knots: tuple[Floats, Floats]
    controls: Floats

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
            count = min(max(GRID, PER_SPAN * (len(np.unique(within)) - 1)), FINEST)
            sides.append(np.linspace(within[0], within[-1], count + 1))
        return self.points(*sides).reshape(-1, 3), grid_triangles(len(sides[0]), len(sides[1]))


def splines(knots: Floats, degree: int, t: Floats) -> Floats:
    """Evaluate all B-splines of a degree, by the recursion of Cox and de Boor.

    Parameters
    ----------
    knots : (m + degree + 1,), ascending.
    degree : of the polynomials.
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
    path : of the file.
    name : object or layer name, if the file has several surfaces.

    Returns
    -------
    Vertices (n, 3), triangles (m, 3) and trims (closed polylines) in the file's unit; and that unit [m], or None.

    Raises
    ------
    InputError : the file is missing or damaged; rhino3dm is not installed; the file has no such face, or several.
    """
    try:
        import rhino3dm
    except ImportError:
        raise InputError(f'{path}: 3dm files need rhino3dm: pip install "rodshell[rhino]"') from None
    data = file_bytes(path)
    model = rhino3dm.File3dm.FromByteArray(data)  # type: ignore[arg-type]
    if model is None:
        raise InputError(f"{path} cannot be read as 3DM: save it again from Rhino")
    shape = _selected(path, _surfaces(model, rhino3dm), name)
    whole = shape if isinstance(shape, rhino3dm.Surface) else shape.Faces[0].UnderlyingSurface()
    trims = [] if whole is shape or shape.IsSurface else _trims(shape)
    return *_nurbs(whole).triangles(), trims, RHINO_UNITS.get(model.Settings.ModelUnitSystem.name)


def _surfaces(model: Any, rhino3dm: Any) -> list[tuple[str, str, Any]]:
    """(name, layer, shape) of every surface object."""
    layers = {layer.Index: layer.Name for layer in model.Layers}
    found = []
    for item in model.Objects:
        shape, attributes = item.Geometry, item.Attributes
        if isinstance(shape, rhino3dm.Extrusion):
            shape = shape.ToBrep(True)
        if isinstance(shape, rhino3dm.Brep | rhino3dm.Surface):
            found.append((attributes.Name, layers.get(attributes.LayerIndex, ""), shape))
    return found


def _selected(path: Path, objects: list[tuple[str, str, Any]], name: str | None) -> Any:
    wanted = [shape for label, layer, shape in objects if name in (None, label, layer)]
    if len(wanted) != 1:
        names = ", ".join(shown(label or layer) for label, layer, _ in objects) or "none"
        what = "surfaces" if name is None else f"surfaces named {shown(name)}"
        raise InputError(
            f"{path} has {len(wanted)} {what}: choose one by its object or layer name (available: {names})"
        )
    faces = len(getattr(wanted[0], "Faces", "1"))
    if faces != 1:
        raise InputError(f"{path}: the surface has {faces} faces: merge them, or export a mesh")
    return wanted[0]


def _nurbs(surface: Any) -> Nurbs:
    """Convert any surface; OpenNURBS omits the first and the last knot."""
    form = surface.ToNurbsSurface()
    knots = [np.array(list(side)) for side in (form.KnotsU, form.KnotsV)]
    count = (len(knots[0]) - form.OrderU + 2, len(knots[1]) - form.OrderV + 2)
    points = [form.Points[i, j] for i in range(count[0]) for j in range(count[1])]
    controls = np.array([(p.X, p.Y, p.Z, p.W) for p in points]).reshape(*count, 4)
    whole = [np.concatenate([side[:1], side, side[-1:]]) for side in knots]
    return Nurbs((form.OrderU - 1, form.OrderV - 1), (whole[0], whole[1]), controls)


def _trims(brep: Any) -> list[Floats]:
    """The closed curves that bound a face; an edge that a loop follows twice is a seam of the surface, not an end."""
    loops = brep.Faces[0].Loops
    edges = [trim.EdgeIndex for loop in (loops[k] for k in range(len(loops))) for trim in loop.Trims]
    return closed_loops([_polyline(brep.Edges[k]) for k in edges if k >= 0 and edges.count(k) == 1])


def _polyline(curve: Any) -> Floats:
    t = np.linspace(curve.Domain.T0, curve.Domain.T1, ALONG_EDGES + 1)
    return np.array([(p.X, p.Y, p.Z) for p in map(curve.PointAt, t.tolist())])


def read_step(path: Path, name: str | None = None) -> tuple[Floats, Ints, list[Floats]]:
    """Read one face of a STEP file, in a separate process (see `opencascade`).

    Parameters
    ----------
    path : of the file.
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
    if LAST_LINE not in data[-1000:]:
        raise InputError(f"{path} is truncated: its last line, {LAST_LINE.decode()}, is missing; export it again")
    if far := ABSURD.search(data):
        raise InputError(f"{path} is damaged: it has a coordinate {far[0].decode()}; export it again")
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "face.npz"
        samples = {"grid": GRID, "per_span": PER_SPAN, "finest": FINEST, "along_edges": ALONG_EDGES}
        request = json.dumps({"path": str(path), "name": name, **samples})
        program = [sys.executable, "-P", str(READER), request, str(result)]
        try:
            subprocess.run(program, capture_output=True, timeout=LONGEST, check=True)
            with np.load(result) as found:
                parts = {key: found[key] for key in found.files}
        except subprocess.TimeoutExpired:
            raise InputError(f"{path} cannot be read within {LONGEST:.0f} s: export the one face by itself") from None
        except (subprocess.CalledProcessError, OSError):
            raise InputError(f"{path} cannot be read as STEP: it is damaged; export it again") from None
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
    listed = [", ".join([str(k), *map(shown, names)]) for k, names in enumerate(faces[:LISTED], start=1)]
    available = "; ".join(listed) + ("; ..." if len(faces) > LISTED else "")
    return InputError(f"{path} has {what}: choose one by its name or number (available: {available})")
