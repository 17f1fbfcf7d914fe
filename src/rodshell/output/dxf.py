"""A drawing as DXF R2010 in millimetres: named layers, line types, text styles; the same bytes each time.

The document around the entities is ezdxf's, kept as a template: to import ezdxf and to have it write some thousand
entities of five kinds takes longer than to find a form. Tests hold both against ezdxf, byte by byte.
"""

import pathlib
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import chain, count
from math import degrees
from string import Template

from rodshell.output.drawing import LAYERS, Anchor, Drawing, Text
from rodshell.results.records import printable

DOCUMENT = pathlib.Path(__file__).parent / "templates" / "r2010.dxf"
MODEL_SPACE, FIRST_HANDLE = "17", 0x3A  # handles: of what owns the entities, and the first that is free for them
LATER = "first", "second", "third", "free"  # handles after those of the entities, the last for what a program adds
FORBIDDEN = '<>/\\":;?*|=`,'  # in a layer's name [DXF reference]; it holds LONGEST letters at most
LONGEST = 200
CAPITAL = 0.716  # height of Arial's capitals over the text size; a DXF text is as high as its capitals
JUSTIFIED: dict[Anchor, str] = {"start": "", "middle": " 72\n1\n", "end": " 72\n2\n"}
STYLES = {False: ("SANS", "arial.ttf"), True: ("SANS-BOLD", "arialbd.ttf")}  # which every CAD program has or replaces


class _Fields(Template):
    """Text with fields such as %%top."""

    delimiter = "%%"
    idpattern = "(?-i:[a-z]+|[A-Z-]+)"


@cache
def _document() -> _Fields:
    return _Fields(DOCUMENT.read_text(encoding="utf-8"))


def drawing_dxf(drawing: Drawing, names: Mapping[str, str] | None = None) -> str:
    """The text of a DXF file: a LINE, LWPOLYLINE or 3D POLYLINE for each path, a CIRCLE a mark, a TEXT a text.

    Parameters
    ----------
    drawing : at 1:1 [mm].
    names : for some layers the name that they take in the file (see `layer_names`).
    """
    layers, handles = layer_names(names or {}), map("{:X}".format, count(FIRST_HANDLE))
    entities = "".join(_records(drawing, layers, handles))
    (left, bottom), (right, top) = (corner.tolist() for corner in drawing.box())
    width, height = 1.05 * (right - left), 1.05 * (top - bottom)
    return _document().substitute(
        layers | dict(zip(LATER, handles, strict=False)),
        entities=entities, scale=float(drawing.pen_scale), left=left, bottom=bottom, right=right, top=top,
        across=0.5 * (left + right), up=0.5 * (bottom + top), view=max(height, 0.5 * width),
    )  # fmt: skip


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


def _records(drawing: Drawing, layers: Mapping[str, str], handles: Iterator[str]) -> Iterator[str]:
    """The records of all entities: group codes and values on lines in turn [DXF reference].

    Parameters
    ----------
    layers : name of each layer in the file.
    handles : free ones.
    """

    def head(kind: str, layer: str, handle: str = "", parent: str = MODEL_SPACE) -> str:
        mine = handle or next(handles)
        return f"  0\n{kind}\n  5\n{mine}\n330\n{parent}\n100\nAcDbEntity\n  8\n{layers[layer]}\n"

    for path in drawing.paths:
        points, closed = path.points.tolist(), int(path.closed)
        if not path.flat:
            handle, end = next(handles), next(handles)
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
