"""Drawings of the shell in space: support plan, elevations, bracing plan, and the stages of its erection.

`text` is the usual size of a drawing's texts [mm at 1:1].
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from textwrap import wrap

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.figures.fabrication import Brace
from rodshell.geometry.bounds import bounds
from rodshell.geometry.boxes import each_meets, lines_meet
from rodshell.output.drawing import (
    BACK,
    INK,
    LAYERS,
    LETTER,
    LINE,
    PALE,
    SMALL,
    SOFT,
    Drawing,
    Pen,
    Pencil,
    Text,
    corners,
)
from rodshell.output.drawings.flat import side_ticks
from rodshell.output.grid import beams_along_edge, end_nodes, joint_places, meshed_rods, outlines_of
from rodshell.output.labels import Label, Room, callouts, closed_segments, outward, segments, spread, upright
from rodshell.output.schedules import seam_meetings
from rodshell.results import Archive, Results
from rodshell.results.judged.deployment import unknown_below
from rodshell.results.wording import Rounding, rounding_of, whole_percent

_SUPPORTS_LEGEND = (
    "Red: where each rod ends and how it continues. A thin line leads to its name: rod.0 its start, rod.1 its end.",
    "Blue: straight lines from rod end to rod end{seams}; the edge itself may run outside them.",
)
RADIUS, TICK = 0.3, 0.8  # radius of a support's mark, and how far its rod's direction is drawn, in text sizes
_NUMBER_SIZES = (1.0, 0.9, 0.82, SMALL)  # sizes of a number that are tried, in text sizes
_NARROW = 40  # letters in a line below the paths of the rod ends
SAME = 0.01  # mm: lines as near as this to each other are drawn once
CLEAR = 0.2  # of its size, between a number and the middle of its cell
SIDES = ((-1, 0.3), (1, 0.3), (-1, -0.85), (1, -0.85))  # half of the diagonal, and its baseline off it in its sizes


def rod_curves(archive: Archive, positions: Floats) -> list[Floats]:
    """The nodes (k, 3) [mm] of each rod that the states hold, in a state (n, 3) [m]."""
    return [1e3 * positions[rod.nodes] for rod in meshed_rods(archive)]


def final_curves(archive: Archive) -> list[Floats]:
    """The same in the final shape, which there has to be."""
    assert archive.final is not None
    return rod_curves(archive, archive.states[archive.final])


def _stopped(archive: Archive) -> str:
    """For titles: that the final shape is not one of equilibrium, and that its ends may not be at their supports."""
    lost = archive.final is not None and archive.is_lost(archive.final)
    return ", not popped up: where the computation stopped" if lost else ""


def elevations_drawing(archive: Archive, text: float) -> Drawing:
    """The final shape from the front (along y) and, above, from the right (along -x), with overall dimensions and the
    levels of the lowest and highest rod ends and of the shell."""
    pencil, curves, marked = Pencil(), final_curves(archive), Pencil()
    heights = np.concatenate(curves)[:, 2]
    tall, rounding = float(np.ptp(heights)) + 10 * text, rounding_of(archive.results)
    ends = np.concatenate([curve[[0, -1], 2] for curve in curves])
    known = {level_text(z - ends.min(), rounding): z for some in (ends, heights) for z in (some.min(), some.max())}
    levels = dict(sorted(known.items(), key=lambda level: float(level[1])))
    for k, (axis, words) in enumerate(((0, "Front elevation: x to the right"), (1, "Right elevation: y to the right"))):
        flat = [np.column_stack([curve[:, axis], curve[:, 2] - heights.min() + k * tall]) for curve in curves]
        pen = Pen(INK, 0.08 * text)
        for curve in apart(map(_thinned, flat)):
            pencil.line(curve, "CUT", pen=pen)
        cloud = np.concatenate(flat)
        low, high = bounds(cloud)
        below, beside = low - (0.0, 1.5 * text), low - (1.5 * text, 0.0)
        _span(pencil, below, np.array([high[0], below[1]]), text, rounding)
        _span(pencil, beside, np.array([beside[0], high[1]]), text, rounding)
        pencil.line([(low[0] - 2 * text, low[1]), (high[0] + 2 * text, low[1])], "DIM")
        pencil.write(words, (low[0], low[1] - 5 * text), 1.2 * text, "LABEL", bold=True)
        at = np.array([*levels.values()]) - heights.min() + k * tall
        for name, y, beside in zip(levels, at.tolist(), spread(at, 1.2 * text).tolist(), strict=True):
            out = high[0] + 2.5 * text
            marked.line([(out - 2 * text, y), (out, y), (out + 0.8 * text, beside)], "DIM")
            marked.write(name, (out + text, beside - 0.3 * text), text, "DIM")
    pencil.paths += marked.paths
    pencil.texts += marked.texts
    return pencil.done("elevations", f"Elevations{_stopped(archive)}", text)


def level_text(above: float, rounding: Rounding) -> str:
    """A level [mm] above the lowest rod end."""
    shown = rounding.mm(1e-3 * above)
    return "\N{PLUS-MINUS SIGN}0" if not float(shown) else shown if shown.startswith("-") else f"+{shown}"


def erection_drawing(archive: Archive, text: float) -> Drawing:
    """Paths of the rod ends from flat to their supports, seen from above, and the shell's side at each stage.

    A line through all ends shows where they are at each stage; a ring where they end.
    """
    pencil, history = Pencil(), archive.states["history"]
    assert archive.results.deployment is not None
    stages, mm = archive.results.deployment.stages, rounding_of(archive.results).mm
    pen = Pen(INK, 0.04 * text)
    drawn = meshed_rods(archive)
    ways, thin = 1e3 * history[:, end_nodes(drawn), :2], Pen(SOFT, 0.05 * text)
    loops = [loop for loop in outlines_of(archive) if len(loop) > 1]
    for stage, loop in product(ways[:-1], loops):
        pencil.line(stage[loop], "DIM", closed=True, pen=thin)
    for way in ways.transpose(1, 0, 2):
        pencil.line(way, "DIM", pen=Pen("#b08a2e", 0.1 * text))
        pencil.mark(way[-1], 0.3 * text, "MARK", pen=thin)
    low, high = bounds(ways.reshape(-1, 2))
    pencil.write("Paths of the rod ends, from above", (low[0], low[1] - 3 * text), 1.2 * text, "LABEL", bold=True)
    pencil.write("Closed lines: the ends at each stage", (low[0], low[1] - 4.8 * text), text, "LABEL")
    for k, line in enumerate(wrap(_not_known(archive.results), _NARROW)):
        pencil.write(line, (low[0], low[1] - (6.6 + 1.4 * k) * text), text, "LABEL", bold=True, colour="#b3372c")
    left, top = high[0] + 8 * text, high[1]
    for k, (stage, positions) in enumerate(zip(stages, history, strict=True)):
        if k == len(stages) // 2 + 1:
            left, top = left + high[0] - low[0] + 8 * text, high[1]
        curves = [curve[:, [0, 2]] for curve in rod_curves(archive, positions)]
        cloud = np.concatenate(curves)
        tall = float(np.ptp(cloud[:, 1]))
        shift = np.array([left - low[0], top - tall - cloud[:, 1].min()])
        for curve in apart(map(_thinned, curves)):
            pencil.line(curve + shift, "CUT", pen=pen)
        words = f"{k}: deployment {100 * stage.share:.0f} %, {mm(stage.height)} mm high"
        pencil.write(words, (left, top - tall - 1.8 * text), text, "LABEL")
        top -= tall + 5 * text
    title = "Erection stages, front elevations"
    if share := unknown_below(archive.results):
        title += f"; not known below {whole_percent(share)}"
    return pencil.done("erection", title, text)


def _not_known(results: Results) -> str:
    """Between which stages of the deployment the shape is not known; "" where all were followed."""
    unknown, guided = unknown_below(results), results.deployment.guided if results.deployment else None
    said = []
    if unknown:
        said.append(
            f"The deployment could not be followed: no stage is known between flat and {whole_percent(unknown)} of it."
        )
    if guided:
        start, stop = map(whole_percent, guided)
        said.append(f"Between {start} and {stop} it has to be guided, and its shape is not known.")
    return " ".join(said)


def _thinned(curve: Floats) -> Floats:
    """A curve by about every third of its nodes, its ends kept."""
    return np.asarray(curve[[*range(0, len(curve) - 1, 3), len(curve) - 1]])


def apart(curves: Iterable[Floats]) -> list[Floats]:
    """Each curve (k, 2) [mm] once: in an elevation a rod covers its mirror image."""
    return list({(np.rint(curve / SAME) + 0.0).tobytes(): curve for curve in curves}.values())


def _seen_from_above(pencil: Pencil, archive: Archive, text: float) -> None:
    """The rods of the final shape, pale."""
    for curve in final_curves(archive):
        pencil.line(_thinned(curve)[:, :2], "CUT", pen=Pen(PALE, 0.08 * text))


def _span(pencil: Pencil, start: Floats, end: Floats, text: float, rounding: Rounding) -> None:
    """A dimension line with its length [mm] next to it."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / max(length, 1e-9)
    across = 0.4 * text * np.array([-along[1], along[0]])
    pencil.line([start, end], "DIM")
    for tip in (start, end):
        pencil.line([tip - across, tip + across], "DIM")
    angle = float(np.arctan2(along[1], along[0]))
    side = 0.5 * text * np.array([-along[1], along[0]]) if angle else np.array([0.0, -1.4 * text])
    pencil.write(rounding.mm(1e-3 * length), 0.5 * (start + end) + side, text, "DIM", anchor="middle", angle=angle)


