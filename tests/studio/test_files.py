"""A case from a page or a program reads no file of the server, by any key, and writes none."""

import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from rodshell.case.case import Case
from rodshell.case.load import FILE_KEYS
from rodshell.errors import InputError
from rodshell.schema import fields_of
from rodshell.studio.worker import Order, job_of

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
MESH: dict[str, Any] = {"kind": "mesh", "file": "upload:roof.obj", "unit": "m"}
LAYERS = ("cut", "mark", "label", "boundary_flat", "boundary_final", "dim", "title")
WORDS = {  # names, titles and formulas: nothing opens a file of this name
    *(f"drawings.{name}" for name in ("project", "revision", "name", "author", "date", "files")),
    *(f"drawings.layers.{name}" for name in LAYERS),
    *(f"loads.{name}" for name in ("name", "coefficient", "supports")),
    *("combinations.name", "combinations.factors", "seams.patches.name", "target.formula", "target.object"),
    *("refine.under", "refine.vary", "bracing.pattern", "stability.imperfection", "layout.left_out", "layout.names"),
    *("supports.at", "combinations.deflection", "design.open"),
}  # fmt: skip


READ = [f"{table}.{key}" for table, keys in FILE_KEYS.items() for key in keys]


def texts(table: type, path: str = "") -> Iterator[tuple[str, str]]:
    """All keys of a table, and of the tables in it, that may hold any text, with what that is."""
    hints = get_type_hints(table, include_extras=True)
    for field in fields_of(table):
        place = path if field.inline else f"{path}.{field.name}".lstrip(".")
        for inner in field.tables:
            yield from texts(inner, place)
        if not field.tables and str in _parts(hints[field.attribute]):
            yield place, field.value.role if field.value else ""


def _parts(annotation: Any) -> list[Any]:
    """An annotation and all that it is made of, without the words of a choice."""
    if "Literal" in repr(annotation)[:20]:
        return []
    return [annotation, *(part for inner in get_args(annotation) for part in _parts(inner))]


def test_each_key_that_holds_text_is_a_file_or_known_to_be_none() -> None:
    found = dict(texts(Case))
    reads = {path for path, role in found.items() if role == "file"}
    writes = {path for path, role in found.items() if role == "folder"}
    assert reads == set(READ) >= {"target.file", "target.boundary", "seams.file"}
    assert writes == {"drape.frames"}
    assert found.keys() - reads - writes == WORDS  # a new one: is it a FileToRead?


def nested(path: str, value: object) -> dict[str, Any]:
    outer, _, name = path.partition(".")
    return {outer: nested(name, value) if name else value}


def spellings(path: str, value: str) -> Iterator[dict[str, Any]]:
    """A key in all the ways in which a mapping may hold it."""
    table, _, name = path.rpartition(".")
    rest = MESH if table == "target" else {}
    yield {"target": MESH} | {table: {**rest, name: value}}
    yield {path: value, **({"target.kind": "mesh", "target.unit": "m"} if table == "target" else {})}
    yield {table: {**rest, f".{name}": value}}
    yield {f".{table}": {**rest, name: value}}
    yield {table: {**rest, "": {name: value}}}
    yield {table: rest, f"{table}.{name}": value}
    yield {f"{table}.": {**rest, name: value}}
    yield {table: {**rest, f"{name}.": value}}


OPENED: list[str] | None = None  # paths, while a test listens


def _hear(event: str, arguments: Any) -> None:
    if OPENED is not None and event in ("open", "os.listdir", "os.mkdir"):
        OPENED.append(str(arguments[0]))


sys.addaudithook(_hear)


@pytest.mark.parametrize(
    "key", sorted({*WORDS, *(f"{t}.{k}" for t, keys in FILE_KEYS.items() for k in keys), "drape.frames"})
)
def test_no_key_in_any_spelling_reads_a_file_that_was_not_uploaded(
    key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    uploads, secret = tmp_path / "uploads", tmp_path / "secret.obj"
    uploads.mkdir()
    for path in (secret, uploads / "roof.obj"):
        path.write_text(OBJ)
    opened = list[str]()
    monkeypatch.setattr(sys.modules[__name__], "OPENED", opened)
    values = (str(secret), "upload:../secret.obj", f"upload:{secret}", "upload:", "upload:./roof.obj", "../secret.obj")
    for value in values:
        for case in (*spellings(key, value), nested(key, value), nested(key, [value])):
            for folder in (str(uploads), ""):
                opened.clear()
                with suppress(InputError):
                    found = job_of(Order(1, "form", case, uploads=folder)).case
                    assert found.files <= {str(uploads / "roof.obj")}
                    assert found.drape.frames is None
                assert [path for path in opened if "secret" in path] == []


def test_a_case_reads_what_was_uploaded(tmp_path: Path) -> None:
    (tmp_path / "roof.obj").write_text(OBJ)
    (tmp_path / "cuts.obj").write_text("v 0 -9 0\nv 0 9 0\nl 1 2\n")
    tables = {"target": {**MESH, "boundary": "upload:roof.obj"}, "seams": {"file": "upload:cuts.obj", "unit": "m"}}
    case = job_of(Order(1, "form", tables, uploads=str(tmp_path))).case
    assert case.files == {str(tmp_path / "roof.obj")}
    assert len(case.seams.lines) == 1
    for kind in ("form", "job"):
        with pytest.raises(InputError, match="reads only files that were uploaded"):
            job_of(Order(1, kind, tables))
