"""Processes that are killed: what they leave in a result folder that a user keeps files in, too."""

import os
import signal
import subprocess
import sys
import time
import uuid
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rodshell.errors import RodshellError
from rodshell.results import read
from rodshell.results.manifest import mark, read_manifest

CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -signal.SIGKILL}
PROGRAM = "from rodshell.cli import entry; entry()"
FOUND = (0, 4)  # built or not: that is not the question here
MARK = "RODSHELL_TEST"
OLD, NEW = "the old one", "the new one"


@dataclass(frozen=True)
class Job:
    """A command that writes its result to --out; `old` and `new` options tell two results of it apart."""

    name: str
    arguments: tuple[str, ...]
    old: tuple[str, ...] = ("--drawings.project", OLD)
    new: tuple[str, ...] = ("--drawings.project", NEW, "--spacing", "55mm")


SMALL = (
    "form", "hemisphere", "--rods", "7x7", "--spacing", "60mm", "--edge", "20mm", "--length", "900mm",
    "--drawings.files", "all",
)  # fmt: skip
JOBS = {
    "bound": Job("bound", SMALL),
    "gravity": Job("gravity", (*SMALL, "--method", "gravity")),
    "paper": Job("paper", (*SMALL, "--method", "paper", "--drape.drag", "5")),
}
CASE = """[target]
kind = "hemisphere"
[layout]
rods = [5, 5]
spacing = {spacing}
edge = 0.04
length = 0.9
[drawings]
project = "{project}"
files = "all"
"""
LOADS = """[[loads]]
name = "snow"
kind = "snow"
value = "0.01 kN/m2"
[[combinations]]
name = "winter"
factors = {{ snow = 1.0 }}
"""


def jobs_of_files(folder: Path) -> dict[str, Job]:
    """The commands that begin with a case or an earlier result, which are written into `folder`."""
    folder.mkdir(parents=True)
    (folder / "loads.toml").write_text(LOADS.format())
    for name, spacing, word in (("old", 0.08, OLD), ("new", 0.075, NEW)):
        (folder / f"{name}.toml").write_text(CASE.format(spacing=spacing, project=word))
    cases = ((str(folder / "old.toml"),), (str(folder / "new.toml"),))
    run(Job("source", ("form",)), cases[0], folder / "source")
    projects = tuple(("--drawings.files", "all", "--drawings.project", word) for word in (OLD, NEW))
    return {
        "check": Job("check", ("check", "--loads", str(folder / "loads.toml")), *cases),
        "refine": Job("refine", ("refine", "--vary", "tails"), *cases),
        "popup": Job("popup", ("popup", str(folder / "source")), *projects),
    }


MINE = {"notes.md": "mine", "photos/site.jpg": "mine", "drawings/mine.dxf": "mine", "pictures/stage_left.png": "mine"}


@dataclass
class Faults:
    """What must not happen, counted."""

    foreign: int = 0
    torn: int = 0
    left: int = 0
    ends: int = 0
    children: int = 0
    notes: list[str] = field(default_factory=list)


def start(*arguments: str, folder: Path, token: str) -> "subprocess.Popen[str]":
    """A process of the command line that obeys Ctrl-C, as one in a terminal does."""
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *arguments, "--out", str(folder)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, MARK: token},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


def run(job: Job, options: tuple[str, ...], folder: Path) -> dict[str, float]:
    """The job, whole; the seconds of each of its stages, of which "" is the start."""
    process, lasted, stage, begun = start(*job.arguments, *options, folder=folder, token=""), {}, "", time.monotonic()
    assert process.stderr is not None
    for line in process.stderr:
        lasted[stage] = time.monotonic() - begun
        stage, begun = line.removeprefix("rodshell:").strip(), time.monotonic()
    lasted[stage] = time.monotonic() - begun
    if process.wait() not in FOUND:
        raise RuntimeError(f"{job.name} ended with {process.returncode}: {stage}")
    return {stage: seconds for stage, seconds in lasted.items() if not stage.startswith("NOT")}


