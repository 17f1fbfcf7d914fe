"""Rhino 3dm: flat rods, final rods and joints on layers, named, with their figures as user text. Millimetres."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.errors import InputError
from rodshell.output.archive import Archive
from rodshell.output.plan import FlatPlan
from rodshell.output.rods import joint_places

COLOURS = {"CUT": (34, 40, 47), "MARK": (179, 55, 44), "FINAL": (31, 95, 139), "BOUNDARY-FINAL": (43, 122, 75)}


def rhino_bytes(archive: Archive, plan: FlatPlan) -> bytes:
    """The whole model.

    Raises
    ------
    InputError : rhino3dm is not installed.
    """
    try:
        import rhino3dm as r
    except ImportError as error:
        raise InputError('a 3dm file needs the package rhino3dm: pip install "rodshell[rhino]"') from error

    model: Any = r.File3dm()
    model.Settings.ModelUnitSystem = r.UnitSystem.Millimeters
    layers = {}
    for name, colour in COLOURS.items():
        layer = r.Layer()
        layer.Name, layer.Color = name, (*colour, 255)
        layers[name] = model.Layers.Add(layer)

    def about(where: str, name: str, figures: dict[str, str] | None = None):  # type: ignore[no-untyped-def]
        attributes: Any = r.ObjectAttributes()
        attributes.Name, attributes.LayerIndex = name, layers[where]
        for key, value in (figures or {}).items():
            attributes.SetUserString(key, value)
        return attributes

    def polyline(points: np.ndarray):  # type: ignore[no-untyped-def]
        result = r.Point3dList()
        for x, y, z in points.tolist():
            result.Add(x, y, z)
        return result

    mm = plan.rounding.mm
    for rod, cut in zip(plan.rods, plan.cuts, strict=True):
        figures = {"length_mm": mm(rod.length), "cut_length_mm": mm(rod.cut_length)}
        joints = " ".join(f"{other}:{mm(rod.from_cut_end(at))}" for other, at in rod.joints)
        figures |= {"layer": str(rod.layer), "joints_from_cut_end_mm": joints}
        (x0, y0), (x1, y1) = cut.tolist()
        model.Objects.AddLine(r.Point3d(x0, y0, 0.0), r.Point3d(x1, y1, 0.0), about("CUT", rod.id, figures))
        if archive.final and len(rod.nodes) > 1:
            curve = 1e3 * archive.states[archive.final][rod.nodes]
            model.Objects.AddPolyline(polyline(curve), about("FINAL", rod.id, figures))
    for joint, (x, y) in zip(plan.joints, plan.marks.tolist(), strict=True):
        model.Objects.AddPoint(r.Point3d(x, y, 0.0), about("MARK", joint.id))
    if archive.final:
        for name, at in joint_places(archive, archive.states[archive.final]).items():
            model.Objects.AddPoint(r.Point3d(*(1e3 * at).tolist()), about("MARK", name))
    for outline in plan.boundary:
        closed = np.vstack([outline, outline[:1]])
        model.Objects.AddPolyline(polyline(closed), about("BOUNDARY-FINAL", "boundary"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.3dm"
        model.Write(str(path), 7)
        return path.read_bytes()
