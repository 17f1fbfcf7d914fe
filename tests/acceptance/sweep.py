"""Prints the acceptance table of sweeps: `python -m tests.acceptance.sweep [--designs 10000]`; exit 1 on a miss.

Times are printed, not judged. The sweep of many designs takes a tenth of a second of processor time for each.
"""

import argparse
import csv
import json
import random
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil

import rodshell as rs
from rodshell.sweeps.store import STORE, Store
from rodshell.sweeps.table import CSV
from tests.acceptance.rows import Row, print_table

ROOT = Path(__file__).parents[2]
PROGRAM = "from rodshell.cli import entry; entry()"
SMALL = '"layout.rods" = ["7x7"]\n"layout.edge" = ["20 mm"]\n"layout.length" = ["900 mm"]\n'
KILLS = 30
SEED = 20


def write_sweep(file: Path, axes: str, run: str, base: str = "hemisphere") -> Path:
    file.write_text(f'base = "{base}"\n[axes]\n{axes}\n[run]\n{run}\n')
    return file


def table(folder: Path, name: str = CSV) -> list[dict[str, str]]:
    """A table without times."""
    with (folder / name).open() as stream:
        return [{key: value for key, value in row.items() if key != "seconds"} for row in csv.DictReader(stream)]


def recorded(folder: Path) -> dict[str, float]:
    """Processor time of each recorded job, which tells whether it was computed again."""
    try:
        with Store(folder, writing=False) as store:
            return {design.job: design.row["seconds"] for design in store.finished()}
    except rs.RodshellError:
        return {}


# Many designs


def many_rows(folder: Path, designs: int) -> Iterator[Row]:
    """Designs of 13 x 13 rods on two processes."""
    name = f"{designs} designs of 13 x 13"
    axes = (
        '"layout.rods" = ["13x13"]\n"layout.spacing" = { from = "26 mm", to = "34 mm" }\n'
        '"layout.rotate" = { from = "0 deg", to = "90 deg" }\n'
        f'[sample]\nmethod = "latin-hypercube"\ncount = {designs}\nseed = 1'
    )
    file = write_sweep(folder / "many.toml", axes, 'workers = 2\nuntil = "pop-up"')
    memory, process, begun = list[tuple[int, int]](), psutil.Process(), time.monotonic()

    def look(stage: str, detail: str, residual: float) -> None:
        done = int(detail.split()[0])
        if done % 50 == 0 and (not memory or done > memory[-1][0]):
            memory.append((done, process.memory_info().rss))

    found = rs.sweep(file, folder / "many", progress=look)
    lasted = time.monotonic() - begun
    rows = table(folder / "many")
    seconds = recorded(folder / "many")
    keys = Counter((row["layout.spacing"], row["layout.rotate"]) for row in rows)
    note = f"{found.designs / lasted:.1f} a second, {np.mean(list(seconds.values())):.3f} s of processor time a job"
    yield Row(name, "designs lost", designs - len(keys), 0, note=note)
    yield Row(name, "designs twice", len(rows) - len(keys) + found.computed - designs, 0)
    yield Row(name, "designs without a form", sum(row["status"] != "converged" for row in rows), 0)
    late = [(done, size) for done, size in memory if done > designs / 10]  # after what is made once
    growth = np.polyfit(*np.array(late).T, 1)[0] * 1000 / 1e6
    note = f"{memory[0][1] / 1e6:.0f} to {memory[-1][1] / 1e6:.0f} MB"
    yield Row(name, "growth of the parent in 1000", max(growth, 0.0), 1.0, "MB", note)
    size = (folder / "many" / STORE).stat().st_size / designs * 10_000 / 1e6
    yield Row(name, "store of 10,000", size, 50, "MB")


# Kills


