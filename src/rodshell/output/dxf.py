"""A drawing as DXF R2010 in millimetres, by ezdxf: named layers, line types, text styles; the same bytes each time."""

from collections.abc import Mapping
from io import StringIO
from itertools import chain, count
from math import degrees
from typing import Any

import ezdxf
from ezdxf.document import CREATED_BY_EZDXF, WRITTEN_BY_EZDXF
from ezdxf.document import Drawing as Document
from ezdxf.enums import TextEntityAlignment
from ezdxf.layouts import Modelspace
from ezdxf.lldxf.tagwriter import TagWriter

from rodshell.figures.records import printable
from rodshell.output.drawing import FORBIDDEN, LAYERS, Drawing, Path, Text

LONGEST = 200  # letters of a layer's name
CAPITAL = 0.716  # height of Arial's capitals over the text size; a DXF text is as high as its capitals
_DATE = 2451544.5  # 2000-01-01, a Julian date
_IDENTIFIER = "{00000000-0000-0000-0000-000000000000}"
ALIGNMENTS = {"start": TextEntityAlignment.LEFT, "middle": TextEntityAlignment.CENTER, "end": TextEntityAlignment.RIGHT}
_STYLES = {False: ("SANS", "arial.ttf"), True: ("SANS-BOLD", "arialbd.ttf")}  # which every CAD program has or replaces


def drawing_dxf(drawing: Drawing, names: Mapping[str, str] | None = None) -> str:
    """The text of a DXF file: a LINE, LWPOLYLINE or 3D POLYLINE for each path, a CIRCLE a mark, a TEXT a text.

    Args:
        names: for some layers the name that they take in the file (see `layer_names`).
    """
    document = ezdxf.new("R2010", units=ezdxf.units.MM)
    layers = layer_names(names or {})
    _set_up(document, layers, drawing)
    space = document.modelspace()
    for path in drawing.paths:
        _add_path(space, path, layers[path.layer])
    for mark in drawing.marks:
        space.add_circle(mark.at.tolist(), float(mark.radius), dxfattribs={"layer": layers[mark.layer]})
    for text in drawing.texts:
        _add_text(space, text, layers[text.layer])
    return _written(document)


def layer_names(names: Mapping[str, str]) -> dict[str, str]:
    """The name of each layer in a file, by a wish or its own: without characters that DXF forbids, and unique in upper
    and lower case."""
    shown, taken = dict[str, str](), {"0", "DEFPOINTS"}  # which every file has
    for layer in LAYERS:
        asked = "".join("_" if letter in FORBIDDEN else letter for letter in printable(str(names.get(layer, layer))))
        asked = asked.strip()[:LONGEST] or layer
        tries = chain([asked], (f"{asked} {k}" for k in count(2)))
        shown[layer] = next(name for name in tries if name.upper() not in taken)
        taken.add(shown[layer].upper())
    return shown


def _written(document: Document) -> str:
    """As `document.write`, but files of the same content are the same: no time of writing, no random identifiers.

    ezdxf has a switch for that, which holds for the whole process, other threads included.
    """
    for kind in sorted(document.entitydb.dxf_types_in_use()):
        document.classes.add_class(kind)  # in a fixed order: `update_all` has that of a set
    document.commit_pending_changes()
    document.update_all()
    for date in ("$TDCREATE", "$TDUCREATE", "$TDUPDATE", "$TDUUPDATE"):
        document.header[date] = _DATE
    for identifier in ("$VERSIONGUID", "$FINGERPRINTGUID"):
        document.header[identifier] = _IDENTIFIER
    about = document.ezdxf_metadata()
    about[CREATED_BY_EZDXF] = about[WRITTEN_BY_EZDXF] = "rodshell"
    stream = StringIO()
    document.export_sections(TagWriter(stream, document.dxfversion))
    return stream.getvalue()


def _set_up(document: Document, layers: Mapping[str, str], drawing: Drawing) -> None:
    """Layers with colour, line weight and line type, text styles, and a first view of the whole drawing."""
    scale = drawing.pen_scale
    for name, layer in LAYERS.items():
        look: dict[str, Any] = {"color": layer.number, "lineweight": round(100 * layer.pen)}
        if layer.dash:
            dash, gap = layer.dash
            look["linetype"] = "DASHED"
            document.linetypes.add("DASHED", [dash + gap, dash, -gap], description="Dashed")
        document.layers.add(layers[name], **look)
    document.header["$LTSCALE"] = scale
    for style, font in _STYLES.values():
        document.styles.add(style, font=font)
    low, high = drawing.box()
    width, height = (1.05 * (high - low)).tolist()
    document.set_modelspace_vport(max(height, 0.5 * width), center=(0.5 * (low + high)).tolist())
    space = document.modelspace()
    space.dxf.extmin, space.dxf.extmax = (*low.tolist(), 0.0), (*high.tolist(), 0.0)


def _add_path(space: Modelspace, path: Path, layer: str) -> None:
    points, look = path.points.tolist(), {"layer": layer}
    if not path.flat:
        space.add_polyline3d(points, close=path.closed, dxfattribs=look)
    elif len(points) == 2:
        space.add_line(*points, dxfattribs=look)
    else:
        space.add_lwpolyline(points, close=path.closed, dxfattribs=look)


def _add_text(space: Modelspace, text: Text, layer: str) -> None:
    entity = space.add_text(
        _plain(text.text),
        height=CAPITAL * text.size,
        rotation=degrees(text.angle) or None,
        dxfattribs={"layer": layer, "style": _STYLES[text.bold][0]},
    )
    entity.set_placement(text.at.tolist(), align=ALIGNMENTS[text.anchor])


def _plain(text: str) -> str:
    """A text as TEXT holds it: a caret would start a control character, two percent signs a symbol [DXF reference]."""
    return printable(text).replace("^", "^ ").replace("%%", "%%%%%%")
