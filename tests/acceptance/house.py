"""Prints the acceptance table of the second drawing: `python -m tests.acceptance.house [FOLDER]`; exit 1 on a miss.

Nothing that worked before it is lost: ten jobs run by the sources of an earlier commit, read from the history, and by
those at hand give the same results; the earlier results open, are exported and run again; what users get wrong is
refused in one sentence. Everything is kept in FOLDER, if given, and what the earlier program
found is not computed again.
"""

import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests.acceptance.house_figures import BEFORE, ROOT, figures
from tests.acceptance.misuses import MISUSES, case_fault, option_fault, python_fault
from tests.acceptance.rows import Row, print_table
from tests.acceptance.same_results import result_differences, state_difference

PROGRAM = "import sys; from rodshell.cli import main; sys.exit(main(sys.argv[1:]))"
FOUND = (0, 4)  # built or not: that is not the question here
FORMULA = "2.2*exp(-((x - 2.2)^2 + y^2)/4.5) + 1.8*exp(-((x + 2.2)^2 + y^2)/4.5)"
GFRP = ("--rod.section.kind", "tube", "--rod.section.radius", "8 mm", "--rod.section.thickness", "2.5 mm",
        "--rod.material.preset", "gfrp")  # fmt: skip
LATH = ("--rod.section.kind", "rectangle", "--rod.section.width", "1 mm", "--rod.section.height", "3 mm")
JOBS: dict[str, tuple[str, ...]] = {
    "hemisphere": ("form", "hemisphere"),
    "ellipsoid": ("form", "ellipsoid", "--rotate", "45 deg", "--rods", "auto", "--length", "auto"),
    "bumps": ("form", "heightfield", "--formula", FORMULA, "--target.radius", "5", "--spacing", "0.8", "--edge", "0.2",
              *GFRP, "--checks.stages", "0"),
    "freeform": ("form", "{data}/freeform.obj", "--unit", "mm", "--spacing", "0.9"),
    "oculus": ("form", "{data}/tent.obj", "--unit", "mm", "--spacing", "0.6", "--anchor", "0,0"),
    "patches": ("form", "hemisphere", "--seams.lines", "-1,-1; 1,1"),
    "laths": ("form", "hemisphere", *LATH, "--joint.kind", "pin"),
    "gravity": ("form", "hemisphere", "--method", "gravity"),
    "table": ("popup", "{before}/hemisphere/schedule/rods.csv"),
    "fall": ("form", "hemisphere", "--method", "paper", "--spacing", "0.05", "--rods", "9x9", "--edge", "0.0125"),
}  # fmt: skip
KINDS = "dxf,svg,pdf,csv,obj,gltf,vtp,compas,png,report,3dm"
SUFFIXES = (
    ".dxf",
    ".svg",
    ".pdf",
    ".csv",
    ".obj",
    ".gl*",
    ".vtp",
    ".json",
    ".png",
    ".html",
    ".3dm",
)  # one of each kind
SYMMETRIC = ("hemisphere", "ellipsoid", "patches", "laths", "gravity", "fall")  # jobs whose shells have mirror images
DERIVED = 1e-10  # positions to 1e-16 of the size make strains of 1e-13, which stiff edges turn into stress
POSITIONS = 1e-12  # of the size: the same operations in the same order


