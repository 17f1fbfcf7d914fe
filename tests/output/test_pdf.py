"""The PDF, read and rendered by PDFium: true to scale, with texts in three scripts where they were drawn."""

import ctypes
import re
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from reportlab import rl_config

from rodshell.cli import main
from rodshell.errors import OutputWarning
from rodshell.output.drawing import CAPITAL, Drawing, Pen, Pencil, Text
from rodshell.output.drawings import sheet_set
from rodshell.output.drawings.flat import flat_plan
from rodshell.output.files import export, save
from rodshell.output.pdf import drawings_pdf, text_width
from rodshell.output.settings import PAPERS
from rodshell.results import Archive, Results
from tests.output.forms import archive, wished
from tests.output.sample_archive import sample_archive

INCH = 25.4  # mm


def sheet_of(pencil: Pencil) -> Drawing:
    return pencil.done("a name", "A title", 2.0)


def rendered(page: pypdfium2.PdfPage, per_mm: float = 10.0) -> np.ndarray:
    """Darkness of the pixels (rows, columns) of a page, 0 (white) to 255, at so many pixels a millimetre."""
    scale = per_mm * INCH / 72 * (1 - 1e-6)  # a size is rounded up to whole pixels
    pixels = page.render(scale=scale, grayscale=True).to_numpy()
    np.testing.assert_allclose(pixels.shape[1::-1], per_mm / 72 * INCH * np.array(page.get_size()), atol=0.01)
    return 255 - pixels.reshape(pixels.shape[:2])


def read_text(page: pypdfium2.PdfPage) -> str:
    return page.get_textpage().get_text_bounded()


def origins(page: pypdfium2.PdfPage) -> np.ndarray:
    """Where each letter's baseline begins (k, 2) [mm]."""
    text, x, y = page.get_textpage(), ctypes.c_double(), ctypes.c_double()
    places = []
    for k in range(text.count_chars()):
        assert pypdfium2.raw.FPDFText_GetCharOrigin(text.raw, k, x, y)
        places.append((x.value, y.value))
    return np.array(places) / 72 * INCH


@pytest.mark.parametrize("paper", PAPERS)
def test_a_line_of_known_length_is_as_long_on_the_rendered_page(paper: str) -> None:
    """From the middle of one tick to that of the other, 250 mm apart, at 127 dpi: 5 pixels a millimetre."""
    pencil, size = Pencil(), PAPERS[paper]
    for x in (20.0, 270.0):
        pencil.line([(x, 20.0), (x, 60.0)], "CUT")
    pencil.line([(20.0, 100.0), (270.0, 100.0)], "CUT")
    page = pypdfium2.PdfDocument(drawings_pdf([sheet_of(pencil)], size, ""))[0]
    np.testing.assert_allclose(np.array(page.get_size()) / 72 * INCH, size, atol=1e-3)
    dark = rendered(page, 5.0)
    ticks, columns = dark[-5 * 50].astype(float), np.arange(dark.shape[1]) + 0.5
    low, high = (np.average(columns[side], weights=ticks[side]) / 5 for side in (columns < 725, columns >= 725))
    assert low == pytest.approx(20.0, abs=0.1)
    assert high - low == pytest.approx(250.0, abs=0.1)
    line = dark[-5 * 100 - 3 : -5 * 100 + 3].max(axis=0)
    assert line.sum() / line.max() / 5 == pytest.approx(250.0, abs=0.1)


@pytest.mark.slow
def test_a_rod_is_as_long_on_its_strip_as_the_sheet_s_scale_says() -> None:
    """Its thick line on the page as it is rendered, against the scale that is printed there."""
    made = archive("dome")
    sheets, paper = sheet_set(made)
    number = next(k for k, sheet in enumerate(sheets) if sheet.title.startswith("Rod strips"))
    page = pypdfium2.PdfDocument(drawings_pdf(sheets, paper, ""))[number]
    scale = float(re.search(r"Scale 1:([\d.]+)", read_text(page))[1])  # type: ignore[index]
    dark, rods = rendered(page), {rod.id: rod for rod in flat_plan(made).rods}
    strips = [path for path in sheets[number].paths if path.name]
    assert strips
    for path in strips:
        (left, y), (right, _) = 10 * path.points
        rows = dark[len(dark) - round(y) - 1 : len(dark) - round(y) + 1, round(left) - 50 : round(right) + 50]
        inked = np.flatnonzero(rows.max(axis=0) > 127)
        assert (inked[-1] - inked[0] + 1) / 10 == pytest.approx(1e3 * rods[path.name].cut_length / scale, abs=0.1)


