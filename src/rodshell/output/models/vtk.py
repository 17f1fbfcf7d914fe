"""VTK PolyData for ParaView: the rods as lines with what is known at their points; a time series of the way up.

Each rod has points of its own, so that a joint can carry the stress of both rods. Arrays are binary (base64, packed).
"""

import base64
import zlib
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.output.archive import Archive
from rodshell.output.rods import rods_of
from rodshell.output.shapes import STAGE, Shape, shape_names, shape_of
from rodshell.output.svg import tag

LEVEL = 3  # of compression: half the time of 6, for files that are 5 % longer


def vtp_text(archive: Archive, name: str) -> str:
    """A shape [m]: gap [m], stress [Pa] and curvature [1/m] at the points; each line's index in `rods`."""
    shape = shape_of(archive, name)
    rods = [(k, rod.nodes) for k, rod in enumerate(rods_of(archive)) if len(rod.nodes) > 1]
    nodes = archive.states["rod_nodes"]
    offsets = np.cumsum([len(own) for _, own in rods], dtype=np.int64)
    counts = {"Points": len(nodes), "Lines": len(rods), "Verts": 0, "Strips": 0, "Polys": 0}
    piece = tag(
        "Piece",
        tag("PointData", *(_array(key, values) for key, values in _known(shape, nodes)), ""),
        tag("CellData", _array("rod", np.array([k for k, _ in rods], dtype=np.int64))),
        tag("Points", _array("Points", shape.positions[nodes], NumberOfComponents="3")),
        tag("Lines", _array("connectivity", np.arange(len(nodes))), _array("offsets", offsets)),
        **{f"NumberOf{key}": str(count) for key, count in counts.items()},
    )
    return _file("PolyData", tag("PolyData", piece))


def time_series(archive: Archive) -> Iterator[tuple[str, str]]:
    """Names and contents of the stages from flat to popped, and of the collection that ParaView opens."""
    stages = [name for name in shape_names(archive) if name.startswith(STAGE)]
    if not stages:
        return
    shares = archive.states["history_share"]
    last = "popped_pinned"
    entries = []
    for share, name in zip(shares.tolist(), ["flat", *stages, last], strict=True):
        yield f"pop_up/{name}.vtp", vtp_text(archive, name)
        entries.append(tag("DataSet", timestep=f"{share:.6f}", group="", part="0", file=f"pop_up/{name}.vtp"))
    yield "pop_up.pvd", _file("Collection", tag("Collection", *entries))


def _known(shape: Shape, nodes: Ints) -> Iterator[tuple[str, Floats]]:
    if shape.gap is not None and np.isfinite(shape.gap).all():
        yield "gap", shape.gap[nodes]
    for key, values in (("stress", shape.stress), ("curvature", shape.curvature)):
        if values is not None:
            yield key, np.asarray(values, dtype=np.float64)


def _array(name: str, values: NDArray[np.generic], **attributes: str) -> str:
    kind = {"f": "Float64", "i": "Int64"}[values.dtype.kind]
    data = np.ascontiguousarray(values).tobytes()
    packed = zlib.compress(data, LEVEL)
    header = np.array([1, len(data), len(data), len(packed)], dtype=np.uint32).tobytes()
    text = (base64.b64encode(header) + base64.b64encode(packed)).decode()
    return tag("DataArray", text, type=kind, Name=name, format="binary", **attributes)


def _file(kind: str, body: str) -> str:
    head = {"version": "1.0", "byte_order": "LittleEndian", "compressor": "vtkZLibDataCompressor"}
    words = " ".join(f'{key}="{value}"' for key, value in head.items())
    return f'<?xml version="1.0"?>\n<VTKFile type="{kind}" {words} header_type="UInt32">{body}</VTKFile>\n'
