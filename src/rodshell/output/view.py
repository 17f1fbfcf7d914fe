"""An axonometric view: from the right, the front and above, without perspective."""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats
from rodshell.output.colour_scale import mixed
from rodshell.output.drawing import Pen, Pencil
from rodshell.output.svg import number
from rodshell.results.wording import MINUS, nice_ticks

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
    shift : (2,) added to the projected coordinates, so that the box's upper left corner is (0, 0).
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
        plane = np.column_stack([corners @ RIGHT, corners @ UP])
        spread = np.ptp(plane, axis=0)
        scale = width / max(spread[0], 1e-12)
        left_top = np.array([plane[:, 0].min(), plane[:, 1].max()])
        return View(low, high, float(scale), -scale * left_top, scale * spread)

    def project(self, points: Floats) -> Floats:
        """(n, 2) drawing coordinates, y up, of the points (n, 3) [m]."""
        return np.asarray(self.scale * np.column_stack([points @ RIGHT, points @ UP]) + self.shift)

    def depth(self, points: Floats) -> Floats:
        """(n,) nearness of the points to the eye, 0 (far) to 1 (near)."""
        if not len(points):
            return np.empty(0)
        nearness = points @ TOWARDS
        return np.asarray((nearness - nearness.min()) / max(np.ptp(nearness), 1e-12))


def ground_axes(pencil: Pencil, view: View, colour: str, text: float) -> None:
    """The box's ground with millimetre ticks on its front edges, and the height on the left.

    Parameters
    ----------
    view : of the box; colour : of lines and numbers; text : size of the numbers [drawing units].
    """
    (x0, y0, z0), (x1, y1, z1) = view.low, view.high
    thin, pale = Pen(colour, 0.8), Pen(mixed(colour, "#ffffff", 0.55), 0.8)
    corners = np.array([[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]])
    pencil.line(view.project(corners), "DIM", closed=True, pen=pale)
    span = 0.02 * max(x1 - x0, y1 - y0)

    def tick(point: list[float], out: list[float], value: float) -> None:
        """A short line outwards from `point`, and the value [m] in mm beyond it."""
        at, off = np.array(point), np.array(out)
        a, b, c = view.project(np.array([at, at + off, at + 2.6 * off]))
        anchor = "end" if b[0] < a[0] - 1 else "start" if b[0] > a[0] + 1 else "middle"
        pencil.line([a, b], "DIM", pen=thin)
        shown = number(1e3 * value).replace("-", MINUS)
        pencil.write(shown, c - (0, 0.35 * text), text, "DIM", anchor=anchor, colour=colour)

    for value in nice_ticks(1e3 * x0, 1e3 * x1, 5):
        tick([1e-3 * value, y0, z0], [0, -span, 0], 1e-3 * value)
    for value in nice_ticks(1e3 * y0, 1e3 * y1, 5):
        tick([x1, 1e-3 * value, z0], [span, 0, 0], 1e-3 * value)
    middle = np.array([[(x0 + x1) / 2, y0 - 8 * span, z0], [x1 + 8 * span, (y0 + y1) / 2, z0]])
    for name, at in zip("xy", view.project(middle), strict=True):
        pencil.write(f"{name}, mm", at - (0, 0.35 * text), text, "DIM", anchor="middle", colour=colour)
    if z1 - z0 > span:
        foot, top = view.project(np.array([[x0, y0, z0], [x0, y0, z1]]))
        pencil.line([foot, top], "DIM", pen=thin)
        pencil.write("z, mm", top + (0, 0.8 * text), text, "DIM", anchor="middle", colour=colour)
        for value in nice_ticks(1e3 * z0, 1e3 * z1, 3):
            if value > 1e3 * (z0 + 0.05 * (z1 - z0)):
                tick([x0, y0, 1e-3 * value], [-0.6 * span, -0.6 * span, 0], 1e-3 * value)
