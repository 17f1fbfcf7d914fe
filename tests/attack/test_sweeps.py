"""Sweeps of a stranger: files that name a scheduler, folders that lead elsewhere, damaged and crafted stores."""

import itertools
import json
import os
import random
import sqlite3
import struct
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

import rodshell as rs
from rodshell.cli import main
from rodshell.paper.genetic_records import StoredValues
from rodshell.sweeps import engines, watched
from rodshell.sweeps.columns import STANDARD
from rodshell.sweeps.engines import opened_engine
from rodshell.sweeps.plan import Settings, read_plan
from rodshell.sweeps.store import FOUND, LOCK, STORE, Store
from rodshell.sweeps.table import CSV, Table, header_notes, write_parquet

pytestmark = pytest.mark.attack
TRIES = 40 * int(os.environ.get("RODSHELL_ATTACK", "1"))
CODES = (0, 2, 3, 4)
JOB = "0123456789abcdef" * 2
ROW = {"verdict": "good", "status": "converged", "rms_pinned": 0.0125, "seconds": 0.1, "results": {"rods": 26}}
SWEEP = 'base = "hemisphere"\ncolumns = ["rods"]\n[axes]\n"layout.spacing" = ["30 mm", "31 mm"]\n[run]\nworkers = 2\n'
SEARCH = (
    'base = "hemisphere"\n[variables]\n"layout.spacing" = { from = "25 mm", to = "35 mm" }\n[objectives]\n'
    'minimise = ["rms_pinned"]\n[constraints]\nmin_angle_deg = { min = 40 }\n[search]\npopulation = 4\nseed = 1\n'
)
links = pytest.mark.skipif(sys.platform == "win32", reason="needs links")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Of a sweep with two designs, both finished."""
    folder = tmp_path / "out"
    with Store(folder, writing=True) as store:
        store.plan([([0.03], JOB), ([0.031], JOB[::-1])], notes=header_notes(["layout.spacing"], ()))
        store.record(JOB, FOUND, ROW)
        store.record(JOB[::-1], FOUND, ROW)
    return folder


def read(folder: Path) -> None:
    """All that reads a store: the table in three forms, and the row of a job."""
    table = rs.read_sweep(folder, ["rods"]).to_pylist()
    numbers = [value for row in table for value in row.values() if isinstance(value, float)]
    assert all(abs(number) < 1e300 for number in numbers)
    with Store(folder, writing=True) as store:
        Table(store).write()
        write_parquet(store)
        store.outcomes()
        store.row(JOB)


def refused(folder: Path) -> str:
    with pytest.raises(rs.RodshellError) as error:
        read(folder)
    assert "\n" not in str(error.value)
    assert str(folder) in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("factor", ["108", "1e308"])
def test_store_is_read_whatever_its_limit(factor: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RODSHELL_LIMITS", factor)
    read(folder)


# Code


def test_no_file_names_a_scheduler(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Whose answers are unpickled."""
    file = tmp_path / "file.toml"
    for command, text in (("sweep", SWEEP), ("optimise", f"{SEARCH}[run]\n")):
        file.write_text(f'{text}engine = "dask"\naddress = "tcp://10.0.0.1:8786"\n')
        assert main([command, str(file), "--out", str(tmp_path / "out")]) == 2
        assert "type --address ADDRESS where you trust what answers there" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_scheduler_and_its_certificates_are_those_of_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dask, distributed = pytest.importorskip("dask"), pytest.importorskip("distributed")
    asked = list[dict[str, object]]()

    def client(address: object, **options: object) -> None:
        asked.append({"address": address, **options})
        raise OSError("nobody")

    monkeypatch.setattr(distributed, "Client", client)
    (tmp_path / "scheduler.json").write_text('{"address": "tls://here:1"}')
    for address in ("tls://here:1", str(tmp_path / "scheduler.json")):
        with pytest.raises(rs.InputError, match=f"no dask scheduler answers at {address}"):
            opened_engine(Settings(), address).__enter__()
        assert asked[-1]["address"] == "tls://here:1"
    monkeypatch.setattr(engines, "PATIENCE", 0.0)
    for content in ("", "{}", "[" * 100_000, '"x"'):
        (tmp_path / "scheduler.json").write_text(content)
        with pytest.raises(rs.InputError, match="is not a scheduler file of dask"):
            opened_engine(Settings(), str(tmp_path / "scheduler.json")).__enter__()
    with dask.config.set({"scheduler-address": "tls://there:2"}), pytest.raises(rs.InputError, match="tls://there:2"):
        opened_engine(Settings(engine="dask")).__enter__()
    assert all("security" not in options for options in asked)  # so that dask's own settings count


