"""What the quick writers write is what the slow and plain way would write."""

import io
import re
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from gridshell.output.drawing import BELOW, LETTER, LINE, Drawing, Mark, Path, Pen, Pencil, Text
from gridshell.output.labels import Room
from gridshell.output.pdf import POINTS, WIDTHS, drawings_pdf
from gridshell.output.png import drawing_png
from gridshell.output.svg import drawing_svg, number

numbers = st.floats(-1e6, 1e6).map(lambda x: float(np.round(x, 4))) | st.sampled_from([0.0, -0.001, 100.0, -0.5, 1.005])


def test_a_png_is_read_back_pixel_by_pixel() -> None:
    """Half of it red, and a line of text that has both inks in it."""
    pencil = Pencil()
    pencil.line([(0, 0), (40, 0), (40, 20), (0, 20)], "TITLE", closed=True, pen=Pen("#ffffff", 0.0, fill="#ffffff"))
    pencil.line([(0, 0), (20, 0), (20, 20), (0, 20)], "TITLE", closed=True, pen=Pen("#ff0000", 0.0, fill="#ff0000"))
    data = drawing_png(pencil.done("", "", 2.0), width=80)
    with Image.open(io.BytesIO(data)) as image:
        image.verify()
    with Image.open(io.BytesIO(data)) as image:
        pixels = np.asarray(image.convert("RGB"))
    assert pixels.shape == (40, 80, 3)
    assert (pixels[:, :39] == (255, 0, 0)).all()
    assert (pixels[:, 42:] == 255).all()


@given(st.lists(st.tuples(numbers, numbers), min_size=2, max_size=6))
def test_numbers_of_svg_paths_are_as_short_as_can_be(points: list[tuple[float, float]]) -> None:
    drawing = Drawing("", "", 2.0, paths=(Path(np.array(points), "DIM"),))
    data = re.search(r' d="M([^"]*)"', drawing_svg(drawing))
    assert data is not None
    assert data[1].split("L") == [f"{number(x)} {number(-y)}" for x, y in points]


@pytest.mark.parametrize(("anchor", "share"), [("start", 0.0), ("middle", 0.5), ("end", 1.0)])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_texts_of_a_pdf_start_where_their_width_says(anchor: str, share: float, angle: float) -> None:
    """Helvetica's A and V are 667 thousandths wide, a letter of another script counts as a digit."""
    words, at, size = "AVЖ", np.array([50.0, 40.0]), 3.0
    assert WIDTHS[ord("A")] == WIDTHS[ord("V")] == 667
    pencil = Pencil()
    pencil.write(words, at, size, "LABEL", anchor=anchor, angle=angle)
    pdf = drawings_pdf([pencil.done("", "", 2.0)], (100.0, 80.0), "")
    streams = re.findall(rb"stream\n(.*?)\nendstream", pdf, re.DOTALL)
    (place,) = re.findall(rb"Tf \S+ \S+ \S+ \S+ (\S+) (\S+) Tm", zlib.decompress(streams[0]))
    width = size * (667 + 667 + 556) / 1000
    expected = at - share * width * np.array([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose([float(x) for x in place], expected, atol=2e-3)
    assert pdf.count(f"/MediaBox [0 0 {POINTS * 100:.3f}".encode()) == 1


@given(st.floats(-3, 3), st.sampled_from(["start", "middle", "end"]), numbers, numbers)
def test_the_box_of_a_text_is_a_rectangle_turned_about_its_place(angle: float, anchor: str, x: float, y: float) -> None:
    text = Text("seven ch", np.array([x, y]), 2.0, "LABEL", anchor=anchor, angle=angle)  # type: ignore[arg-type]
    width = 8 * 2.0 * LETTER
    left = {"start": 0.0, "middle": -0.5, "end": -1.0}[anchor] * width
    flat = np.array([[left, -2 * BELOW], [left + width, -2 * BELOW], [left + width, 2 * (LINE - BELOW)],
                     [left, 2 * (LINE - BELOW)]])  # fmt: skip
    turned = flat @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(text.box(), turned + [x, y], atol=1e-9)


def test_a_drawing_that_is_placed_keeps_what_does_not_change_and_scales_the_rest() -> None:
    pen = Pen("#123456", 0.5, (1.0, 2.0), "#abcdef")
    path, space = Path(np.eye(2), "CUT", True, pen, "U01", "a note"), Path(np.eye(3), "CUT")
    mark, text = Mark(np.ones(2), 3.0, "MARK", pen, "another"), Text("words", np.ones(2), 2.0, "LABEL", "end", 0.3)
    placed = Drawing("n", "t", 2.0, (path, space), (mark,), (text,)).placed(2.0, np.array([10.0, 0.0]))
    wide = Pen("#123456", 1.0, (2.0, 4.0), "#abcdef")
    assert (placed.name, placed.title, placed.text) == ("n", "t", 4.0)
    (line,), (ring,), (word,) = placed.paths, placed.marks, placed.texts
    np.testing.assert_array_equal(line.points, 2 * np.eye(2) + [10.0, 0.0])
    assert (line.layer, line.closed, line.pen, line.name, line.note) == ("CUT", True, wide, "U01", "a note")
    np.testing.assert_array_equal(ring.at, [12.0, 2.0])
    assert (ring.radius, ring.layer, ring.pen, ring.note) == (6.0, "MARK", wide, "another")
    np.testing.assert_array_equal(word.at, [12.0, 2.0])
    assert (word.text, word.size, word.anchor, word.angle) == ("words", 4.0, "end", 0.3)


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(0.1, 30), st.floats(0.1, 30)), max_size=8))
def test_a_box_is_free_unless_it_meets_one_that_was_taken(boxes: list[tuple[float, float, float, float]]) -> None:
    room, taken = Room(7.0), list[tuple[float, float, float, float]]()
    for x, y, width, height in boxes:
        corners = np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
        apart = [x >= a + w or a >= x + width or y >= b + h or b >= y + height for a, b, w, h in taken]
        assert room.free(corners) == all(apart)
        room.take(corners)
        taken.append((x, y, width, height))