def axes(pencil: Pencil, text: float) -> None:
    """Ticks of x and y [mm] along two sides of all that is there."""
    low, high = pencil.done("", "", text).box()
    low, high = low - text, high + text
    pencil.line([(low[0], high[1]), low, (high[0], low[1])], "DIM")
    side_ticks(pencil, low, high, text, 6)


# Supports


def supports_drawing(archive: Archive, text: float) -> Drawing:
    """Where every rod end goes, seen from above, with the direction in which its rod arrives there."""
    pencil, names = Pencil(), archive.results.rod_ends
    _seen_from_above(pencil, archive, text)
    curves = [curve[:, :2] for curve in final_curves(archive)]
    ends = np.array([curve[[0, -1]] for curve in curves]).reshape(-1, 2)
    arrives = np.array([curve[[0, -1]] - curve[[1, -2]] for curve in curves]).reshape(-1, 2)
    arrives /= np.maximum(np.linalg.norm(arrives, axis=1), 1e-9)[:, None]
    room, tick = Room(4 * text), Pen(LAYERS["MARK"].colour, 0.12 * text)
    for name, end, way in zip(names, ends, arrives, strict=True):
        pencil.mark(end, RADIUS * text, "MARK", note=name)
        pencil.line([end, end + TICK * text * way], "MARK", pen=tick)
        room.take(end + RADIUS * text * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]))
    lines = segments(_thinned(_thinned(curve)) for curve in curves)  # what names keep clear of
    on_seams = [end for _, meeting in seam_meetings(archive.results) for end in meeting.ends]  # these have numbers
    alone = ~np.isin(names, on_seams)
    for seam in (run for loop in outlines_of(archive) for run in _runs(loop, ~alone) if len(run) > 1):
        pencil.line(ends[seam], "BOUNDARY-FINAL")
    walks, left_out = list(_walks(outlines_of(archive), ends, alone)), 0
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
    legend, beams = [*_SUPPORTS_LEGEND, _levels(pencil, archive, text, room, lines)], beams_along_edge(archive)
    for _, points in beams:
        pencil.line(1e3 * points[:, :2], "BOUNDARY-FINAL", pen=Pen(LAYERS["BOUNDARY-FINAL"].colour, 0.4 * text))
    if beams:
        named = ", ".join(str(beam.name) for beam, _ in beams)
        legend.append(f"Thick: beams along the edge, {named} (table Edge beams).")
    axes(pencil, text)
    low, _ = pencil.done("", "", text).box()
    for k, line in enumerate(legend, start=1):
        written = line.format(seams="" if alone.all() else ", and seams")
        pencil.write(written, low - (0.0, 1.5 * k * text), text, "DIM")
    return pencil.done("supports", f"Support plan{_stopped(archive)}", text)


