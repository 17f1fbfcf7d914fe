"""A separate program that reads the curves of a DXF drawing with ezdxf; see `apart` and `curve_files.read_curves`."""

from typing import Any

import ezdxf
import numpy as np
from ezdxf import path as curves

_ARCS = 8  # cubics for a circle: within 4e-6 of the radius; with the four of ezdxf within 3e-4
KINDS = "LINE LWPOLYLINE POLYLINE ARC CIRCLE ELLIPSE SPLINE"


def main(request: dict[str, Any]) -> dict[str, Any]:
    """The curves of a drawing as polylines.

    Args:
        request: `path`; `sag`, of a curve's extent, how finely arcs and splines are divided; `most`, curves; and
            `farthest`, coordinate in the unit of the drawing.

    Returns:
        `count` of the curves; if it is not above `most`, `far`, the largest coordinate; if that is not beyond
        `farthest`, `points` (n, 3) of all polylines, and `ends`, where each of them ends, the first being empty.
    """
    found = ezdxf.readfile(request["path"]).modelspace().query(KINDS)
    if len(found) > request["most"]:
        return {"count": len(found)}
    paths = [(item, path) for item in found if len(path := curves.make_path(item, segments=_ARCS))]
    far = max((float(np.abs([tuple(x) for x in path.control_vertices()]).max()) for _, path in paths), default=0.0)
    if not far <= request["farthest"]:  # ezdxf never ends, or crashes, where it divides such curves
        return {"count": len(found), "far": far}
    strokes = [np.empty((0, 3))]
    for item, path in paths:
        rough = np.array([tuple(x) for x in path.control_vertices()])
        exact = item if item.dxftype() == "SPLINE" else path  # its path is an approximation
        strokes.append(np.array([tuple(x) for x in exact.flattening(request["sag"] * max(np.ptp(rough), 1e-12))]))
    ends = np.cumsum([len(stroke) for stroke in strokes])
    return {"count": len(found), "far": far, "points": np.vstack(strokes), "ends": ends}
