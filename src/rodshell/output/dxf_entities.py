"""Entities of ezdxf that are made and written in a third of the time, with the same result.

An entity of ezdxf checks each attribute that it is given and, when it is written, asks for each that it might have.
Ours are valid and few, and entities of one kind with the same attributes differ by the values alone: ezdxf writes the
first with marks in place of values, and each is that text with its own.
"""

import re
from collections.abc import Iterable
from io import StringIO
from typing import Any, ClassVar, NamedTuple

from ezdxf.entities import Circle, DXFGraphic, Line, LWPolyline, Text
from ezdxf.entities.dxfns import DXFNamespace
from ezdxf.lldxf.tagwriter import TagWriter
from ezdxf.lldxf.types import TAG_STRING_FORMAT, DXFTag, DXFVertex

from rodshell.arrays import Floats

MARK = re.compile(r"\0(\w+) (\d?)\0")
POINT = "".join(TAG_STRING_FORMAT % (code, "%s") for code in (10, 20))


class _Attributes(DXFNamespace):  # type: ignore[misc]
    """Attributes that are valid: points of three coordinates, numbers that are floats or ints."""

    def __setattr__(self, key: str, value: object) -> None:
        self.__dict__[key] = value

    def export_dxf_attribs(self, tagwriter: TagWriter, attribs: str | Iterable[str]) -> None:
        """Write those that are set, and those that every entity of the kind has in a file."""
        known, held, always = self.dxfattribs, self.__dict__, self._entity.always
        for name in (attribs,) if isinstance(attribs, str) else attribs:
            if name not in held:
                if name in always:
                    super().export_dxf_attribs(tagwriter, name)
            elif isinstance(held[name], tuple):
                tagwriter.write_vertex(known.get(name).code, held[name])
            else:
                tagwriter.write_tag2(known.get(name).code, held[name])


class _Pattern(NamedTuple):
    """The text of entities, with %s for each value: of the attribute of a name, or a coordinate of it."""

    text: str
    slots: list[tuple[str, int | None]]


class _Plain(DXFGraphic):  # type: ignore[misc]
    """Mixed into a kind of entities.

    Parameters
    ----------
    attributes : by the names that ezdxf has for them.
    """

    always: frozenset[str]
    patterns: ClassVar[dict[object, _Pattern]] = {}

    def __init_subclass__(cls) -> None:
        known = cls.DXFATTRIBS
        cls.always = frozenset(name for _, name in known.build_group_code_items() if not known.get(name).optional)

    def __init__(self, **attributes: Any) -> None:
        super().__init__()
        self.dxf = _Attributes(entity=self)
        self.dxf.__dict__.update(handle=None, owner=None, **attributes)

    def export_dxf(self, tagwriter: TagWriter) -> None:
        held = self.dxf.__dict__
        kind = type(self), tagwriter.dxfversion, *held
        pattern = self.patterns.get(kind)
        if pattern is None:
            pattern = self.patterns[kind] = self._pattern(tagwriter.dxfversion)
        values = [held[name] if axis is None else held[name][axis] for name, axis in pattern.slots]
        tagwriter.write_str(pattern.text % tuple(values))

    def _pattern(self, version: str) -> _Pattern:
        stream, held = StringIO(), self.dxf.__dict__
        values = {name: value for name, value in held.items() if not name.startswith("_")}
        held.update((name, _marks(name, value)) for name, value in values.items())
        super().export_dxf(Writer(stream, version))
        held.update(values)
        text = stream.getvalue()
        slots = [(name, int(axis) if axis else None) for name, axis in MARK.findall(text)]
        return _Pattern(MARK.sub("%s", text), slots)


def _marks(name: str, value: object) -> str | tuple[str, ...]:
    """What stands for a value in a pattern; of a point for each coordinate."""
    return tuple(f"\0{name} {axis}\0" for axis in range(len(value))) if isinstance(value, tuple) else f"\0{name} \0"


class PlainLine(_Plain, Line): ...  # type: ignore[misc]


class PlainCircle(_Plain, Circle): ...  # type: ignore[misc]


class PlainText(_Plain, Text): ...  # type: ignore[misc]


class PlainPolyline(_Plain, LWPolyline):  # type: ignore[misc]
    def __init__(self, points: Floats, *, closed: bool, **attributes: Any) -> None:
        coordinates = len(points) * POINT % tuple(points.ravel().tolist())
        super().__init__(count=len(points), flags=int(closed), points=coordinates, **attributes)
        self.lwpoints = _Points(10, self.dxf)

    def preprocess_export(self, tagwriter: TagWriter) -> bool:
        return True  # ezdxf counts the points


class _Points(DXFTag):  # type: ignore[misc]
    """The points of a polyline as one tag."""

    def dxftags(self) -> tuple[DXFTag, ...]:
        return (self,)

    def dxfstr(self) -> str:
        return str(self.value.points)


class Writer(TagWriter):  # type: ignore[misc]
    """Writes a point at once, not as an object for each coordinate."""

    def write_tag(self, tag: DXFTag) -> None:
        if isinstance(tag, DXFVertex):
            self.write_vertex(tag.code, tag.value)
        else:
            super().write_tag(tag)
