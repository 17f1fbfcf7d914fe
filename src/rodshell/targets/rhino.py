"""Surfaces in Rhino's 3dm files, trimmed or not: points of the whole surface, and its trims as curves."""

from pathlib import Path
from typing import Any

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.targets.curvefile import closed_loops
from rodshell.targets.meshfile import file_bytes
from rodshell.targets.nurbs import Nurbs
from rodshell.units import shown

RHINO_FILES = (".3dm",)
TRIM_POINTS = 400  # on each edge
UNITS = {
    "Microns": 1e-6, "Millimeters": 1e-3, "Centimeters": 1e-2, "Decimeters": 0.1, "Meters": 1.0, "Kilometers": 1e3,
    "Inches": 0.0254, "Feet": 0.3048, "Yards": 0.9144,
}  # fmt: skip


def read_3dm(path: Path, name: str | None = None) -> tuple[Floats, Ints, list[Floats], float | None]:
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
        raise InputError(f'{path}: 3dm files need rhino3dm: pip install "rodshell[rhino]"') from None
    data = file_bytes(path)
    model = rhino3dm.File3dm.FromByteArray(data)  # type: ignore[arg-type]
    if model is None:
        raise InputError(f"{path} cannot be read as 3DM: save it anew from Rhino")
    shape = _chosen(path, _surfaces(model, rhino3dm), name)
    whole = shape if isinstance(shape, rhino3dm.Surface) else shape.Faces[0].UnderlyingSurface()
    trims = [] if whole is shape or shape.IsSurface else _trims(shape)
    return *_nurbs(whole).triangles(), trims, UNITS.get(model.Settings.ModelUnitSystem.name)


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


def _nurbs(surface: Any) -> Nurbs:
    """Of any surface; OpenNURBS leaves out the first and the last knot."""
    form = surface.ToNurbsSurface()
    knots = [np.array(list(side)) for side in (form.KnotsU, form.KnotsV)]
    count = (len(knots[0]) - form.OrderU + 2, len(knots[1]) - form.OrderV + 2)
    points = [form.Points[i, j] for i in range(count[0]) for j in range(count[1])]
    controls = np.array([(p.X, p.Y, p.Z, p.W) for p in points]).reshape(*count, 4)
    whole = [np.concatenate([side[:1], side, side[-1:]]) for side in knots]
    return Nurbs((form.OrderU - 1, form.OrderV - 1), (whole[0], whole[1]), controls)


def _trims(brep: Any) -> list[Floats]:
    """The closed curves at which a face ends; an edge that one loop runs along twice is a seam."""
    loops = brep.Faces[0].Loops
    edges = [trim.EdgeIndex for loop in (loops[k] for k in range(len(loops))) for trim in loop.Trims]
    return closed_loops([_polyline(brep.Edges[k]) for k in edges if k >= 0 and edges.count(k) == 1])


def _polyline(curve: Any) -> Floats:
    t = np.linspace(curve.Domain.T0, curve.Domain.T1, TRIM_POINTS + 1)
    return np.array([(p.X, p.Y, p.Z) for p in map(curve.PointAt, t.tolist())])
