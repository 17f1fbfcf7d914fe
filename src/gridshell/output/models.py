"""The shell in space as polylines for other programs: OBJ and VTP, both in metres."""

import numpy as np

from gridshell.output.archive import GAPS, Archive
from gridshell.output.rods import rods_of
from gridshell.output.svg import tag


def obj_text(archive: Archive, state: str) -> str:
    """Wavefront OBJ [m]: all nodes, then one object with one polyline for each rod."""
    lines = [
        f"# gridshell, {state}, metres",
        *(f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in archive.states[state]),
    ]
    for rod in rods_of(archive):
        if len(rod.nodes) > 1:
            lines += [f"o {' '.join(rod.id.split()) or 'rod'}", "l " + " ".join(map(str, rod.nodes + 1))]
    return "\n".join(lines) + "\n"


def vtp_text(archive: Archive, state: str) -> str:
    """VTK PolyData [m]: a line a rod with its index in `rods`; the nodes' signed gap [m] if known."""
    points, gap = archive.states[state], archive.states.get(GAPS[state])
    rods = [(k, rod.nodes) for k, rod in enumerate(rods_of(archive)) if len(rod.nodes) > 1]
    nodes = np.concatenate([np.empty(0, dtype=np.intp), *(own for _, own in rods)])
    offsets = np.cumsum([len(own) for _, own in rods], dtype=np.intp)
    index = np.array([k for k, _ in rods], dtype=np.intp)
    known = gap is not None and bool(np.all(np.isfinite(gap)))
    counts = {"Points": len(points), "Lines": len(rods), "Verts": 0, "Strips": 0, "Polys": 0}
    piece = tag(
        "Piece",
        tag("PointData", _array("gap", "Float64", gap), Scalars="gap") if known and gap is not None else "",
        tag("CellData", _array("rod", "Int32", index), Scalars="rod"),
        tag("Points", _array("Points", "Float64", points, NumberOfComponents="3")),
        tag("Lines", _array("connectivity", "Int64", nodes), _array("offsets", "Int64", offsets)),
        **{f"NumberOf{name}": str(count) for name, count in counts.items()},
    )
    body = tag("PolyData", piece)
    return '<?xml version="1.0"?>\n' + tag("VTKFile", body, type="PolyData", version="1.0") + "\n"


def _array(name: str, kind: str, values: np.ndarray, **attributes: str) -> str:
    digits = "{:.9g}" if kind.startswith("Float") else "{:d}"
    rows = values if values.ndim > 1 else values[:, None]
    text = "\n".join(" ".join(digits.format(item) for item in row) for row in rows.tolist())
    return "\n" + tag("DataArray", f"\n{text}\n", type=kind, Name=name, format="ascii", **attributes) + "\n"
