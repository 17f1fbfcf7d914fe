"""COMPAS JSON: the rods as polylines, the grid as a graph. It is plain JSON, so that COMPAS need not be installed.

Load it with `compas.json_load("popped_clamped.json")`: {"rods": [Polyline, ...], "grid": Graph}, in metres.
"""

import json
from itertools import pairwise
from typing import Any

from rodshell.output.archive import Archive
from rodshell.output.rods import joint_places, joints_of, rods_of


def compas_json(archive: Archive, state: str) -> str:
    """A state of the shell; the graph's nodes are joints, its edges the rods between them."""
    positions, rods = archive.states[state], rods_of(archive)
    places = joint_places(archive, positions)
    lines = [
        {
            "dtype": "compas.geometry/Polyline",
            "data": {"points": positions[rod.nodes].tolist()},
            "name": rod.id,
        }
        for rod in rods
        if len(rod.nodes) > 1
    ]
    node = {repr(name): dict(zip("xyz", at.tolist(), strict=True)) for name, at in places.items()}
    edge: dict[str, dict[str, Any]] = {name: {} for name in node}
    on_rod: dict[int, list[tuple[float, str]]] = {}
    for joint in joints_of(rods):
        for rod_index, at in zip(joint.rods, joint.at, strict=True):
            on_rod.setdefault(rod_index, []).append((at, repr(joint.id)))
    for rod_index, row in on_rod.items():
        for (_, a), (_, b) in pairwise(sorted(row)):
            edge[a][b] = {"rod": rods[rod_index].id}
    graph = {
        "dtype": "compas.datastructures/Graph",
        "data": {
            "attributes": {},
            "default_node_attributes": {"x": 0.0, "y": 0.0, "z": 0.0},
            "default_edge_attributes": {},
            "node": node,
            "edge": edge,
            "max_node": -1,
        },
        "name": archive.name,
    }
    return json.dumps({"rods": lines, "grid": graph}, ensure_ascii=False) + "\n"
