"""Start-up: whole processes against the bare imports that they cannot do without, and where the time goes.

    python -m benchmarks.startup [--fresh] [--cpu]

--fresh installs the checkout into a new environment first; --cpu counts time of processors, those of child processes
included, instead of time on the clock: for machines that do other work.

The solve is the form finding alone, in a process that has imported nothing yet (so with kernels read from disk); the
checks are the deployment from flat, solves too, which the command does and `rs.find_form` does not.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from statistics import median

from benchmarks.rows import Row, Section, ms

RUNS = 5
ROOT = Path(__file__).parent.parent
QUICK = ("--only", "csv,svg,obj,report", "--checks.stages", "0")  # what a designer looks at first
FRONT = "typer" if find_spec("typer") else "click"  # of which command lines are made
BARE = "import numpy, scipy.sparse"
STAGES = """
import gc, json, tempfile, time
clock = time.process_time if CPU else time.perf_counter
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
from rodshell.output.files import Content, DEFAULT, KINDS, save
content = Content(archive)
content.drawings
told("drawings")
for kind in DEFAULT:
    list(KINDS[kind](content))
    told(kind)
with tempfile.TemporaryDirectory() as folder:
    save(archive, folder + "/a", [])
told("archive")
print(json.dumps(stages))
"""


@dataclass(frozen=True)
class Startup:
    """Median seconds of whole processes (`form` with every default file, with few), of what they are measured by,
    and of each stage within one process."""

    whole: float
    quick: float
    bare: float
    help: float
    front: float
    stages: dict[str, float]

    @property
    def solve(self) -> float:
        return self.stages["solve"]

    @property
    def share(self) -> float:
        """Whole process / (bare imports + solve), every default file written."""
        return self.whole / (self.bare + self.solve)

    @property
    def ratio(self) -> float:
        """(Whole process - solve) / bare imports: the stricter reading of the same sentence."""
        return (self.whole - self.solve) / self.bare

    @property
    def ratio_without_checks(self) -> float:
        """The same, the deployment counted as a solve."""
        return (self.whole - self.solve - self.stages["checks"]) / self.bare

    @property
    def quick_ratio(self) -> float:
        """The same with the files that a designer looks at first and without the deployment."""
        return (self.quick - self.solve) / self.bare


def startup(*, fresh: bool = False, cpu: bool = False, runs: int = RUNS) -> Startup:
    """Medians of `runs` processes of each kind, one kind after the other in turn."""
    staged = f"CPU = {cpu}\n{STAGES}"
    with tempfile.TemporaryDirectory() as folder:
        scripts = Path(sys.executable).parent
        if fresh:
            venv.create(Path(folder) / "venv", with_pip=True)
            scripts = Path(folder) / "venv" / "bin"
            subprocess.run([scripts / "pip", "install", "--quiet", str(ROOT)], check=True)
        form = [str(scripts / "rodshell"), "form", "hemisphere", "--quiet", "--out", f"{folder}/out"]
        python = [str(scripts / "python"), "-c"]
        commands = {
            "whole": form, "quick": [*form, *QUICK], "bare": [*python, BARE],
            "help": [str(scripts / "rodshell"), "--help"], "front": [*python, f"import {FRONT}"],
        }  # fmt: skip
        for command in commands.values():  # compiles the kernels, once
            _seconds(command, folder, cpu)
        seconds = {name: list[float]() for name in commands}
        stages = list[dict[str, float]]()
        for _ in range(runs):
            for name, command in commands.items():
                seconds[name].append(_seconds(command, folder, cpu))
            stages.append(json.loads(_output([*python, staged], folder)))
    each = {name: median(one[name] for one in stages) for name in stages[0]}
    return Startup(**{name: median(values) for name, values in seconds.items()}, stages=each)


def _seconds(command: Sequence[str], folder: str, cpu: bool) -> float:
    start = _clock(cpu)
    _output(command, folder)
    return _clock(cpu) - start


def _clock(cpu: bool) -> float:
    """Seconds on the clock, or of processors that ended children took."""
    if not cpu:
        return time.perf_counter()
    times = os.times()
    return times.children_user + times.children_system


def _output(command: Sequence[str], folder: str) -> str:
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    return subprocess.run(command, check=True, cwd=folder, capture_output=True, text=True, env=kept).stdout


def section(runs: int) -> Section:
    """Whole processes on the clock, `rodshell form hemisphere` with every default file; the solve is `rs.find_form` in
    a process that loads its kernels from disk; the checks are the deployment from flat, solves too."""
    found = startup(runs=runs)
    rows = [
        Row(f"`rodshell --help` over `python -c 'import {FRONT}'`", f"{found.help / found.front:.2f}", "at most 3"),
        Row("whole process over the bare imports of numpy and scipy.sparse and the solve", f"{found.share:.2f}",
            "at most 3"),
        Row("read strictly: (whole process - solve) over the bare imports", f"{found.ratio:.2f}", "at most 3"),
        Row("the same, the deployment counted as a solve", f"{found.ratio_without_checks:.2f}"),
        Row(f"the same with `{' '.join(QUICK)}`", f"{found.quick_ratio:.2f}"),
        Row("whole process", f"{found.whole:.2f} s; bare imports {found.bare:.2f} s"),
        *(Row(f"   {name}", ms(seconds)) for name, seconds in found.stages.items()),
    ]  # fmt: skip
    assert section.__doc__ is not None
    return Section("Start-up", section.__doc__.replace("\n    ", " "), rows)


def main(*, fresh: bool, cpu: bool) -> None:
    found = startup(fresh=fresh, cpu=cpu)
    few = f"with {' '.join(QUICK)} {found.quick:.2f} s"
    print(f"whole process {found.whole:.2f} s, {few}; bare imports {found.bare:.2f} s")
    print("stages, ms: " + ", ".join(f"{name} {1e3 * seconds:.0f}" for name, seconds in found.stages.items()))
    print(f"whole / (bare imports + solve) = {found.share:.2f}")
    print(f"(whole - solve) / bare imports = {found.ratio:.2f}, with the deployment counted as a solve ", end="")
    print(f"{found.ratio_without_checks:.2f}, with few files {found.quick_ratio:.2f}")
    print(f"rodshell --help / python -c 'import {FRONT}' = {found.help / found.front:.2f}")


if __name__ == "__main__":
    main(fresh="--fresh" in sys.argv, cpu="--cpu" in sys.argv)
