"""Meshes and NURBS surfaces in the JSON of COMPAS, which need not be installed: `compas.json_dump(mesh, "roof.json")`.

The file holds one of either, or a list or table of them, of which one is chosen by its name or its key.
"""

import json
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.errors import InputError
from rodshell.targets.mesh_files import FileSurface, file_bytes, read_with
from rodshell.targets.nurbs import Nurbs
from rodshell.targets.polygons import Polygons
from rodshell.units import shown

COMPAS_FILES = (".json",)
_FORMAT = "COMPAS"


def read_compas(path: Path, name: str | None = None) -> FileSurface:
    """Read the surface of a COMPAS file.

    Args:
        name: of the object, or its key or number in the file.

    Raises:
        InputError: the file is missing or damaged, or has no such surface, or several.
    """
    data = file_bytes(path)
    found = dict(read_with(path, _FORMAT, lambda: list(_surfaces(json.loads(data)))))
    if name is None and len(found) > 1:
        raise InputError(f"{path} has {len(found)} surfaces: choose one by target.object: {', '.join(found)}")
    if not found or name not in (None, *found):
        there = f"it has {', '.join(found)}" if found else "there is neither a Mesh nor a NurbsSurface of COMPAS in it"
        raise InputError(f"{path} has no surface{f' named {shown(name)}' if name else ''}: {there}")
    kind, content = found[name or next(iter(found))]
    if kind == "Mesh":
        polygons = read_with(path, _FORMAT, lambda: _mesh(content))
        return FileSurface(polygons.points, polygons.triangles(str(path)))
    surface = read_with(path, _FORMAT, lambda: _nurbs(content))
    if surface.fault:
        raise InputError(f"{path} is damaged: {surface.fault}: write it again from COMPAS")
    return FileSurface(*surface.triangles())


def _surfaces(tree: Any, key: str = "1") -> Iterator[tuple[str, tuple[str, dict[str, Any]]]]:
    """Name, kind and data of each surface."""
    if isinstance(tree, list):
        for number, inner in enumerate(tree, start=1):
            yield from _surfaces(inner, str(number))
    elif isinstance(tree, dict) and isinstance(tree.get("dtype"), str):
        kind = tree["dtype"].rpartition("/")[2]
        if kind in ("Mesh", "NurbsSurface", "OCCNurbsSurface", "RhinoNurbsSurface"):
            yield str(tree.get("name") or key), (kind, tree["data"])
    elif isinstance(tree, dict):
        for inner_key, inner in tree.items():
            yield from _surfaces(inner, str(inner_key))


def _mesh(data: dict[str, Any]) -> Polygons:
    usual = {"x": 0.0, "y": 0.0, "z": 0.0} | data.get("default_vertex_attributes", {})
    points = np.array([[float((usual | vertex)[axis]) for axis in "xyz"] for vertex in data["vertex"].values()])
    index = {str(key): k for k, key in enumerate(data["vertex"])}
    faces = [[index[str(key)] for key in face] for face in data["face"].values()]
    corners = np.array([*chain.from_iterable(faces)], dtype=np.intp)
    return Polygons(points.reshape(-1, 3), corners, np.array([len(face) for face in faces], dtype=np.intp))


def _nurbs(data: dict[str, Any]) -> Nurbs:
    if data["is_periodic_u"] or data["is_periodic_v"]:
        raise ValueError("its surface is periodic, and only open ones are read")
    weights = np.array(data["weights"], dtype=float)[..., None]
    controls = np.concatenate([weights * np.array(data["points"], dtype=float), weights], axis=-1)
    u, v = (np.repeat(np.array(data[f"knots_{axis}"], dtype=float), data[f"mults_{axis}"]) for axis in "uv")
    return Nurbs((int(data["degree_u"]), int(data["degree_v"])), (u, v), controls)
