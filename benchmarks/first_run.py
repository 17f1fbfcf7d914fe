"""The first run: README's first command (environment, installation, build, first job), and its job again.

    python -m benchmarks.first_run [--compiled]

--compiled installs with compiled kernels, which takes a C compiler. The checkout is a clone of this repository. Caches
are empty, as a newcomer's are, so that downloads count.
"""

import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from benchmarks.rows import Row, Section

ROOT = Path(__file__).resolve().parent.parent
Seconds = tuple[float, float]  # on the clock, of processors


@dataclass(frozen=True)
class FirstRun:
    """Seconds of the installation, with the environment and the build, and of two runs, and the installed size without
    bytecode [MB]."""

    install: Seconds
    first: Seconds
    second: Seconds
    size: float

    @property
    def whole(self) -> Seconds:
        """Of the installation and the first run."""
        return self.install[0] + self.first[0], self.install[1] + self.first[1]


def first_run(*, compiled: bool) -> FirstRun:
    """Of README's first command, and of its job again."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(source)], check=True)
        parts = command_of((source / "README.md").read_text(encoding="utf-8"))
        if compiled:
            at = next(k for k, part in enumerate(parts) if part.startswith("pip install"))
            parts[at] = f"RODSHELL_KERNELS=compiled {parts[at]}"
        parts.append(f"{parts[-1]}-again")
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "NUMBA", "RODSHELL"))}
        caches = {name: f"{folder}/caches/{name}" for name in ("XDG_CACHE_HOME", "PIP_CACHE_DIR")}
        script = "\n".join(["at() { echo at $EPOCHREALTIME; times; }", "set -e", "at", *(f"{x}\nat" for x in parts)])
        done = subprocess.run(["bash", "-c", script], cwd=source, capture_output=True, text=True, env=kept | caches)
        if done.returncode:
            raise SystemExit(f"README's command ended with {done.returncode}:\n{done.stderr}")
        *install, first, second = _seconds(done.stdout)
        packages = next((source / ".venv" / "lib").glob("python*/site-packages"))
        files = (path for path in packages.rglob("*") if path.is_file() and "pip" not in path.parts)
        size = sum(path.stat().st_size for path in files if path.suffix != ".pyc")  # what wheels hold
        clock, processors = (sum(part) for part in zip(*install, strict=True))
        return FirstRun((clock, processors), first, second, size / 1e6)


def command_of(readme: str) -> list[str]:
    """The parts of its first command, which are joined by `&&`."""
    return str(re.findall(r"```sh\n(.*?)\n```", readme, re.DOTALL)[0]).split(" && ")


def _seconds(said: str) -> list[Seconds]:
    """Of each part of the command: between the lines of `at`, each the time, then that of bash and of its children."""
    clocks, used = list[float](), list[float]()
    for line, of_children in re.findall(r"^at (\S+)\n.*\n(.*)$", said, re.MULTILINE):
        clocks.append(float(line))
        used.append(sum(60 * float(m) + float(s) for m, s in re.findall(r"(\d+)m([\d.]+)s", of_children)))
    ends = zip(clocks[1:], used[1:], strict=True)
    return [(clock - clocks[k], one - used[k]) for k, (clock, one) in enumerate(ends)]


def section(*, compiled: bool = False) -> Section:
    """README's first command: environment, installation, build, first job; then the job again. Caches are empty.
    Seconds on the clock (of processors)."""
    now, how = first_run(compiled=compiled), ", with compiled kernels" * compiled
    rows = [
        Row(f"README's first command{how}", _both(now.whole)),
        Row("   its installation", _both(now.install)),
        Row("   its first run", _both(now.first)),
        Row("   the run again", _both(now.second)),
        Row(f"first run over the second{how}, on the clock", f"{now.first[0] / now.second[0]:.2f}",
            "at most 1.4" if compiled else ""),
        Row(f"installed size{how}, without bytecode", f"{now.size:.0f} MB"),
    ]  # fmt: skip
    return Section(f"First run{how}", " ".join((section.__doc__ or "").split()), rows)


def _both(seconds: Seconds) -> str:
    return f"{seconds[0]:.1f} s ({seconds[1]:.1f} s)"


if __name__ == "__main__":
    for row in section(compiled="--compiled" in sys.argv).rows:
        print(f"{row.what}: {row.figure}" + f"   [{row.asked}]" * bool(row.asked))