def killed_rows(folder: Path, designs: int) -> Iterator[Row]:
    """Workers and coordinators killed in turn at random moments, and the sweep continued after each coordinator.

    A kill counts if its process was alive: for a worker it is waited until there is one.
    """
    name = f"{designs} designs, {KILLS} kills"
    axes = SMALL + f'"layout.spacing" = {{ from = "50 mm", to = "62 mm", count = {designs} }}'
    file = write_sweep(folder / "kills.toml", axes, 'workers = 2\nuntil = "pop-up"')
    rs.sweep(file, folder / "undisturbed")
    rng, out = random.Random(SEED), folder / "kills"
    moments = sorted(rng.sample(range(0, designs - designs // 50, 5), KILLS))
    victims = ["worker", "coordinator"] * (KILLS // 2)
    rng.shuffle(victims)
    killed, seen = Counter[str](), defaultdict[str, set[float]](set)

    def look() -> int:
        """Number of recorded designs; notes the processor time of each."""
        for job, seconds in (now := recorded(out)).items():
            seen[job].add(seconds)
        return len(now)

    process = _started(file, out)
    for moment, victim in zip(moments, victims, strict=True):
        while look() < moment and process.poll() is None:
            time.sleep(0.05)
        time.sleep(rng.random() * 0.3)
        if victim == "worker":
            killed[victim] += _kill_worker(process.pid, rng)
        else:
            process.kill()
            killed[victim] += process.wait() == -signal.SIGKILL
            look()
            process = _started(file, out)
    code = process.wait()
    look()
    first, second = table(folder / "undisturbed"), table(out)
    for victim in ("worker", "coordinator"):
        yield Row(name, f"{victim}s not killed, of {KILLS // 2}", KILLS // 2 - killed[victim], 0)
    yield Row(name, "exit code of the last run", code, 0)
    yield Row(name, "rows that differ from undisturbed", _differing(first, second), 0, note=f"of {len(first)}")
    yield Row(name, "finished jobs computed again", sum(len(times) > 1 for times in seen.values()), 0)
    yield Row(name, "finished jobs lost", len(seen.keys() - recorded(out).keys()), 0)


def _kill_worker(coordinator: int, rng: random.Random) -> bool:
    """Kill one of its workers, as soon as it has one; whether one was killed, and not the end of the sweep came first.

    A child that does not run the worker's program yet is one that starts.
    """
    while psutil.pid_exists(coordinator) and psutil.Process(coordinator).status() != psutil.STATUS_ZOMBIE:
        for child in rng.sample(children := psutil.Process(coordinator).children(), len(children)):
            with suppress(psutil.NoSuchProcess):
                if child.status() != psutil.STATUS_ZOMBIE:
                    child.kill()
                    return True
        time.sleep(0.02)
    return False


def _started(file: Path, out: Path) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "sweep", str(file), "--out", str(out), "--quiet"],
        stderr=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


def _differing(first: list[dict[str, str]], second: list[dict[str, str]]) -> int:
    return abs(len(first) - len(second)) + sum(a != b for a, b in zip(first, second, strict=False))


# Engines


def engine_rows(folder: Path) -> Iterator[Row]:
    """The same designs, all checks done, by each engine."""
    axes = SMALL.replace("7x7", "9x9") + '"layout.spacing" = { from = "40 mm", to = "48 mm", count = 24 }'
    tables, costs = {}, {}
    for name, run in {
        "processes, 1 worker": "workers = 1",
        "processes, 2 workers": "workers = 2",
        "dask, 2 workers": 'engine = "dask"\nworkers = 2',
    }.items():
        file = write_sweep(folder / "engine.toml", axes, run)
        rs.sweep(file, folder / name)
        tables[name] = table(folder / name)
        costs[name] = float(np.median(list(recorded(folder / name).values())))
    first, *others = tables
    for other in others:
        yield Row(f"{first} against {other}", "rows that differ", _differing(tables[first], tables[other]), 0)
        apart = costs[other] / costs[first] - 1
        note = f"{costs[first]:.3f} and {costs[other]:.3f} s, medians"
        yield Row(f"{first} against {other}", "processor time a job apart", abs(apart), 0.3, note=note)
    with Store(folder / first, writing=False) as store:
        rows = [design.row for design in store.finished()]
    with Store(folder / "large", writing=True) as store:  # these rows again and again, each compressed alone
        names = [f"{k:032x}" for k in np.random.default_rng(SEED).permutation(10_000)]
        store.plan(([0.01 + 1e-7 * k], name) for k, name in enumerate(names))
        for k, name in enumerate(names):
            store.record(name, "found", rows[k % len(rows)])
    size = sum(file.stat().st_size for file in (folder / "large").iterdir()) / 1e6
    yield Row("store with all checks", "of 10,000 designs", size, 50, "MB")


# Faults


def fault_rows(folder: Path) -> Iterator[Row]:
    """Workers that die, hang, eat memory; a full disk; two sweeps into one folder."""
    falls = SMALL + '"drape.method" = ["bound", "paper"]'
    for what, act, run, sentence in (
        ("dies twice", psutil.Process.kill, "", "its process died twice: SIGKILL, as for lack of memory"),
        ("hangs", psutil.Process.suspend, 'time_limit = "12 s"', "stopped: it took longer than the time limit of 12 s"),
    ):
        file = write_sweep(folder / "fault.toml", falls, f'until = "pop-up"\n{run}')
        with _Busy(act):
            found = rs.sweep(file, folder / what)
        yield Row(f"a worker {what}", "not said", float(found.failures != ((sentence, 1),)), 0, note=sentence)
        yield Row(f"a worker {what}", "other designs lost", 1 - found.verdicts.get("not checked", 0), 0)
    sizes = '"layout.rods, layout.spacing, layout.edge" = [["5x5", 0.08, 0.04], ["33x33", 0.012, 0.0008]]'
    file = write_sweep(folder / "fault.toml", sizes, 'until = "pop-up"\nmemory_limit = "250 MB"')
    found = rs.sweep(file, folder / "memory")
    sentence = "stopped: it took more memory than the limit of 250 MB"
    yield Row("a worker eats memory", "not said", float(found.failures != ((sentence, 1),)), 0, note=sentence)
    yield Row("a worker eats memory", "other designs lost", 1 - found.verdicts.get("not checked", 0), 0)
    yield from _disk_rows(folder)
    yield from second_rows(folder)


class _Busy:
    """Does something to each worker that is in a long job."""

    def __init__(self, act: Callable[[psutil.Process], None]) -> None:
        self._act, self._over = act, threading.Event()

    def __enter__(self) -> None:
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _look(self) -> None:
        done = set[int]()
        while not self._over.wait(0.02):
            for child in psutil.Process().children():
                try:
                    if child.pid not in done and child.cpu_times().user > 3.0:
                        self._act(child)
                        done.add(child.pid)
                except psutil.Error:
                    continue


def _disk_rows(folder: Path) -> Iterator[Row]:
    """Files that may not grow beyond a size stand for a full disk; then there is room again."""
    axes = SMALL + '"layout.spacing" = { from = "50 mm", to = "62 mm", count = 200 }'
    file, out = write_sweep(folder / "full.toml", axes, 'workers = 2\nuntil = "pop-up"'), folder / "full"

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (600_000, 600_000))

    full = subprocess.run(
        [sys.executable, "-c", PROGRAM, "sweep", str(file), "--out", str(out), "--quiet"],
        capture_output=True, text=True, preexec_fn=limited, check=False,
    )  # fmt: skip
    said = full.stderr.strip()
    one_line = full.returncode == 2 and said.startswith("rodshell: error: cannot write") and "\n" not in said
    kept = recorded(out)
    yield Row("a full disk", "not said in a sentence", float(not one_line), 0, note=said)
    yield Row("a full disk", "kept designs, at least", -len(kept), -1)
    rs.sweep(file, out)
    after = recorded(out)
    lost = sum(after.get(job) != seconds for job, seconds in kept.items())
    yield Row("a full disk", "finished designs lost", lost + 200 - len(after), 0)


def second_rows(folder: Path, designs: int = 100) -> Iterator[Row]:
    """A sweep into a folder into which another is writing."""
    axes = SMALL + f'"layout.spacing" = {{ from = "50 mm", to = "62 mm", count = {designs} }}'
    file, out = write_sweep(folder / "two.toml", axes, 'until = "pop-up"'), folder / "two"
    process = _started(file, out)
    while len(recorded(out)) < 5:
        time.sleep(0.05)
    try:
        rs.sweep(file, out)
        said = "NOT REFUSED"
    except rs.OutputError as error:
        said = str(error)
    yield Row("a second sweep into a folder", "not refused", float("another sweep" not in said), 0, note=said)
    yield Row(
        "a second sweep into a folder", "designs of the first lost", process.wait() + designs - len(table(out)), 0
    )


# Search and studies


def front_rows(folder: Path) -> Iterator[Row]:
    """Gap against waste on the roof of the examples, twice from the same seed."""
    roof = ROOT / "examples" / "data" / "freeform.obj"
    plan = {
        "base": rs.Job.load(roof, {"target.unit": "mm", "fabrication.stock_length": "6 m", "layout.spacing": "0.9 m"}),
        "variables": {
            "layout.spacing": {"from": "0.8 m", "to": "1.3 m"},
            "layout.rotate": {"from": "0 deg", "to": "90 deg"},
        },
        "objectives": {"minimise": ["rms_pinned", "fabrication.stock.waste"]},
        "search": {"population": 8, "generations": 3, "seed": 1},
        "run": {"workers": 2},
    }
    found = [rs.optimise(plan, folder / name) for name in ("front", "front again")]
    first, again = (table(folder / name, "front.csv") for name in ("front", "front again"))
    yield Row("freeform roof, gap against waste", "points that differ", _differing(first, again), 0)
    values = np.array([[float(row["rms_pinned"]), float(row["fabrication.stock.waste"])] for row in first])
    everything = np.array(
        [
            [float(row["rms_pinned"]), float(row["fabrication.stock.waste"])]
            for row in table(folder / "front")
            if row["status"] == "converged" and row["rms_pinned"]
        ]
    )
    dominated = sum(bool(((everything <= v).all(axis=1) & (everything < v).any(axis=1)).any()) for v in values)
    note = f"{len(values)} points of {found[0].designs} designs, {found[0].feasible} converged"
    yield Row("freeform roof, gap against waste", "dominated points", dominated, 0, note=note)
    yield Row("freeform roof, gap against waste", "points, at least", -len(values), -1)


def study_rows(folder: Path) -> Iterator[Row]:
    """The sweep's runs against the paper's figures: G0 over spacing is that of Fig 7, and over E, r and g it moves
    against the first run as docs/paper/studies says.

    A job whose drape has not converged has no G0: such runs are compared by strain and state only.
    """
    rs.sweep(ROOT / "examples" / "studies.toml", folder / "studies")
    first, *others = table(folder / "studies")
    base = _ends(folder, first)
    spaced = [row for row in others if row["layout.spacing"] != first["layout.spacing"]]
    yield from _spacing_rows({float(row["layout.spacing"]): _ends(folder, row) for row in spaced})
    lines = json.loads((ROOT / "docs/paper/studies/result.json").read_text())["lines"]
    known = {(line["changed"], f"{line['factor']:g}"): line for line in lines}
    worst, strain, rests, compared = 0.0, 0.0, 0, Counter[str]()
    for row in [row for row in (first, *others) if row not in spaced]:
        factors = {
            "E": float(row["rod.material.youngs_modulus"]) / 1e6,
            "r": float(row["rod.section.radius"]) / 1e-3,
            "g": float(row["drape.gravity"]) / 9.81,
        }
        changed = next((name for name, factor in factors.items() if abs(factor - 1) > 1e-9), "E")
        line = known[changed, f"{factors[changed]:g}"]
        strain = max(strain, abs(float(row["drape.max_strain"]) / line["strain"] - 1))
        rests += row["drape.status"] != line["rests"]
        if row["drape.status"] == "converged":
            ends = _ends(folder, row)
            moved = np.concatenate([np.subtract(ends[name], base[name]) for name in ends if name in base])
            rms, largest = float(np.sqrt(np.mean(moved**2))), float(np.abs(moved).max())
            worst = max(worst, abs(rms - line["change_rms"]), abs(largest - line["change_max"]))
            compared[changed] += 1
    name = "the paper's studies of E, r and g"
    note = f"{', '.join(f'{count} of {of}' for of, count in compared.items())}, whose drape converged"
    yield Row(name, "change of G0 off docs/paper/studies", 1e3 * worst, 1e-3, "mm", note)
    yield Row(name, "runs compared, at least", -compared.total(), -7)
    yield Row(name, "largest strain, relative", strain, 1e-5, note="12 runs")
    yield Row(name, "states of rest that differ", rests, 0, note="12 runs")


def _ends(folder: Path, row: dict[str, str]) -> dict[str, tuple[float, float]]:
    """G0 of a run: where each rod ends."""
    results = rs.read(folder / "studies" / "archives" / row["job"]).results
    return {rod.id: (rod.start, rod.end) for rod in results.rods}


def _spacing_rows(found: dict[float, dict[str, tuple[float, float]]]) -> Iterator[Row]:
    """G0 by spacing [m]."""
    name = "the paper's study of spacing"
    drapes = json.loads((ROOT / "docs/paper/fig7/result.json").read_text())["drapes"]
    known = {
        drape["spacing"]: {rod["id"]: (rod["start"], rod["end"]) for rod in drape["rods"]}
        for drape in drapes
        if drape["method"] == "gravity"
    }
    yield Row(name, "runs and rods that are not those", float(_names(found) != _names(known)), 0)
    apart = [np.subtract(end, known[spacing][rod]) for spacing, ends in found.items() for rod, end in ends.items()]
    note = f"{len(apart)} rods at {', '.join(f'{1e3 * spacing:g}' for spacing in found)} mm"
    yield Row(name, "ends of G0 off docs/paper/fig7", 1e3 * float(np.abs(apart).max()), 1e-3, "mm", note)


def _names(ends: dict[float, dict[str, tuple[float, float]]]) -> dict[float, set[str]]:
    return {spacing: set(rods) for spacing, rods in ends.items()}


def all_rows(designs: int, only: str | None) -> Iterator[Row]:
    parts: dict[str, Callable[[Path], Iterator[Row]]] = {
        "engines": engine_rows,
        "faults": fault_rows,
        "studies": study_rows,
        "front": front_rows,
        "kills": lambda folder: killed_rows(folder, min(designs, 1000)),
        "many": lambda folder: many_rows(folder, designs),
    }
    for name, rows in parts.items():
        if only in (None, name):
            with tempfile.TemporaryDirectory() as folder:
                yield from rows(Path(folder))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=10_000, help="of the large sweep; a tenth of a second each")
    parser.add_argument("--only", help="engines, faults, studies, front, kills or many")
    given: Any = parser.parse_args()
    return print_table("sweep", all_rows(given.designs, given.only))


if __name__ == "__main__":
    sys.exit(main())
