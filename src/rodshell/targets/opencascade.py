"""A separate program that reads a face of a STEP file with OpenCASCADE; see `apart` and `nurbs_files.read_step`."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

_ON_BORDER = 1e-6  # of the range of a parameter


def read(path: str) -> list[tuple[Any, list[str]]]:
    """Every face of a file, with its names and those of the shells and solids that it belongs to."""
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
    from OCP.TopoDS import TopoDS

    Message.DefaultMessenger_s().ChangePrinters().Clear()  # nothing on the terminal
    reader = STEPControl_Reader()
    reader.ReadFile(path)
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape is None or shape.IsNull():
        return []
    origin = reader.WS().TransferReader()

    def name_of(part: Any) -> str:
        entity = origin.EntityFromShapeResult(part, 1)
        text = entity.Name() if hasattr(entity, "Name") else None
        return text.ToCString() if text is not None else ""

    owners = [(name_of(part), list(parts(part, TopAbs_FACE))) for kind in (TopAbs_SOLID, TopAbs_SHELL)
              for part in parts(shape, kind)]  # fmt: skip
    found = []
    for face in parts(shape, TopAbs_FACE):
        names = {name_of(face), *(owner for owner, faces in owners if any(face.IsSame(other) for other in faces))}
        found.append((TopoDS.Face(face), sorted(names - {"", "NONE"})))
    return found


def parts(whole: Any, kind: Any) -> Iterator[Any]:
    """The parts of a shape that are of a `kind`, such as its faces."""
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(whole, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _points_of(surface: Any, grid: int, per_span: int, finest: int) -> Any:
    """Points (k, l, 3) [mm] of a surface on a lattice of its parameters, with at least `grid` intervals each way,
    `per_span` for each span of the surface, and at most `finest`."""
    from OCP.GeomAbs import GeomAbs_CN

    sides = []
    for first, last, spans in (
        (surface.FirstUParameter(), surface.LastUParameter(), surface.NbUIntervals(GeomAbs_CN)),
        (surface.FirstVParameter(), surface.LastVParameter(), surface.NbVIntervals(GeomAbs_CN)),
    ):
        sides.append(np.linspace(first, last, min(max(grid, per_span * spans), finest) + 1).tolist())
    return np.array([[coordinates(surface.Value(u, v)) for v in sides[1]] for u in sides[0]])


def coordinates(point: Any) -> tuple[float, float, float]:
    """x, y, z of a point of OpenCASCADE."""
    return point.X(), point.Y(), point.Z()


def edges(face: Any) -> list[Any]:
    """The edges of a face."""
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS

    return [TopoDS.Edge(edge) for edge in parts(face, TopAbs_EDGE)]


def _is_untrimmed(face: Any, surface: Any) -> bool:
    """Whether all edges run along the bounds of the surface's parameters."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d

    low = np.array([surface.FirstUParameter(), surface.FirstVParameter()])
    high = np.array([surface.LastUParameter(), surface.LastVParameter()])
    for edge in edges(face):
        curve = BRepAdaptor_Curve2d(edge, face)
        t = np.linspace(curve.FirstParameter(), curve.LastParameter(), 9)
        uv = np.array([(p.X(), p.Y()) for p in map(curve.Value, t.tolist())])
        away = np.minimum(np.abs(uv - low), np.abs(uv - high))
        if not (away.max(axis=0) <= _ON_BORDER * (high - low)).any():
            return False
    return True


def trims_of(face: Any, along_edges: int) -> Any:
    """Curves (n, along_edges + 1, 3) at which a face ends [mm]; not its seams, nor the poles of spheres."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve

    strokes = []
    for edge in edges(face):
        if BRep_Tool.Degenerated_s(edge) or BRep_Tool.IsClosed_s(edge, face):
            continue
        curve = BRepAdaptor_Curve(edge)
        t = np.linspace(curve.FirstParameter(), curve.LastParameter(), along_edges + 1)
        strokes.append([coordinates(curve.Value(parameter)) for parameter in t.tolist()])
    return np.array(strokes).reshape(-1, along_edges + 1, 3)


def main(request: dict[str, Any]) -> dict[str, Any]:
    """The faces of a file, and the one that is wanted.

    Args:
        request: `path`, `name` of a face, or None, and the resolution: `grid`, `per_span`, `finest`, `along_edges`.

    Returns:
        `names` (JSON, a list for each face) and, if one face matches, `points` (k, l, 3) of its surface and `trims`
        (n, along_edges + 1, 3), the curves that bound it, in millimetres.
    """
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    faces = read(request["path"])
    found: dict[str, Any] = {"names": json.dumps([names for _, names in faces])}
    wanted = [face for k, (face, names) in enumerate(faces) if request["name"] in (None, str(k + 1), *names)]
    if len(wanted) == 1:
        surface = BRepAdaptor_Surface(wanted[0], True)
        found["points"] = _points_of(surface, request["grid"], request["per_span"], request["finest"])
        along = request["along_edges"]
        untrimmed = _is_untrimmed(wanted[0], surface)
        found["trims"] = np.empty((0, along + 1, 3)) if untrimmed else trims_of(wanted[0], along)
    return found
