"""Whole commands beside those of earlier commits, in pairs of runs: CPU seconds of whole processes.

An earlier commit is read from the history and run by the same interpreter, both with kernels that are compiled.
"""

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from itertools import count
from pathlib import Path
from statistics import median

from benchmarks.rows import Row, Section
from tests.acceptance.house import earlier_source
from tests.acceptance.house_figures import BEFORE

ROOT = Path(__file__).resolve().parent.parent
FIRST = "1075d4c"  # the last commit before kernels were compiled ahead and drawings laid out once
JOB = "import sys; from {package}.cli import entry; sys.argv[0] = 'rodshell'; entry()"
BARE = "import numpy, scipy.sparse"
FORM = ("form", "hemisphere")
FEW = ("--only", "csv", "--checks.stages", "0")
ALL_FILES, TABLES, AGAIN = (
    "`form hemisphere`, all files",
    f"the same with `{' '.join(FEW)}`",
    "`export`, all files again",
)
COMMANDS = {ALL_FILES: FORM, TABLES: (*FORM, *FEW), AGAIN: ("export", "{result}")}
LIMITS = ((BEFORE, ALL_FILES, "at most 1.3"), (FIRST, ALL_FILES, ""), (FIRST, TABLES, ""), (FIRST, AGAIN, ""))
OF_BARE = {ALL_FILES: "at most 8", TABLES: "at most 3"}


def earlier(pairs: int) -> Section:
    """Commands now over then, and over `BARE`: medians of the ratios of runs that follow each other."""
    rows, title = list[Row](), "Compared with earlier commits"
    with tempfile.TemporaryDirectory() as folder:
        for commit, what, asked in LIMITS:
            try:
                sources = earlier_source(Path(folder) / commit, commit), ROOT
            except SystemExit as reason:
                return Section(title, str(reason), ())
            for source in sources:  # kernels are compiled; a result is there to be exported
                _run(source, COMMANDS[ALL_FILES], Path(folder), f"result-{source.name}")
            runs = [
                (*(_run(source, COMMANDS[what], Path(folder)) for source in sources), _cpu_seconds(ROOT, BARE))
                for _ in range(pairs)
            ]
            ratios = [now / then for then, now, _ in runs]
            then, now, _ = (median(seconds) for seconds in zip(*runs, strict=True))
            figure = (
                f"{median(ratios):.2f} times ({min(ratios):.2f} to {max(ratios):.2f}; {now:.2f} s and {then:.2f} s)"
            )
            rows.append(Row(f"{what}, over commit {commit}", figure, asked))
            if commit == FIRST:
                ours, theirs = (median(run[k] / run[2] for run in runs) for k in (1, 0))
                figure = f"{ours:.1f} times; of commit {commit} {theirs:.1f}"
                rows.append(Row(f"{what}, over `{BARE}`", figure, OF_BARE.get(what, "")))
    said = f"CPU seconds of whole processes, kernels compiled, one thread; {pairs} pairs in turn."
    return Section(title, said, rows)


_NUMBERS = count()


def _run(source: Path, words: Sequence[str], folder: Path, name: str = "") -> float:
    """Time [s] of a command of the program in `source`, into a new folder, or that of a name if it is not there."""
    out = folder / (name or f"out-{next(_NUMBERS)}")
    if out.exists():
        return 0.0
    (package,) = (path.name for path in (source / "src").iterdir() if (path / "__init__.py").exists())
    about = source / "src" / f"{package}-0.dist-info" / "METADATA"
    if source != ROOT and not about.exists():  # it asks for its version
        about.parent.mkdir()
        about.write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 0\n")
    arguments = [word.format(result=folder / f"result-{source.name}") for word in words]
    return _cpu_seconds(source, JOB.format(package=package), [*arguments, "--out", str(out)])


def _cpu_seconds(source: Path, code: str, arguments: Sequence[str] = ()) -> float:
    """User and system time [s] of one run with the sources in `source`/src."""
    environment = {**os.environ, "PYTHONPATH": str(source / "src")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-c", code, *arguments]
    subprocess.run(command, env=environment, check=True, cwd=source, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
