"""The shell in space as polylines for other programs: OBJ and VTP, both in metres."""

import numpy as np

from gridshell.output.archive import Archive
from gridshell.output.rods import rods_of
from gridshell.output.svg import tag

GAPS = {"draped": "gap_draped", "popped_pinned": "gap_pinned", "popped_clamped": "gap_clamped"}


def obj_text(archive: Archive, state: str) -> str:
    """Wavefront OBJ [m]: all nodes, then one object with one polyline for each rod."""
    lines = [f"# gridshell, {state}, metres", *(f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in archive.states[state])]
    for rod in rods_of(archive):
        if len(rod.nodes) > 1:
            lines += [f"o {' '.join(rod.id.split()) or 'rod'}", "l " + " ".join(map(str, rod.nodes + 1))]
    return "\n".join(lines) + "\n"


def vtp_text(archive: Archive, state: str) -> str:
    """VTK PolyData [m]: a line for each rod, with its index in `rods`; the nodes' signed gap [m] if it is known."""
    points = archive.states[state]
    rods = [(k, rod.nodes) for k, rod in enumerate(rods_of(archive)) if len(rod.nodes) > 1]
    nodes = np.concatenate([nodes for _, nodes in rods]) if rods else np.empty(0, dtype=np.intp)
    offsets = np.cumsum([len(nodes) for _, nodes in rods])
    gap = archive.states.get(GAPS[state])
    finite = gap is not None and bool(np.all(np.isfinite(gap)))
    point_data = [_array("gap", "Float64", gap)] if finite and gap is not None else []
    piece = tag(
        "Piece",
        tag("PointData", *point_data, **({"Scalars": "gap"} if point_data else {})),
        tag("CellData", _array("rod", "Int32", np.array([k for k, _ in rods], dtype=np.int32)), Scalars="rod"),
        tag("Points", _array("Points", "Float64", points, NumberOfComponents="3")),
        tag("Lines", _array("connectivity", "Int64", nodes), _array("offsets", "Int64", offsets)),
        NumberOfPoints=str(len(points)), NumberOfLines=str(len(rods)),
        NumberOfVerts="0", NumberOfStrips="0", NumberOfPolys="0",
    )  # fmt: skip
    head = '<?xml version="1.0"?>\n'
    return head + tag("VTKFile", tag("PolyData", piece), type="PolyData", version="1.0", byte_order="LittleEndian")


def _array(name: str, kind: str, values: np.ndarray, **attributes: str) -> str:
    digits = "{:.9g}" if kind.startswith("Float") else "{:d}"
    rows = values if values.ndim > 1 else values[:, None]
    text = "\n".join(" ".join(digits.format(item) for item in row) for row in rows.tolist())
    return "\n" + tag("DataArray", f"\n{text}\n", type=kind, Name=name, format="ascii", **attributes) + "\n"
