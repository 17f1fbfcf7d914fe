"""All benchmarks in one table: `python benchmarks/run.py [--quick] [--only NAME,...] [--write FILE]`.

--quick leaves out what takes minutes: large systems, long falls. Without --quick the table is written to
docs/performance.md, with --quick only where --write says so.
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
os.environ |= dict.fromkeys(THREADS, "1")  # before NumPy is imported
ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))

from benchmarks import (  # noqa: E402
    costs,
    factorisation,
    first_run,
    jobs,
    kernels,
    loads,
    others,
    sameness,
    scaling,
    startup,
    studio,
    sweeps,
)
from benchmarks.rows import Row, Section, machine  # noqa: E402

SECTIONS: dict[str, Callable[[bool], Section]] = {
    "job": lambda quick: jobs.whole_job(5 if quick else 15),
    "paper": others.paper,
    "factorisation": factorisation.factorisation,
    "scaling": scaling.scaling,
    "slider": lambda quick: jobs.slider(6 if quick else 20),
    "studio": studio.studio,
    "warm": lambda quick: jobs.warm(3 if quick else 9),
    "startup": lambda quick: startup.section(3 if quick else 7),
    "first": lambda _: first_run.section(),
    "first-compiled": lambda _: first_run.section(compiled=True),
    "costs": costs.costs,
    "loads": lambda quick: loads.loads(1 if quick else 3),
    "sameness": sameness.sameness,
    "sweeps": lambda quick: sweeps.sweeps(20 if quick else 100),
    "kernels": lambda _: kernels.kernels(),
    "pyelastica": others.pyelastica,
}
HEAD = """# How fast it is

Printed by `make bench`, which is `python benchmarks/run.py`; the command below a title prints that table again, in less
time with `--quick`. Ratios and counts can be compared between machines, times cannot. No test asserts any of it.

"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small systems, short falls, few repetitions")
    parser.add_argument("--only", help=f"some of {', '.join(SECTIONS)}")
    parser.add_argument("--write", metavar="FILE", help="where the table goes; default docs/performance.md if whole")
    given = parser.parse_args()
    names = given.only.split(",") if given.only else list(SECTIONS)
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        parser.error(f"unknown benchmark {unknown[0]}: use {', '.join(SECTIONS)}")
    sections = dict[str, Section]()
    for k, name in enumerate(names, start=1):
        print(f"benchmark {k} of {len(names)}: {name}", file=sys.stderr, flush=True)
        sections[name] = SECTIONS[name](given.quick)
        print(_plain(sections[name]), flush=True)
    where = given.write or (None if given.quick or given.only else ROOT / "docs" / "performance.md")
    if where is not None:
        Path(where).write_text(document(sections, quick=given.quick), encoding="utf-8")
        print(f"written to {where}", file=sys.stderr)
    return 0


def document(sections: Mapping[str, Section], *, quick: bool) -> str:
    """The tables as Markdown."""
    how = "short runs (`--quick`)" if quick else "whole runs"
    parts = [f"{HEAD}Measured on {machine()}; commit {_commit()}; {how}.\n"]
    for name, one in sections.items():
        said = " ".join(one.said.split())
        parts.append(f"## {one.title}\n\n`python benchmarks/run.py --only {name}`: {said}\n\n{_table(one.rows)}")
    return "\n".join(parts)


def _table(rows: Sequence[Row]) -> str:
    heads = ("what", "measured", *(["asked"] * any(row.asked for row in rows)))
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for row in rows:
        cells = (row.what.replace("   ", "&nbsp;&nbsp;"), row.figure, row.asked)[: len(heads)]
        lines.append("| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _plain(section: Section) -> str:
    wide = max(len(row.what) for row in section.rows)
    lines = [f"{row.what:{wide}}  {row.figure}" + f"   [{row.asked}]" * bool(row.asked) for row in section.rows]
    return "\n".join([f"\n{section.title}", *lines])


def _commit() -> str:
    done = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() or "unknown"


if __name__ == "__main__":
    sys.exit(main())
