"""The first run: installation, build and first job in a new environment, beside those of an earlier commit.

    python -m benchmarks.first_run [--jit] [--commit COMMIT]

--jit installs without compiled kernels, as where there is no C compiler. Each checkout is a clone of this repository;
pip uses its cache, so that nothing is timed that comes over the network once it has been fetched.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
import venv
from dataclasses import dataclass
from pathlib import Path

from benchmarks.rows import Row, Section

ROOT = Path(__file__).resolve().parent.parent
EARLIER = "1075d4c"


@dataclass(frozen=True)
class FirstRun:
    """Seconds on the clock and of processors of the installation and of two runs, and the installed size [MB]."""

    install: tuple[float, float]
    first: tuple[float, float]
    second: tuple[float, float]
    size: float

    @property
    def whole(self) -> float:
        """Seconds on the clock of the installation and the first run."""
        return self.install[0] + self.first[0]


def first_run(commit: str, command: str, *, jit: bool = False) -> FirstRun:
    """Of `COMMAND form hemisphere`, all files, with a commit installed into a new environment."""
    with tempfile.TemporaryDirectory() as folder:
        source, scripts = Path(folder) / "source", Path(folder) / "venv" / "bin"
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(source)], check=True)
        subprocess.run(["git", "checkout", "--quiet", commit], check=True, cwd=source)
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "NUMBA", "RODSHELL"))}
        environment = {
            **kept,
            "XDG_CACHE_HOME": folder,
            "PIP_CACHE_DIR": _pip_cache(),
            "PATH": f"{scripts}:{kept['PATH']}",
        }
        environment |= {"RODSHELL_KERNELS": "jit"} if jit else {}

        def timed(*words: str) -> tuple[float, float]:
            clock, before = time.perf_counter(), os.times()
            subprocess.run(words, check=True, cwd=folder, env=environment, capture_output=True)
            after = os.times()
            processors = after.children_user + after.children_system - before.children_user - before.children_system
            return time.perf_counter() - clock, processors

        begin = time.perf_counter()
        venv.create(scripts.parent, with_pip=True)
        made = time.perf_counter() - begin
        clock, processors = timed(str(scripts / "pip"), "install", "--quiet", str(source))
        job = (str(scripts / command), "form", "hemisphere", "--quiet", "--force", "--out", "out")
        packages = next((scripts.parent / "lib").glob("python*/site-packages"))
        size = sum(path.stat().st_size for path in packages.rglob("*") if path.is_file() and "pip" not in path.parts)
        return FirstRun((made + clock, processors), timed(*job), timed(*job), size / 1e6)


def _pip_cache() -> str:
    asked = [sys.executable, "-m", "pip", "cache", "dir"]
    return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()


def section(*, jit: bool = False, earlier: str = EARLIER) -> Section:
    """Environment, installation, build, first and second `form hemisphere`, all files; an earlier commit first."""
    then, now = first_run(earlier, "gridshell"), first_run("HEAD", "rodshell", jit=jit)
    how = "without a compiler" if jit else "with a compiler"
    rows = [
        Row(f"installation and first run, {how}, on the clock, over commit {earlier}", f"{now.whole / then.whole:.2f}",
            "at most 0.75" if jit else "at most 0.7"),
        Row(f"first run, {how}, on the clock, over commit {earlier}", f"{now.first[0] / then.first[0]:.2f}",
            "at most 0.6" if jit else ""),
        Row(f"first run over the second, {how}, on the clock", f"{now.first[0] / now.second[0]:.2f}",
            "" if jit else "at most 1.4"),
        Row(f"installed size, {how}, over commit {earlier}", f"{now.size / then.size:.2f}",
            "" if jit else "at most 0.6"),
        *(Row(f"   {name}: installation, first, second run; size",
              f"{_both(run.install)}, {_both(run.first)}, {_both(run.second)} s; {run.size:.0f} MB")
          for name, run in ((f"commit {earlier}", then), ("now", now))),
    ]  # fmt: skip
    return Section("First run", f"{section.__doc__} Seconds on the clock (of processors).", rows)


def _both(seconds: tuple[float, float]) -> str:
    return f"{seconds[0]:.1f} ({seconds[1]:.1f})"


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--jit", action="store_true")
    parser.add_argument("--commit", default=EARLIER)
    given = parser.parse_args()
    for row in section(jit=given.jit, earlier=given.commit).rows:
        print(f"{row.what}: {row.figure}" + f"   [{row.asked}]" * bool(row.asked))
