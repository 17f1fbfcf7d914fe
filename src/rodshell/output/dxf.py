"""A drawing as DXF R2010 in millimetres: named layers, line types, text styles; the same bytes each time.

ezdxf makes the document. The entities, thousands of five kinds, are written here: ten times as fast, the same bytes.
"""

from collections.abc import Callable, Iterator, Mapping
from io import StringIO
from itertools import chain, count
from math import degrees
from typing import TYPE_CHECKING, Any

from rodshell.output.drawing import LAYERS, Anchor, Drawing, Text
from rodshell.results.records import printable

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document

FORBIDDEN = '<>/\\":;?*|=`,'  # in a layer's name [DXF reference]; it holds LONGEST letters at most
LONGEST = 200
CAPITAL = 0.716  # height of Arial's capitals over the text size; a DXF text is as high as its capitals
DATE = 2451544.5  # 2000-01-01, a Julian date
IDENTIFIER = "{00000000-0000-0000-0000-000000000000}"
JUSTIFIED: dict[Anchor, str] = {"start": "", "middle": " 72\n1\n", "end": " 72\n2\n"}
ENTITIES = "  0\nSECTION\n  2\nENTITIES\n"  # what the section begins with
STYLES = {False: ("SANS", "arial.ttf"), True: ("SANS-BOLD", "arialbd.ttf")}  # which every CAD program has or replaces


def drawing_dxf(drawing: Drawing, names: Mapping[str, str] | None = None) -> str:
    """The text of a DXF file: a LINE, LWPOLYLINE or 3D POLYLINE for each path, a CIRCLE a mark, a TEXT a text.

    Parameters
    ----------
    drawing : at 1:1 [mm].
    names : for some layers the name that they take in the file (see `layer_names`).
    """
    import ezdxf

    document = ezdxf.new("R2010", units=ezdxf.units.MM)
    layers = layer_names(names or {})
    _set_up(document, layers, drawing)
    records = "".join(_records(drawing, layers, document.modelspace().layout_key, document.entitydb.next_handle))
    before, after = _written(document).split(ENTITIES)
    return f"{before}{ENTITIES}{records}{after}"


def layer_names(names: Mapping[str, str]) -> dict[str, str]:
    """The name of each layer in a file: without characters that DXF forbids, and unique in upper and lower case.

    Parameters
    ----------
    names : the wished names of some layers, by those of `LAYERS`.
    """
    shown, taken = dict[str, str](), {"0", "DEFPOINTS"}  # which every file has
    for layer in LAYERS:
        asked = "".join("_" if letter in FORBIDDEN else letter for letter in printable(str(names.get(layer, layer))))
        asked = asked.strip()[:LONGEST] or layer
        tries = chain([asked], (f"{asked} {k}" for k in count(2)))
        shown[layer] = next(name for name in tries if name.upper() not in taken)
        taken.add(shown[layer].upper())
    return shown


def _written(document: "Document") -> str:
    """As `document.write`, but files of the same content are the same: no time of writing, no random identifiers.

    ezdxf has a switch for that, which holds for the whole process, other threads included.
    """
    from ezdxf.document import CREATED_BY_EZDXF, WRITTEN_BY_EZDXF
    from ezdxf.lldxf.tagwriter import TagWriter

    for kind in sorted(document.entitydb.dxf_types_in_use()):
        document.classes.add_class(kind)  # in a fixed order: `update_all` has that of a set
    document.commit_pending_changes()
    document.update_all()
    for date in ("$TDCREATE", "$TDUCREATE", "$TDUPDATE", "$TDUUPDATE"):
        document.header[date] = DATE
    for identifier in ("$VERSIONGUID", "$FINGERPRINTGUID"):
        document.header[identifier] = IDENTIFIER
    about = document.ezdxf_metadata()
    about[CREATED_BY_EZDXF] = about[WRITTEN_BY_EZDXF] = "rodshell"
    stream = StringIO()
    document.export_sections(TagWriter(stream, document.dxfversion))
    return stream.getvalue()


def _set_up(document: "Document", layers: Mapping[str, str], drawing: Drawing) -> None:
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
    for style, font in STYLES.values():
        document.styles.add(style, font=font)
    low, high = drawing.box()
    width, height = (1.05 * (high - low)).tolist()
    document.set_modelspace_vport(max(height, 0.5 * width), center=(0.5 * (low + high)).tolist())
    space = document.modelspace()
    space.dxf.extmin, space.dxf.extmax = (*low.tolist(), 0.0), (*high.tolist(), 0.0)


def _records(drawing: Drawing, layers: Mapping[str, str], owner: str, next_handle: Callable[[], str]) -> Iterator[str]:
    """The records of all entities: group codes and values on lines in turn [DXF reference].

    Parameters
    ----------
    layers : name of each layer in the file.
    owner : handle of the model space.
    next_handle : gives a handle that no other record has.
    """

    def head(kind: str, layer: str, handle: str = "", parent: str = owner) -> str:
        mine = handle or next_handle()
        return f"  0\n{kind}\n  5\n{mine}\n330\n{parent}\n100\nAcDbEntity\n  8\n{layers[layer]}\n"

    for path in drawing.paths:
        points, closed = path.points.tolist(), int(path.closed)
        if not path.flat:
            handle, end = next_handle(), next_handle()
            line = head("POLYLINE", path.layer, handle)
            yield f"{line}100\nAcDb3dPolyline\n 66\n1\n{_at(10, 0.0, 0.0)} 70\n{8 + closed}\n"
            for point in points:
                vertex = head("VERTEX", path.layer)
                yield f"{vertex}100\nAcDbVertex\n100\nAcDb3dPolylineVertex\n{_at(10, *point)} 70\n32\n"
            yield head("SEQEND", path.layer, end, handle)
        elif len(points) == 2:
            start, stop = points
            yield f"{head('LINE', path.layer)}100\nAcDbLine\n{_at(10, *start)}{_at(11, *stop)}"
        else:
            corners = "".join(f" 10\n{x}\n 20\n{y}\n" for x, y in points)
            yield f"{head('LWPOLYLINE', path.layer)}100\nAcDbPolyline\n 90\n{len(points)}\n 70\n{closed}\n{corners}"
    for mark in drawing.marks:
        middle = _at(10, *mark.at.tolist())
        yield f"{head('CIRCLE', mark.layer)}100\nAcDbCircle\n{middle} 40\n{float(mark.radius)}\n"
    for text in drawing.texts:
        yield head("TEXT", text.layer) + _lettering(text)


def _lettering(text: Text) -> str:
    """The part of a TEXT that says what stands where."""
    x, y = text.at.tolist()
    turned = f" 50\n{degrees(text.angle)}\n" if text.angle else ""
    return (
        f"100\nAcDbText\n{_at(10, x, y)} 40\n{float(CAPITAL * text.size)}\n  1\n{_plain(text.text)}\n{turned}"
        f"  7\n{STYLES[text.bold][0]}\n{JUSTIFIED[text.anchor]}{_at(11, x, y)}100\nAcDbText\n"
    )


def _at(code: int, x: float, y: float, z: float = 0.0) -> str:
    """A place as group codes `code`, and 10 and 20 more."""
    return f" {code}\n{x}\n {code + 10}\n{y}\n {code + 20}\n{z}\n"


def _plain(text: str) -> str:
    """A text as TEXT holds it: a caret would start a control character, two percent signs a symbol [DXF reference]."""
    return printable(text).replace("^", "^ ").replace("%%", "%%%%%%")
