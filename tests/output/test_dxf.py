"""The DXF files: sound, with every line, mark and text where it was drawn."""

import io
from math import degrees, pi
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from ezdxf.document import Drawing as Document
from ezdxf.enums import TextEntityAlignment as Alignment

from rodshell.output.drawing import LAYERS, Drawing, Pencil
from rodshell.output.dxf import CAPITAL, drawing_dxf
from rodshell.output.files import export
from tests.output.dxf_reader import read_dxf
from tests.output.forms import TARGETS, archive, wished

ALIGNMENTS = {"start": Alignment.LEFT, "middle": Alignment.CENTER, "end": Alignment.RIGHT}


def one_of_each() -> Drawing:
    """Paths open and closed, in the plane and in space, a mark, texts of each alignment."""
    points = np.array([[0.0, -0.0], [1.0, 2.5], [10 / 3, 1e-7]])
    pencil = Pencil()
    for closed in (False, True):
        pencil.line(points, "MARK", closed=closed)
        pencil.line(np.column_stack([points, [1.0, 2.0, 3.0]]), "BOUNDARY-FINAL", closed=closed)
    pencil.line(points[1:], "CUT")
    pencil.mark((1.0, 2 / 3), 0.5, "DIM")
    for anchor, angle in (("start", 0.0), ("middle", 0.3), ("end", -pi / 2)):
        pencil.write("Stück 50 % ^ %%d Ω", (1.0, 2 / 3), 2.1, "LABEL", anchor=anchor, angle=angle, bold=angle == 0.3)
    return pencil.done("a", "b", 2.0)


def written(drawing: Drawing, names: dict[str, str] | None = None) -> Document:
    return ezdxf.read(io.StringIO(drawing_dxf(drawing, names)))


@pytest.mark.parametrize("names", [{}, {"CUT": "LASER", "DIM": "Maße"}], ids=["our layers", "named layers"])
def test_every_line_mark_and_text_is_where_it_was_drawn(names: dict[str, str]) -> None:
    drawing = one_of_each()
    entities = list(written(drawing, names).modelspace())
    items = [*drawing.paths, *drawing.marks, *drawing.texts]
    assert [one.dxf.layer for one in entities] == [names.get(item.layer, item.layer) for item in items]
    for path, one in zip(drawing.paths, entities, strict=False):
        if one.dxftype() == "LINE":
            points = [list(one.dxf.start)[:2], list(one.dxf.end)[:2]]
        elif one.dxftype() == "LWPOLYLINE":
            points = one.get_points("xy")
            assert one.closed == path.closed
        else:
            assert one.get_mode() == "AcDb3dPolyline"
            points = [list(point) for point in one.points()]
            assert one.is_closed == path.closed
        np.testing.assert_allclose(points, path.points, rtol=0, atol=1e-12)
    assert [one.dxftype() for one in entities[:5]] == ["LWPOLYLINE", "POLYLINE", "LWPOLYLINE", "POLYLINE", "LINE"]
    mark = entities[len(drawing.paths)]
    assert (mark.dxftype(), mark.dxf.radius) == ("CIRCLE", 0.5)
    np.testing.assert_allclose(list(mark.dxf.center), [1.0, 2 / 3, 0.0], rtol=0, atol=1e-12)
    for text, one in zip(drawing.texts, entities[-3:], strict=True):
        alignment, at, _ = one.get_placement()
        assert alignment == ALIGNMENTS[text.anchor]
        np.testing.assert_allclose(list(at), [1.0, 2 / 3, 0.0], rtol=0, atol=1e-12)
        assert one.dxf.rotation == pytest.approx(degrees(text.angle), abs=1e-9)
        assert one.dxf.height == pytest.approx(CAPITAL * 2.1)
        assert one.plain_text() == "Stück 50 % ^ %%d Ω"
        assert one.dxf.style == ("SANS-BOLD" if text.bold else "SANS")


def test_layers_have_the_colours_widths_and_dashes_of_the_drawing() -> None:
    document = written(one_of_each(), {"CUT": "LASER"})
    for name, layer in LAYERS.items():
        found = document.layers.get({"CUT": "LASER"}.get(name, name)).dxf
        assert found.color == layer.number
        assert found.lineweight == pytest.approx(100 * layer.pen)
        pattern = document.linetypes.get(found.linetype).pattern_tags.tags
        lengths = [tag.value for tag in pattern if tag.code == 49]
        assert np.abs(lengths).tolist() == list(layer.dash)
    assert document.header["$LTSCALE"] == pytest.approx(one_of_each().pen_scale)
    assert document.styles.get("SANS").dxf.font == "arial.ttf"
    assert document.header["$INSUNITS"] == 4  # mm
    assert document.header["$MEASUREMENT"] == 1  # metric


def test_the_first_view_shows_the_whole_drawing() -> None:
    drawing = one_of_each()
    document = written(drawing)
    low, high = drawing.box()
    np.testing.assert_allclose(document.header["$EXTMIN"][:2], low)
    np.testing.assert_allclose(document.header["$EXTMAX"][:2], high)
    (view,) = document.viewports.get("*ACTIVE")
    np.testing.assert_allclose(list(view.dxf.center)[:2], 0.5 * (low + high))
    assert view.dxf.height > high[1] - low[1]


def test_the_same_drawing_gives_the_same_bytes_and_leaves_ezdxf_as_it_was() -> None:
    first = drawing_dxf(one_of_each())
    ezdxf.new()
    assert drawing_dxf(one_of_each()) == first
    assert not ezdxf.options.write_fixed_meta_data_for_testing


def test_other_threads_of_the_process_keep_their_dates(monkeypatch: pytest.MonkeyPatch) -> None:
    """ezdxf's own switch would give their files fixed dates too, for as long as one of ours is written."""
    seen, export_sections = list[bool](), Document.export_sections

    def export_and_look(self: Document, writer: object) -> None:
        seen.append(ezdxf.options.write_fixed_meta_data_for_testing)
        export_sections(self, writer)

    monkeypatch.setattr(Document, "export_sections", export_and_look)
    assert "2451544.5" in drawing_dxf(one_of_each())
    assert seen == [False]


@pytest.mark.slow
@pytest.mark.parametrize("name", [*TARGETS, "wished"])
def test_every_drawing_passes_the_audit(name: str, tmp_path: Path) -> None:
    names = export(wished() if name == "wished" else archive(name), tmp_path, ["dxf"])
    assert len(names) == 6
    for file in names:
        document = ezdxf.readfile(tmp_path / file)
        audit = document.audit()
        assert audit.errors == []
        assert audit.fixes == []
        used = {one.layer for one in read_dxf(tmp_path / file)}
        assert used <= {layer.dxf.name for layer in document.layers}
        assert ("LASER" in used, "CUT" in used) == ((True, False) if name == "wished" else (False, True))
