"""A strip for each rod: where to mark it, all distances from one end, so that errors do not add up."""

from collections.abc import Sequence

import numpy as np

from rodshell.output.drawing import INK, PAPER, Drawing, Pen, Pencil
from rodshell.output.labels import spread
from rodshell.output.plan import FlatPlan
from rodshell.output.rods import RodRecord
from rodshell.output.schedules import Show

TITLE = "Rod strips, distances from the cut end of the rod's start in mm"
LEGEND = (
    "Datum: left, the cut end of the rod's start. Full mark: the other rod lies over this one. S: splice. "
    "Open triangle: support."
)
TALL = 15.0  # text sizes from strip to strip


def strips_drawing(plan: FlatPlan, text: float, rods: Sequence[RodRecord] | None = None) -> Drawing:
    """The strips of some rods (default: all) one below the other [mm], all starting at x = 0."""
    pencil = Pencil()
    layer = {rod.id: rod.layer for rod in plan.rods}
    chosen = plan.rods if rods is None else rods
    for k, rod in enumerate(chosen):
        _strip(pencil, rod, -k * TALL * text, text, layer, plan.rounding.mm)
    pencil.write(LEGEND, (0.0, -len(chosen) * TALL * text + 5 * text), text, "DIM")
    return pencil.done("strips", TITLE, text)


def per_sheet(height: float, text: float) -> int:
    """How many strips find room in a height [mm]."""
    return max(int((height / text - 3) // TALL), 1)


def _strip(pencil: Pencil, rod: RodRecord, y: float, text: float, layer: dict[str, int | None], mm: Show) -> None:
    """One rod: above it the distances, below it the rods that are met."""
    cut, start = 1e3 * rod.cut_length, 1e3 * rod.from_cut_end(0.0)
    pencil.line([(0.0, y), (cut, y)], "CUT", name=rod.id, note=f"{rod.id}: {mm(rod.cut_length)} mm")
    words = [rod.id, f"cut {mm(rod.cut_length)}", f"layer {rod.layer}" if rod.layer is not None else ""]
    if start > 0:
        words.append(f"with {mm(rod.allowance)} at each end for the supports")
    pencil.write("   ".join(filter(None, words)), (0.0, y + 7.2 * text), 1.1 * text, "LABEL", bold=True)
    joints = ((1e3 * rod.from_cut_end(at), other, "joint") for other, at in rod.joints)
    stops = [(0.0, "", ""), *joints, (cut, "", "")]
    stops += [(1e3 * rod.from_cut_end(at), "S", "splice") for at in rod.splices]
    if start > 0:
        stops += [(start, "", "support"), (cut - start, "", "support")]
    stops.sort(key=lambda stop: stop[0])
    places = spread([at for at, _, _ in stops], 1.15 * text)
    for (at, name, kind), x in zip(stops, places, strict=True):
        _stop(pencil, rod, at, float(x), y, text, name, kind, layer, mm)


def _stop(
    pencil: Pencil, rod: RodRecord, at: float, x: float, y: float, text: float, name: str, kind: str,
    layer: dict[str, int | None], mm: Show,
) -> None:  # fmt: skip
    """A mark at `at`, its texts at `x`."""
    shift = 0.35 * text
    for side, far in ((1, 2.2), (-1, -1.6)):
        if side > 0 or name:
            way = [(at, y + 0.4 * side * text), (at, y + 0.7 * side * text), (x, y + 0.85 * far * text)]
            pencil.line(way if abs(x - at) > 1e-6 else way[::2], "DIM")
    pencil.write(mm(1e-3 * at), (x + shift, y + 2.0 * text), text, "LABEL", angle=np.pi / 2)
    if name:
        pencil.write(name, (x + shift, y - 1.6 * text), text, "LABEL", anchor="end", angle=np.pi / 2)
    if kind == "joint":
        mine, other = rod.layer, layer.get(name)
        below = mine is not None and other is not None and other > mine
        pencil.mark((at, y), 0.35 * text, "MARK", pen=Pen("#b3372c", 0.07 * text, fill="#b3372c" if below else PAPER))
    elif kind == "splice":
        pencil.line([(at, y - 0.5 * text), (at, y + 0.5 * text)], "MARK", pen=Pen(INK, 0.2 * text))
    elif kind == "support":
        corners = [(at, y), (at - 0.4 * text, y - 0.7 * text), (at + 0.4 * text, y - 0.7 * text)]
        pencil.line(corners, "MARK", closed=True, pen=Pen(INK, 0.07 * text))
