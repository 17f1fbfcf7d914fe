"""Names that attack what reads them come out of every kind of file as plain text."""

import csv
import io
import json
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import ezdxf
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rodshell.output.dxf import layer_names
from rodshell.output.files import KINDS, export, save
from rodshell.output.schedules import csv_text
from tests.output.hostile import LAYERS, NAMES, hostile_archive
from tests.output.live_cells import live_cells


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("hostile")
    return {name: folder / name for name in export(hostile_archive(), folder, KINDS)}


@pytest.mark.slow
def test_no_schedule_holds_a_live_formula(written: dict[str, Path]) -> None:
    tables = [path for name, path in written.items() if name.endswith(".csv")]
    assert {path.stem for path in tables} >= {"rods", "joints", "supports", "bracing", "stock", "seams", "end_paths"}
    for path in tables:
        assert live_cells(path.read_text(encoding="utf-8")) == []


def test_numbers_stay_numbers_in_csv() -> None:
    cells = ["-1.5", "+2", "-3e-05", ".5", "-0.000", -2.5, 7, "1.0; -2.0"]
    (row,) = csv.reader(io.StringIO(csv_text([cells])))
    assert row == [str(cell) for cell in cells]


@pytest.mark.slow
@given(st.lists(st.lists(st.text(st.sampled_from("=+-@;, \t\r\n\"'1a.\uff1d")), min_size=2), min_size=1))
def test_no_text_is_live_in_csv(rows: list[list[str]]) -> None:
    assert live_cells(csv_text(rows)) == []


def test_dxf_files_are_sound_and_keep_their_layers_apart(written: dict[str, Path]) -> None:
    for path in (path for name, path in written.items() if name.endswith(".dxf")):
        document = ezdxf.readfile(path)
        audit = document.audit()
        assert not audit.errors
        assert not audit.fixes
        names = [layer.dxf.name for layer in document.layers]
        assert len({name.upper() for name in names}) == len(names) == len(LAYERS) + 2  # and 0, Defpoints
        assert not [name for name in names if set(name) & set('<>/\\":;?*|=`,') or not name.isprintable()]
        assert {entity.dxf.layer for entity in document.modelspace()} <= set(names)


def test_texts_of_a_drawing_read_as_they_were_meant(written: dict[str, Path]) -> None:
    texts = {entity.plain_text() for entity in ezdxf.readfile(written["drawings/plan.dxf"]).modelspace().query("TEXT")}
    assert "%%d^J{\\U+0041}" in texts
    assert NAMES[9] in texts


def test_layers_that_ask_for_names_of_others_are_still_told_apart() -> None:
    for asked in ({"CUT": "mark"}, {"TITLE": "CUT", "CUT": "TITLE"}, dict.fromkeys(LAYERS, "x"), {"DIM": "0"}):
        names = [name.upper() for name in layer_names(asked).values()]
        assert len(set(names)) == len(names)
        assert not {"0", "DEFPOINTS"} & set(names)


class _Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.scripts, self.bold = 0, 0

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.scripts += tag == "script"
        self.bold += tag == "b"


def test_the_report_holds_no_element_of_a_name(written: dict[str, Path]) -> None:
    page = _Tags()
    page.feed(written["report.html"].read_text(encoding="utf-8"))
    assert page.scripts == 3  # the sorting of tables, the view and its data
    assert page.bold == 0


def test_models_and_pictures_parse_and_name_every_rod(written: dict[str, Path]) -> None:
    ids = ["".join(letter if letter.isprintable() else " " for letter in name) for name in NAMES]
    for name, path in written.items():
        if name.endswith((".svg", ".vtp", ".pvd")):
            ElementTree.parse(path)
        elif name.endswith(".obj"):
            assert {line.split(" ")[0] for line in path.read_text().splitlines()} == {"#", "v", "o", "l"}
        elif name.endswith(".glb"):
            content = path.read_bytes()
            length = int(np.frombuffer(content[12:16], "<u4")[0])
            assert set(ids) <= {node.get("name") for node in json.loads(content[20 : 20 + length])["nodes"]}
        elif name.endswith(".json"):
            key = "id" if name.startswith("opensees/") else "name"
            assert [line[key] for line in json.loads(path.read_text(encoding="utf-8"))["rods"]] == ids


def test_a_rhino_file_names_every_rod(written: dict[str, Path]) -> None:
    rhino3dm = pytest.importorskip("rhino3dm")
    model = rhino3dm.File3dm.Read(str(written["model/rodshell.3dm"]))
    names = {item.Attributes.Name for item in model.Objects}
    assert NAMES[0] in names
    assert not any(letter < " " for name in names for letter in name)


def test_a_hostile_archive_is_written_and_exported_again(tmp_path: Path) -> None:
    folder = save(hostile_archive(), tmp_path / "out", ["csv"])
    assert json.loads((folder / "result.json").read_text(encoding="utf-8"))["rods"][0]["id"] == NAMES[0]
