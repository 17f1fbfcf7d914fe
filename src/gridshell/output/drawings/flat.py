"""Flat plan: both families as cut, their joints, labels, the footprint, and what it is set out by."""

import numpy as np

from gridshell.output.drawing import INK, LETTER, Drawing, Pen, Pencil
from gridshell.output.labels import Room, leaders, place
from gridshell.output.plan import FlatPlan, nice_ticks

FAMILY = {"u": "#1f5f8b", "v": "#a8552a", "free": "#1f5f8b"}
TITLE = "Flat plan"


def flat_drawing(plan: FlatPlan, text: float) -> Drawing:
    """The flat plan [mm], its rods labelled in the size `text` [mm]."""
    pencil = Pencil()
    for outline in plan.footprint:
        pencil.line(outline, "BOUNDARY-FLAT", closed=True)
    for outline in plan.boundary:
        pencil.line(outline, "BOUNDARY-FINAL", closed=True)
    _rods(pencil, plan, text)
    _labels(pencil, plan, text)
    _joints(pencil, plan, text)
    for a, b in diagonals(plan):
        _dimension(pencil, plan, a, b, text)
    _axes(pencil, plan, text)
    return pencil.done("plan", TITLE, text)


def _rods(pencil: Pencil, plan: FlatPlan, text: float) -> None:
    """Each rod as cut; a dot at the end from which its joints are measured, a tick where it is held."""
    for rod, cut, line in zip(plan.rods, plan.cuts, plan.lines, strict=True):
        pen = Pen(FAMILY.get(rod.family, INK), 0.18 * text)
        pencil.line(cut, "CUT", pen=pen, name=rod.id, note=f"{rod.id}: {1e3 * rod.cut_length:.3f} mm")
        pencil.mark(line[0], min(0.2 * text, 0.08 * plan.spacing), "DIM", pen=Pen(INK, 0.0, fill=INK))
        if rod.allowance > 0:
            along = line[1] - line[0]
            across = 0.3 * text * np.array([-along[1], along[0]]) / np.linalg.norm(along)
            for end in line:
                pencil.line([end - across, end + across], "DIM")


def _joints(pencil: Pencil, plan: FlatPlan, text: float) -> None:
    """A mark and an id at each joint; an id that finds no room is left to the mark's note and the schedule."""
    radius = min(0.25 * text, 0.04 * plan.spacing, 1.0)
    size = min(0.5 * text, 0.11 * plan.spacing)
    room = Room(plan.spacing)
    taken = [label.box() for label in pencil.texts]
    for box in taken:
        room.take(box)
    for joint, mark in zip(plan.joints, plan.marks, strict=True):
        a, b = (f"{plan.rods[k].id} at {1e3 * at:.2f} mm" for k, at in zip(joint.rods, joint.at, strict=True))
        pencil.mark(mark, radius, "MARK", note=f"{joint.id}: {a}, {b}")
        width = LETTER * size * len(joint.id) + 2 * radius
        for corner in (
            (radius, 1.3 * radius),
            (-width, 1.3 * radius),
            (radius, -radius - size),
            (-width, -radius - size),
        ):
            pencil.write(joint.id, mark + corner, size, "LABEL")
            if room.claim(pencil.texts[-1].box()):
                break
            pencil.texts.pop()


def _labels(pencil: Pencil, plan: FlatPlan, text: float) -> None:
    labels = place([rod.id for rod in plan.rods], plan.cuts, text)
    pencil.texts += [label.written(text) for label in labels]
    for line in leaders(labels, text):
        pencil.line(line, "DIM")


def diagonals(plan: FlatPlan) -> list[tuple[np.ndarray, np.ndarray]]:
    """The two diagonals of the largest rectangle of joints, by which the grid is set out square."""
    sides = [[k for k, rod in enumerate(plan.rods) if rod.family == family] for family in "uv"]
    if min(map(len, sides)) < 2:
        return []
    column = {rod: k for k, rod in enumerate(sides[1])}
    row = {rod: k for k, rod in enumerate(sides[0])}
    met = np.zeros((len(row), len(column)), dtype=bool)
    for joint in plan.joints:
        u, v = joint.rods
        if u in row and v in column:
            met[row[u], column[v]] = True
    best: tuple[float, list[int]] = (0.0, [])
    offsets = [np.array([plan.rods[k].offset for k in side], dtype=float) for side in sides]
    for low in range(len(row)):
        for high in range(len(row) - 1, low, -1):
            both = np.flatnonzero(met[low] & met[high])
            if len(both) > 1:
                area = (offsets[0][high] - offsets[0][low]) * (offsets[1][both[-1]] - offsets[1][both[0]])
                best = max(best, (float(area), [low, high, int(both[0]), int(both[-1])]))
    if not best[1]:
        return []
    low, high, left, right = best[1]
    x, y = 1e3 * offsets[1][[left, right]], 1e3 * offsets[0][[low, high]]
    return [(np.array([x[0], y[0]]), np.array([x[1], y[1]])), (np.array([x[0], y[1]]), np.array([x[1], y[0]]))]


def _dimension(pencil: Pencil, plan: FlatPlan, a: np.ndarray, b: np.ndarray, text: float) -> None:
    """A thin line with its length, written a third of the way along, off the joints."""
    along = b - a
    pencil.line([a, b], "DIM", pen=Pen("#b08a2e", 0.05 * text, (1.5 * text, 0.5 * text, 0.3 * text, 0.5 * text)))
    size, words = 0.7 * text, f"{np.linalg.norm(along):.1f}"
    room = Room(plan.spacing)
    for other in pencil.texts:
        room.take(other.box())
    for share in (0.33, 0.36, 0.3, 0.39, 0.27, 0.42, 0.24, 0.45, 0.2):
        angle = float(np.arctan2(along[1], along[0]))
        pencil.write(words, a + share * along, size, "DIM", anchor="middle", angle=angle, colour="#8a6a1c")
        if room.free(pencil.texts[-1].box()):
            return
        pencil.texts.pop()


def _axes(pencil: Pencil, plan: FlatPlan, text: float) -> None:
    """A frame with millimetre ticks along its lower and left side, and a scale bar of one tick."""
    corners = np.concatenate([plan.cuts.reshape(-1, 2), *(one.box() for one in pencil.texts), np.zeros((1, 2))])
    low, high = corners.min(axis=0) - text, corners.max(axis=0) + text
    frame = [low, (high[0], low[1]), high, (low[0], high[1])]
    pencil.line(frame, "DIM", closed=True)
    for axis, name in enumerate("xy"):
        out = np.array([0.0, -1.0]) if axis == 0 else np.array([-1.0, 0.0])
        ticks = nice_ticks(low[axis], high[axis] - 2 * text, 8)
        for value in ticks:
            foot = np.array([value, low[1]]) if axis == 0 else np.array([low[0], value])
            pencil.line([foot, foot - 0.4 * text * out], "DIM")
            shift = np.array([0.0, -1.1 * text]) if axis == 0 else np.array([-0.4 * text, -0.3 * text])
            anchor = "middle" if axis == 0 else "end"
            pencil.write(f"{value:g}", foot + shift, 0.8 * text, "DIM", anchor=anchor)
        end = np.array([high[0], low[1] - 1.1 * text]) if axis == 0 else np.array([low[0] - 0.4 * text, high[1] - text])
        pencil.write(name, end, 0.8 * text, "DIM", anchor="end")
