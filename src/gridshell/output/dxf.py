"""A drawing as DXF in millimetres, on named layers, the same bytes for the same drawing."""

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gridshell.output.drawing import LAYERS, Drawing, Path, Text

if TYPE_CHECKING:
    from ezdxf.layouts import Modelspace

CAP = 0.72  # height of a capital over the text size; DXF measures text by its capitals


def drawing_dxf(drawing: Drawing, names: Mapping[str, str] | None = None) -> str:
    """A LINE, LWPOLYLINE or 3D POLYLINE for each path, a CIRCLE for each mark, a TEXT for each text.

    names : for each layer the name that it takes in the file, where that is another.
    """
    import ezdxf
    from ezdxf import units

    layer = {name: (names or {}).get(name, name) for name in LAYERS}
    fixed = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True  # no clock and no random id in the file
    try:
        file = ezdxf.new("R2010", units=units.MM)
        for name, shown in layer.items():
            file.layers.add(shown, color=LAYERS[name].number)
        space = file.modelspace()
        for path in drawing.paths:
            _path(space, path, layer[path.layer])
        for mark in drawing.marks:
            space.add_circle(mark.at.tolist(), mark.radius, dxfattribs={"layer": layer[mark.layer]})
        for text in drawing.texts:
            _text(space, text, layer[text.layer])
        file.classes.add_required_classes(file.dxfversion)  # from a set, whose order changes from run to run
        file.classes.classes = dict(sorted(file.classes.classes.items()))
        stream = io.StringIO()
        file.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = fixed
    return stream.getvalue()


def _path(space: "Modelspace", path: Path, layer: str) -> None:
    points, style = path.points.tolist(), {"layer": layer}
    if not path.flat:
        space.add_polyline3d(points, close=path.closed, dxfattribs=style)
    elif len(points) == 2:
        space.add_line(*points, dxfattribs=style)
    else:
        space.add_lwpolyline(points, close=path.closed, dxfattribs=style)


def _text(space: "Modelspace", text: Text, layer: str) -> None:
    from ezdxf.enums import TextEntityAlignment as Align

    align = {"start": Align.LEFT, "middle": Align.CENTER, "end": Align.RIGHT}[text.anchor]
    style = {"layer": layer, "height": CAP * text.size, "rotation": float(np.degrees(text.angle))}
    space.add_text(text.text, dxfattribs=style).set_placement(text.at.tolist(), align=align)
