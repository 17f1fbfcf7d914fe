"""Names of places along an outline, in the order of the places, each with a line to its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gridshell.output.drawing import LETTER, Text
from gridshell.output.labels import NEAR, Label, Room, lines_meet, spread, upright

Floats = NDArray[np.float64]

SIZES = (1.0, 0.85, 0.7, 0.6)  # of the names, over the usual one: the largest at which all of an outline find room
OFF = 1.3  # from a place to where its name may begin
GAP = 1.1  # from name to name
THIN = 0.1  # what a line takes
EVENED = 6  # times
CLOSE = 4  # steps out on its line that a name may be without a smaller size being tried


@dataclass(frozen=True)
class Callout:
    """A name, and the line (3, 2) to it from its place."""

    written: Text
    line: Floats


def outward(places: Floats) -> Floats:
    """(k, 2) unit normals, to the right of an outline that is walked through the places (k, 2); 0 for a single one.

    At each place across the chord of its neighbours, so that places that nearly coincide do not turn it.
    """
    along = np.roll(places, -1, axis=0) - np.roll(places, 1, axis=0)
    return _unit(np.column_stack([along[:, 1], -along[:, 0]]))


def callouts(
    names: Sequence[str], places: Floats, away: Floats, text: float, room: Room, lines: Floats
) -> list[Callout]:
    """Names of the places (k, 2) of one outline, in the order of a walk around it; takes their room.

    Each stands on a line of its own, side by side with its neighbours', and farther along it where it would cover a
    text or one of `lines` (m, 2, 2). Where not all find room, in an opening, they are spaced evenly around it, and
    written smaller.

    Parameters
    ----------
    away : (k, 2) unit vectors from each place to the side where its name is to stand.
    """
    best: _Tried | None = None
    for size, even in ((text * share, even) for share in SIZES for even in (False, True)):
        tried = _tried(names, places, away, size, even, room, lines)
        best = tried if best is None or tried.farthest < best.farthest else best
        if best.farthest <= CLOSE:
            break
    assert best is not None
    room.join(best.room)
    return [
        Callout(label.written(best.size), np.array([place, label.end, _foot(label, best.size)]))
        for label, place in zip(best.labels, places, strict=True)
    ]


@dataclass(frozen=True)
class _Tried:
    """Names of a size, the room that they take, and how many steps out on its line the farthest is."""

    labels: list[Label]
    size: float
    room: Room
    farthest: int


def _tried(
    names: Sequence[str], places: Floats, away: Floats, size: float, even: bool, room: Room, lines: Floats
) -> _Tried:
    mine = Room(4 * size, room)
    starts, ways = _slots(places, away, size, even=even)
    for place, start in zip(places, starts, strict=True):
        mine.take(_thin(place, start, THIN * size))
    found = [_free(*one, size, mine, lines) for one in zip(names, starts, ways, strict=True)]
    return _Tried([label for label, _ in found], size, mine, max(step for _, step in found))


def _slots(places: Floats, away: Floats, size: float, *, even: bool) -> tuple[Floats, Floats]:
    """Where each name's own line begins (k, 2), off the outline and apart from its neighbours', and its way (k, 2).

    even : as far from each other as all around allows, their ways turning evenly; else as near to the places as can be.
    """
    for _ in range(EVENED if even else 0):
        away = _unit(np.roll(away, 1, axis=0) + 2 * away + np.roll(away, -1, axis=0))
    aside = places + OFF * size * away
    steps = np.linalg.norm(np.roll(aside, -1, axis=0) - aside, axis=1)  # to the next place, all around
    around = float(steps.sum())
    if around == 0:
        return aside, away
    first = (int(np.argmax(steps)) + 1) % len(places)  # the widest gap parts the last from the first
    at = np.roll(np.append(0.0, np.cumsum(np.roll(steps, -first))[:-1]), first)
    widest = around / len(places)
    asked = spread(at, widest if even else min(GAP * size, widest))
    table = [np.interp(asked, at, column, period=around) for column in np.hstack([aside, away]).T]
    return np.column_stack(table[:2]), _unit(np.column_stack(table[2:]))


def _unit(ways: Floats) -> Floats:
    return np.asarray(ways / np.maximum(np.linalg.norm(ways, axis=1), 1e-12)[:, None])


def _free(name: str, start: Floats, way: Floats, size: float, room: Room, lines: Floats) -> tuple[Label, int]:
    """The first free place of a name along its line, taken with the line to it, and how many steps out it is."""
    angle = upright(float(np.arctan2(way[1], way[0])))
    half = (0.3 + 0.5 * LETTER * len(name)) * size
    step = 0
    while True:
        label = Label(name, start + (half + 0.5 * step * size) * way, angle, start, step > 0)
        box = label.box(size)
        way_there = _thin(start + 2 * THIN * size * way, _foot(label, size), THIN * size)
        if room.free(box) and (step >= NEAR or (not lines_meet(box, lines) and (not step or room.free(way_there)))):
            break
        step += 1
    room.take(box)
    if step:
        room.take(way_there)
    return label, step


def _foot(label: Label, size: float) -> Floats:
    """Where the line to a label ends."""
    way = label.centre - label.end
    far = float(np.linalg.norm(way))
    return np.asarray(label.end + way / far * (far - (0.1 + 0.5 * LETTER * len(label.text)) * size))


def _thin(a: Floats, b: Floats, width: float) -> Floats:
    """(4, 2) corners of a line's room."""
    along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-12)
    side = 0.5 * width * np.array([-along[1], along[0]])
    return np.array([a - side, b - side, b + side, a + side])
