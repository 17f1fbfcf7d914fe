"""What a DXF file holds, as ezdxf reads it."""

from dataclasses import dataclass
from pathlib import Path

import ezdxf
import numpy as np
from ezdxf.entities import DXFEntity


@dataclass(frozen=True)
class Entity:
    """An entity: its kind, its layer, and the points, in the plane or in space, that it has [mm]."""

    kind: str
    layer: str
    points: np.ndarray


def read_dxf(path: Path) -> list[Entity]:
    """All lines, polylines, circles and texts of the model space."""
    space = ezdxf.readfile(path).modelspace()
    return [Entity(one.dxftype(), one.dxf.layer, _points(one)) for one in space]


def _points(entity: DXFEntity) -> np.ndarray:
    kind, dxf = entity.dxftype(), entity.dxf
    if kind == "LINE":
        return np.array([list(dxf.start.vec2), list(dxf.end.vec2)])
    if kind == "LWPOLYLINE":
        return np.array(entity.get_points("xy"))
    if kind == "POLYLINE":
        return np.array([list(point) for point in entity.points()])
    return np.array([list((dxf.center if kind == "CIRCLE" else dxf.insert).vec2)])


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
