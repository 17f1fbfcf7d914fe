"""The flat plan as SVG at true scale: one unit is one millimetre, y points up (drawn as -y)."""

from html import escape

import numpy as np

from gridshell.output.labels import Label
from gridshell.output.plan import NOTE, FlatPlan, nice_step, nice_ticks
from gridshell.output.svg import document, label, number, tag

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
    lines = [
        tag("line", tag("title", escape(f"{rod.id}: {1e3 * rod.length:.3f} mm")), data_rod=rod.id,
            x1=a[0], y1=-a[1], x2=b[0], y2=-b[1], stroke=FAMILY.get(rod.family, INK))
        for rod, (a, b) in zip(plan.rods, plan.lines, strict=True)
    ]  # fmt: skip
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
    return tag("polygon", points=points, fill="#f4f2ec", stroke="#8f8a7c", stroke_width=0.9 * unit,
               stroke_dasharray=f"{number(7 * unit)} {number(4 * unit)}")  # fmt: skip


def _label(item: Label, size: float, unit: float) -> str:
    x, y = item.centre[0], -item.centre[1]
    turn = -np.degrees(item.angle)
    text = label(item.text, 0, 0.35 * size, size, text_anchor="middle", fill=INK,
                 transform=f"translate({number(x, 3)} {number(y, 3)}) rotate({number(turn, 3)})")  # fmt: skip
    if not item.moved:
        return text
    gap = item.centre - item.end
    near = item.centre - gap / np.linalg.norm(gap) * size * (0.2 + 0.31 * len(item.text))
    return text + tag("line", x1=item.end[0], y1=-item.end[1], x2=near[0], y2=-near[1], stroke=PALE,
                      stroke_width=0.6 * unit)  # fmt: skip


def _axes(low: np.ndarray, high: np.ndarray, unit: float) -> str:
    """A frame with millimetre ticks on its lower and left side, and the origin of the material coordinates."""
    size, parts = 13 * unit, []
    parts.append(tag("rect", x=low[0], y=-high[1], width=high[0] - low[0], height=high[1] - low[1], fill="none",
                     stroke=PALE, stroke_width=0.8 * unit))  # fmt: skip
    for axis in (0, 1):
        for value in nice_ticks(low[axis], high[axis] - 32 * unit, 10):  # room for the axis' name
            x, y = (value, -low[1]) if axis == 0 else (low[0], -value)
            dx, dy = (0.0, 6 * unit) if axis == 0 else (-6 * unit, 0.0)
            parts.append(tag("line", x1=x, y1=y, x2=x + dx, y2=y + dy, stroke=SOFT, stroke_width=0.8 * unit))
            at = (x, y + 20 * unit) if axis == 0 else (x - 10 * unit, y + 0.35 * size)
            anchor = "middle" if axis == 0 else "end"
            parts.append(label(number(value).replace("-", "\N{MINUS SIGN}"), *at, size, text_anchor=anchor, fill=SOFT))
    parts.append(label("x", high[0], -low[1] + 20 * unit, size, text_anchor="end", fill=INK, font_style="italic"))
    parts.append(label("y", low[0] - 10 * unit, -high[1] + size, size, text_anchor="end", fill=INK, font_style="italic"))
    return "".join(parts)


def _title_block(plan: FlatPlan, low: np.ndarray, high: np.ndarray, unit: float) -> str:
    """Below the frame: name and content on the left, scale bar and note on the right."""
    y, left, right = -low[1] + 58 * unit, low[0], high[0]
    bar = nice_step(plan.extent / 4, 1)
    rule = tag("line", x1=left, y1=y - 22 * unit, x2=right, y2=y - 22 * unit, stroke=INK, stroke_width=1.2 * unit)
    parts = [
        rule,
        label(plan.name, left, y + 6 * unit, 24 * unit, fill=INK, font_weight="600"),
        label(HOW_TO_READ, left, y + 28 * unit, 14 * unit, fill=INK),
        label(plan.summary, left, y + 48 * unit, 14 * unit, fill=SOFT),
        label(NOTE, right, y + 48 * unit, 14 * unit, fill=SOFT, text_anchor="end"),
        label(f"{number(bar)} mm", right, y + 28 * unit, 14 * unit, fill=INK, text_anchor="end"),
    ]
    for k in range(4):
        parts.append(tag("rect", x=right - bar + k * bar / 4, y=y - 4 * unit, width=bar / 4, height=7 * unit,
                         fill=INK if k % 2 == 0 else PAPER, stroke=INK, stroke_width=0.8 * unit))  # fmt: skip
    parts.append(label("0", right - bar, y + 28 * unit, 14 * unit, fill=INK))
    return "".join(parts)


def _pen(plan: FlatPlan, unit: float) -> float:
    return min(1.6 * unit, 0.07 * plan.spacing)
