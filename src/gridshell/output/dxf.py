"""The flat plan as DXF in millimetres, on named layers, the same bytes for the same plan."""

import io
from typing import TYPE_CHECKING

import numpy as np

from gridshell.output.plan import NOTE, FlatPlan

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.layouts import Modelspace

LAYERS = {  # name: AutoCAD colour
    "CUT": 7, "MARK": 1, "LABEL": 3, "LABEL-JOINTS": 8, "BOUNDARY-FLAT": 5, "BOUNDARY-FINAL": 6, "TITLE": 7,
}  # fmt: skip
CAP = 0.72  # height of a capital over the text size; DXF measures text by its capitals


def plan_dxf(plan: FlatPlan) -> str:
    """One LINE a rod on CUT, a circle a joint on MARK, labels, both boundary curves, and a title."""
    import ezdxf
    from ezdxf import units

    fixed = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True  # no clock and no random id in the file
    try:
        drawing = ezdxf.new("R2010", units=units.MM)
        for name, colour in LAYERS.items():
            drawing.layers.add(name, color=colour)
        _draw(plan, drawing)
        stream = io.StringIO()
        drawing.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = fixed
    return stream.getvalue()


def _draw(plan: FlatPlan, drawing: "Drawing") -> None:
    space = drawing.modelspace()
    for a, b in plan.lines.tolist():
        space.add_line(a, b, dxfattribs={"layer": "CUT"})
    radius = min(1.0, 0.05 * plan.spacing)
    for mark in plan.marks.tolist():
        space.add_circle(mark, radius, dxfattribs={"layer": "MARK"})
    if len(plan.footprint):
        space.add_lwpolyline(plan.footprint.tolist(), close=True, dxfattribs={"layer": "BOUNDARY-FLAT"})
    if len(plan.boundary):
        space.add_polyline3d(plan.boundary.tolist(), close=True, dxfattribs={"layer": "BOUNDARY-FINAL"})
    _write(plan, space)


def _write(plan: FlatPlan, space: "Modelspace") -> None:
    """All texts."""
    from ezdxf.enums import TextEntityAlignment as Align

    height = CAP * plan.text_size
    for item in plan.labels:
        style = {"layer": "LABEL", "height": height, "rotation": float(np.degrees(item.angle))}
        text = space.add_text(item.text, dxfattribs=style)
        text.set_placement(item.centre.tolist(), align=Align.MIDDLE_CENTER)
    small = {"layer": "LABEL-JOINTS", "height": CAP * 0.12 * plan.spacing}  # fits between two joints
    for joint, mark in zip(plan.joints, plan.marks, strict=True):
        space.add_text(joint.id, dxfattribs=small).set_placement((mark + 0.06 * plan.spacing).tolist())
    size = 0.018 * plan.extent
    left, below = plan.lines.reshape(-1, 2).min(axis=0, initial=0.0) - (0.0, 6 * plan.text_size)
    for k, line in enumerate((plan.name, "Flat plan, units mm, scale 1:1", plan.summary, NOTE)):
        title = {"layer": "TITLE", "height": CAP * size * (1.5 if k == 0 else 1.0)}
        space.add_text(line, dxfattribs=title).set_placement((left, below - 1.7 * (k + 1) * size))
