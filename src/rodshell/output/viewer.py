"""What the report's 3D view shows: the shapes from flat to popped, as small as a picture needs them.

Each frame is a shape that was computed; the view goes from one to the next and draws nothing between them.
"""

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.output.archive import Archive
from rodshell.output.pictures import FAMILIES, SEGMENTS
from rodshell.output.plan import nice_ticks
from rodshell.output.rods import rods_of
from rodshell.output.scale import Colour, Scale, scale_of
from rodshell.output.shapes import Shape, shape_names, shape_of

STEPS = 65535  # of a coordinate: 16 bits


def viewer_json(archive: Archive) -> str | None:
    """The frames for templates/view.js; None where there is no shape in space."""
    names = [name for name in shape_names(archive) if name != "draped"] or []
    rods = [rod for rod in rods_of(archive) if len(rod.nodes)]
    if len(names) < 2 or not rods:
        return None
    shapes = [_frame_shape(archive, name) for name in names]
    entries, counts = _entries([len(rod.nodes) for rod in rods])
    nodes = archive.states["rod_nodes"][entries]
    cloud = np.concatenate([shape.positions[nodes] for shape in shapes])
    low, size = cloud.min(axis=0), float(np.ptp(cloud, axis=0).max())
    scales: dict[Colour, dict[str, Any]] = {}
    frames = [_frame(archive, shape, nodes, entries, low, size, scales) for shape in shapes]
    view = {
        "frames": frames,
        "scales": scales,
        "rods": counts,
        "inks": [FAMILIES[rod.family == "v"] for rod in rods],
        "box": ((cloud.max(axis=0) - low) / size).tolist(),
    }
    return json.dumps(view, separators=(",", ":")).replace("<", "\\u003c")


def _frame_shape(archive: Archive, name: str) -> Shape:
    """The flat grid is shown where the way up begins."""
    shape = shape_of(archive, name)
    if shape.flat and "history" in archive.states:
        return Shape("flat", shape.caption, np.asarray(archive.states["history"][0], dtype=float))
    return shape


def _entries(lengths: list[int]) -> tuple[NDArray[np.intp], list[int]]:
    """Entries of `rod_nodes` that are drawn, at most about SEGMENTS, and how many of them each rod has."""
    stride, first, parts = max(1, -(-sum(lengths) // SEGMENTS)), 0, []
    for length in lengths:
        parts.append(first + np.unique([*range(0, length - 1, stride), length - 1]))
        first += length
    return np.concatenate(parts).astype(np.intp), [len(part) for part in parts]


def _frame(
    archive: Archive, shape: Shape, nodes: NDArray[np.intp], entries: NDArray[np.intp], low: NDArray[np.float64],
    size: float, scales: dict[Colour, dict[str, Any]],
) -> dict[str, Any]:  # fmt: skip
    places = np.rint((shape.positions[nodes] - low) / size * STEPS).astype("<u2")
    frame: dict[str, Any] = {"name": shape.name, "caption": shape.caption, "places": _packed(places)}
    kinds: tuple[Colour, ...] = ("gap", "stress")
    for colour in kinds:
        scale = scale_of(archive, shape, colour)
        if scale is not None and not shape.flat:
            frame[colour] = _packed(scale.bins[entries].astype(np.uint8))
            scales.setdefault(colour, _scale(scale))
    return frame


def _scale(scale: Scale) -> dict[str, Any]:
    ticks = nice_ticks(scale.low, scale.high, 4)
    spread = scale.high - scale.low
    return {
        "caption": scale.caption,
        "palette": scale.palette,
        "ticks": [[(value - scale.low) / spread, f"{value + 0.0:g}"] for value in ticks],
    }


def _packed(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