def kill(job: Job, folder: Path, how: signal.Signals, stage: str, after: float, faults: Faults) -> str | None:
    """Start the new job in the old one's folder and kill it so long after a stage began; which result is there then.

    None where the job was over before.
    """
    before, token = snapshot(folder), uuid.uuid4().hex
    process = start(*job.arguments, *job.new, folder=folder, token=token)
    assert process.stderr is not None
    for line in process.stderr if stage else ():
        if line == f"rodshell: {stage}\n":
            break
    time.sleep(after)
    process.send_signal(how)
    said = process.communicate(timeout=60)[1]
    seen = project(folder)
    code, where = process.returncode, f"{job.name}, {how.name} {after:.3f} s into {stage or 'the start'}"
    if code in FOUND and seen == NEW:
        return None
    words = said.splitlines()
    late = seen == NEW and words[-1:] == [f"rodshell: interrupted: the new result in {folder} is complete"]
    spoken = (late or words[-1:] == ["rodshell: interrupted"]) and all(word.startswith("rodshell: ") for word in words)
    if code != CODES[how] or not (spoken or how is signal.SIGKILL):
        faults.ends += 1
        faults.notes.append(f"{where}: exit code {code}, said {said!r}")
    if seen not in (OLD, NEW):
        faults.torn += 1
        faults.notes.append(f"{where}: {seen}")
    if how is not signal.SIGKILL and seen == OLD and snapshot(folder) != before:
        faults.left += 1
        faults.notes.append(f"{where}: {sorted(snapshot(folder).keys() ^ before.keys())} left")
    faults.foreign += foreign_touched(folder)
    faults.children += orphans(token)
    return seen


def lay_foreign_files(folder: Path) -> None:
    """What a user keeps in a result folder."""
    for name, text in MINE.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def foreign_touched(folder: Path) -> int:
    """Files of the user that are changed or gone."""
    return sum(not (folder / name).is_file() or (folder / name).read_text() != text for name, text in MINE.items())


def snapshot(folder: Path) -> dict[str, bytes | None]:
    """Every file and folder, hidden ones too."""
    return {str(one.relative_to(folder)): one.read_bytes() if one.is_file() else None for one in folder.rglob("*")}


def project(folder: Path) -> str:
    """Which of the two results is there, if all that can be read of it belongs together; else what is wrong."""
    try:
        archive = read(folder)
    except RodshellError as error:
        return str(error)
    name = str(archive.results.plain()["drawings"]["project"])
    if "[drawings]" in archive.case_toml and f'project = "{name}"' not in archive.case_toml:  # a table has none
        return f"result.json is of {name}, case.toml is not"
    ends = np.array(archive.results.plain()["footprint"])
    flat = archive.states["flat"]
    if not np.isin(np.round(ends[:, 0], 9), np.round(flat[:, 0], 9)).all():
        return f"result.json is of {name}, states.npz is not"
    return name


def left_over(folder: Path) -> list[str]:
    """Names that neither the manifest nor the user knows, and files that are not as the manifest says."""
    listed = read_manifest(folder)
    known = {*listed, *MINE, "manifest.json"}
    strange = [name for name, content in snapshot(folder).items() if content is not None and name not in known]
    strange += [one.name for one in folder.parent.iterdir() if one != folder and one.name.startswith(".")]
    strange += [str(one.relative_to(folder)) for one in folder.rglob("*") if one.is_dir() and not any(one.iterdir())]
    return strange + [name for name, entry in listed.items() if mark(folder, name) != entry]


def orphans(token: str) -> int:
    """Living processes that descend from one that was started with `token`."""
    time.sleep(0.05)
    count = 0
    for process in Path("/proc").glob("[0-9]*"):
        try:
            mine = f"{MARK}={token}".encode() in (process / "environ").read_bytes()
            count += mine and (process / "stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
        except OSError:
            continue
    return count
