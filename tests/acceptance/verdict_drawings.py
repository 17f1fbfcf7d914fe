"""Rows of what leaves the house: hostile names, sizes of letters, digits, title blocks, and results that are moved."""

import csv
import io
import re
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import ezdxf
import numpy as np

import rodshell as rs
from rodshell.cli import main
from rodshell.output.drawing import CAPITAL, Drawing
from rodshell.output.drawings import sheet_set
from rodshell.output.files import KINDS, export
from rodshell.output.options import OutputOptions
from rodshell.output.settings import DrawingStyle
from rodshell.results import Archive, read
from rodshell.results.wording import rounding_of
from tests.acceptance.cases import HEMISPHERE, ROD
from tests.acceptance.rows import Row
from tests.output.hostile import hostile_archive
from tests.output.live_cells import live_cells

FOUND = (0, 4)  # exit codes of a form that converged
LABELS = (
    "Project", "Drawn by", "Date", "Revision", "Section", "Material", "Joints", "Rods", "Units", "Tolerance", "Input",
    "Made by",
)  # fmt: skip
MILLIMETRES = re.compile(r"_mm$")
ROOF = """[target]
kind = "mesh"
file = "roof.obj"
unit = "m"
[layout]
spacing = "1 m"
edge = "0.25 m"
[rod.section]
kind = "rectangle"
width = "12 mm"
height = "50 mm"
[rod.material]
youngs_modulus = "11 GPa"
density = 470
poisson_ratio = 0.3
[drawings]
tolerance = "1 mm"
project = "Bandstand"
"""


def roof_obj() -> str:
    """A vault of 16 by 12 m as a mesh [m]."""
    x, y = np.meshgrid(np.linspace(-8, 8, 33), np.linspace(-6, 6, 25), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), (3 * np.cos(np.pi * x / 22) * np.cos(np.pi * y / 18)).ravel()])
    index = 1 + np.arange(len(points)).reshape(x.shape)
    a, b, c, d = (one.ravel() for one in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points] + [f"f {i} {j} {k}" for i, j, k in faces]
    return "\n".join(lines) + "\n"


@cache
def moved() -> tuple[Archive, Archive]:
    """A roof from a mesh, and the same run again from its case after its folder was moved and all else deleted."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        here = folder / "here"
        here.mkdir()
        (here / "roof.obj").write_text(roof_obj())
        (here / "roof.toml").write_text(ROOF)
        assert main(["form", str(here / "roof.toml"), "--out", str(here / "out"), "--only", "csv", "--quiet"]) in FOUND
        shutil.move(here / "out", folder / "elsewhere")
        shutil.rmtree(here)
        case = str(folder / "elsewhere/case.toml")
        assert main(["form", case, "--out", str(folder / "again"), "--only", "csv", "--quiet"]) in FOUND
        return read(folder / "elsewhere"), read(folder / "again")


@cache
def dome() -> Archive:
    """The README's dome with every field of its title block given."""
    layout = rs.GridLayout.orthogonal(rods=(17, 17), spacing=0.03, edge=0.01)
    style = DrawingStyle(
        project="Park", author="A. Nyone", date="2026-11-22", revision="C", tolerance=5e-4, name="Dome"
    )
    return rs.find_form(HEMISPHERE, layout, ROD).archive(options=OutputOptions(stages=2, drawings=style))


def sheets_of(archive: Archive) -> list[Drawing]:
    return sheet_set(archive)[0]


def hostile_rows() -> Iterator[Row]:
    """Names that attack spreadsheets and DXF."""
    with tempfile.TemporaryDirectory() as folder:
        names = export(hostile_archive(), folder, KINDS)
        tables = [Path(folder) / name for name in names if name.endswith(".csv")]
        live = sum(len(live_cells(table.read_text(encoding="utf-8"))) for table in tables)
        yield Row("hostile names", "live formulas in CSV files", live, 0, note=f"{len(tables)} tables")
        faults = bad = 0
        drawings = [Path(folder) / name for name in names if name.endswith(".dxf")]
        for path in drawings:
            document = ezdxf.readfile(path)
            audit = document.audit()
            faults += len(audit.errors) + len(audit.fixes)
            layers = [layer.dxf.name for layer in document.layers]
            bad += len(layers) - len({name.upper() for name in layers})
            bad += sum(bool(set(name) & set('<>/\\":;?*|=`,')) or not name.isprintable() for name in layers)
        yield Row("hostile names", "layers' names that DXF forbids, or alike", bad, 0, note=f"{len(drawings)} files")
        yield Row("hostile names", "faults that the DXF audit finds", faults, 0)


