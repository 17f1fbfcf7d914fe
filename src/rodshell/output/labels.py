"""Labels that never cover each other, and callouts: names along an outline, each with a line to its place."""

import sys
from collections.abc import Iterable, Sequence
from math import cos, hypot, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import isotonic_regression

from rodshell.arrays import Bools, Floats
from rodshell.geometry.boxes import boxes_meet, lines_meet, lines_near
from rodshell.output.drawing import BELOW, LETTER, LINE, SMALL, Pencil, Text

_Extent = tuple[float, float, float, float]

NOISE = 1e-3  # rad: a text that leans no more than this beyond the vertical is vertical
CLOSE = 5  # positions that are tried on a label's line
STEPS, _TURNS = 40, np.pi / 8 * np.array([0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7, 8])  # and next to it
THIN = 0.1  # what a line takes, over the size of its text


class Label(NamedTuple):
    """A rod's label at one of its ends.

    Args:
        centre: (2,) middle of the text.
        angle: of the text against x [rad].
        end: (2,) the rod's end that it belongs to.
        moved: whether it stands so far off that it needs a line to its rod.
    """

    text: str
    centre: Floats
    angle: float
    end: Floats
    moved: bool

    def written(self, size: float) -> Text:
        """The text itself, its box about the centre."""
        (x, y), down = self.centre.tolist(), (0.5 * LINE - BELOW) * size
        baseline = np.array([x + down * sin(self.angle), y - down * cos(self.angle)])
        return Text(self.text, baseline, size, "LABEL", anchor="middle", angle=self.angle)

    def box(self, size: float) -> Floats:
        """Corners (4, 2) of the text's box for this text size."""
        return self.written(size).box()

    def leader(self, size: float) -> Floats:
        """Line (2, 2) from the end to the nearest place of the text's box."""
        (x, y), (a, b), c, s = self.end.tolist(), self.centre.tolist(), cos(self.angle), sin(self.angle)
        wide, tall = 0.5 * size * (LETTER * len(self.text) + 0.2), 0.5 * size * LINE
        u = min(max(c * (x - a) + s * (y - b), -wide), wide)
        v = min(max(c * (y - b) - s * (x - a), -tall), tall)
        return np.array([(x, y), (a + c * u - s * v, b + s * u + c * v)])


_MOST_SQUARES = 10_000  # that a box is found by; one that lies in more is compared with all
WIDE = ()


