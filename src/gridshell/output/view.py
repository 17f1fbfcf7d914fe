"""An axonometric view: from the right, the front and above, without perspective."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gridshell.output.plan import nice_ticks
from gridshell.output.svg import label, number, tag

Floats = NDArray[np.float64]

AZIMUTH, ELEVATION = np.radians(-62.0), np.radians(27.0)  # of the eye
_C, _S, _CE, _SE = np.cos(AZIMUTH), np.sin(AZIMUTH), np.cos(ELEVATION), np.sin(ELEVATION)
RIGHT = np.array([-_S, _C, 0.0])
UP = np.array([-_SE * _C, -_SE * _S, _CE])
TOWARDS = np.array([_CE * _C, _CE * _S, _SE])


@dataclass(frozen=True)
class View:
    """A box in space [m] drawn `width` units wide.

    Parameters
    ----------
    low, high : (3,) corners of the box [m].
    scale : drawing units per metre.
    shift : (2,) added to the projected coordinates, so that the box starts at (0, 0).
    size : (2,) width and height of the drawn box.
    """

    low: Floats
    high: Floats
    scale: float
    shift: Floats
    size: Floats

    @staticmethod
    def of(points: Floats, width: float) -> "View":
        """The view of all points (n, 3) [m] and of the ground below them."""
        low, high = points.min(axis=0), points.max(axis=0)
        corners = np.array([[x, y, low[2]] for x in (low[0], high[0]) for y in (low[1], high[1])])
        corners = np.concatenate([corners, points])
        plane = np.column_stack([corners @ RIGHT, -corners @ UP])
        spread = np.ptp(plane, axis=0)
        scale = width / max(spread[0], 1e-12)
        return View(low, high, float(scale), -scale * plane.min(axis=0), scale * spread)

    def project(self, points: Floats) -> Floats:
        """(n, 2) drawing coordinates, y down, of the points (n, 3) [m]."""
        return np.asarray(self.scale * np.column_stack([points @ RIGHT, -points @ UP]) + self.shift)

    def depth(self, points: Floats) -> Floats:
        """(n,) nearness of the points to the eye, 0 (far) to 1 (near)."""
        if not len(points):
            return np.empty(0)
        nearness = points @ TOWARDS
        return np.asarray((nearness - nearness.min()) / max(np.ptp(nearness), 1e-12))


def ground_axes(view: View, colour: str, text: float) -> str:
    """The box's ground with millimetre ticks on its front edges, and the height on the left."""
    (x0, y0, z0), (x1, y1, z1) = view.low, view.high
    corner = np.array([[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]])
    outline = " ".join(f"{number(x)},{number(y)}" for x, y in view.project(corner))
    parts = [tag("polygon", points=outline, fill="none", stroke=colour, stroke_width=0.8, stroke_opacity=0.45)]
    span = 0.02 * max(x1 - x0, y1 - y0)
    along_x = [np.array([1e-3 * t, y0, z0]) for t in nice_ticks(1e3 * x0, 1e3 * x1, 5)]
    along_y = [np.array([x1, 1e-3 * t, z0]) for t in nice_ticks(1e3 * y0, 1e3 * y1, 5)]
    along_z = [np.array([x0, y0, 1e-3 * t]) for t in nice_ticks(1e3 * z0, 1e3 * z1, 3)]
    parts += [_tick(view, p, np.array([0, -span, 0]), p[0], colour, text) for p in along_x]
    parts += [_tick(view, p, np.array([span, 0, 0]), p[1], colour, text) for p in along_y]
    middle = np.array([[(x0 + x1) / 2, y0 - 8 * span, z0], [x1 + 8 * span, (y0 + y1) / 2, z0]])
    for name, (x, y) in zip("xy", view.project(middle), strict=True):
        parts.append(label(f"{name}, mm", x, y + 0.35 * text, text, text_anchor="middle", fill=colour))
    if z1 - z0 > span:
        foot, top = view.project(np.array([[x0, y0, z0], [x0, y0, z1]]))
        parts += [
            _line(foot, top, colour),
            label("z, mm", top[0], top[1] - 0.8 * text, text, text_anchor="middle", fill=colour),
        ]
        out = np.array([-0.6 * span, -0.6 * span, 0])
        parts += [_tick(view, p, out, p[2], colour, text) for p in along_z if p[2] > z0 + 0.05 * (z1 - z0)]
    return "".join(parts)


def _tick(view: View, point: Floats, out: Floats, value: float, colour: str, text: float) -> str:
    """A short line outwards from `point`, and the value [m] in mm beyond it."""
    a, b, c = view.project(np.array([point, point + out, point + 2.6 * out]))
    anchor = "end" if b[0] < a[0] - 1 else "start" if b[0] > a[0] + 1 else "middle"
    shown = number(1e3 * value).replace("-", "\N{MINUS SIGN}")
    return _line(a, b, colour) + label(shown, c[0], c[1] + 0.35 * text, text, text_anchor=anchor, fill=colour)


def _line(a: Floats, b: Floats, colour: str) -> str:
    return tag("line", x1=a[0], y1=a[1], x2=b[0], y2=b[1], stroke=colour, stroke_width=0.8)
