"""The first run: README's first command (environment, installation, build, first job) beside that of an earlier commit.

    python -m benchmarks.first_run [--alike] [--compiled] [--commit COMMIT]

As written, or, by --alike, both with `pip install .` and `form hemisphere`. --compiled installs with compiled kernels,
which takes a C compiler. Each checkout is a clone of this repository. Caches are empty, as a newcomer's are, so that
downloads count.
"""

import argparse
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from benchmarks.rows import Row, Section

ROOT = Path(__file__).resolve().parent.parent
EARLIER = "1075d4c"
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


def first_run(commit: str, *, alike: bool = False, compiled: bool = False) -> FirstRun:
    """Of README's first command, as it stands at a commit, and of its job again."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(source)], check=True)
        subprocess.run(["git", "checkout", "--quiet", commit], check=True, cwd=source)
        parts = command_of((source / "README.md").read_text(encoding="utf-8"))
        at = next(k for k, part in enumerate(parts) if part.startswith("pip install"))
        if alike:
            program = parts[-1].split()[0]
            parts[at], parts[-1] = "pip install .", f"{program} form hemisphere --out out/dome"
        if compiled:
            parts[at] = f"RODSHELL_KERNELS=compiled {parts[at]}"
        parts.append(f"{parts[-1]}-again")
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "NUMBA", "RODSHELL"))}
        caches = {name: f"{folder}/caches/{name}" for name in ("XDG_CACHE_HOME", "PIP_CACHE_DIR")}
        script = "\n".join(["at() { echo at $EPOCHREALTIME; times; }", "set -e", "at", *(f"{x}\nat" for x in parts)])
        done = subprocess.run(
            ["bash", "-c", script], cwd=source, capture_output=True, text=True, env=kept | caches
        )  # fmt: skip
        if done.returncode:
            raise SystemExit(f"README's command at commit {commit} ended with {done.returncode}:\n{done.stderr}")
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


def section(*, alike: bool = False, compiled: bool = False, earlier: str = EARLIER) -> Section:
    """README's first command: environment, installation, build, first job; then the job again. An earlier commit's
    first. Caches are empty. On a busy machine the clock depends on what else runs."""
    then, now = first_run(earlier, alike=alike), first_run("HEAD", alike=alike, compiled=compiled)
    how = ", both by `pip install .` and of the hemisphere" * alike + ", with compiled kernels" * compiled
    clock, processors = (ours / theirs for ours, theirs in zip(now.whole, then.whole, strict=True))
    as_written = not (alike or compiled)
    rows = [
        Row(f"README's first command{how}, on the clock, over commit {earlier}", f"{clock:.2f}",
            "at most 0.7" if as_written else ""),
        Row("   in seconds of processors", f"{processors:.2f}"),
        Row("   its installation, on the clock", f"{now.install[0] / then.install[0]:.2f}"),
        Row("   its first run, on the clock", f"{now.first[0] / then.first[0]:.2f}",
            "at most 0.6" if alike and not compiled else ""),
        Row(f"first run over the second{how}, on the clock", f"{now.first[0] / now.second[0]:.2f}",
            "at most 1.4" if compiled else ""),
        Row(f"installed size{how}, without bytecode, over commit {earlier}", f"{now.size / then.size:.2f}",
            "at most 0.6" if compiled else ""),
        *(Row(f"   {name}: installation, first, second run; size",
              f"{_both(run.install)}, {_both(run.first)}, {_both(run.second)} s; {run.size:.0f} MB")
          for name, run in ((f"commit {earlier}", then), ("now", now))),
    ]  # fmt: skip
    said = " ".join((section.__doc__ or "").split())
    return Section(f"First run{how}", f"{said} Seconds on the clock (of processors).", rows)


def _both(seconds: Seconds) -> str:
    return f"{seconds[0]:.1f} ({seconds[1]:.1f})"


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--alike", action="store_true")
    parser.add_argument("--compiled", action="store_true")
    parser.add_argument("--commit", default=EARLIER)
    given = parser.parse_args()
    for row in section(alike=given.alike, compiled=given.compiled, earlier=given.commit).rows:
        print(f"{row.what}: {row.figure}" + f"   [{row.asked}]" * bool(row.asked))
