"""The store of a sweep and its table: what is kept, by what a job is known, and what happens to files that are full,
foreign or in use."""

import csv
import os
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

import rodshell as rs
from rodshell.sweeps.columns import read_column
from rodshell.sweeps.identity import job_identity
from rodshell.sweeps.plan import Settings
from rodshell.sweeps.run import best_jobs
from rodshell.sweeps.store import FOUND, STORE, Store
from rodshell.sweeps.table import CSV, Table, header_notes

ROW = {
    "verdict": "good",
    "status": "converged",
    "findings": "stands no_loads",
    "rms_pinned": 0.0125,
    "seconds": 0.1,
    "results": {"rods": 26},
}


def identity(job: rs.Job, until: str = "fabrication") -> str:
    return job_identity(job, until)


def mesh_job(file: Path) -> rs.Job:
    return rs.Job.load({"target": {"kind": "mesh", "file": str(file), "unit": "m"}})


def test_a_job_is_known_by_its_case_and_not_by_how_it_was_written():
    job = rs.Job.load("hemisphere", layout__spacing="30 mm")
    assert identity(job) == identity(rs.Job.load("hemisphere", layout__spacing=0.03))
    assert identity(job) == identity(rs.Job.load(job.to_toml()))
    assert identity(job) != identity(job.changed(layout__spacing="31 mm"))
    assert identity(job) != identity(job, "pop-up")


def test_texts_that_a_spreadsheet_would_run_have_an_apostrophe_in_front(tmp_path: Path):
    with Store(tmp_path, writing=True) as store:
        store.plan([(["=cmd|' /C calc'!A0", [0.1, -0.2]], "a")], notes=header_notes(["base", "layout.spacing"], ()))
        store.record("a", FOUND, ROW)
        Table(store).write()
    with (tmp_path / CSV).open() as stream:
        (row,) = csv.DictReader(stream)
    assert (row["base"], row["layout.spacing"]) == ("'=cmd|' /C calc'!A0", "[0.1, -0.2]")


def test_numbers_that_are_not_finite_are_said_and_not_kept(tmp_path: Path):
    with Store(tmp_path, writing=True) as store:
        store.plan([([1], "a")])
        store.record("a", FOUND, {**ROW, "rms_pinned": float("nan")})
        assert [(design.outcome, design.row) for design in store.finished()] == [
            ("failed", {"status": "its result has numbers that are not finite"})
        ]


def test_a_job_is_known_by_what_is_in_its_files_and_not_by_their_names(tmp_path: Path):
    one, same, other = (tmp_path / name for name in ("one.obj", "same.obj", "other.obj"))
    for file, text in ((one, "v 0 0 0\n"), (same, "v 0 0 0\n"), (other, "v 0 0 1\n")):
        file.write_text(text)
    assert identity(mesh_job(one)) == identity(mesh_job(same)) != identity(mesh_job(other))
    before = identity(mesh_job(one))
    one.write_text("v 0 0 2\n")
    os.utime(one, (1, 1))
    assert identity(mesh_job(one)) != before
    with pytest.raises(rs.InputError, match="cannot be read"):
        identity(mesh_job(tmp_path / "missing.obj"))


def test_a_job_is_known_by_the_parts_of_its_gltf_file(tmp_path: Path):
    file = tmp_path / "shell.gltf"
    file.write_text('{"buffers": [{"uri": "shell.bin"}]}')
    (tmp_path / "shell.bin").write_bytes(b"one")
    first = identity(mesh_job(file))
    (tmp_path / "shell.bin").write_bytes(b"two")
    os.utime(file, (1, 1))
    assert identity(mesh_job(file)) != first