def run(source: Path, folder: Path, *arguments: str) -> int:
    """The exit code of a command of the program in `source`, run in `folder` without the user's settings of threads."""
    environment = os.environ | {"PYTHONPATH": str(source), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", PROGRAM, *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode not in FOUND:
        print(done.stderr.strip()[-400:], file=sys.stderr)
    return done.returncode


def earlier_source(folder: Path, commit: str = BEFORE) -> Path:
    """The checkout of an earlier commit in `folder`."""
    if not folder.exists():
        done = subprocess.run(["git", "archive", commit, "src", "examples"], cwd=ROOT, capture_output=True, check=False)
        if done.returncode:
            raise SystemExit(f"this checkout has no history back to {commit}: clone it with its history")
        with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
            archive.extractall(folder, filter="data")
    return folder


def find(source: Path, name: str, folder: Path, work: Path) -> bool:
    """Job `name` run by the program in `source`, into folder/name; whether there is a result."""
    places = {"data": str(work / "source/examples/data"), "before": str(work / "before")}
    arguments = [argument.format(**places) for argument in JOBS[name]]
    folder.mkdir(parents=True, exist_ok=True)
    out = ("--out", str(folder / name), "--only", "csv", "--force", "--quiet")
    return run(source, folder, *arguments, *out) in FOUND


def result_rows(name: str, work: Path) -> Iterator[Row]:
    """A job before and after: positions in space, and every field of result.json."""
    before, after = work / "before" / name, work / "after" / name
    if not (before / "result.json").exists() and not find(work / "source/src", name, work / "before", work):
        raise SystemExit(f"the sources of {BEFORE} find no {name}")
    found = find(ROOT / "src", name, work / "after", work)
    yield Row(name, "jobs without a result", float(not found), 0)
    if not found:
        return
    yield from state_rows(name, before, after)
    differences = result_differences(before, after, symmetric=name in SYMMETRIC)
    note = "; ".join(map(str, differences[:3]))
    yield Row(name, "fields of result.json that differ", len(differences), 0, note=note)


def state_rows(case: str, before: Path, after: Path) -> Iterator[Row]:
    """The arrays of states.npz, over the size."""
    target = json.loads((before / "result.json").read_text()).get("target") or {}
    apart = state_difference(before, after, target.get("reference_size") or 1.0)
    yield Row(case, "positions apart, of the size", apart.positions, POSITIONS)
    yield Row(case, "curvature and stress apart, of the largest", apart.derived, DERIVED)
    yield Row(case, "arrays that only one of both has", len(apart.unlike), 0, note=", ".join(apart.unlike))


def archive_rows(name: str, work: Path) -> Iterator[Row]:
    """A result of the earlier program: every kind of file made from it, and run again from what it holds."""
    before, exported, again = work / "before" / name, work / "exported" / name, work / "again" / name
    case = f"{name}, earlier result"
    code = run(ROOT / "src", work, "export", str(before), "--only", KINDS, "--out", str(exported), "--force", "--quiet")
    yield Row(case, "exit code of export", code, 0)
    missing = [suffix for suffix in SUFFIXES if not any(exported.rglob(f"*{suffix}"))]
    yield Row(case, "kinds of files not exported", len(missing), 0, note=" ".join(missing))
    arguments = ("popup", str(before)) if JOBS[name][0] == "popup" else ("form", str(before / "case.toml"))
    code = run(ROOT / "src", work, *arguments, "--out", str(again), "--only", "csv", "--force", "--quiet")
    yield Row(case, "not run again", float(code not in FOUND), 0)
    if code in FOUND:
        yield from state_rows(f"{case}, run again", before, again)


def misuse_rows(work: Path) -> Iterator[Row]:
    """What users get wrong, at each door."""
    folder = work / "misuse"
    folder.mkdir(parents=True, exist_ok=True)
    for misuse in MISUSES:
        for door, fault in (
            ("Python", python_fault(misuse)),
            ("case file", case_fault(misuse, folder)),
            ("option", option_fault(misuse, folder)),
        ):
            yield Row(misuse.what, f"not refused in one sentence, {door}", float(bool(fault)), 0, note=fault)


def tree_rows() -> Iterator[Row]:
    """Circles of imports, and types that are defined twice."""
    after = figures(ROOT / "src" / "rodshell")
    yield Row("source tree", "files in circles of imports", sum(map(len, after.circles)), 0)
    yield Row("source tree", "definitions of array types outside arrays", after.array_aliases, 0)


def all_rows(work: Path) -> Iterator[Row]:
    earlier_source(work / "source")
    for name in JOBS:
        yield from result_rows(name, work)
    for name in JOBS:
        yield from archive_rows(name, work)
    yield from misuse_rows(work)
    yield from tree_rows()


def main(arguments: list[str]) -> int:
    if arguments:
        return print_table("house", all_rows(Path(arguments[0]).resolve()))
    with tempfile.TemporaryDirectory() as folder:
        return print_table("house", all_rows(Path(folder)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
