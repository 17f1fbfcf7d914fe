"""A reader of DXF that knows nothing of the library that wrote it: pairs of a group code and a value."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Entity:
    """An entity: its kind, its layer, and the points, in the plane or in space, that it has [mm]."""

    kind: str
    layer: str
    points: np.ndarray
    text: str = ""


def read_dxf(path: Path) -> list[Entity]:
    """All lines, polylines, circles and texts of the model space."""
    lines = path.read_text(encoding="utf-8").splitlines()
    pairs = [(int(code), value.strip()) for code, value in zip(lines[::2], lines[1::2], strict=True)]
    start = next(k for k, pair in enumerate(pairs) if pair == (2, "ENTITIES"))
    stop = next(k for k in range(start, len(pairs)) if pairs[k] == (0, "ENDSEC"))
    return list(_entities(pairs[start + 1 : stop]))


def _entities(pairs: list[tuple[int, str]]) -> Iterator[Entity]:
    starts = [k for k, (code, _) in enumerate(pairs) if code == 0]
    parts = [pairs[a:b] for a, b in zip(starts, [*starts[1:], len(pairs)], strict=True)]
    k = 0
    while k < len(parts):
        kind, codes = parts[k][0][1], parts[k]
        layer = next((value for code, value in codes if code == 8), "")
        text = next((value for code, value in codes if code == 1), "")
        if kind == "POLYLINE":
            vertices = []
            while parts[k + 1][0][1] == "VERTEX":
                k += 1
                vertices.append([_first(parts[k], code) for code in (10, 20, 30)])
            yield Entity(kind, layer, np.array(vertices))
        elif kind == "LINE":
            yield Entity(kind, layer, np.array([[_first(codes, c) for c in row] for row in ((10, 20), (11, 21))]))
        elif kind == "LWPOLYLINE":
            columns = [[float(value) for code, value in codes if code == wanted] for wanted in (10, 20)]
            yield Entity(kind, layer, np.column_stack(columns))
        elif kind in ("CIRCLE", "TEXT"):
            yield Entity(kind, layer, np.array([[_first(codes, 10), _first(codes, 20)]]), text)
        k += 1


def _first(codes: list[tuple[int, str]], wanted: int) -> float:
    return next(float(value) for code, value in codes if code == wanted)


def rods_of_dxf(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Flat ends (m, 2, 2) and final ends (m, 2, 3) of the rods of a plan [mm], from its layers alone.

    A vertex of BOUNDARY-FLAT is where a rod's end is held; that of BOUNDARY-FINAL with its number is where it goes.
    """
    entities = read_dxf(path)
    flat = np.array([one.points for one in entities if one.layer == "CUT"])
    (before,) = (one.points for one in entities if one.layer == "BOUNDARY-FLAT")
    (after,) = (one.points for one in entities if one.layer == "BOUNDARY-FINAL")
    apart = np.linalg.norm(flat[:, :, None] - before, axis=-1)
    nearest = np.argsort(apart, axis=-1)[..., :1][..., 0]
    assert apart.min(axis=-1).max() < 1e-6
    return flat, after[nearest]