@pytest.mark.slow
def test_every_sheet_is_a_page_with_a_bookmark_and_the_file_has_a_title(tmp_path: Path) -> None:
    made = wished()
    export(made, tmp_path, ["pdf"])
    document = pypdfium2.PdfDocument(tmp_path / "drawings/drawings.pdf")
    sheets, _ = sheet_set(made)
    assert len(document) == len(sheets)
    assert document.get_metadata_value("Title") == "hemisphere"
    assert document.get_metadata_value("Creator") == "rodshell"
    assert [bookmark.get_title() for bookmark in document.get_toc()] == [sheet.title for sheet in sheets]
    text = read_text(document[0])
    for words in ("Pavilion", "0.5 mm", "rod 2 mm", "ball", "Design aid, not code compliance"):
        assert words in text


def test_letters_of_three_scripts_are_printed_from_embedded_fonts() -> None:
    lines = ("Größe 3 m², ±2 mm, Ω", "Μήκος ράβδου: 12,5 mm", "Длина стержня – 3 м", "ő ł ş ≤ ≥ − × · … € „“")
    pencil = Pencil()
    for k, line in enumerate(lines):
        pencil.write(line, (10.0, 20.0 + 10 * k), 4.0, "LABEL", bold=k == 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        data = drawings_pdf([sheet_of(pencil)], (200.0, 100.0), "Größe Ω Ж")
    document = pypdfium2.PdfDocument(data)
    assert document.get_metadata_value("Title") == "Größe Ω Ж"
    text = read_text(document[0])
    for line in lines:
        assert line in text
    assert data.count(b"/FontFile2") >= 2
    assert b"/Type1" not in data


def test_the_height_of_capitals_is_that_of_the_typeface() -> None:
    pencil = Pencil()
    pencil.write("H", (10.0, 10.0), 80.0, "LABEL")
    dark = rendered(pypdfium2.PdfDocument(drawings_pdf([sheet_of(pencil)], (100.0, 100.0), ""))[0])
    assert (dark.max(axis=1) > 107).sum() / 10 == pytest.approx(CAPITAL * 80.0, abs=0.1)


def box_drawn(letter: str) -> float:
    """Mean darkness of a page with a letter 40 mm high."""
    pencil = Pencil()
    pencil.write(letter, (10.0, 10.0), 40.0, "LABEL")
    return float(rendered(pypdfium2.PdfDocument(drawings_pdf([sheet_of(pencil)], (60.0, 60.0), ""))[0], 5.0).mean())


def test_characters_without_a_glyph_are_boxes_and_said_once() -> None:
    pencil = Pencil()
    pencil.write("width 漢 = 3 字", (10.0, 10.0), 4.0, "LABEL")
    pencil.write("漢 again", (10.0, 20.0), 4.0, "LABEL", bold=True)
    with pytest.warns(OutputWarning) as said:
        data = drawings_pdf([sheet_of(pencil), sheet_of(pencil)], (200.0, 100.0), "")
    assert [str(one.message) for one in said] == ["the PDF shows boxes for characters that its typeface lacks: 字 漢"]
    text = read_text(pypdfium2.PdfDocument(data)[0])
    assert "width" in text
    assert "again" in text
    with pytest.warns(OutputWarning):
        assert box_drawn("漢") > 2
    assert box_drawn(" ") == 0.0


def test_a_warning_names_no_more_characters_than_can_be_read() -> None:
    pencil = Pencil()
    pencil.write("".join(chr(0x4E00 + k) for k in range(30)), (10.0, 10.0), 4.0, "LABEL")
    with pytest.warns(OutputWarning, match="lacks: . . . . . . . . . . and 20 more$"):
        drawings_pdf([sheet_of(pencil)], (200.0, 100.0), "")


def test_the_command_line_says_which_characters_are_boxes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = sample_archive(5)
    made = replace(made, results=Results.of({**made.results.plain(), "drawings": {"project": "漢字 Halle"}}))
    save(made, tmp_path / "out", [])
    assert main(["export", str(tmp_path / "out"), "--only", "pdf", "--quiet"]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line == "rodshell: warning: the PDF shows boxes for characters that its typeface lacks: 字 漢"


@pytest.mark.parametrize(("anchor", "share"), [("start", 0.0), ("middle", 0.5), ("end", 1.0)])
@pytest.mark.parametrize("angle", [0.0, 0.7, -np.pi / 2])
@pytest.mark.parametrize("bold", [False, True])
def test_texts_start_where_their_width_says(anchor: str, share: float, angle: float, bold: bool) -> None:
    at, along = np.array([50.0, 40.0]), np.array([np.cos(angle), np.sin(angle)])
    pencil = Pencil()
    pencil.write("AVЖ", at, 3.0, "LABEL", anchor=anchor, angle=angle, bold=bold)
    places = origins(pypdfium2.PdfDocument(drawings_pdf([sheet_of(pencil)], (100.0, 80.0), ""))[0])
    width = text_width("AVЖ", 3.0, bold=bold)
    np.testing.assert_allclose(places[0], at - share * width * along, atol=2e-3)
    np.testing.assert_allclose(places[2], places[0] + text_width("AV", 3.0, bold=bold) * along, atol=5e-3)


def test_a_text_box_holds_its_text() -> None:
    """Ids and numbers, by the widths of the typeface."""
    for words in ("U01/V12", "1234.56", "-0.07", "ends 14 % of the way", "R07.1"):
        box = Text(words, np.zeros(2), 10.0, "LABEL").box()
        assert np.ptp(box[:, 0]) >= text_width(words, 10.0)


def test_a_mark_is_a_circle() -> None:
    pencil = Pencil()
    pencil.mark((50.0, 40.0), 20.0, "MARK", pen=Pen("#000000", 1.0))
    dark = rendered(pypdfium2.PdfDocument(drawings_pdf([sheet_of(pencil)], (100.0, 80.0), ""))[0])
    row, column = np.nonzero(dark > 127)
    radius = np.hypot(column / 10 + 0.05 - 50.0, 80.0 - row / 10 - 0.05 - 40.0)
    assert 19.4 < radius.min() <= radius.max() < 20.6
    angle = np.arctan2(40.0 - row / 10, column / 10 - 50.0)
    assert len(np.unique(np.floor(angle / 0.05))) >= 2 * np.pi / 0.05


def test_dashes_widths_and_fills_are_those_of_the_pen() -> None:
    """A dashed line, a thick one, and two filled squares of one pen that overlap: both are filled throughout."""
    pencil = Pencil()
    pencil.line([(10, 70), (90, 70)], "DIM", pen=Pen("#000000", 1.0, (3.0, 1.0)))
    pencil.line([(10, 60), (90, 60)], "DIM", pen=Pen("#000000", 4.0))
    for x in (20, 35):
        corners = [(x, 10), (x + 30, 10), (x + 30, 40), (x, 40)]
        pencil.line(corners, "DIM", closed=True, pen=Pen("#000000", 0.0, fill="#000000"))
    dark = rendered(pypdfium2.PdfDocument(drawings_pdf([sheet_of(pencil)], (100.0, 80.0), ""))[0])
    assert dark[100, 100:900].mean() / 255 == pytest.approx(0.75, abs=0.01)
    assert dark[150:250, 500].sum() / 255 / 10 == pytest.approx(4.0, abs=0.1)
    assert dark[402:698, 202:648].min() == 255


def test_the_same_sheets_give_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    made: Archive = sample_archive(5)
    sheets, paper = sheet_set(made)
    first = drawings_pdf(sheets, paper, "title")
    monkeypatch.setattr("time.time", lambda: 2e9)
    assert drawings_pdf(sheets, paper, "title") == first


def test_two_threads_write_the_same_bytes_and_leave_reportlab_as_it_was() -> None:
    """reportlab's switch for binary pages holds for the whole process."""
    before, (sheets, paper) = rl_config.useA85, sheet_set(sample_archive(5))
    with ThreadPoolExecutor(2) as threads:
        files = list(threads.map(lambda _: drawings_pdf(sheets, paper, "title"), range(4)))
    assert len(set(files)) == 1
    assert b"/ASCII85Decode" not in files[0]
    assert rl_config.useA85 == before
