"""The main job with all its files beside that of an earlier commit, in pairs of runs: CPU seconds of whole processes.

The earlier commit is read from the history and run by the same interpreter, both with kernels that are compiled.
"""

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from benchmarks.rows import Row, Section
from tests.acceptance.house import earlier_source
from tests.acceptance.house_figures import BEFORE

ROOT = Path(__file__).resolve().parent.parent
JOB = "import sys; from rodshell.cli import entry; sys.argv[0] = 'rodshell'; entry()"
LIMIT = 1.3


def earlier(pairs: int) -> Section:
    """`rodshell form hemisphere`, all files, now over then: the median of the pairs' ratios."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            sources = earlier_source(Path(folder) / "earlier"), ROOT
        except SystemExit as reason:
            return Section("Beside an earlier commit", str(reason), ())
        for source in sources:  # kernels are compiled
            _cpu_seconds(source, Path(folder) / "out")
        runs = [[_cpu_seconds(source, Path(folder) / "out") for source in sources] for _ in range(pairs)]
    ratios = [now / then for then, now in runs]
    then, now = (median(seconds) for seconds in zip(*runs, strict=True))
    figure = f"{median(ratios):.2f} times ({min(ratios):.2f} to {max(ratios):.2f}; {now:.2f} s and {then:.2f} s)"
    what = f"`rodshell form hemisphere`, all files, over commit {BEFORE}"
    return Section(
        "Beside an earlier commit",
        f"CPU seconds of whole processes, kernels compiled, one thread; {pairs} pairs in turn.",
        [Row(what, figure, f"at most {LIMIT}")],
    )


def _cpu_seconds(source: Path, out: Path) -> float:
    """User and system time [s] of one run with the sources in `source`/src."""
    environment = {**os.environ, "PYTHONPATH": str(source / "src")}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-c", JOB, "form", "hemisphere", "--quiet", "--force", "--out", str(out)]
    subprocess.run(command, env=environment, check=True, cwd=source)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
