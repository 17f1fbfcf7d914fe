"""Labels that never cover each other."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gridshell.output.drawing import BELOW, LETTER, LINE, Text

Floats = NDArray[np.float64]

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

    def written(self, size: float) -> Text:
        """The text itself, its box about the centre."""
        across = np.array([-np.sin(self.angle), np.cos(self.angle)])
        baseline = self.centre - (0.5 * LINE - BELOW) * size * across
        return Text(self.text, baseline, size, "LABEL", anchor="middle", angle=self.angle)

    def box(self, size: float) -> Floats:
        """Corners (4, 2) of the text's box for this text size."""
        return self.written(size).box()


class Room:
    """The boxes (4, 2) that are taken, found by the square of the plane that they lie in."""

    def __init__(self, square: float) -> None:
        self._square = square
        self._taken: dict[tuple[int, int], list[Floats]] = {}

    def free(self, box: Floats) -> bool:
        """Whether no box that was taken is met."""
        near = [other for key in self._keys(box) for other in self._taken.get(key, ())]
        return not near or not boxes_meet(box, np.array(near))

    def take(self, box: Floats) -> None:
        for key in self._keys(box):
            self._taken.setdefault(key, []).append(box)

    def _keys(self, box: Floats) -> Iterator[tuple[int, int]]:
        columns, rows = (sorted([int(value // self._square) for value in axis]) for axis in box.T.tolist())
        return ((x, y) for x in range(columns[0], columns[-1] + 1) for y in range(rows[0], rows[-1] + 1))


def place(texts: Sequence[str], rods: Floats, size: float, *, both: bool = True) -> list[Label]:
    """Labels at both ends of the rods (m, 2, 2); a second end that is too crowded goes without.

    size : of the text, in the unit of `rods`.
    both : else at the first end only.
    """
    placed: list[Label] = []
    room = Room(4 * size)
    for end in (0, 1) if both else (0,):
        for k, text in enumerate(texts):
            label = _first_free(text, rods[k, end], rods[k, 1 - end], size, room, rods, must=end == 0)
            if label is not None:
                placed.append(label)
                room.take(label.box(size))
    return placed


def leaders(labels: Sequence[Label], size: float) -> Iterator[Floats]:
    """Lines (2, 2) from the rods' ends to those labels that stand off, where no other label is in their way."""
    boxes = [label.box(size) for label in labels]
    for k, label in enumerate(labels):
        away = label.centre - label.end
        near = label.centre - away / np.linalg.norm(away) * size * (0.3 + 0.5 * LETTER * len(label.text))
        line = np.array([label.end, near])
        others = (
            box for j, box in enumerate(boxes) if j != k and np.ptp([box[0], label.centre], axis=0).max() < 80 * size
        )
        if label.moved and not any(lines_meet(box, line[None]) for box in others):
            yield line


def spread(places: ArrayLike, gap: float) -> Floats:
    """Places (k,) next to those asked for, in the same order, at least `gap` apart: least squares.

    Pool adjacent violators: neighbours that are too close form a group about the mean of what they asked for.
    """
    asked = np.asarray(places, dtype=float)
    order = np.argsort(asked, kind="stable")
    wanted = asked[order] - gap * np.arange(len(asked))  # now they need only be ascending
    groups: list[tuple[float, int]] = []
    for value in wanted.tolist():
        group = (value, 1)
        while groups and groups[-1][0] > group[0]:
            mean, count = groups.pop()
            group = ((mean * count + group[0] * group[1]) / (count + group[1]), count + group[1])
        groups.append(group)
    result = np.empty_like(asked)
    result[order] = np.concatenate([np.full(n, mean) for mean, n in groups] or [np.empty(0)]) + gap * np.arange(
        len(asked)
    )
    return result


def _first_free(
    text: str, end: Floats, other: Floats, size: float, room: Room, rods: Floats, *, must: bool
) -> Label | None:
    for label, step in _places(text, end, other, size):
        box = label.box(size)
        if step >= NEAR and not must:
            return None
        if room.free(box) and (step >= NEAR or not lines_meet(box, rods)):
            return label
    return None


def _places(text: str, end: Floats, other: Floats, size: float) -> Iterable[tuple[Label, int]]:
    """Places on the rod's own line, from its end outwards."""
    outward = (end - other) / np.linalg.norm(end - other)
    angle = upright(float(np.arctan2(outward[1], outward[0])))
    first = (0.55 + 0.5 * LETTER * len(text)) * size
    for step in range(FAR):
        yield Label(text, end + (first + 0.5 * step * size) * outward, angle, end, step > 2), step


def upright(angle: float) -> float:
    """The angle [rad] of a text along a line, turned by pi where it would stand on its head."""
    if LOWEST < angle <= LOWEST + np.pi:
        return angle
    return angle + (np.pi if angle < 0 else -np.pi)


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
