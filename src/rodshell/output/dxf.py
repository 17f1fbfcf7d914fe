"""A drawing as DXF in millimetres, on named layers, the same bytes for the same drawing.

Header, tables, blocks and objects are those that ezdxf writes for DXF R2010, kept in templates/frame.dxf: to build them
again for each file costs far more than to write what is drawn. Entities are tags, each two lines, and have handles,
numbers in hexadecimal that follow those of the frame.
"""

from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from itertools import chain, count

import numpy as np

from rodshell.output.drawing import CAP, LAYERS, Drawing, Mark, Path, Text
from rodshell.results.records import printable

FIRST_LAYER = 0x2F  # handle of the first of our layers, and
FIRST = 0x39  # of the first entity; the frame's own end before
SPACE = "17"  # handle of the model space, to which entities belong
FORBIDDEN = '<>/\\":;?*|=`,'  # in a layer's name [DXF reference]; it holds LONGEST letters at most
LONGEST = 200
ALIGNED = {"start": "", "middle": " 72\n1\n", "end": " 72\n2\n"}


def drawing_dxf(drawing: Drawing, names: Mapping[str, str] | None = None) -> str:
    """A LINE, LWPOLYLINE or 3D POLYLINE for each path, a CIRCLE for each mark, a TEXT for each text.

    names : for each layer the name that it takes in the file, where that is another.
    """
    layer = layer_names(names or {})
    handles = count(FIRST)
    entities = [part for path in drawing.paths for part in _path(path, layer[path.layer], handles)]
    entities += [_circle(mark, layer[mark.layer], handles) for mark in drawing.marks]
    entities += [_text(text, layer[text.layer], handles) for text in drawing.texts]
    head, tables, blocks, objects = _frame()
    parts = (head, f"{next(handles):X}", tables, _layers(layer), blocks, "".join(entities), objects)
    return "".join(parts)


def layer_names(names: Mapping[str, str]) -> dict[str, str]:
    """What each layer is called in a file: without what DXF forbids in a name, no two alike, upper case or lower."""
    shown, taken = dict[str, str](), {"0", "DEFPOINTS"}  # which every file has
    for layer in LAYERS:
        asked = "".join("_" if letter in FORBIDDEN else letter for letter in printable(str(names.get(layer, layer))))
        asked = asked.strip()[:LONGEST] or layer
        tries = chain([asked], (f"{asked} {k}" for k in count(2)))
        shown[layer] = next(name for name in tries if name.upper() not in taken)
        taken.add(shown[layer].upper())
    return shown


@cache
def _frame() -> tuple[str, ...]:
    """What comes before the seed of handles, before the layers, before the entities, and after them."""
    text = (files("rodshell.output") / "templates" / "frame.dxf").read_text(encoding="utf-8")
    head, rest = text.split("@SEED@")
    tables, rest = rest.split("@LAYERS@\n")
    blocks, objects = rest.split("@ENTITIES@\n")
    return head, tables, blocks, objects


def _layers(shown: Mapping[str, str]) -> str:
    return "".join(
        f"  0\nLAYER\n  5\n{FIRST_LAYER + k:X}\n330\n1\n100\nAcDbSymbolTableRecord\n100\nAcDbLayerTableRecord\n"
        f"  2\n{shown[name]}\n 70\n0\n 62\n{layer.number}\n  6\nContinuous\n370\n-3\n390\n13\n347\n21\n"
        for k, (name, layer) in enumerate(LAYERS.items())
    )


def _entity(kind: str, layer: str, handle: int, owner: str = SPACE) -> str:
    return f"  0\n{kind}\n  5\n{handle:X}\n330\n{owner}\n100\nAcDbEntity\n  8\n{layer}\n"


def _path(path: Path, layer: str, handles: Iterator[int]) -> Iterator[str]:
    points = path.points.tolist()
    if not path.flat:
        yield from _polyline(points, path.closed, layer, handles)
    elif len(points) == 2:
        (x, y), (u, v) = points
        yield f"{_entity('LINE', layer, next(handles))}100\nAcDbLine\n{_place(x, y)} 11\n{u}\n 21\n{v}\n 31\n0.0\n"
    else:
        head = f"100\nAcDbPolyline\n 90\n{len(points)}\n 70\n{int(path.closed)}\n"
        yield _entity("LWPOLYLINE", layer, next(handles)) + head
        yield "".join([f" 10\n{x}\n 20\n{y}\n" for x, y in points])


def _polyline(points: list[list[float]], closed: bool, layer: str, handles: Iterator[int]) -> Iterator[str]:
    """In space: its vertices and its end are entities too."""
    own, end = next(handles), next(handles)
    yield f"{_entity('POLYLINE', layer, own)}100\nAcDb3dPolyline\n 66\n1\n{_place(0.0, 0.0)} 70\n{9 if closed else 8}\n"
    for point in points:
        vertex = _entity("VERTEX", layer, next(handles))
        yield f"{vertex}100\nAcDbVertex\n100\nAcDb3dPolylineVertex\n{_place(*point)} 70\n32\n"
    yield _entity("SEQEND", layer, end, owner=f"{own:X}")


def _circle(mark: Mark, layer: str, handles: Iterator[int]) -> str:
    place = _place(*mark.at.tolist())
    return f"{_entity('CIRCLE', layer, next(handles))}100\nAcDbCircle\n{place} 40\n{float(mark.radius)}\n"


def _text(text: Text, layer: str, handles: Iterator[int]) -> str:
    x, y = text.at.tolist()
    turned = f" 50\n{float(np.degrees(text.angle))}\n" if text.angle else ""
    head = f"{_entity('TEXT', layer, next(handles))}100\nAcDbText\n{_place(x, y)}"
    return (
        f"{head} 40\n{CAP * text.size}\n  1\n{_plain(text.text)}\n"
        f"{turned}{ALIGNED[text.anchor]} 11\n{x}\n 21\n{y}\n 31\n0.0\n100\nAcDbText\n"
    )


def _plain(text: str) -> str:
    """A text as TEXT holds it: a caret would start a control character, two percent signs a symbol [DXF reference]."""
    return printable(text).replace("^", "^ ").replace("%%", "%%%%%%")


def _place(x: float, y: float, z: float = 0.0) -> str:
    return f" 10\n{x}\n 20\n{y}\n 30\n{z}\n"
