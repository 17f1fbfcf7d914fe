"""Names of places along an outline, in the order of the places, each with a line to its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats
from rodshell.output.drawing import LETTER, SMALL, Text
from rodshell.output.labels import (
    CLOSE,
    THIN,
    Label,
    Room,
    fits,
    lines_near,
    nearby,
    off_its_mark,
    spread,
    take,
    thin,
    upright,
)

SIZES = (1.0, 0.9, 0.82, SMALL)  # of the names, over the usual one: the largest at which all of an outline find room
OFF = 1.3  # from a place to where its name may begin
GAPS = (1.1, 1.7, np.inf)  # from name to name, or what there is all around; at the wider ones their ways turn evenly
EVENED = 6  # times
MANY = 24  # names: where more find no room, the drawing needs a larger scale, not other places for them
FARTHEST = 8.0  # from a place to where its name's own line begins


@dataclass(frozen=True)
class Callout:
    """A name, and the line (k, 2) to it from its place."""

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

    Each stands on a line of its own, side by side with its neighbours', and a little farther along it where it would
    cover a text or one of `lines` (m, 2, 2). Where not all find room, in an opening, they are written smaller,
    or spaced wider; one that finds none yet stands wherever there is some next to its place, and is left out where
    there is none, or where it is one of more than MANY.

    Parameters
    ----------
    away : (k, 2) unit vectors from each place to the side where its name is to stand.
    """
    best: _Tried | None = None
    for size, gap in ((text * share, gap) for gap in GAPS for share in SIZES):
        tried = _tried(names, places, away, size, gap, room, lines)
        best = tried if best is None or tried.missing < best.missing else best
        if not best.missing or (size <= text * SMALL and best.missing > MANY):
            break
    assert best is not None
    room.join(best.room)
    sizes = [text * share for share in SIZES if text * share <= best.size]
    found = list[Callout]()
    for label, name, place, way in zip(best.labels, names, places, away, strict=True):
        if label is not None:
            found.append(Callout(label.written(best.size), np.vstack([place, label.leader(best.size)])))
        elif best.missing <= MANY:
            found += _elsewhere(name, place, way, sizes, room, lines)
    return found


@dataclass(frozen=True)
class _Tried:
    """Names of a size, None for each that found no room, and the room that they take."""

    labels: list[Label | None]
    size: float
    room: Room

    @property
    def missing(self) -> int:
        return sum(label is None for label in self.labels)


def _tried(
    names: Sequence[str], places: Floats, away: Floats, size: float, gap: float, room: Room, lines: Floats
) -> _Tried:
    mine = Room(4 * size, room)
    starts, ways = _slots(places, away, size, gap)
    labels = [_free(*one, size, mine, lines) for one in zip(names, places, starts, ways, strict=True)]
    return _Tried(labels, size, mine)


def _elsewhere(
    name: str, place: Floats, way: Floats, sizes: Sequence[float], room: Room, lines: Floats
) -> list[Callout]:
    """A name next to its place, in the first of the sizes that finds room, taken with the line to it; or none."""
    for size in sizes:
        label = nearby(name, place, way, size, room, lines)
        if label is not None:
            take(label, size, room)
            return [Callout(label.written(size), label.leader(size))]
    return []


def _slots(places: Floats, away: Floats, size: float, gap: float) -> tuple[Floats, Floats]:
    """Where each name's own line begins (k, 2), off the outline and apart from its neighbours', and its way (k, 2).

    gap : from one to the next, in text sizes; as far as all around allows if that is less.
    """
    for _ in range(EVENED if gap > GAPS[0] else 0):
        away = _unit(np.roll(away, 1, axis=0) + 2 * away + np.roll(away, -1, axis=0))
    aside = places + OFF * size * away
    steps = np.linalg.norm(np.roll(aside, -1, axis=0) - aside, axis=1)  # to the next place, all around
    around = float(steps.sum())
    if around == 0:
        return aside, away
    first = (int(np.argmax(steps)) + 1) % len(places)  # the widest gap parts the last from the first
    at = np.roll(np.append(0.0, np.cumsum(np.roll(steps, -first))[:-1]), first)
    widest = around / len(places)
    asked = spread(at, min(gap * size, widest))
    table = [np.interp(asked, at, column, period=around) for column in np.hstack([aside, away]).T]
    return np.column_stack(table[:2]), _unit(np.column_stack(table[2:]))


def _unit(ways: Floats) -> Floats:
    return np.asarray(ways / np.maximum(np.linalg.norm(ways, axis=1), 1e-12)[:, None])


def _free(name: str, place: Floats, start: Floats, way: Floats, size: float, room: Room, lines: Floats) -> Label | None:
    """The first free place of a name along its line, taken with the line to it."""
    angle = upright(float(np.arctan2(way[1], way[0])))
    half = (0.3 + 0.5 * LETTER * len(name)) * size
    foot = off_its_mark(np.array([place, start]), size)
    near = float(np.linalg.norm(start - place)) < FARTHEST * size
    lines = lines_near(lines, start, 2 * half + CLOSE * size) if near else lines
    for step in range(CLOSE if near and room.free(foot) else 0):
        label = Label(name, start + (half + 0.5 * step * size) * way, angle, start, moved=True)
        if fits(label, size, room, lines) and room.free(thin(label.leader(size), THIN * size)):
            room.take(foot)
            take(label, size, room)
            return label
    return None
