"""Whole sweeps of small shells: the table against single runs, going on after kills, limits, and both engines."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

import rodshell as rs
from rodshell.cli import main
from rodshell.sweeps import watched
from rodshell.sweeps.plan import read_plan
from rodshell.sweeps.store import Store
from rodshell.sweeps.table import CSV

SMALL = {"layout": {"rods": [5, 5], "spacing": 0.08, "edge": 0.04, "length": 0.9}}
BASE = {"target": {"kind": "hemisphere"}, "rod": {"section": {"radius": 0.001}}, **SMALL}
PROGRAM = "from rodshell.cli import entry; entry()"


def plan(**changes: Any) -> dict[str, Any]:
    """A sweep of six designs, of which two cannot be computed."""
    axes = {"layout.spacing": ["80 mm", "75 mm", "1 mm"], "joint.kind": ["ball", "pin"]}
    run = {"until": "pop-up"}
    return {"base": BASE, "axes": axes} | changes | {"run": run | changes.get("run", {})}


def rows_of(folder: Path) -> list[dict[str, str]]:
    """The table without times."""
    with (folder / CSV).open() as stream:
        return [{key: value for key, value in row.items() if key != "seconds"} for row in csv.DictReader(stream)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep that nothing disturbed."""
    folder = tmp_path_factory.mktemp("whole") / "sweep"
    found = rs.sweep(plan(), folder)
    assert (found.designs, found.computed, found.verdicts) == (6, 6, {"not checked": 4, "no form": 2})
    return folder


def test_the_table_holds_what_single_runs_find(whole: Path):
    rows = rows_of(whole)
    assert [(row["layout.spacing"], row["joint.kind"]) for row in rows] == [
        (spacing, kind) for spacing in ("0.08", "0.075", "0.001") for kind in ("ball", "pin")
    ]
    for row in rows[:4]:
        case = {"layout.spacing": float(row["layout.spacing"]), "joint.kind": row["joint.kind"]}
        form = rs.Job.load(BASE, case).run(until="pop-up")
        assert float(row["rms_pinned"]) == form.agreement["pinned"].rms_relative
        assert float(row["rms_clamped"]) == form.agreement["clamped"].rms_relative
        assert float(row["total_length"]) == sum(rod.length for rod in form.footprint.rods)
        assert row["status"] == form.status == "converged"
        assert row["verdict"] == ""
    for row in rows[4:]:
        assert "edge 0.04 m is longer than the spacing 0.001 m" in row["status"]
        assert row["rms_pinned"] == ""


def test_a_changed_sweep_computes_only_what_is_new(whole: Path):
    assert rs.sweep(plan(), whole).computed == 0
    wider = {"layout.spacing": ["75 mm", 0.08, "70 mm"], "joint.kind": ["ball"]}
    found = rs.sweep(plan(axes=wider, columns=["rods"]), whole)
    assert (found.designs, found.computed) == (3, 1)
    rows = rows_of(whole)
    assert [row["layout.spacing"] for row in rows] == ["0.075", "0.08", "0.07"]
    assert [row["rods"] for row in rows] == ["10", "10", "10"]


@pytest.mark.slow
def test_the_table_says_in_codes_what_the_verdict_of_a_single_run_says(tmp_path: Path):
    rs.sweep(plan(axes={"layout.spacing": ["80 mm"]}, run={"until": "fabrication"}), tmp_path)
    (row,) = rows_of(tmp_path)
    form = rs.Job.load(BASE, {"layout.spacing": 0.08}).run()
    assert row["verdict"] == form.verdict.level
    assert row["findings"].split() == list(dict.fromkeys(found.code for found in form.verdict.findings))


def test_no_findings_are_selected_where_no_verdict_is_made():
    with pytest.raises(rs.InputError, match=r"run\.without needs the verdict"):
        read_plan(plan(run={"without": ["strength"]}))


def test_the_best_form_is_kept_and_follows_the_sweep(tmp_path: Path):
    axes = {"layout.spacing": ["80 mm", "75 mm"]}
    rs.sweep(plan(axes=axes, run={"keep": "best"}), tmp_path)
    rows = rows_of(tmp_path)
    best = min(rows, key=lambda row: float(row["rms_pinned"]))
    assert rs.read(tmp_path / "best").results.layout.spacing[0] == float(best["layout.spacing"])
    again = rs.sweep(plan(axes=axes, run={"keep": "best", "best": "total_length"}), tmp_path)
    assert again.computed <= 1
    shortest = min(rows, key=lambda row: float(row["total_length"]))
    assert rs.read(tmp_path / "best").results.layout.spacing[0] == float(shortest["layout.spacing"])


