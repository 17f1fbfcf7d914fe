"""Entities of ezdxf that are made and written in half of the time, with the same result.

An entity of ezdxf checks each attribute that it is given and, when it is written, asks for each that it might have.
Ours are valid, and few.
"""

from collections.abc import Iterable
from typing import Any

from ezdxf.entities import Circle, DXFGraphic, Line, LWPolyline, Text
from ezdxf.entities.dxfns import DXFNamespace
from ezdxf.lldxf.tagwriter import TagWriter
from ezdxf.lldxf.types import TAG_STRING_FORMAT, DXFTag, DXFVertex

from rodshell.arrays import Floats

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


class _Plain(DXFGraphic):  # type: ignore[misc]
    """Mixed into a kind of entities.

    Parameters
    ----------
    attributes : by the names that ezdxf has for them.
    """

    always: frozenset[str]

    def __init_subclass__(cls) -> None:
        known = cls.DXFATTRIBS
        cls.always = frozenset(name for _, name in known.build_group_code_items() if not known.get(name).optional)

    def __init__(self, **attributes: Any) -> None:
        super().__init__()
        self.dxf = _Attributes(entity=self)
        self.dxf.__dict__.update(handle=None, owner=None, **attributes)


class PlainLine(_Plain, Line): ...  # type: ignore[misc]


class PlainCircle(_Plain, Circle): ...  # type: ignore[misc]


class PlainText(_Plain, Text): ...  # type: ignore[misc]


class PlainPolyline(_Plain, LWPolyline):  # type: ignore[misc]
    def __init__(self, points: Floats, *, closed: bool, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.closed = closed
        self.lwpoints = _Points(10, points)


class _Points(DXFTag):  # type: ignore[misc]
    """The points (k, 2) of a polyline as one tag."""

    def __len__(self) -> int:
        return len(self.value)

    def dxftags(self) -> tuple[DXFTag, ...]:
        return (self,)

    def dxfstr(self) -> str:
        return len(self.value) * POINT % tuple(self.value.ravel().tolist())


class Writer(TagWriter):  # type: ignore[misc]
    """Writes a point at once, not as an object for each coordinate."""

    def write_tag(self, tag: DXFTag) -> None:
        if isinstance(tag, DXFVertex):
            self.write_vertex(tag.code, tag.value)
        else:
            super().write_tag(tag)
