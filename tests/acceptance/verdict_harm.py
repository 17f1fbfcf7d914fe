"""Harm: foreign files, kills, mount points, read-only installations."""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import rodshell
from tests.acceptance.kills import (
    FOUND,
    JOBS,
    NEW,
    OLD,
    PROGRAM,
    SMALL,
    Faults,
    Job,
    foreign_touched,
    kill,
    lay_foreign_files,
    left_over,
    project,
    run,
    snapshot,
)  # fmt: skip
from tests.acceptance.rows import Row

KILLS = 20  # of each method
SEED = 20261122


def rows() -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as folder:
        yield from foreign_rows(Path(folder) / "foreign")
        for job in JOBS.values():
            yield from kill_rows(job, Path(folder) / job.name)
        yield from mount_rows(Path(folder) / "mount")
        yield from read_only_rows(Path(folder) / "read-only")


def ended(*arguments: str, **options: object) -> "subprocess.CompletedProcess[str]":
    """The command line's process, over."""
    command = [sys.executable, "-c", PROGRAM, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)  # type: ignore[call-overload,no-any-return]


def foreign_rows(folder: Path) -> Iterator[Row]:
    """A second run beside the user's files, and refusals before the work."""
    case, dome = "foreign files", folder / "dome"
    run(JOBS["bound"], JOBS["bound"].old, dome)
    lay_foreign_files(dome)
    run(JOBS["bound"], JOBS["bound"].new, dome)
    yield Row(case, "second run: files of others touched", foreign_touched(dome), 0)
    yield Row(case, "second run: left over, or not listed", len(left_over(dome)), 0)
    copy = folder / "copy"
    copy.mkdir()
    shutil.copy(dome / "result.json", copy)
    changed = shutil.copytree(dome, folder / "changed")
    (changed / "drawings/plan.dxf").write_text("mine")
    older = shutil.copytree(dome, folder / "older")
    (older / "manifest.json").unlink()
    for what, place in (("copied result.json", copy), ("changed drawing", changed), ("no manifest", older)):
        before = snapshot(place)
        done = ended(*SMALL, "--out", str(place))
        wrong = done.returncode != 2 or "--force" not in done.stderr or "rodshell: net" in done.stderr
        yield Row(case, f"{what}: not refused before the work", float(wrong), 0, note=done.stderr.strip()[:60])
        yield Row(case, f"{what}: touched", float(snapshot(place) != before), 0)
        exported = ended("export", str(dome), "--out", str(place), "--only", "dxf") if place == changed else None
        if exported is not None:
            yield Row(case, f"{what}: export not refused", float(exported.returncode != 2), 0)
        forced = ended(*SMALL, "--out", str(place), "--force", "--only", "dxf,csv", "--quiet")
        yield Row(case, f"{what}: not replaced by --force", float(forced.returncode not in FOUND), 0)


def kill_rows(job: Job, folder: Path, kills: int = KILLS) -> Iterator[Row]:
    """KILL, TERM and INT in turn, every other one while files are written; after each the next run."""
    faults, chance = Faults(), random.Random(f"{SEED} {job.name}")
    dome, pristine = folder / "dome", folder / "kept/pristine"
    run(job, job.old, pristine)
    lay_foreign_files(pristine)
    lasts = run(job, job.new, folder / "kept/timed")
    seen, tries = {OLD: 0, NEW: 0}, 0
    while sum(seen.values()) < kills and tries < 3 * kills:
        shutil.rmtree(dome, ignore_errors=True)
        shutil.copytree(pristine, dome)
        how = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)[sum(seen.values()) % 3]
        stage = "files" if tries % 2 else chance.choice(list(lasts))
        tries += 1
        found = kill(job, dome, how, stage, chance.random() * lasts[stage], faults)
        if found is None:
            continue
        seen[found] = seen.get(found, 0) + 1
        if ended("export", str(dome), "--only", "csv", "--quiet").returncode != 0 or project(dome) != found:
            faults.torn += 1
            faults.notes.append(f"{how.name} in {stage}: the next run does not find the same result")
        if left := left_over(dome):
            faults.left += 1
            faults.notes.append(f"{how.name} in {stage}: {left[:3]} left")
        faults.foreign += foreign_touched(dome)
    for word in faults.notes:
        print("  ", word, flush=True)
    case, note = f"{kills} kills, {job.name}", f"{seen[OLD]} old, {seen[NEW]} new; {tries - kills} were over before"
    yield Row(case, "kills that did not come in time", kills - sum(seen.values()), 0, note=note)
    yield Row(case, "files of others touched", faults.foreign, 0)
    yield Row(case, "torn", faults.torn, 0)
    yield Row(case, "left over after the next run", faults.left, 0)
    yield Row(case, "wrong exit code, or not one line", faults.ends, 0)
    yield Row(case, "orphans", faults.children, 0)


def mount_rows(folder: Path) -> Iterator[Row]:
    """The result folder is a mount point, and its parent is read-only."""
    out = folder / "out"
    out.mkdir(parents=True)
    command = f'"{sys.executable}" -c "{PROGRAM}" {" ".join(SMALL)} --out "{out}" --quiet --only csv'
    script = (
        f'mount --bind "{folder}" "{folder}" && mount -t tmpfs none "{out}" && mount -o remount,bind,ro "{folder}" && '
        f'echo mine > "{out}/notes.md" && {command} && {command} && cat "{out}/notes.md" && ls -A "{out}"'
    )
    done = subprocess.run(["unshare", "-m", "sh", "-c", script], capture_output=True, text=True, check=False)
    if "mount" in done.stderr or "unshare" in done.stderr:
        yield Row("mount point", "not tried: mounting is not allowed here", 1, 0, note=done.stderr.strip()[:60])
        return
    names = {"mine", "notes.md", "manifest.json", "result.json", "states.npz", "case.toml", "schedule"}
    yield Row("mount point", "two runs: failed", done.returncode, 0, note=done.stderr.strip()[:60])
    yield Row("mount point", "files more or less than written", len(set(done.stdout.split()) ^ names), 0)


def read_only_rows(folder: Path) -> Iterator[Row]:
    """A read-only installation and no home: as nobody, or, where that is not possible, refused rights."""
    source = folder / "installation"
    shutil.copytree(Path(rodshell.__file__).parent, source / "rodshell", ignore=shutil.ignore_patterns("__pycache__"))
    out = folder / "out"
    out.mkdir()
    for one in (folder.parent, folder, source, *source.rglob("*")):
        one.chmod(one.stat().st_mode | 0o555 if one.is_dir() else 0o444)
    out.chmod(0o777)
    nobody = ["setpriv", "--reuid=65534", "--clear-groups"] if os.getuid() == 0 else []
    kept = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    environment = {**kept, "HOME": "/nonexistent", "PYTHONPATH": str(source), "PYTHONDONTWRITEBYTECODE": "1"}
    few = ("--rods", "5x5", "--spacing", "80mm", "--edge", "40mm", "--length", "700mm", "--checks.stages", "0")
    command = [*nobody, sys.executable, "-c", PROGRAM, "form", "hemisphere", *few, "--only", "csv"]
    done = subprocess.run(
        [*command, "--out", str(out / "dome")], capture_output=True, text=True, check=False, env=environment, cwd=out
    )
    lines = [line for line in done.stderr.splitlines() if "compil" in line]
    yield Row("read-only installation", "failed", done.returncode, 0, note=done.stderr.strip()[-60:])
    yield Row("read-only installation", "sentences about it, off 1", abs(len(lines) - 1), 0, note="".join(lines)[:60])
    yield Row("read-only installation", "tracebacks", done.stderr.count("Traceback"), 0)