def test_all_forms_are_kept_by_their_job(tmp_path: Path):
    found = rs.sweep(plan(columns=["job"], run={"keep": "all"}), tmp_path)
    assert found.computed == 6
    for row in rows_of(tmp_path)[:4]:
        kept = rs.read(tmp_path / "archives" / row["job"])
        assert kept.results.layout.spacing[0] == float(row["layout.spacing"])
    assert rs.sweep(plan(columns=["job"], run={"keep": "all"}), tmp_path, report=True).computed == 0
    page = (tmp_path / "report.html").read_text()
    data = json.loads(page.partition("const designs = ")[2].partition(";\n")[0])
    assert data["rows"]["rms_pinned"] == [*(float(row["rms_pinned"]) for row in rows_of(tmp_path)[:4]), None, None]
    assert [link is not None for link in data["reports"]] == [True] * 4 + [False] * 2
    assert page.count("<figure>") == 4
    assert "http" not in page.partition("</style>")[2].partition("<script>")[0]


def test_nothing_is_computed_where_a_design_is_not_valid(tmp_path: Path):
    with pytest.raises(rs.InputError, match=r"layout\.edge"):
        rs.sweep(plan(axes={"layout.edge": ["40 mm", "-1 mm"]}), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_table_of_somebody_else_is_not_replaced(tmp_path: Path):
    (tmp_path / CSV).write_text("mine")
    with pytest.raises(rs.OutputError, match="will not replace"):
        rs.sweep(plan(), tmp_path)
    assert (tmp_path / CSV).read_text() == "mine"


def test_the_command_checks_without_computing_and_says_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    file = tmp_path / "sweep.toml"
    file.write_text('base = "hemisphere"\n[axes]\n"layout.spacing" = ["30 mm", "30 mm", "35 mm"]\n')
    assert main(["sweep", str(file), "--out", str(tmp_path / "out"), "--dry-run"]) == 0
    assert "3 designs, 1 of them the same as another; 0 jobs are finished" in capsys.readouterr().out
    assert not (tmp_path / "out").exists()
    file.write_text('base = "hemisphere"\n[axes]\n"layout.spacin" = ["30 mm"]\n')
    assert main(["sweep", str(file), "--dry-run"]) == 2
    assert capsys.readouterr().err == "rodshell: error: unknown key layout.spacin: did you mean layout.spacing?\n"
    assert main(["sweep", str(tmp_path / "missing.toml")]) == 2
    assert "there is no file named" in capsys.readouterr().err


PROCESS = """
import os, pathlib, signal, sys, time
place = pathlib.Path({place!r})

def noted(letter):
    place.write_text(place.read_text() + letter)
    return place.read_text().count(letter)

{start}
import rodshell.sweeps.worker as worker
compute = worker.reply_to

def reply_to(task):
    kind = task["case"].partition('[joint]')[2].partition('kind = "')[2].partition('"')[0]
    {job}
    return compute(task)

worker.reply_to = reply_to
worker.main()
"""


@pytest.fixture
def process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Makes each worker process do something when it starts, or before a job, whose joints are of a `kind`; returns a
    file in which it notes what it did."""

    def process(*, start: str = "pass", job: str = "pass") -> Path:
        (place := tmp_path / "noted").write_text("")
        monkeypatch.setattr(watched, "PROGRAM", PROCESS.format(place=str(place), start=start, job=job))
        return place

    return process


@pytest.mark.parametrize(
    ("act", "patience", "why"),
    [
        ("sys.exit('no room for kernels')", watched.PATIENCE, r"exit code 1 \(no room for kernels\)"),
        ("time.sleep(60)", 2.0, "it was not ready after 2 s"),
    ],
)
def test_a_process_that_never_starts_ends_the_sweep_after_one_more_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, process: Callable[..., Path], act: str, patience: float, why: str
):
    noted = process(start=f"noted('s'); {act}")
    monkeypatch.setattr(watched, "PATIENCE", patience)
    with pytest.raises(rs.RodshellError, match=f"a process for jobs cannot be started: .*{why}") as error:
        rs.sweep(plan(axes={"layout.spacing": ["80 mm"]}), tmp_path / "out")
    assert "\n" not in str(error.value)
    assert noted.read_text() == "ss"


def test_a_process_that_dies_once_while_it_starts_is_started_again(tmp_path: Path, process: Callable[..., Path]):
    noted = process(start="noted('s') == 1 and sys.exit(1)")
    assert rs.sweep(plan(axes={"layout.spacing": ["80 mm"]}), tmp_path / "out").verdicts == {"not checked": 1}
    assert noted.read_text() == "ss"


KINDS = {"joint.kind": ["pin", "ball", "spring"]}


@pytest.mark.slow
def test_a_job_whose_process_dies_is_run_again_once(tmp_path: Path, process: Callable[..., Path]):
    """With pins it always dies, with springs only at first."""
    dies = "os.kill(os.getpid(), signal.SIGKILL)"
    noted = process(job=f"kind == 'pin' and noted('p') and {dies}; kind == 'spring' and noted('s') == 1 and {dies}")
    found = rs.sweep(plan(axes=KINDS), tmp_path / "out")
    assert found.failures == (("its process died twice: SIGKILL, as for lack of memory", 1),)
    assert found.verdicts == {"not checked": 2, "no form": 1}
    assert noted.read_text() == "ppss"
    assert rs.sweep(plan(axes=KINDS), tmp_path / "out").computed == 0
    process()
    assert rs.sweep(plan(axes=KINDS), tmp_path / "out", retry=True).verdicts == {"not checked": 3}


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["processes", "dask"])
def test_jobs_over_a_limit_are_stopped_alone(tmp_path: Path, process: Callable[..., Path], engine: str):
    """With pins it takes much memory, with springs it hangs."""
    takes = "held = bytearray(os.urandom(1024)) * 400_000 if kind == 'pin' else b''; held and time.sleep(60)"
    process(job=f"{takes}; kind == 'spring' and os.kill(os.getpid(), signal.SIGSTOP)")
    run = {"memory_limit": "320 MB", "time_limit": "2 s", "workers": 2, "engine": engine}
    found = rs.sweep(plan(axes=KINDS, run=run), tmp_path / "out")
    assert dict(found.failures) == {
        "stopped: it took more memory than the limit of 320 MB": 1,
        "stopped: it took longer than the time limit of 2 s": 1,
    }
    assert found.verdicts == {"not checked": 1, "no form": 2}


@pytest.mark.slow
def test_a_sweep_that_is_stopped_goes_on_where_it_was(tmp_path: Path):
    """Again and again, in each way, and then it is computed to its end."""
    file, out = tmp_path / "sweep.toml", tmp_path / "out"
    spacings = ", ".join(f'"{count} mm"' for count in range(60, 90))
    (tmp_path / "base.toml").write_text(rs.Job.load(BASE).to_toml())
    file.write_text(f'base = "base.toml"\n[axes]\n"layout.spacing" = [{spacings}]\n[run]\nuntil = "pop-up"\n')
    workers, kept = list[psutil.Process](), 0
    for number, code in ((signal.SIGKILL, -9), (signal.SIGINT, 130), (signal.SIGTERM, 143)):
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, "sweep", str(file), "--out", str(out)],
            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip
        while process.poll() is None and _recorded(out) == kept:
            time.sleep(0.01)
        workers += psutil.Process(process.pid).children()
        os.kill(process.pid, number)
        said = process.communicate()[1]
        assert process.returncode == code
        before, kept = kept, _recorded(out)
        assert before < kept < 30
        if number != signal.SIGKILL:
            assert f"{kept} of 30 designs are in {out / CSV}; the same command continues from there" in said
            assert len(rows_of(out)) == kept
    assert rs.sweep(file, out).computed == 30 - kept
    assert len(workers) == 3
    assert psutil.wait_procs(workers, timeout=10)[1] == []


def _recorded(folder: Path) -> int:
    try:
        with Store(folder, writing=False) as store:
            return sum(store.outcomes().values())
    except rs.RodshellError:
        return 0


@pytest.mark.slow
def test_engines_and_numbers_of_workers_give_the_same_table(tmp_path: Path):
    tables = []
    for engine, workers in (("processes", 1), ("processes", 2), ("dask", 2)):
        folder = tmp_path / f"{engine}-{workers}"
        run = {"engine": engine, "workers": workers, "until": "fabrication"}
        rs.sweep(plan(axes={"layout.spacing": ["80 mm", "75 mm", "1 mm"]}, run=run), folder)
        tables.append(rows_of(folder))
    assert tables[0] == tables[1] == tables[2]
    assert {row["verdict"] for row in tables[0][:2]} <= {"good", "check", "unbuildable", "unknown"}
