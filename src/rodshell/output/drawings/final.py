"""Drawings of the shell as it stands, from the side and at the stages of its erection, and what its plans share."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.output.archive import Archive
from rodshell.output.drawing import INK, PALE, SOFT, Drawing, Pen, Pencil
from rodshell.output.plan import nice_ticks
from rodshell.output.rods import rods_of
from rodshell.output.rounding import Rounding, rounding_of


def rod_curves(archive: Archive, positions: Floats) -> list[Floats]:
    """The nodes (k, 3) [mm] of each rod that the states hold, in a state (n, 3) [m]."""
    return [1e3 * positions[rod.nodes] for rod in rods_of(archive) if len(rod.nodes) > 1]


def elevations_drawing(archive: Archive, text: float) -> Drawing:
    """The final shape from the front (along y) and, above, from the right (along -x), with overall dimensions."""
    pencil, final = Pencil(), archive.final
    assert final is not None
    curves = rod_curves(archive, archive.states[final])
    heights = np.concatenate(curves)[:, 2]
    tall, rounding = float(np.ptp(heights)) + 10 * text, rounding_of(archive.result)
    for k, (axis, words) in enumerate(((0, "Front elevation: x to the right"), (1, "Right elevation: y to the right"))):
        flat = [np.column_stack([curve[:, axis], curve[:, 2] - heights.min() + k * tall]) for curve in curves]
        for curve in flat:
            pencil.line(thinned(curve), "CUT", pen=Pen(INK, 0.08 * text))
        cloud = np.concatenate(flat)
        low, high = cloud.min(axis=0), cloud.max(axis=0)
        _span(pencil, (low[0], low[1] - 1.5 * text), (high[0], low[1] - 1.5 * text), high[0] - low[0], text, rounding)
        _span(pencil, (low[0] - 1.5 * text, low[1]), (low[0] - 1.5 * text, high[1]), high[1] - low[1], text, rounding)
        pencil.line([(low[0] - 2 * text, low[1]), (high[0] + 2 * text, low[1])], "DIM")
        pencil.write(words, (low[0], low[1] - 5 * text), 1.2 * text, "LABEL", bold=True)
    return pencil.done("elevations", "Elevations", text)


def erection_drawing(archive: Archive, text: float) -> Drawing:
    """Ways of the rod ends from flat to their supports, seen from above, and the shell's side at each stage."""
    pencil, history = Pencil(), archive.states["history"]
    stages, mm = archive.result["deployment"]["stages"], rounding_of(archive.result).mm
    ends = np.concatenate([rod.nodes[[0, -1]] for rod in rods_of(archive) if len(rod.nodes) > 1])
    ways = 1e3 * history[:, ends, :2]
    for way in ways.transpose(1, 0, 2):
        pencil.line(way[[0, -1]], "DIM", pen=Pen("#b08a2e", 0.1 * text))
    for k, places in enumerate(ways):
        last = k == len(ways) - 1
        for at in places:
            pencil.mark(at, (0.3 if last else 0.12) * text, "MARK" if last else "DIM", pen=Pen(SOFT, 0.05 * text))
    low, high = ways.reshape(-1, 2).min(axis=0), ways.reshape(-1, 2).max(axis=0)
    pencil.write("Ways of the rod ends, from above", (low[0], low[1] - 3 * text), 1.2 * text, "LABEL", bold=True)
    left, top = high[0] + 8 * text, high[1]
    for k, (stage, positions) in enumerate(zip(stages, history, strict=True)):
        if k == len(stages) // 2 + 1:
            left, top = left + high[0] - low[0] + 8 * text, high[1]
        curves = [curve[:, [0, 2]] for curve in rod_curves(archive, positions)]
        cloud = np.concatenate(curves)
        tall = float(np.ptp(cloud[:, 1]))
        shift = np.array([left - low[0], top - tall - cloud[:, 1].min()])
        for curve in curves:
            pencil.line(thinned(curve) + shift, "CUT", pen=Pen(INK, 0.04 * text))
        words = f"{k}: ends {100 * stage['share']:.0f} % of the way, {mm(stage['height'])} mm high"
        pencil.write(words, (left, top - tall - 1.8 * text), text, "LABEL")
        top -= tall + 5 * text
    return pencil.done("erection", "Erection stages, front elevations", text)


def thinned(curve: Floats) -> Floats:
    """A curve by about every third of its nodes, its ends kept."""
    return curve[np.unique(np.append(np.arange(0, len(curve), 3), len(curve) - 1))]


def seen_from_above(pencil: Pencil, archive: Archive, text: float) -> None:
    """The rods of the final shape, pale."""
    assert archive.final is not None
    for curve in rod_curves(archive, archive.states[archive.final]):
        pencil.line(thinned(curve)[:, :2], "CUT", pen=Pen(PALE, 0.08 * text))


def _span(
    pencil: Pencil, a: tuple[float, float], b: tuple[float, float], length: float, text: float, rounding: Rounding
) -> None:
    """A dimension line with its length [mm] beside it."""
    start, end = np.array(a), np.array(b)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    across = 0.4 * text * np.array([-along[1], along[0]])
    pencil.line([start, end], "DIM")
    for place_ in (start, end):
        pencil.line([place_ - across, place_ + across], "DIM")
    angle = float(np.arctan2(along[1], along[0]))
    side = 0.5 * text * np.array([-along[1], along[0]]) if angle else np.array([0.0, -1.4 * text])
    pencil.write(rounding.mm(1e-3 * length), 0.5 * (start + end) + side, text, "DIM", anchor="middle", angle=angle)


def axes(pencil: Pencil, text: float) -> None:
    """Ticks of x and y [mm] along two sides of all that is there."""
    low, high = pencil.done("", "", text).box()
    low, high = low - text, high + text
    pencil.line([(low[0], high[1]), low, (high[0], low[1])], "DIM")
    for value in nice_ticks(low[0], high[0], 6):
        pencil.line([(value, low[1]), (value, low[1] + 0.4 * text)], "DIM")
        pencil.write(f"{value:g}", (value, low[1] - 1.1 * text), 0.8 * text, "DIM", anchor="middle")
    for value in nice_ticks(low[1], high[1], 6):
        pencil.line([(low[0], value), (low[0] + 0.4 * text, value)], "DIM")
        pencil.write(f"{value:g}", (low[0] - 0.4 * text, value - 0.3 * text), 0.8 * text, "DIM", anchor="end")
