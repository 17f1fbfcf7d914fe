"""Rod labels beyond the rods' ends, moved outwards until none covers another."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LETTER = 0.62  # width of a capital or digit over the text size
LINE = 0.95  # height of a line of text over its size, a little air included
LOWEST = np.radians(-75.0)  # angle of a text: readable from below or from the right, also when somewhat steeper
NEAR, FAR = 14, 150  # places that are tried at an end: where no rod is covered either; at all


@dataclass(frozen=True)
class Label:
    """A rod's label at one of its ends.

    Parameters
    ----------
    centre : (2,) middle of the text.
    angle : of the text against x [rad].
    end : (2,) the rod's end that it belongs to.
    moved : whether it stands so far off that it needs a line to its rod.
    """

    text: str
    centre: Floats
    angle: float
    end: Floats
    moved: bool

    def box(self, size: float) -> Floats:
        """Corners (4, 2) of the text's box for this text size."""
        along = np.array([np.cos(self.angle), np.sin(self.angle)])
        half = 0.5 * LETTER * size * len(self.text) * along
        side = 0.5 * LINE * size * np.array([-along[1], along[0]])
        return np.array([self.centre + a * half + b * side for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def place(texts: Sequence[str], rods: Floats, size: float) -> list[Label]:
    """Labels at both ends of the rods (m, 2, 2); a second end that is too crowded goes without.

    size : of the text, in the unit of `rods`.
    """
    placed: list[Label] = []
    boxes = np.empty((0, 4, 2))
    for end in (0, 1):
        for k, text in enumerate(texts):
            label = _first_free(text, rods[k, end], rods[k, 1 - end], size, boxes, rods, must=end == 0)
            if label is not None:
                placed.append(label)
                boxes = np.concatenate([boxes, label.box(size)[None]])
    return placed


def _first_free(
    text: str, end: Floats, other: Floats, size: float, boxes: Floats, rods: Floats, *, must: bool
) -> Label | None:
    for label, step in _places(text, end, other, size):
        box = label.box(size)
        if step >= NEAR and not must:
            return None
        if not boxes_meet(box, boxes) and (step >= NEAR or not lines_meet(box, rods)):
            return label
    return next(_places(text, end, other, size))[0]


def _places(text: str, end: Floats, other: Floats, size: float) -> Iterator[tuple[Label, int]]:
    """Places on the rod's own line, from its end outwards."""
    outward = (end - other) / np.linalg.norm(end - other)
    angle = float(np.arctan2(outward[1], outward[0]))
    if not LOWEST < angle <= LOWEST + np.pi:
        angle += np.pi if angle < 0 else -np.pi
    first = (0.55 + 0.5 * LETTER * len(text)) * size
    for step in range(FAR):
        yield Label(text, end + (first + 0.5 * step * size) * outward, angle, end, step > 2), step


def boxes_meet(box: Floats, others: Floats) -> bool:
    """Whether the rectangle (4, 2) covers a part of one of `others` (m, 4, 2): no axis separates them."""
    if not len(others):
        return False
    mine = np.broadcast_to(box[[1, 3]] - box[0], (len(others), 2, 2))
    sides = np.concatenate([mine, others[:, [1, 3]] - others[:, :1]], axis=1)
    p, q = np.einsum("mac,pc->map", sides, box), np.einsum("mac,mpc->map", sides, others)
    apart = (p.max(-1) <= q.min(-1)) | (q.max(-1) <= p.min(-1))
    return bool(np.any(~apart.any(axis=1)))


def lines_meet(box: Floats, lines: Floats) -> bool:
    """Whether one of the lines (m, 2, 2) runs through the rectangle (4, 2)."""
    middle, sides = box.mean(axis=0), box[[1, 3]] - box[0]
    local = np.einsum("mpc,ac->mpa", lines - middle, sides / np.sum(sides**2, axis=1)[:, None])  # box: +-1/2
    start, along = local[:, 0], local[:, 1] - local[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        hits = (np.array([-0.5, 0.5])[:, None, None] - start) / along  # (2, m, axis) parameters on the line
    outside = (along == 0) & (np.abs(start) > 0.5)
    hits = np.where(along == 0, np.array([-np.inf, np.inf])[:, None, None], hits)
    enter = np.maximum(hits.min(axis=0).max(axis=1), 0.0)
    leave = np.minimum(hits.max(axis=0).min(axis=1), 1.0)
    return bool(np.any((enter < leave) & ~outside.any(axis=1)))