def test_local_cluster_is_seen_from_this_machine_only() -> None:
    pytest.importorskip("distributed")
    with opened_engine(Settings(engine="dask")):
        ports = [place.laddr for place in psutil.Process().net_connections() if place.status == "LISTEN"]
    assert {port.ip for port in ports} <= {"127.0.0.1"}


def test_workers_import_nothing_from_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "strangers.py").write_text("")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(watched, "PROGRAM", "import strangers")
    with pytest.raises(rs.RodshellError, match="No module named 'strangers'"):
        watched.Worker().run({}, None, None)


# Files elsewhere


@links
@pytest.mark.parametrize("name", [STORE, LOCK])
def test_store_is_not_written_through_a_link(folder: Path, tmp_path: Path, name: str) -> None:
    victim = tmp_path / "victim"
    with sqlite3.connect(victim) as database:
        database.execute("CREATE TABLE history (url TEXT)")
    before = victim.read_bytes()
    (folder / name).unlink(missing_ok=True)
    (folder / name).symlink_to(victim)
    assert "is not a file of a sweep" in refused(folder)
    assert victim.read_bytes() == before


@pytest.mark.parametrize("name", [STORE, LOCK])
def test_journal_that_names_a_file_to_delete_is_not_obeyed(folder: Path, tmp_path: Path, name: str) -> None:
    """SQLite deletes the super-journal that a journal names, once it has rolled back; it may be any file."""
    (folder / LOCK).write_bytes((folder / STORE).read_bytes())
    victim = tmp_path / "victim"
    victim.write_text("precious")
    magic, named = bytes.fromhex("d9d505f920a163d7"), os.fsencode(victim)
    page = int.from_bytes((folder / STORE).read_bytes()[16:18], "big")
    header = magic + struct.pack(">5I", 0, 1, (folder / STORE).stat().st_size // page, 512, page)
    end = struct.pack(">I", 0x40000000 // page + 1) + named + struct.pack(">2I", len(named), sum(named)) + magic
    (folder / f"{name}-journal").write_bytes(header.ljust(512, b"\0") + end)
    with pytest.raises(rs.OutputError, match="is not"), Store(folder, writing=True):
        pass
    assert victim.read_text() == "precious"


@links
def test_tables_are_not_written_through_links_of_their_parts(folder: Path, tmp_path: Path) -> None:
    victim = tmp_path / "victim"
    victim.write_text("precious")
    for name in (CSV, "table.parquet", "report.html", "sweep.toml", STORE):
        (folder / f".{name}.part").symlink_to(victim)
    read(folder)
    (folder / STORE).unlink()
    with Store(folder, writing=True):
        pass
    assert victim.read_text() == "precious"


@links
def test_results_are_not_kept_behind_a_link(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (folder / "archives").symlink_to(tmp_path / "elsewhere")
    with Store(folder, writing=False) as store, pytest.raises(rs.OutputError, match="leads out of the sweep's folder"):
        store.inside(f"archives/{JOB}")


def test_devices_are_not_read_as_files_of_a_case(tmp_path: Path) -> None:
    if not Path("/dev/zero").exists():
        pytest.skip("needs /dev/zero")
    file = tmp_path / "sweep.toml"
    file.write_text(
        'base = "hemisphere"\n[axes]\n"target.kind, target.file, target.unit" = [["mesh", "/dev/zero", "m"]]\n'
    )
    assert main(["sweep", str(file), "--out", str(tmp_path / "out"), "--dry-run"]) == 2
    assert main(["sweep", "/dev/zero"]) == 2


# Stores


def test_what_is_no_store_is_refused_in_a_sentence(folder: Path) -> None:
    store = folder / STORE
    whole = store.read_bytes()
    for content in (b"", b"SQLite format 3\0", whole[:100], whole[:5000], whole[:-4096], b"\0" * 10_000, whole[::-1]):
        store.write_bytes(content)
        refused(folder)
    store.unlink()
    store.mkdir()
    assert "is not a file of a sweep" in refused(folder)
    store.rmdir()
    assert "holds no sweep" in refused(folder)
    if hasattr(os, "mkfifo"):
        os.mkfifo(store)
        assert "is not a file of a sweep" in refused(folder)


@pytest.mark.parametrize(
    "sql",
    [
        "DROP TABLE jobs", "ALTER TABLE jobs ADD COLUMN more", "DROP TABLE notes", "CREATE TABLE more (x)",
        "CREATE TRIGGER t AFTER INSERT ON jobs BEGIN DELETE FROM designs; END",
        "DROP TABLE designs; CREATE VIEW designs AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x FROM c) "
        "SELECT x AS position, 'a' AS job, '[]' AS keys FROM c",
    ],
)  # fmt: skip
def test_another_schema_is_refused_before_anything_is_written(folder: Path, sql: str) -> None:
    with sqlite3.connect(folder / STORE) as database:
        database.executescript(sql)
    assert "is not of a sweep" in refused(folder)


def packed(content: object) -> bytes:
    return zlib.compress(content if isinstance(content, bytes) else json.dumps(content).encode())


@pytest.mark.parametrize(
    ("column", "value"),
    [
        *(("row", value) for value in (b"", b"x", "text", 3, 0.5, *map(packed, (b"{", [], {}, b"\xff")))),
        *(("row", packed({**ROW, name: {}})) for name in (*STANDARD, "more")),
        *(("row", packed(json.dumps({**ROW, "rms_pinned": 7}).replace("7", text).encode())) for text in (
            "NaN", "Infinity", "1e999", "1" * 30, "1" * 10_000, "[" * 100_000, '"\\ud800"', "true and",
        )),
        ("row", packed({**ROW, "status": "\ud800"})),
        ("row", packed({**ROW, "results": []})),
        ("row", packed(b'{"status": "' + b" " * 30_000_000 + b'"}')),
        *(("outcome", value) for value in ("other", b"found", 1)),
        *(("id", value) for value in ("../../secret", "/etc", b"x")),
    ],
    ids=map(str, itertools.count()),
)  # fmt: skip
def test_damaged_job_is_one_sentence(folder: Path, column: str, value: object) -> None:
    with sqlite3.connect(folder / STORE) as database:
        database.execute(f"UPDATE jobs SET {column} = ? WHERE id = ?", (value, JOB))
        if column == "id":
            database.execute("UPDATE designs SET job = ? WHERE job = ?", (value, JOB))
    refused(folder)


@pytest.mark.parametrize(
    "keys",
    ["", "{", "{}", "3", "[]", "[1, 2]", "[NaN]", "[1e999]", "[" * 50_000, '["\\udc00"]', b"[1]\xff", None],
    ids=map(str, itertools.count()),
)
def test_damaged_design_is_one_sentence(folder: Path, keys: object) -> None:
    with sqlite3.connect(folder / STORE) as database:
        database.execute("UPDATE designs SET keys = ifnull(?, zeroblob(9))", (keys,))
    refused(folder)


@pytest.mark.parametrize(
    "header",
    [
        "", "[]", "{}", '{"keys": 3, "columns": []}', '{"keys": [3], "columns": []}',
        '{"keys": ["a"], "columns": [[]]}', b"\xff",
    ],
)  # fmt: skip
def test_damaged_header_is_one_sentence(folder: Path, header: object) -> None:
    with sqlite3.connect(folder / STORE) as database:
        database.execute("UPDATE notes SET value = ? WHERE name = 'header'", (header,))
    refused(folder)


@pytest.mark.parametrize("seed", range(TRIES))
def test_store_of_changed_bytes_is_read_or_refused_in_a_sentence(folder: Path, seed: int) -> None:
    draw = random.Random(seed)
    content = bytearray((folder / STORE).read_bytes())
    for _ in range(draw.choice((1, 3, 30))):
        content[draw.randrange(len(content))] = draw.randrange(256)
    (folder / STORE).write_bytes(content)
    try:
        read(folder)
    except rs.RodshellError as error:
        assert "\n" not in str(error)  # noqa: PT017


@pytest.mark.parametrize(
    "change",
    [
        {"values": [[1e999]]}, {"values": [["x"]]}, {"values": {}}, {"values": [{}]}, {"values": 3}, {"seconds": ["x"]},
        {"seconds": [None]}, {"digests": []}, {"format": "x"}, {"version": None},
    ],
    ids=str,
)  # fmt: skip
def test_damaged_values_of_a_genetic_search_are_one_sentence(tmp_path: Path, change: dict[str, object]) -> None:
    good = {"format": "rodshell-genetic-values", "version": 1, "digests": ["x"], "values": [[0.1]], "seconds": [0.2]}
    (file := tmp_path / "values.json").write_text(json.dumps(good))
    assert StoredValues.read(file).values == [[0.1]]
    for text in (json.dumps({**good, **change}), "[" * 100_000, "", "\xff"):
        file.write_text(text, encoding="latin-1")
        with pytest.raises(rs.InputError, match=r"cannot continue|not text"):
            StoredValues.read(file)


@pytest.mark.parametrize("value", ["[" * 2000 + "]" * 2000, "9" * 100_000, '"\\ud800"'])
def test_values_that_no_sweep_has_are_one_sentence(tmp_path: Path, value: str) -> None:
    (tmp_path / "sweep.toml").write_text(f'base = "hemisphere"\n[axes]\n"layout.spacing" = {value}\n')
    with pytest.raises(rs.InputError):
        read_plan(tmp_path / "sweep.toml")


def test_values_of_axes_are_counted_before_they_are_made(tmp_path: Path) -> None:
    keys = ["layout.spacing", "layout.rotate", "layout.edge", "drape.gravity", "layout.length"]
    spans = "\n".join(f'"{key}" = {{ from = 0.01, to = 0.02, count = 200_000 }}' for key in keys)
    (tmp_path / "sweep.toml").write_text(f'base = "hemisphere"\n[axes]\n{spans}\n')
    with pytest.raises(rs.InputError, match="axes: 40000000000 designs are more than"):
        read_plan(tmp_path / "sweep.toml")


TOKENS = (
    '"', "'", "[", "]", "{", "}", "=", ",", ".", "#", "\n", "\0", "\x1b", "\u202e", "nan", "inf", "1e400", "-1",
    "9" * 400, "true", "[run]", "[axes]", "base", "from", "to", "count", "..", "/", "~nobody", "1979-05-27",
    "''", '"""', "é",
)  # fmt: skip


def mutated(draw: random.Random, text: str) -> str:
    for _ in range(draw.choice((1, 2, 5))):
        begin = draw.randrange(len(text))
        end = begin + draw.choice((0, 0, 1, 5, 20))
        text = text[:begin] + draw.choice((*TOKENS, text[end : end + 30])) + text[end:]
    return text


@pytest.mark.parametrize("seed", range(3 * TRIES))
def test_changed_files_are_read_or_refused_in_a_sentence(
    seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    draw = random.Random(seed)
    stop: Callable[..., None] = lambda *_, **__: (_ for _ in ()).throw(rs.InputError("stop"))  # noqa: E731
    monkeypatch.setattr("rodshell.sweeps.search.opened_computation", stop)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "f.toml").write_text(mutated(draw, SEARCH if seed % 3 else SWEEP), encoding="utf-8")
    code = main(["optimise", "f.toml", "-q"] if seed % 3 else ["sweep", "f.toml", "--dry-run"])
    said = capsys.readouterr().err
    assert code in CODES
    assert said.count("\n") <= 1, said
    assert "Traceback" not in said
    assert (code == 2) == said.startswith("rodshell: error: ")
