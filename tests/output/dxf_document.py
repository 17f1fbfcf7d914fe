"""The DXF document around the entities, as ezdxf makes it.

python -m tests.output.dxf_document   # writes the template
"""

from io import StringIO
from typing import Any

import ezdxf
from ezdxf.document import CREATED_BY_EZDXF, WRITTEN_BY_EZDXF
from ezdxf.lldxf.tagwriter import TagWriter

from rodshell.output.drawing import LAYERS
from rodshell.output.dxf import DOCUMENT, FIRST_HANDLE, LATER, MODEL_SPACE, STYLES

MADE_BY = "1.4.5"  # version of ezdxf
DATE = 2451544.5  # 2000-01-01, a Julian date
IDENTIFIER = "{00000000-0000-0000-0000-000000000000}"
NUMBERS = {  # no other numbers of the document
    "scale": 1001.5, "left": 1002.5, "bottom": 1003.5, "right": 1004.5, "top": 1005.5, "across": 1006.5, "up": 1007.5,
    "view": 1008.5,
}  # fmt: skip
AFTER = 0xABC0  # in place of the first handle after those of the entities


def template() -> str:
    """The text of an empty document, its fields by their names."""
    document = ezdxf.new("R2010", units=ezdxf.units.MM)
    for name, layer in LAYERS.items():
        look: dict[str, Any] = {"color": layer.number, "lineweight": round(100 * layer.pen)}
        if layer.dash:
            dash, gap = layer.dash
            look["linetype"] = "DASHED"
            document.linetypes.add("DASHED", [dash + gap, dash, -gap], description="Dashed")
        document.layers.add(f"%%{name}", **look)
    document.header["$LTSCALE"] = NUMBERS["scale"]
    for style, font in STYLES.values():
        document.styles.add(style, font=font)
    document.set_modelspace_vport(NUMBERS["view"], center=(NUMBERS["across"], NUMBERS["up"]))
    space = document.modelspace()
    space.dxf.extmin = NUMBERS["left"], NUMBERS["bottom"], 0.0
    space.dxf.extmax = NUMBERS["right"], NUMBERS["top"], 0.0
    assert (space.layout_key, int(document.entitydb.next_handle(), 16)) == (MODEL_SPACE, FIRST_HANDLE)
    document.entitydb.handles.reset(f"{AFTER:X}")
    text = _written(document)
    for number, name in enumerate(LATER, start=AFTER):
        text = text.replace(f"\n{number:X}\n", f"\n%%{name}\n")
    for name, number in NUMBERS.items():
        text = text.replace(f"\n{number}\n", f"\n%%{name}\n")
    return text.replace("\nENTITIES\n", "\nENTITIES\n%%entities")


def _written(document: "ezdxf.document.Drawing") -> str:
    """As `document.write`, without time of writing and random identifiers."""
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


if __name__ == "__main__":
    DOCUMENT.write_text(template(), encoding="utf-8", newline="")
