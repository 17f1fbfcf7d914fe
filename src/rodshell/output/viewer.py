"""What the report's 3D view shows: the shapes from flat to popped, as small as a picture needs them.

Each frame is a shape that was computed; the view steps from frame to frame and draws nothing between them.
"""

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.output.colour_scale import Colour, Scale, scale_of
from rodshell.output.grid import Shape, rods_of, shape_names, shape_of
from rodshell.output.pictures import FAMILIES, SEGMENTS
from rodshell.results import Archive
from rodshell.results.wording import nice_ticks

STEPS = 65535  # of a coordinate: 16 bits


def viewer_data(archive: Archive) -> dict[str, Any] | None:
    """The frames for templates/view.js, and what their colours are called; None where there is no shape in space."""
    names = [name for name in shape_names(archive) if name != "draped"] or []
    rods = [rod for rod in rods_of(archive) if len(rod.nodes)]
    if len(names) < 2 or not rods:
        return None
    shapes = [_frame_shape(archive, name) for name in names]
    entries, counts = _entries([len(rod.nodes) for rod in rods])
    nodes = archive.states["rod_nodes"][entries]
    cloud = np.concatenate([shape.positions[nodes] for shape in shapes])
    low, size = cloud.min(axis=0), float(np.ptp(cloud, axis=0).max())
    scales = [_scales(archive, shape) for shape in shapes]
    frames = [
        _frame(shape, coloured, nodes, entries, low, size) for shape, coloured in zip(shapes, scales, strict=True)
    ]
    kinds = {kind: scale for coloured in scales for kind, scale in coloured.items()}
    return {
        "frames": frames,
        "palettes": {kind: scale.palette for kind, scale in kinds.items()},
        "names": {kind: scale.caption.split(" in ")[0] for kind, scale in kinds.items()},
        "rods": counts,
        "inks": [FAMILIES[rod.family == "v"] for rod in rods],
        "box": ((cloud.max(axis=0) - low) / size).tolist(),
    }


def viewer_json(data: dict[str, Any]) -> str:
    """The data as they stand in a page: they cannot end its script element."""
    return json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")


def _frame_shape(archive: Archive, name: str) -> Shape:
    """The flat grid is shown where the deployment begins."""
    shape = shape_of(archive, name)
    if shape.flat and "history" in archive.states:
        return Shape("flat", shape.caption, np.asarray(archive.states["history"][0], dtype=float))
    return shape


def _entries(lengths: list[int]) -> tuple[Ints, list[int]]:
    """Entries of `rod_nodes` that are drawn, at most about SEGMENTS, and how many of them each rod has."""
    stride, first, parts = max(1, -(-sum(lengths) // SEGMENTS)), 0, []
    for length in lengths:
        parts.append(first + np.unique([*range(0, length - 1, stride), length - 1]))
        first += length
    return np.concatenate(parts).astype(np.intp), [len(part) for part in parts]


def _scales(archive: Archive, shape: Shape) -> dict[Colour, Scale]:
    """Scales by which the shape is coloured."""
    kinds: tuple[Colour, ...] = () if shape.flat else ("stress", "gap")
    found = {colour: scale_of(archive, shape, colour) for colour in kinds}
    return {colour: scale for colour, scale in found.items() if scale is not None}


def _frame(
    shape: Shape, scales: dict[Colour, Scale], nodes: Ints, entries: Ints,
    low: Floats, size: float,
) -> dict[str, Any]:  # fmt: skip
    places = np.rint((shape.positions[nodes] - low) / size * STEPS).astype("<u2")
    coloured: dict[str, Any] = {
        colour: {"bins": _packed(scale.bins[entries].astype(np.uint8)), **_legend(scale)}
        for colour, scale in scales.items()
    }
    return {"name": shape.name, "caption": shape.caption, "places": _packed(places), **coloured}


def _legend(scale: Scale) -> dict[str, Any]:
    """What stands at the colour bar."""
    ticks = nice_ticks(scale.low, scale.high, 4)
    spread = scale.high - scale.low
    return {
        "caption": scale.caption,
        "ticks": [[(value - scale.low) / spread, f"{value + 0.0:g}"] for value in ticks],
    }


def _packed(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
