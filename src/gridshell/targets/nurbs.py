"""NURBS surfaces in Rhino's 3dm files, trimmed or not: points of the whole surface, and its trims as curves."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gridshell.errors import InputError
from gridshell.targets.curvefile import closed_loops
from gridshell.targets.meshfile import file_bytes
from gridshell.units import shown

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

NURBS_FILES = (".3dm",)
GRID = 80  # quads each way: the field through them is right to 1e-5 of the size on a whole sphere
PER_SPAN = 4  # of a NURBS with many knots
FINEST = 400
TRIM_POINTS = 400  # on each edge
UNITS = {
    "Microns": 1e-6, "Millimeters": 1e-3, "Centimeters": 1e-2, "Decimeters": 0.1, "Meters": 1.0, "Kilometers": 1e3,
    "Inches": 0.0254, "Feet": 0.3048, "Yards": 0.9144,
}  # fmt: skip


def read_nurbs(path: Path, name: str | None = None) -> tuple[Floats, Ints, list[Floats], float | None]:
    """Vertices (n, 3), triangles, trims (closed polylines) in the file's unit, and that unit [m] if it has one.

    Parameters
    ----------
    name : of the object, or of its layer, in a file that holds several surfaces.

    Raises
    ------
    InputError : no such file, damaged, without rhino3dm, without one single face.
    """
    try:
        import rhino3dm
    except ImportError:
        raise InputError(f'{path}: 3dm files need rhino3dm: pip install "gridshell[rhino]"') from None
    data = file_bytes(path)
    model = rhino3dm.File3dm.FromByteArray(data)  # type: ignore[arg-type]
    if model is None:
        raise InputError(f"{path} cannot be read as 3DM: save it anew from Rhino")
    shape = _chosen(path, _surfaces(model, rhino3dm), name)
    whole = shape if isinstance(shape, rhino3dm.Surface) else shape.Faces[0].UnderlyingSurface()
    trims = [] if whole is shape or shape.IsSurface else _trims(shape)
    return *_grid(whole), trims, UNITS.get(model.Settings.ModelUnitSystem.name)


def _surfaces(model: Any, rhino3dm: Any) -> list[tuple[str, str, Any]]:
    """(name, layer, shape) of every surface object."""
    layers = {layer.Index: layer.Name for layer in model.Layers}
    found = []
    for thing in model.Objects:
        shape, attributes = thing.Geometry, thing.Attributes
        if isinstance(shape, rhino3dm.Extrusion):
            shape = shape.ToBrep(True)
        if isinstance(shape, rhino3dm.Brep | rhino3dm.Surface):
            found.append((attributes.Name, layers.get(attributes.LayerIndex, ""), shape))
    return found


def _chosen(path: Path, objects: list[tuple[str, str, Any]], name: str | None) -> Any:
    wanted = [shape for own, layer, shape in objects if name in (None, own, layer)]
    if len(wanted) != 1:
        names = ", ".join(shown(own or layer) for own, layer, _ in objects) or "none"
        what = "surfaces" if name is None else f"surfaces named {shown(name)}"
        raise InputError(f"{path} has {len(wanted)} {what}: choose one object or layer by its name (there: {names})")
    faces = len(getattr(wanted[0], "Faces", "1"))
    if faces != 1:
        raise InputError(f"{path}: the surface has {faces} faces: merge them, or give a mesh of it")
    return wanted[0]


def _grid(surface: Any) -> tuple[Floats, Ints]:
    """The whole surface in triangles."""
    sides = []
    for way in (0, 1):
        domain = surface.Domain(way)
        count = min(max(GRID, PER_SPAN * surface.SpanCount(way)), FINEST)
        sides.append(np.linspace(domain.T0, domain.T1, count + 1))
    points = [surface.PointAt(u, v) for u in sides[0].tolist() for v in sides[1].tolist()]
    vertices = np.array([(p.X, p.Y, p.Z) for p in points])
    return vertices, grid_triangles(len(sides[0]), len(sides[1]))


def grid_triangles(rows: int, columns: int) -> Ints:
    """Triangles (m, 3) between the points of a lattice, row by row."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.intp)


def _trims(brep: Any) -> list[Floats]:
    """The closed curves at which a face ends; an edge that one loop runs along twice is a seam."""
    loops = brep.Faces[0].Loops
    edges = [trim.EdgeIndex for loop in (loops[k] for k in range(len(loops))) for trim in loop.Trims]
    return closed_loops([_polyline(brep.Edges[k]) for k in edges if k >= 0 and edges.count(k) == 1])


def _polyline(curve: Any) -> Floats:
    t = np.linspace(curve.Domain.T0, curve.Domain.T1, TRIM_POINTS + 1)
    return np.array([(p.X, p.Y, p.Z) for p in map(curve.PointAt, t.tolist())])
