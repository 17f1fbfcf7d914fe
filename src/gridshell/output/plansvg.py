"""The flat plan as SVG at true scale: one unit is one millimetre, y points up (drawn as -y)."""

from html import escape

import numpy as np
from numpy.typing import NDArray

from gridshell.output.labels import Label
from gridshell.output.plan import NOTE, FlatPlan, nice_step, nice_ticks
from gridshell.output.svg import document, label, number, tag
from gridshell.output.wording import MINUS

Floats = NDArray[np.float64]

INK, SOFT, PALE = "#22282f", "#6c757d", "#c9ced3"
FAMILY = {"u": "#1f5f8b", "v": "#a8552a", "free": "#1f5f8b"}
PAPER = "#ffffff"
HOW_TO_READ = "Flat plan in mm, 1:1. Dot: start of a rod, from which its joints are measured."


def plan_svg(plan: FlatPlan) -> str:
    """Rods, joints, labels, footprint, axes, scale bar and title block."""
    unit = 0.001 * plan.extent  # pen widths and text grow with the sheet
    corners = [plan.lines.reshape(-1, 2), *(item.box(plan.text_size) for item in plan.labels)]
    cloud = np.concatenate([*corners, np.zeros((1, 2))])
    low, high = cloud.min(axis=0) - 12 * unit, cloud.max(axis=0) + 12 * unit
    left, top = low[0] - 62 * unit, -high[1] - 14 * unit
    width, height = high[0] - left + 14 * unit, high[1] - low[1] + 146 * unit
    return document(
        (left, top, width, height),
        tag("title", escape(f"{plan.name}: flat plan, 1:1 in mm")),
        tag("rect", x=left, y=top, width=width, height=height, fill=PAPER),
        _axes(low, high, unit),
        _footprint(plan, unit),
        _rods(plan, unit),
        _joints(plan, unit),
        *(_label(item, plan.text_size, unit) for item in plan.labels),
        _title_block(plan, low, high, unit),
        unit="mm",
    )


def _rods(plan: FlatPlan, unit: float) -> str:
    lines = []
    for rod, (a, b) in zip(plan.rods, plan.lines, strict=True):
        title = tag("title", escape(f"{rod.id}: {1e3 * rod.length:.3f} mm"))
        ends = {"x1": a[0], "y1": -a[1], "x2": b[0], "y2": -b[1]}
        lines.append(tag("line", title, data_rod=rod.id, **ends, stroke=FAMILY.get(rod.family, INK)))
    dot = min(2.6 * unit, 0.1 * plan.spacing)
    starts = [tag("circle", cx=x, cy=-y, r=dot) for x, y in plan.lines[:, 0]]
    return tag("g", *lines, stroke_width=_pen(plan, unit)) + tag("g", *starts, fill=INK) if lines else ""


def _joints(plan: FlatPlan, unit: float) -> str:
    radius = min(2.2 * unit, 0.09 * plan.spacing)
    marks = []
    for joint, (x, y) in zip(plan.joints, plan.marks, strict=True):
        a, b = (f"{plan.rods[k].id} at {1e3 * at:.2f} mm" for k, at in zip(joint.rods, joint.at, strict=True))
        title = tag("title", escape(f"{joint.id}: {a}, {b}"))
        marks.append(tag("circle", title, cx=x, cy=-y, r=radius))
    return tag("g", *marks, fill=PAPER, stroke=INK, stroke_width=0.6 * _pen(plan, unit)) if marks else ""


def _footprint(plan: FlatPlan, unit: float) -> str:
    if not len(plan.footprint):
        return ""
    points = " ".join(f"{number(x, 3)},{number(-y, 3)}" for x, y in plan.footprint)
    pen = {"stroke_width": 0.9 * unit, "stroke_dasharray": f"{number(7 * unit)} {number(4 * unit)}"}
    return tag("polygon", points=points, fill="#f4f2ec", stroke="#8f8a7c", **pen)


def _label(item: Label, size: float, unit: float) -> str:
    x, y = item.centre[0], -item.centre[1]
    place = f"translate({number(x, 3)} {number(y, 3)}) rotate({number(-np.degrees(item.angle), 3)})"
    text = label(item.text, 0, 0.35 * size, size, text_anchor="middle", fill=INK, transform=place)
    if not item.moved:
        return text
    gap = item.centre - item.end
    near = item.centre - gap / np.linalg.norm(gap) * size * (0.2 + 0.31 * len(item.text))
    line = {"x1": item.end[0], "y1": -item.end[1], "x2": near[0], "y2": -near[1]}
    return text + tag("line", **line, stroke=PALE, stroke_width=0.6 * unit)


def _axes(low: Floats, high: Floats, unit: float) -> str:
    """A frame with millimetre ticks along its lower and left side."""
    (x0, y0), (x1, y1), size = low, high, 13 * unit
    box = {"x": x0, "y": -y1, "width": x1 - x0, "height": y1 - y0}
    parts = [tag("rect", **box, fill="none", stroke=PALE, stroke_width=0.8 * unit)]
    ticks = []
    for x in nice_ticks(x0, x1 - 32 * unit, 10):  # room for the axis' name
        ticks.append(tag("line", x1=x, y1=-y0, x2=x, y2=6 * unit - y0))
        parts.append(label(_tick(x), x, 20 * unit - y0, size, text_anchor="middle", fill=SOFT))
    for y in nice_ticks(y0, y1 - 32 * unit, 10):
        ticks.append(tag("line", x1=x0, y1=-y, x2=x0 - 6 * unit, y2=-y))
        parts.append(label(_tick(y), x0 - 10 * unit, 0.35 * size - y, size, text_anchor="end", fill=SOFT))
    name = {"text_anchor": "end", "fill": INK, "font_style": "italic"}
    parts.append(tag("g", *ticks, stroke=SOFT, stroke_width=0.8 * unit) if ticks else "")
    parts.append(label("x", x1, 20 * unit - y0, size, **name))
    parts.append(label("y", x0 - 10 * unit, size - y1, size, **name))
    return "".join(parts)


def _tick(value: float) -> str:
    return number(value).replace("-", MINUS)


def _title_block(plan: FlatPlan, low: Floats, high: Floats, unit: float) -> str:
    """Below the frame: name and content on the left, scale bar and note on the right."""
    y, left, right = 58 * unit - low[1], low[0], high[0]
    bar, rule, size = nice_step(plan.extent / 4, 1), y - 22 * unit, 14 * unit
    quarters = [
        tag("rect", x=right - bar + k * bar / 4, y=y - 4 * unit, width=bar / 4, height=7 * unit, fill=fill)
        for k, fill in enumerate((INK, PAPER, INK, PAPER))
    ]
    return "".join(
        [
            tag("line", x1=left, y1=rule, x2=right, y2=rule, stroke=INK, stroke_width=1.2 * unit),
            label(plan.name, left, y + 6 * unit, 24 * unit, fill=INK, font_weight="600"),
            label(HOW_TO_READ, left, y + 28 * unit, size, fill=INK),
            label(plan.summary, left, y + 48 * unit, size, fill=SOFT),
            tag("g", *quarters, stroke=INK, stroke_width=0.8 * unit),
            label("0", right - bar, y + 28 * unit, size, fill=INK),
            label(f"{number(bar)} mm", right, y + 28 * unit, size, fill=INK, text_anchor="end"),
            label(NOTE, right, y + 48 * unit, size, fill=SOFT, text_anchor="end"),
        ]
    )


def _pen(plan: FlatPlan, unit: float) -> float:
    return min(1.6 * unit, 0.07 * plan.spacing)