class Room:
    """The boxes (4, 2) that are taken, also those `within` an outer room, found by the square of the plane that they
    lie in."""

    def __init__(self, square: float, within: "Room | None" = None) -> None:
        self._square = square
        self._taken: dict[tuple[int, ...], list[tuple[_Extent, Floats]]] = {}
        self._boxes = list[Floats]()
        self._within = within

    def free(self, box: Floats) -> bool:
        """Whether no box that was taken is met."""
        if self._within is not None and not self._within.free(box):
            return False
        extent = left, low, right, high = _extent(box)
        squares, taken = self._squares(extent), self._taken
        lists = taken.values() if squares == [WIDE] else (taken.get(square, ()) for square in (*squares, WIDE))
        near = [
            other
            for boxes in lists
            for (x0, y0, x1, y1), other in boxes
            if x0 < right and left < x1 and y0 < high and low < y1
        ]
        return not boxes_meet(box, near)

    def take(self, box: Floats) -> None:
        self._boxes.append(box)
        extent = _extent(box)
        for square in self._squares(extent):
            self._taken.setdefault(square, []).append((extent, box))

    def claim(self, box: Floats) -> bool:
        """Take the box if it is free; whether it was."""
        free = self.free(box)
        if free:
            self.take(box)
        return free

    def write(self, pencil: Pencil, texts: Iterable[Text]) -> bool:
        """Write the first of some texts that finds room, which it takes; whether one did."""
        found = next((text for text in texts if self.claim(text.box())), None)
        pencil.texts += [found] if found else []
        return found is not None

    def join(self, other: "Room") -> None:
        """Take all that the other has taken."""
        for box in other._boxes:
            self.take(box)

    def _squares(self, extent: _Extent) -> list[tuple[int, ...]]:
        (left, low, right, high), square = extent, self._square
        if (right - left + square) * (high - low + square) > _MOST_SQUARES * square**2:
            return [WIDE]
        rows = range(int(low // square), int(high // square) + 1)
        return [(x, y) for x in range(int(left // square), int(right // square) + 1) for y in rows]


def _extent(box: Floats) -> _Extent:
    """Lowest x and y, highest x and y."""
    (a, b, c, d), (e, f, g, h) = box.T.tolist()
    return min(a, b, c, d), min(e, f, g, h), max(a, b, c, d), max(e, f, g, h)


def place(texts: Sequence[str], rods: Floats, size: float, *, at: Bools | None = None) -> list[Label]:
    """Labels at both ends of the rods (m, 2, 2), each on its rod's line.

    A rod that finds room at neither end has its label next to its first end; where there is none it goes without.

    Args:
        size: of the text, in the unit of `rods`.
        at: (m, 2) whether an end is to have one; default: all.
    """
    placed: list[Label] = []
    room, labelled = Room(4 * size), np.zeros(len(rods), dtype=bool)
    wanted = np.ones((len(rods), 2), dtype=bool) if at is None else at
    for end in (0, 1):
        for k in np.flatnonzero(wanted[:, end]).tolist():
            choices = _on_own_line(texts[k], rods[k, end], rods[k, 1 - end], size)
            label = next((label for label in choices if _fits(label, size, room, rods)), None)
            if label is not None:
                placed.append(label)
                take(label, size, room)
                labelled[k] = True
    for k in np.flatnonzero(wanted.any(axis=1) & ~labelled).tolist():
        end = int(np.argmax(wanted[k]))
        label = nearby(texts[k], rods[k, end], rods[k, end] - rods[k, 1 - end], size, room, rods)
        if label is not None:
            placed.append(label)
            take(label, size, room)
    return placed


def nearby(text: str, end: Floats, way: Floats, size: float, room: Room, lines: Floats) -> Label | None:
    """The nearest place to an end for a level text, and for a line to it, clear of all that is taken.

    The text covers none of the lines (m, 2, 2) either, the line to it may cross them.

    Args:
        way: (2,) to the side that is tried first.
        size: of the text, in the unit of `end`.
    """
    first = float(np.arctan2(way[1], way[0]))
    half = 0.5 * size * np.array([LETTER * len(text), LINE])
    reach = 0.5 * (STEPS + 2) * size + 2 * float(half.max())
    lines = lines_near(lines, end - reach, end + reach)
    for step, turn in ((step, turn) for step in range(STEPS) for turn in _TURNS):
        ray = np.array([np.cos(first + turn), np.sin(first + turn)])
        to_side = float(np.min(half / np.maximum(np.abs(ray), 1e-12)))  # from the box's middle to its rim
        label = Label(text, end + ((0.8 + 0.5 * step) * size + to_side) * ray, 0.0, end, moved=True)
        if _fits(label, size, room, lines):
            return label
    return None


def take(label: Label, size: float, room: Room) -> None:
    """Take the room of a label, its text of a size, and that of the line to it."""
    room.take(label.box(size))
    if label.moved:
        room.take(thin(label.leader(size), THIN * size))


def _fits(label: Label, size: float, room: Room, lines: Floats) -> bool:
    """Whether a label and the line to it find room; the label must cover none of the lines."""
    box = label.box(size)
    return (
        room.free(box)
        and not lines_meet(box, lines)
        and (not label.moved or room.free(_off_its_mark(label.leader(size), size)))
    )


def _off_its_mark(line: Floats, size: float) -> Floats:
    """(4, 2) corners of the room of a line (2, 2), without its beginning, where the mark that it leads from is."""
    (ax, ay), (bx, by) = line.tolist()
    share = min(0.5 * size / max(hypot(bx - ax, by - ay), 1e-12), 0.9)
    return thin(np.array([(ax + share * (bx - ax), ay + share * (by - ay)), (bx, by)]), THIN * size)


def thin(line: Floats, width: float) -> Floats:
    """(4, 2) corners of the room of a line (2, 2) of some width."""
    (ax, ay), (bx, by) = line.tolist()
    half = 0.5 * width / max(hypot(bx - ax, by - ay), 1e-12)
    x, y = half * (ay - by), half * (bx - ax)  # to the left
    return np.array([(ax - x, ay - y), (bx - x, by - y), (bx + x, by + y), (ax + x, ay + y)])


def spread(positions: ArrayLike, gap: float) -> Floats:
    """Places (k,) next to those asked for, in the same order, at least `gap` apart: least squares."""
    asked = np.asarray(positions, dtype=float)
    order, apart = np.argsort(asked, kind="stable"), gap * np.arange(len(asked))
    result = np.empty_like(asked)
    result[order] = isotonic_regression(asked[order] - apart).x + apart
    return result


def _on_own_line(text: str, end: Floats, other: Floats, size: float) -> Iterable[Label]:
    """Positions on the rod's line, from its end outwards."""
    outward = (end - other) / np.linalg.norm(end - other)
    angle = upright(float(np.arctan2(outward[1], outward[0])))
    first = (0.55 + 0.5 * LETTER * len(text)) * size
    for step in range(CLOSE):
        yield Label(text, end + (first + 0.5 * step * size) * outward, angle, end, step > 2)


def segments(courses: Iterable[Floats]) -> Floats:
    """(m, 2, 2) the lines of polylines (k, 2)."""
    return np.concatenate([np.empty((0, 2, 2)), *(np.stack([line[:-1], line[1:]], axis=1) for line in courses)])


def closed_segments(outline: Floats) -> Floats:
    """(k, 2, 2) the lines of a closed curve (k, 2)."""
    return np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)


def upright(angle: float) -> float:
    """The angle [rad] of a text along a line, -pi/2 to pi/2: it reads from below, or from the right if vertical."""
    lowest = NOISE - 0.5 * np.pi
    return min(lowest + (angle - lowest) % np.pi, 0.5 * np.pi)


# Callouts

_CALLOUT_SIZES = (1.0, 0.9, 0.82, SMALL)  # of the names: the largest at which all of an outline find room
OFF = 1.3  # from a place to where its name may begin
GAPS = (1.1, 1.7, np.inf)  # from name to name, or what there is all around; at the wider ones their ways turn evenly
_EVENED = 6  # times
MANY = 24  # names: where more find no room, the drawing needs a larger scale, not other places for them
FARTHEST = 8.0  # from a place to the start of its name's line


class Callout(NamedTuple):
    """A name, and the line (k, 2) to it from its place."""

    written: Text
    line: Floats


def outward(points: Floats) -> Floats:
    """(k, 2) unit normals, to the right of an outline that is walked through the points (k, 2); 0 for a single one.

    At each place across the chord of its neighbours, so that points that nearly coincide do not turn it.
    """
    along = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    return _unit(np.column_stack([along[:, 1], -along[:, 0]]))


def callouts(
    names: Sequence[str], points: Floats, away: Floats, text: float, room: Room, lines: Floats
) -> list[Callout]:
    """Names of the points (k, 2) of one outline, in the order of a walk around it; takes their room.

    Each name has a line, next to its neighbours' lines, and stands farther along it where it would cover a text or one
    of `lines` (m, 2, 2). Where not all find room, in an opening, they are written smaller or spaced wider. A name that
    still finds no room on its line is put anywhere near its place; it is left out if there is no room, or if there are
    more than MANY such names.

    Args:
        away: (k, 2) unit vectors from each place to the side where its name is to stand.
    """
    best = sys.maxsize, 0.0, list[Label | None](), room  # names without a place; size and labels of all, their room
    for size, gap in ((text * share, gap) for gap in GAPS for share in _CALLOUT_SIZES):
        taken, (starts, ways) = Room(4 * size, room), _slots(points, away, size, gap)
        labels = [_free(*slot, size, taken, lines) for slot in zip(names, points, starts, ways, strict=True)]
        best = min(best, (labels.count(None), size, labels, taken), key=lambda tried: tried[0])
        if not best[0] or (size <= text * SMALL and best[0] > MANY):
            break
    missing, largest, labels, taken = best
    room.join(taken)
    sizes = [text * share for share in _CALLOUT_SIZES if text * share <= largest]
    found = list[Callout]()
    for label, name, place, way in zip(labels, names, points, away, strict=True):
        if label is not None:
            found.append(Callout(label.written(largest), np.vstack([place, label.leader(largest)])))
            continue
        for size in sizes if missing <= MANY else ():
            if aside := nearby(name, place, way, size, room, lines):
                take(aside, size, room)
                found.append(Callout(aside.written(size), aside.leader(size)))
                break
    return found


def _slots(points: Floats, away: Floats, size: float, gap: float) -> tuple[Floats, Floats]:
    """Start (k, 2) of each name's line, off the outline and apart from its neighbours', and its direction (k, 2).

    gap : from a name to the next, in text sizes; less if the outline is too short.
    """
    for _ in range(_EVENED if gap > GAPS[0] else 0):
        away = _unit(np.roll(away, 1, axis=0) + 2 * away + np.roll(away, -1, axis=0))
    aside = points + OFF * size * away
    steps = np.linalg.norm(np.roll(aside, -1, axis=0) - aside, axis=1)  # to the next place, all around
    around = float(steps.sum())
    if around == 0:
        return aside, away
    first = (int(np.argmax(steps)) + 1) % len(points)  # the widest gap parts the last from the first
    at = np.roll(np.append(0.0, np.cumsum(np.roll(steps, -first))[:-1]), first)
    widest = around / len(points)
    asked = spread(at, min(gap * size, widest))
    table = [np.interp(asked, at, column, period=around) for column in np.hstack([aside, away]).T]
    return np.column_stack(table[:2]), _unit(np.column_stack(table[2:]))


def _unit(ways: Floats) -> Floats:
    return np.asarray(ways / np.maximum(np.linalg.norm(ways, axis=1), 1e-12)[:, None])


def _free(name: str, place: Floats, start: Floats, way: Floats, size: float, room: Room, lines: Floats) -> Label | None:
    """The first free place of a name along its line, taken with the line to it."""
    angle = upright(float(np.arctan2(way[1], way[0])))
    half = (0.3 + 0.5 * LETTER * len(name)) * size
    foot = _off_its_mark(np.array([place, start]), size)
    near = float(np.linalg.norm(start - place)) < FARTHEST * size
    reach = 2 * half + CLOSE * size
    lines = lines_near(lines, start - reach, start + reach)
    for step in range(CLOSE if near and room.free(foot) else 0):
        label = Label(name, start + (half + 0.5 * step * size) * way, angle, start, moved=True)
        if _fits(label, size, room, lines) and room.free(thin(label.leader(size), THIN * size)):
            room.take(foot)
            take(label, size, room)
            return label
    return None