def letter_rows(name: str, archive: Archive) -> Iterator[Row]:
    """The smallest capitals of all sheets on A3."""
    sheets = sheets_of(archive)
    smallest = min(text.size for sheet in sheets for text in sheet.texts)
    yield Row(name, "- height of the smallest capitals on A3", -CAPITAL * smallest, -1.8, "mm", f"{len(sheets)} sheets")
    silent = sum(
        bool(sheet.left_out) and not any(text.text.startswith("Left out") for text in sheet.texts) for sheet in sheets
    )
    yield Row(name, "sheets that leave out texts and do not say so", silent, 0)


def digit_rows(name: str, archive: Archive) -> Iterator[Row]:
    """Digits of lengths beyond the rule: in the schedules that people read, and in every text of the sheets."""
    digits, beyond, lengths = rounding_of(archive.results).digits, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for file in export(archive, folder, ["csv"]):
            if "end_paths" in file:  # which finite element programs read
                continue
            for row in csv.DictReader(io.StringIO((Path(folder) / file).read_text(encoding="utf-8"))):
                for column, cell in row.items():
                    for number in re.findall(r"\d+\.(\d+)", cell) if MILLIMETRES.search(column) else ():
                        lengths, beyond = lengths + 1, beyond + (len(number) > digits)
    strips = [sheet for sheet in sheets_of(archive) if "strips" in sheet.title]
    for text in (text.text for sheet in strips for text in sheet.texts if text.layer == "LABEL"):
        for number in re.findall(r"\d+\.(\d+)", text):
            lengths, beyond = lengths + 1, beyond + (len(number) > digits)
    step = rounding_of(archive.results).words
    yield Row(name, "lengths with digits beyond the rule", beyond, 0, note=f"{lengths} lengths, shown to {step}")


def sum_rows(name: str, archive: Archive) -> Iterator[Row]:
    """Cumulative distances are each rounded from the exact one: no error adds up."""
    step, worst = rounding_of(archive.results).step, 0.0
    with tempfile.TemporaryDirectory() as folder:
        export(archive, folder, ["csv"])
        rows = csv.DictReader(io.StringIO((Path(folder) / "schedule/rods.csv").read_text(encoding="utf-8")))
        for row, rod in zip(rows, archive.results.plain()["rods"], strict=True):
            shown = [float(word.split()[-1]) for word in row["joints_from_cut_end_mm"].split("; ") if word]
            before = 0.5 * (rod["cut_length"] - rod["length"])  # the allowance
            exact = sorted(1e3 * (before + joint["at"]) for joint in rod["joints"])
            worst = max(worst, float(np.abs(np.subtract(shown, exact)).max(initial=0.0)))
    yield Row(name, "joints' distances off the exact ones", worst, 0.5 * step * (1 + 1e-9), "mm")


def title_rows(name: str, archive: Archive) -> Iterator[Row]:
    """Fields of the title block on every sheet of the PDF."""
    sheets = sheets_of(archive)
    missing = sum(label not in {text.text for text in sheet.texts} for sheet in sheets for label in LABELS)
    given = archive.results.plain()["drawings"]
    wanted = [given[key] for key in ("project", "author", "date", "revision") if given[key]]
    missing += sum(value not in {text.text for text in sheet.texts} for sheet in sheets for value in wanted)
    yield Row(name, "fields of title blocks missing", missing, 0, note=f"{len(sheets)} sheets, {len(LABELS)} fields")


def moved_rows() -> Iterator[Row]:
    first, again = moved()
    shapes = [key for key in first.states if key.startswith(("flat", "draped", "popped"))]
    apart = max(float(np.abs(first.states[key] - again.states[key]).max()) for key in shapes)
    yield Row("roof, moved and run again", "positions apart", apart, 1e-12, "m", f"{len(first.inputs)} input kept")
    yield Row("roof, moved and run again", "cases that differ", float(first.case_toml != again.case_toml), 0)


def rows() -> Iterator[Row]:
    yield from hostile_rows()
    for name, archive in (("hemisphere", dome()), ("roof of 16 by 12 m", moved()[0])):
        yield from letter_rows(name, archive)
        yield from digit_rows(name, archive)
        yield from sum_rows(name, archive)
        yield from title_rows(name, archive)
    yield from moved_rows()
