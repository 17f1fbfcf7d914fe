"""Rectangles of any direction in the plane: whether they meet each other, or lines, by axes that separate them
[Ericson, Real-Time Collision Detection, section 5.2.1]."""

from collections.abc import Iterable, Sequence

import numpy as np

from rodshell.arrays import Floats
from rodshell.kernels import njit

Corners = Sequence[tuple[float, float]]


def boxes_meet(box: Floats, others: Iterable[Floats]) -> bool:
    """Whether the rectangle (4, 2), its corners in a row, covers a part of one of the others."""
    corners = box.tolist()
    return any(not _apart(corners, other.tolist()) for other in others)


def _apart(box: Corners, other: Corners) -> bool:
    """Whether an axis along a side of one of two rectangles separates them; they may touch."""
    for (ax, ay), (bx, by), _, (dx, dy) in (box, other):
        for ux, uy in ((bx - ax, by - ay), (dx - ax, dy - ay)):
            p, q = ([ux * x + uy * y for x, y in corners] for corners in (box, other))
            if max(p) <= min(q) or max(q) <= min(p):
                return True
    return False


def lines_meet(box: Floats, lines: Floats) -> bool:
    """Whether one of the lines (m, 2, 2), from end to end, runs through the rectangle (4, 2): no axis separates
    them."""
    return bool(each_meets(box[None], lines[None])[0])


@njit("f3 f4")
def each_meets(boxes, lines):  # type: ignore[no-untyped-def]
    """(n,) whether one of its own `lines` (n, m, 2, 2) runs through each of the rectangles `boxes` (n, 4, 2).

    In coordinates along its sides each rectangle is the square from -1 to 1.
    """
    met = np.zeros(len(boxes), dtype=np.bool_)
    for n in range(len(boxes)):
        (x0, y0), (x1, y1), (x2, y2), (x3, y3) = boxes[n, 0], boxes[n, 1], boxes[n, 2], boxes[n, 3]
        x, y, ux, uy, vx, vy = 0.5 * (x0 + x2), 0.5 * (y0 + y2), x1 - x0, y1 - y0, x3 - x0, y3 - y0
        wide, tall = 2.0 / (ux * ux + uy * uy), 2.0 / (vx * vx + vy * vy)
        for k in range(lines.shape[1]):
            px, py, qx, qy = lines[n, k, 0, 0] - x, lines[n, k, 0, 1] - y, lines[n, k, 1, 0] - x, lines[n, k, 1, 1] - y
            a, b = wide * (px * ux + py * uy), tall * (px * vx + py * vy)
            c, d = wide * (qx * ux + qy * uy), tall * (qx * vx + qy * vy)
            left, right, low, high = min(a, c), max(a, c), min(b, d), max(b, d)
            apart = left >= 1.0 or low >= 1.0 or right <= -1.0 or high <= -1.0
            if not (apart or abs(a * d - b * c) > (right - left) + (high - low)):
                met[n] = True
                break
    return met


def length_beneath(box: Floats, shifts: Floats, lines: Floats) -> Floats:
    """(k,) length of all `lines` (m, 2, 2) together that is within the rectangle (4, 2) where it is after each of the
    `shifts` (k, 2)."""
    corners = (box + shifts[:, None]).reshape(-1, 2)
    lines = lines_near(lines, corners.min(axis=0, initial=np.inf), corners.max(axis=0, initial=-np.inf))
    sides = box[[1, 3]] - box[0]
    axes = (2.0 * sides / (sides**2).sum(axis=1)[:, None]).T
    start = (lines[:, 0] - box.sum(axis=0) / 4) @ axes - (shifts @ axes)[:, None]  # the rectangle is from -1 to 1
    along = (lines[:, 1] - lines[:, 0]) @ axes
    along = np.where(np.abs(along) < 1e-12, 1e-12, along)
    low, high = (-1.0 - start) / along, (1.0 - start) / along  # shares of each line at which it meets the sides
    enters, leaves = np.minimum(low, high), np.maximum(low, high)
    enter, leave = np.maximum(enters[..., 0], enters[..., 1]), np.minimum(leaves[..., 0], leaves[..., 1])
    shares = np.maximum(np.minimum(leave, 1.0) - np.maximum(enter, 0.0), 0.0)
    return np.asarray(shares @ np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1))


def lines_near(lines: Floats, low: Floats, high: Floats) -> Floats:
    """Those of the lines (m, 2, 2) that may come into the rectangle from its lower left corner `low` to the upper right
    `high`."""
    a, b = lines[:, 0], lines[:, 1]
    near = (np.minimum(a, b) < high) & (np.maximum(a, b) > low)
    return np.asarray(lines[near[:, 0] & near[:, 1]])