def test_what_was_recorded_is_there_after_the_process_was_killed(tmp_path: Path):
    program = (
        "import os, signal, sys; from pathlib import Path; from rodshell.sweeps.store import Store\n"
        "with Store(Path(sys.argv[1]), writing=True) as store:\n"
        "    store.plan([([0.03], 'a'), ([0.04], 'b')])\n"
        "    store.record('a', 'found', {'status': 'converged'})\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=False).returncode == -9
    with Store(tmp_path, writing=True) as store:  # its lock went with it
        assert store.outcome("a") == FOUND
        assert store.outcome("b") is None
        assert [design.keys for design in store.finished()] == [[0.03]]


def test_a_second_sweep_into_the_folder_is_refused_and_readers_are_not(tmp_path: Path):
    with Store(tmp_path, writing=True) as store:
        store.plan([([1], "a")])
        store.record("a", FOUND, ROW)
        with pytest.raises(rs.OutputError, match="another sweep is writing into"):
            Store(tmp_path, writing=True).__enter__()
        with Store(tmp_path, writing=False) as reader:
            assert [design.row["rms_pinned"] for design in reader.finished()] == [0.0125]
    with Store(tmp_path, writing=True):
        pass


def test_a_full_disk_is_said_and_nothing_recorded_is_lost(tmp_path: Path):
    with Store(tmp_path, writing=True) as store:
        store.plan([([k], f"{k:032x}") for k in range(1000)])
        pages = store._connection.execute("PRAGMA page_count").fetchone()[0]
        store._connection.execute(f"PRAGMA max_page_count = {pages + 5}")
        recorded = list[int]()

        def fill() -> None:
            for k in range(1000):
                store.record(f"{k:032x}", FOUND, ROW | {"results": {str(n): os.urandom(8).hex() for n in range(40)}})
                recorded.append(k)

        with pytest.raises(rs.OutputError, match=r"disk is full; .* is kept: make room"):
            fill()
        assert recorded
    with Store(tmp_path, writing=False) as store:
        assert [design.position for design in store.finished()] == recorded


def test_the_designs_are_replaced_whole_or_not_at_all(tmp_path: Path):
    def broken() -> object:
        yield [1], "c"
        raise KeyboardInterrupt

    with Store(tmp_path, writing=True) as store:
        store.plan([([1], "a"), ([2], "b")])
        with pytest.raises(KeyboardInterrupt):
            store.plan(broken())  # type: ignore[arg-type]
        assert store.count() == 2
        store.plan([([3], "c")], more=True)
        store.record("c", FOUND, ROW)
        assert [(design.position, design.keys) for design in store.finished()] == [(2, [3])]


def test_the_table_has_a_row_for_each_finished_design_in_order(tmp_path: Path):
    with Store(tmp_path, writing=True) as store:
        store.plan(
            [([0.03, "ball"], "b"), ([0.04, "ball"], "missing"), ([0.05, [13, 11]], "a"), ([0.06, None], "b")],
            notes=header_notes(["layout.spacing", "joint.kind"], [read_column("rods"), read_column("job")]),
        )
        store.record("a", "refused", {"status": 'no net, "none"', "seconds": 0.0})
        store.record("b", FOUND, ROW)
        Table(store).write()
    with (tmp_path / CSV).open() as stream:
        head, *rows = csv.reader(stream)
    standard = [
        "verdict",
        "status",
        "findings",
        "rms_pinned",
        "rms_clamped",
        "min_angle_deg",
        "total_length",
        "seconds",
    ]
    assert head == ["layout.spacing", "joint.kind", *standard, "rods", "job"]
    assert [row[:4] for row in rows] == [
        ["0.03", "ball", "good", "converged"],
        ["0.05", "[13, 11]", "", 'no net, "none"'],
        ["0.06", "", "good", "converged"],
    ]
    assert [row[-2:] for row in rows] == [["26", "b"], ["", "a"], ["26", "b"]]
    table = rs.read_sweep(tmp_path, ["fabrication.total_mass"])
    assert table.column_names == [*head, "fabrication.total_mass"]
    assert table["rms_pinned"].to_pylist() == [0.0125, None, 0.0125]
    assert str(table["rods"].type) == "int64"
    assert table["joint.kind"].to_pylist() == ["ball", "[13, 11]", None]


def test_columns_are_values_lists_counted_and_tables_with_names_of_the_user():
    assert (
        read_column("loads.winter.pinned.limit_factor").of({"loads": {"winter": {"pinned": {"limit_factor": 2.0}}}})
        == 2
    )
    assert read_column("loads.winter.pinned.limit_factor").of({"loads": {}}) is None
    assert read_column("dropped").of({"dropped": [{"id": "U01"}]}) == 1
    assert read_column("layout.spacing").of({"layout": {"spacing": [0.03, 0.04]}}) == [0.03, 0.04]
    with pytest.raises(rs.InputError, match=r"loads is a table: name one of its keys, such as loads\.NAME"):
        read_column("loads")


def test_a_folder_without_a_sweep_or_with_a_broken_one_is_refused(tmp_path: Path):
    with pytest.raises(rs.OutputError, match="holds no sweep"):
        rs.read_sweep(tmp_path)
    (tmp_path / STORE).write_bytes(b"no database" * 100)
    with pytest.raises(rs.OutputError, match="cannot use"):
        rs.read_sweep(tmp_path)
    sqlite3.connect(tmp_path / "other.sqlite").close()
    (tmp_path / "a file").write_text("")
    with pytest.raises(rs.OutputError, match="cannot write"):
        Store(tmp_path / "a file" / "out", writing=True).__enter__()


def test_the_best_design_has_none_of_the_findings_that_are_not_wanted(tmp_path: Path):
    found = {"near": (0.01, "strength too_thick"), "far": (0.03, "off_target"), "between": (0.02, "contact strength")}
    with Store(tmp_path, writing=True) as store:
        store.plan([([k], job) for k, job in enumerate([*found, "old"])], notes=header_notes(["layout.rotate"], []))
        for job, (rms, codes) in found.items():
            store.record(job, FOUND, ROW | {"verdict": "check", "rms_pinned": rms, "findings": codes})
        store.record("old", FOUND, ROW | {"rms_pinned": 0.0, "findings": None})  # nothing was judged
        assert best_jobs(store, Settings()) == ["old", "near", "between", "far"]
        assert best_jobs(store, Settings(without=("strength",))) == ["far"]
        assert best_jobs(store, Settings(without=("too_thick", "contact"))) == ["far"]
        assert best_jobs(store, Settings(without=("too_thick",))) == ["between", "far"]
