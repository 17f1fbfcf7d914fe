"""Start-up: whole processes against the bare imports that they cannot do without, and where the time goes.

    python -m benchmarks.startup [--fresh]

--fresh installs the checkout into a new environment first. Seconds are those of processors, child processes included.

The solve is the form finding alone, in a process that has imported nothing yet (so with kernels read from disk); the
checks are the deployment from flat, solves too, which the command does and `rs.find_form` does not.
"""

import json
import os
import subprocess
import sys
import tempfile
import venv
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from statistics import median

from benchmarks.rows import Row, Section, ms

RUNS = 5
ROOT = Path(__file__).parent.parent
QUICK = ("--only", "csv", "--checks.stages", "0")
FRONT = "typer" if find_spec("typer") else "click"  # of which command lines are made
BARE = "import numpy, scipy.sparse"
STAGES = """
import gc, json, tempfile, time
clock = time.process_time
stages, last = {}, clock()
def told(name):
    global last
    now = clock()
    stages[name] = stages.get(name, 0.0) + now - last
    last = now
import numpy, scipy.sparse
told("bare imports")
from rodshell.cli import RARELY
gc.set_threshold(RARELY)  # as the command does
from rodshell.case import load_case
import rodshell.cli.form
case = load_case("hemisphere")
from rodshell.job import Job
told("other imports")
form = Job.of_case(case).run(until="pop-up")
told("solve")
archive = form.archive()
told("checks")
from rodshell.output.files import ALL, KINDS, save
from rodshell.output.drawings import drawing_set
drawing_set(archive)
told("drawings")
for kind in ALL:
    list(KINDS[kind](archive))
    told(kind)
with tempfile.TemporaryDirectory() as folder:
    save(archive, folder + "/a", [])
told("archive")
print(json.dumps(stages))
"""


@dataclass(frozen=True)
class Startup:
    """Median seconds of whole processes (`form --all`, and with few files), of what they are measured by,
    and of each stage within one process."""

    whole: float
    quick: float
    bare: float
    help: float
    front: float
    stages: dict[str, float]


def startup(*, fresh: bool = False, runs: int = RUNS) -> Startup:
    """Medians of `runs` processes of each kind, one kind after the other in turn."""
    with tempfile.TemporaryDirectory() as folder:
        scripts = Path(sys.executable).parent
        if fresh:
            venv.create(Path(folder) / "venv", with_pip=True)
            scripts = Path(folder) / "venv" / "bin"
            subprocess.run([scripts / "pip", "install", "--quiet", str(ROOT)], check=True)
        form = [str(scripts / "rodshell"), "form", "hemisphere", "--quiet", "--out", f"{folder}/out"]
        python = [str(scripts / "python"), "-c"]
        commands = {
            "whole": [*form, "--all"], "quick": [*form, *QUICK], "bare": [*python, BARE],
            "help": [str(scripts / "rodshell"), "--help"], "front": [*python, f"import {FRONT}"],
        }  # fmt: skip
        for command in commands.values():  # compiles the kernels, once
            _seconds(command, folder)
        seconds = {name: list[float]() for name in commands}
        stages = list[dict[str, float]]()
        for _ in range(runs):
            for name, command in commands.items():
                seconds[name].append(_seconds(command, folder))
            stages.append(json.loads(_output([*python, STAGES], folder)))
    each = {name: median(one[name] for one in stages) for name in stages[0]}
    return Startup(**{name: median(values) for name, values in seconds.items()}, stages=each)


def _seconds(command: Sequence[str], folder: str) -> float:
    """Of processors, that the command and its children took."""
    before = os.times()
    _output(command, folder)
    after = os.times()
    return after.children_user - before.children_user + after.children_system - before.children_system


def _output(command: Sequence[str], folder: str) -> str:
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=kept)
    if done.returncode not in (0, 4):  # a shell that cannot be built is a result
        done.check_returncode()
    return done.stdout


def section(runs: int) -> Section:
    """Seconds of processors of whole processes, `rodshell form hemisphere --all`; the solve is
    `rs.find_form` in a process that loads its kernels from disk; the checks are the deployment from flat."""
    return _section(startup(runs=runs))


def _section(found: Startup) -> Section:
    rows = [
        Row(f"`rodshell --help` over `python -c 'import {FRONT}'`", f"{found.help / found.front:.2f}", "at most 3"),
        Row(f"`form hemisphere`, all files, over `{BARE}`", f"{found.whole / found.bare:.1f} ({found.whole:.2f} s)",
            "at most 8"),
        Row(f"the same with `{' '.join(QUICK)}`", f"{found.quick / found.bare:.1f} ({found.quick:.2f} s)", "at most 3"),
        *(Row(f"   {name}", ms(seconds)) for name, seconds in found.stages.items()),
    ]  # fmt: skip
    return Section("Start-up", " ".join((section.__doc__ or "").split()), rows)


if __name__ == "__main__":
    for row in _section(startup(fresh="--fresh" in sys.argv)).rows:
        print(f"{row.what}: {row.figure}" + f"   [{row.asked}]" * bool(row.asked))