def _walks(outlines: list[Ints], ends: Floats, alone: Bools) -> Iterator[Ints]:
    """The ends that are `alone`, on no seam, in their order around the whole shell and its openings.

    outlines : the ends around each grid and its openings. Where a seam ends, a walk continues along the next patch.
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
    on_none = alone.copy()
    on_none[np.concatenate([[], *outlines]).astype(np.intp)] = False
    yield from np.flatnonzero(on_none)[:, None]


def _runs(loop: Ints, alone: Bools) -> list[Ints]:
    """The ends of an outline that are `alone`, run by run between the others; all of it where there are none."""
    turned = np.roll(loop, -int(np.argmin(alone[loop])))
    parts = [run[alone[run]] for run in np.split(turned, np.flatnonzero(~alone[turned]))]
    return [run for run in parts if len(run)]


def _meetings(pencil: Pencil, archive: Archive, text: float, room: Room) -> None:
    """The numbers of the places on seams where rods meet, as in the table of the seams, where there is room."""
    size, left_out = SMALL * text, 0
    for number, meeting in seam_meetings(archive.results):
        at = 1e3 * np.array(meeting.point[:2])
        tried = (
            Text(number, at + text * np.array([side, up]), size, "LABEL", "start" if side > 0 else "end")
            for up, side in product((0.4, -1.1), (0.5, -0.5))
        )
        left_out += not room.write(pencil, tried)
    pencil.leave_out(left_out, sum(1 for _ in seam_meetings(archive.results)), "numbers of meetings (table Seams)")


def _levels(pencil: Pencil, archive: Archive, text: float, room: Room, lines: Floats) -> str:
    """The levels of the joints, to their upper right where there is room, clear of `lines` (m, 2, 2); returns a line of
    legend on all levels."""
    rounding, shape = rounding_of(archive.results), archive.states[archive.final or ""]
    ends = 1e3 * shape[end_nodes(meshed_rods(archive)), 2]
    for place in joint_places(archive, shape).values():
        at = 1e3 * place
        words, size = level_text(at[2] - ends.min(), rounding), SMALL * text
        half = 0.5 * size * np.array([LETTER * len(words) + 0.6, LINE + 0.3])
        level = Label(words, at[:2] + half, 0.0, at[:2], moved=False).written(size)._replace(layer="DIM")
        if not lines_meet(level.box(), lines):
            room.write(pencil, [level])
    high = level_text(float(np.ptp(ends)), rounding)
    where = f"up to {high} (z in table Supports)" if float(high[1:]) else f"all at {high}"
    return (
        f"Levels in mm above the lowest rod end: rod ends {where}, of joints to their upper right (z in table Joints)."
    )


# Bracing


def bracing_drawing(archive: Archive, text: float) -> Drawing:
    """The diagonals of the cells in the final shape, seen from above, with their true lengths.

    Each number stands off all rods and diagonals of its cell, as large as finds room; where there is none the table
    has it.
    """
    pencil, final = Pencil(), archive.final
    assert final is not None
    _seen_from_above(pencil, archive, text)
    joints = joint_places(archive, archive.states[final])
    supports = zip(archive.results.rod_ends, archive.results.boundary, strict=False)
    joints |= {name: np.array(place) for name, place in supports}
    braces = [brace for brace in archive.results.bracing if {brace.start, brace.end} <= joints.keys()]
    ends = 1e3 * np.array([[joints[end][:2] for end in (brace.start, brace.end)] for brace in braces])
    ends = ends.reshape(-1, 2, 2)
    pen = Pen("#b08a2e", 0.07 * text)
    for brace, line in zip(braces, ends, strict=True):
        pencil.line(line, "DIM", pen=pen, note=f"{brace.start} to {brace.end}")
    other = ends[_crossing(braces)]
    mm = rounding_of(archive.results).mm
    found = _numbers([mm(brace.final) for brace in braces], ends, other, text)
    pencil.texts += found
    pencil.leave_out(len(braces) - len(found), len(braces), "lengths of diagonals (table Bracing)")
    axes(pencil, text)
    return pencil.done("bracing", "Bracing, true lengths in the final shape", text)


def _crossing(braces: Sequence[Brace]) -> list[int]:
    """Index of the other diagonal of each brace's cell, which is between the same four rods; its own where there is
    none."""
    cells = [frozenset(f"{brace.start}/{brace.end}".split("/")) for brace in braces]
    near = [[j for j in (k - 1, k + 1) if 0 <= j < len(cells) and cells[j] == cells[k]] for k in range(len(cells))]
    return [found[0] if found else k for k, found in enumerate(near)]


def _numbers(words: list[str], ends: Floats, other: Floats, text: float) -> list[Text]:
    """The numbers that find room along the diagonals (n, 2, 2) of cells with the `other` diagonals (n, 2, 2)."""
    (a, b), (c, d) = ends.transpose(1, 0, 2), other.transpose(1, 0, 2)
    around = np.array([[a, c], [c, b], [b, d], [d, a], [a, b], [c, d]]).transpose(2, 0, 1, 3).copy()
    letters = np.array([*map(len, words)], dtype=float)
    angle = np.array([upright(float(direction)) for direction in np.arctan2(*(b - a).T[::-1])])
    along, above = (np.column_stack(pair) for pair in ((np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))))
    middle, centred = 0.5 * (a + b), np.full(len(words), BACK["middle"])
    room, found = Room(3 * text), dict[int, Text]()
    for size, (side, up) in ((text * share, side) for share in _NUMBER_SIZES for side in SIDES):
        at = middle + (side * (CLEAR + 0.5 * LETTER * letters) * size)[:, None] * along + up * size * above
        (x, y), (cosine, sine), sizes = at.T, along.T, np.full(len(words), size)
        boxes = np.array(corners(x, y, cosine, sine, sizes, letters, centred)).transpose(2, 0, 1).copy()
        for k in np.flatnonzero(~each_meets(boxes, around)).tolist():
            if k not in found and room.claim(boxes[k]):
                found[k] = Text(words[k], at[k], size, "LABEL", "middle", float(angle[k]), colour="#6b5212")
    return list(found.values())
