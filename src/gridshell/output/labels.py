"""Labels that never cover each other."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gridshell.output.drawing import BELOW, LETTER, LINE, Text

Floats = NDArray[np.float64]
Extent = tuple[float, float, float, float]

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
    """The boxes (4, 2) that are taken, found by the square of the plane that they lie in.

    within : another, in which all that is taken is taken here too.
    """

    def __init__(self, square: float, within: "Room | None" = None) -> None:
        self._square = square
        self._taken: dict[tuple[int, int], list[tuple[Extent, Floats]]] = {}
        self._own = list[Floats]()
        self._within = within

    def free(self, box: Floats) -> bool:
        """Whether no box that was taken is met."""
        if self._within is not None and not self._within.free(box):
            return False
        extent = left, low, right, high = _extent(box)
        near = [
            other
            for square in self._squares(extent)
            for (x0, y0, x1, y1), other in self._taken.get(square, ())
            if x0 < right and left < x1 and y0 < high and low < y1
        ]
        return not near or not boxes_meet(box, np.array(near))

    def take(self, box: Floats) -> None:
        self._own.append(box)
        extent = _extent(box)
        for square in self._squares(extent):
            self._taken.setdefault(square, []).append((extent, box))

    def claim(self, box: Floats) -> bool:
        """Take the box if it is free; whether it was."""
        free = self.free(box)
        if free:
            self.take(box)
        return free

    def join(self, other: "Room") -> None:
        """Take all that the other has taken."""
        for box in other._own:
            self.take(box)

    def _squares(self, extent: Extent) -> list[tuple[int, int]]:
        left, low, right, high = (int(value // self._square) for value in extent)
        return [(x, y) for x in range(left, right + 1) for y in range(low, high + 1)]


def _extent(box: Floats) -> Extent:
    """Lowest x and y, highest x and y."""
    (a, b, c, d), (e, f, g, h) = box.T.tolist()
    return min(a, b, c, d), min(e, f, g, h), max(a, b, c, d), max(e, f, g, h)


def place(texts: Sequence[str], rods: Floats, size: float, *, at: NDArray[np.bool_] | None = None) -> list[Label]:
    """Labels at both ends of the rods (m, 2, 2); a second end that is too crowded goes without.

    size : of the text, in the unit of `rods`.
    at : (m, 2) whether an end is to have one; default: all.
    """
    placed: list[Label] = []
    room = Room(4 * size)
    wanted = np.ones((len(rods), 2), dtype=bool) if at is None else at
    for end in (0, 1):
        for k in np.flatnonzero(wanted[:, end]).tolist():
            must = end == 0 or not wanted[k, 0]
            label = _first_free(texts[k], rods[k, end], rods[k, 1 - end], size, room, rods, must=must)
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
    """Whether one of the lines (m, 2, 2) runs through the rectangle (4, 2): no axis separates them."""
    sides = box[[1, 3]] - box[0]
    axes = (2.0 * sides / np.sum(sides**2, axis=1)[:, None]).T
    return bool(runs_through((lines - box.mean(axis=0)) @ axes).any())


def runs_through(lines: Floats) -> NDArray[np.bool_]:
    """(...) whether each of the lines (..., 2, 2) runs through the square from -1 to 1: no axis separates them."""
    low, high = lines.min(axis=-2), lines.max(axis=-2)
    off = lines[..., 0, 0] * lines[..., 1, 1] - lines[..., 0, 1] * lines[..., 1, 0]
    apart = (low >= 1.0).any(axis=-1) | (high <= -1.0).any(axis=-1) | (np.abs(off) > (high - low).sum(axis=-1))
    return np.asarray(~apart)
