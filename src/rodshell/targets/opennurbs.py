"""A separate program that reads a surface or curves of a 3dm file with OpenNURBS; see `nurbs_files.rhino_content`."""

import json
from pathlib import Path
from typing import Any

import numpy as np

FEWEST = 8  # pieces of each span of a curve


def main(request: dict[str, Any]) -> dict[str, Any]:
    """The surfaces of a file, and the one that is wanted; or its curves.

    Args:
        request: `path`; `along_edges`, the pieces of each edge or curve; `most_joined`, faces of a polysurface; and
            `name` of an object or a layer, or None, or `most`, curves.

    Returns:
        `unit`, by its name, `names` (JSON: object, layer and number of faces of each surface) and `others` (JSON:
        numbers of meshes, SubDs and curves); nothing for another kind of file. If one surface matches, and has one face
        or only untrimmed ones, also their number `surfaces`, of each `degrees0` (2,), `knots_u0` and `knots_v0` without
        the first and the last and `controls0` (m, n, 4), and `trims` (k, along_edges + 1, 3), the curves that bound a
        single one.

    Of curves `unit` and their `count`; if it is not above `most`, `points` and `ends` as `dxf_curves` returns them.
    """
    import rhino3dm

    model: Any = rhino3dm.File3dm.FromByteArray(Path(request["path"]).read_bytes())  # type: ignore[arg-type]
    if model is None:
        return {}
    found: dict[str, Any] = {"unit": model.Settings.ModelUnitSystem.name}
    shapes = [item.Geometry for item in model.Objects]
    if "most" in request:
        curves = [shape for shape in shapes if isinstance(shape, rhino3dm.Curve)]
        drawn = [divided(curve, request["along_edges"]) for curve in curves[: int(request["most"])]]
        ends = np.cumsum([0, *map(len, drawn)])
        return found | {"count": len(curves), "points": np.vstack([np.empty((0, 3)), *drawn]), "ends": ends}
    surfaces = list(_surfaces_of(model))
    found["names"] = json.dumps([names for *names, _ in surfaces])
    kinds = rhino3dm.Mesh, rhino3dm.SubD, rhino3dm.Curve
    found["others"] = json.dumps([sum(isinstance(shape, kind) for shape in shapes) for kind in kinds])
    wanted = [(shape, faces) for name, layer, faces, shape in surfaces if request["name"] in (None, name, layer)]
    number = request["name"] or ""
    if not wanted and number.isdecimal() and 0 < int(number) <= len(surfaces):
        *_, faces, shape = surfaces[int(number) - 1]
        wanted = [(shape, faces)]
    if len(wanted) == 1:
        shape, count = wanted[0]
        faces = [shape] if isinstance(shape, rhino3dm.Surface) else [shape.Faces[k] for k in range(count)]
        whole = [face if face is shape else face.UnderlyingSurface() for face in faces]
        trims: list[Any] = []
        if count == 1:
            trims = [] if whole[0] is shape or shape.IsSurface else trims_of(shape, request["along_edges"])
        elif count > request["most_joined"] or not all(face.DuplicateFace(False).IsSurface for face in faces):
            return found
        for k, surface in enumerate(whole):
            values = _nurbs_of(surface)
            if count > 1 and faces[k].OrientationIsReversed:
                knots = values["knots_u"]
                values |= {"knots_u": knots[0] + knots[-1] - knots[::-1], "controls": values["controls"][::-1]}
            found |= {f"{key}{k}": value for key, value in values.items()}
        found |= {"surfaces": count, "trims": np.array(trims).reshape(-1, request["along_edges"] + 1, 3)}
    return found


def _surfaces_of(model: Any) -> Any:
    """Name, layer, number of faces and shape of every surface object."""
    import rhino3dm

    layers = {layer.Index: layer.Name for layer in model.Layers}
    for item in model.Objects:
        shape, attributes = item.Geometry, item.Attributes
        if isinstance(shape, rhino3dm.Extrusion):
            shape = shape.ToBrep(True)
        if isinstance(shape, rhino3dm.Brep | rhino3dm.Surface):
            yield attributes.Name, layers.get(attributes.LayerIndex, ""), len(getattr(shape, "Faces", "1")), shape


def _nurbs_of(surface: Any) -> dict[str, Any]:
    """Any surface as a NURBS."""
    form = surface.ToNurbsSurface()
    knots = [np.array(list(side), dtype=float) for side in (form.KnotsU, form.KnotsV)]
    orders = (form.OrderU, form.OrderV)
    count = [len(side) - order + 2 for side, order in zip(knots, orders, strict=True)]
    points = [form.Points[i, j] for i in range(count[0]) for j in range(count[1])]
    controls = np.array([(p.X, p.Y, p.Z, p.W) for p in points]).reshape(*count, 4)
    return {"degrees": np.array(orders) - 1, "knots_u": knots[0], "knots_v": knots[1], "controls": controls}


def trims_of(brep: Any, pieces: int) -> list[Any]:
    """The curves that bound a face; an edge that a loop follows twice is a seam of the surface, not an end."""
    loops = brep.Faces[0].Loops
    edges = [trim.EdgeIndex for loop in (loops[k] for k in range(len(loops))) for trim in loop.Trims]
    return [polyline(brep.Edges[k], pieces) for k in edges if k >= 0 and edges.count(k) == 1]


def divided(curve: Any, pieces: int) -> list[tuple[float, float, float]]:
    """Points of any curve: its corners where it is straight between them, else about `pieces` or more."""
    form = curve.ToNurbsCurve()
    knots = np.unique(list(form.Knots))
    share = np.linspace(0.0, 1.0, 2 if form.Degree == 1 else max(pieces // (len(knots) - 1), FEWEST) + 1)[1:]
    t = np.append(knots[:1], knots[:-1, None] + np.diff(knots)[:, None] * share)
    return [(p.X, p.Y, p.Z) for p in map(form.PointAt, t.tolist())]


def polyline(curve: Any, pieces: int) -> list[tuple[float, float, float]]:
    """Points at equal steps of a curve's parameter."""
    t = np.linspace(curve.Domain.T0, curve.Domain.T1, pieces + 1)
    return [(p.X, p.Y, p.Z) for p in map(curve.PointAt, t.tolist())]
