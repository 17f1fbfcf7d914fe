"""The support plan: where every rod end goes, which it is, and how its rod arrives there."""

from collections.abc import Iterator

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.output.archive import Archive
from rodshell.output.callouts import callouts, outward
from rodshell.output.drawing import LAYERS, SMALL, Drawing, Pen, Pencil
from rodshell.output.drawings.final import axes, rod_curves, seen_from_above, thinned
from rodshell.output.labels import Room, closed_segments
from rodshell.output.plan import FlatPlan
from rodshell.output.rods import outlines_of
from rodshell.output.schedules import seam_meetings

LEGEND = (
    "Red: where each rod ends and how it goes on. A thin line leads to its name: rod.0 its start, rod.1 its end.",
    "Blue: straight lines from rod end to rod end{seams}; the edge itself may run outside them.",
)
MARK, TICK = 0.3, 0.8  # radius of a support's mark, and how far its rod's direction is drawn, in text sizes


def supports_drawing(archive: Archive, plan: FlatPlan, text: float) -> Drawing:
    """Where every rod end goes, seen from above, with the direction in which its rod arrives there."""
    pencil, final = Pencil(), archive.final
    assert final is not None
    seen_from_above(pencil, archive, text)
    drawn = [rod for rod in plan.rods if len(rod.nodes) > 1]
    curves = [curve[:, :2] for curve in rod_curves(archive, archive.states[final])]
    ends = np.array([curve[[0, -1]] for curve in curves]).reshape(-1, 2)
    arrives = np.array([curve[[0, -1]] - curve[[1, -2]] for curve in curves]).reshape(-1, 2)
    arrives /= np.maximum(np.linalg.norm(arrives, axis=1), 1e-9)[:, None]
    names = [f"{rod.id}.{end}" for rod in drawn for end in (0, 1)]
    room, tick = Room(4 * text), Pen(LAYERS["MARK"].colour, 0.12 * text)
    for name, end, way in zip(names, ends, arrives, strict=True):
        pencil.mark(end, MARK * text, "MARK", note=name)
        pencil.line([end, end + TICK * text * way], "MARK", pen=tick)
        room.take(end + MARK * text * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]))
    lines = np.concatenate([_segments(thinned(thinned(curve))) for curve in curves])  # what names keep clear of
    alone = ~np.isin(names, list(_sewn(archive)))
    for seam in (run for loop in outlines_of(drawn) for run in _runs(loop, ~alone) if len(run) > 1):
        pencil.line(ends[seam], "BOUNDARY-FINAL")
    walks, left_out = list(_walks(outlines_of(drawn), ends, alone)), 0
    for walk in walks:
        if len(walk) > 1:
            pencil.line(ends[walk], "BOUNDARY-FINAL", closed=True)
            lines = np.concatenate([lines, closed_segments(ends[walk])])
    for walk in walks:
        away = outward(ends[walk])
        away = np.where(np.any(away, axis=1, keepdims=True), away, arrives[walk])
        found = callouts([names[end] for end in walk], ends[walk], away, text, room, lines)
        left_out += len(walk) - len(found)
        for callout in found:
            pencil.texts.append(callout.written)
            pencil.line(callout.line, "DIM")
    pencil.leave_out(left_out, int(alone.sum()), "names of rod ends (table Supports has their places)")
    _meetings(pencil, archive, text, room)
    axes(pencil, text)
    low, _ = pencil.done("", "", text).box()
    for k, line in enumerate(LEGEND, start=1):
        said = line.format(seams="" if alone.all() else ", and seams")
        pencil.write(said, low - (0.0, 1.5 * k * text), text, "DIM")
    return pencil.done("supports", "Support plan", text)


def _walks(outlines: list[Ints], ends: Floats, alone: Bools) -> Iterator[Ints]:
    """The ends that are `alone`, not sewn, in their order around the whole shell, its openings, and what is by itself.

    outlines : the ends around each grid and its openings. Where a seam ends, a walk goes on along the next patch.
    """
    runs = [run for loop in outlines for run in _runs(loop, alone)]
    while runs:
        walk = [runs.pop(0)]
        while True:
            starts = np.array([ends[run[0]] for run in (walk[0], *runs)])
            nearest = int(np.linalg.norm(starts - ends[walk[-1][-1]], axis=1).argmin())
            if nearest == 0:
                break
            walk.append(runs.pop(nearest - 1))
        yield np.concatenate(walk)
    on_none = np.setdiff1d(np.flatnonzero(alone), np.concatenate([[], *outlines]).astype(np.intp))
    yield from on_none[:, None]


def _runs(loop: Ints, alone: Bools) -> list[Ints]:
    """The ends of an outline that are `alone`, run by run between the others; all of it where there are none."""
    turned = np.roll(loop, -int(np.argmin(alone[loop])))
    parts = [run[alone[run]] for run in np.split(turned, np.flatnonzero(~alone[turned]))]
    return [run for run in parts if len(run)]


def _sewn(archive: Archive) -> set[str]:
    """The rod ends on seams, which have the number of their meeting instead."""
    return {end for seam in archive.result.get("seams") or [] for one in seam["meetings"] for end in one["ends"]}


def _segments(curve: Floats) -> Floats:
    """(k - 1, 2, 2) the parts of a polyline (k, 2)."""
    return np.stack([curve[:-1], curve[1:]], axis=1)


def _meetings(pencil: Pencil, archive: Archive, text: float, room: Room) -> None:
    """The numbers of the places on seams where rods meet, as in the table of the seams, where there is room."""
    size, left_out = SMALL * text, 0
    for number, meeting in seam_meetings(archive.result):
        at = 1e3 * np.array(meeting["point"][:2])
        for corner in ((0.5, 0.4), (-0.5, 0.4), (0.5, -1.1), (-0.5, -1.1)):
            anchor = "start" if corner[0] > 0 else "end"
            pencil.write(number, at + text * np.array(corner), size, "LABEL", anchor=anchor)
            if room.claim(pencil.texts[-1].box()):
                break
            pencil.texts.pop()
        else:
            left_out += 1
    pencil.leave_out(left_out, sum(1 for _ in seam_meetings(archive.result)), "numbers of meetings (table Seams)")
