"""Forms beside those of an earlier commit, whose package was called gridshell: calls, CPU seconds, large grids."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.rows import Row, Section
from tests.acceptance.house import earlier_source

BEFORE = "1075d4c"
ROOT = Path(__file__).resolve().parent.parent
RODS = 210  # rods each way at 6 edges a spacing: a million unknowns
FORM = """
import json, resource, sys, time
from importlib import import_module
from statistics import median

def case(name, rods, edges):
    rs = import_module(name)
    rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
    spacing = 3.14159 * 0.2 / (rods + 0.5)
    return rs, rs.Hemisphere(radius=0.2), rs.GridLayout.orthogonal(spacing=spacing, edge=spacing / edges), rod

def form(rs, target, layout, rod):
    return rs.find_form(target, layout, rod)
"""
SMALL = """
import numpy as np

def footprint(rs, target, layout, rod):
    return rs.map_back(rs.trim(rs.drape(layout, rod, target)))

def calls(case):
    count = 0
    def listen(frame, event, argument):
        nonlocal count
        count += event in ("call", "c_call")
    sys.setprofile(listen)
    footprint(*case)
    sys.setprofile(None)
    return count

def auto(rs, target, layout, rod):
    return rs, target, rs.GridLayout.orthogonal(spacing=0.03, edge=0.005), rod

def coarse(rs, target, layout, rod):
    return rs, target, rs.GridLayout.orthogonal(rods=(13, 13), spacing=0.03, length=1.4, edge=0.015), rod

both = [case(name, 9, 3) for name in ("rodshell", "gridshell")]
large, small = [auto(*one) for one in both], [coarse(*one) for one in both]
for one in (*large, *small):
    form(*one)  # kernels are loaded
counts, found = [calls(one) for one in large], [form(*one) for one in small]
seconds = [[], []]
for _ in range(int(sys.argv[1])):
    for one, times in zip(small, seconds):
        begin = time.process_time()
        form(*one)
        times.append(time.process_time() - begin)
def apart(a, b):
    return max(float(np.abs(a.popped[ends].positions - b.popped[ends].positions).max()) / 0.2 for ends in a.popped)

before = import_module("gridshell.solve.newton_step")
before.CHORD, before.FORCE_TOLERANCE = 0.0, 1e-15  # it goes on to round-off
found.append(form(*small[1]))
print(json.dumps({
    "calls": counts, "seconds": [median(times) for times in seconds],
    "apart": apart(found[0], found[1]), "continued": apart(found[0], found[2]), "then": apart(found[1], found[2]),
}))
"""
LARGE = """
from pathlib import Path
import re
form(*case(sys.argv[1], 9, 3))
begin, cpu = time.perf_counter(), time.process_time()
found = form(*case(sys.argv[1], int(sys.argv[2]), 6))
print(json.dumps({
    "wall": time.perf_counter() - begin, "cpu": time.process_time() - cpu,
    "unknowns": found.popped["clamped"].report.dofs, "status": found.status,
    "memory": 1024 * int(re.search("VmHWM:\\\\s*([0-9]+)", Path("/proc/self/status").read_text())[1]),
}))
"""


def beside(quick: bool) -> Section:
    """Ratios to the earlier commit, both run by turns with compiled kernels; large grids with two threads."""
    rows, said = list[Row](), beside.__doc__ or ""
    with tempfile.TemporaryDirectory() as folder:
        try:
            source = earlier_source(Path(folder) / "earlier", BEFORE)
        except SystemExit as reason:
            return Section(f"Compared with commit {BEFORE}", str(reason), ())
        path = os.pathsep.join(str(root / "src") for root in (ROOT, source))
        one = _run(SMALL, [str(5 if quick else 25)], path, threads=1)
        (calls, before), (now, then) = one["calls"], one["seconds"]
        rows += [
            Row("net, drape, trim and map back, hemisphere at 30 mm with 5 mm edges: Python and C calls, over then",
                f"{calls / before:.3f} ({calls} and {before})", "at most 0.333"),
            Row("13 x 13 rods, 15 mm edges, formed and popped up twice: forms a CPU second, over then",
                f"{then / now:.2f} ({1 / now:.1f} and {1 / then:.1f})", "at least 2"),
            Row("   the states of these forms differ from those of then, continued to round-off, by",
                f"{one['continued']:.1e} of the size", "at most 1e-12"),
            Row("   the same, then's as they were", f"{one['apart']:.1e}; their own error was {one['then']:.1e}"),
        ]  # fmt: skip
        for rods in (21,) if quick else (21, RODS):
            pairs = [[_run(LARGE, [name, str(rods)], path, threads=2) for name in ("rodshell", "gridshell")]
                     for _ in range(3)]  # fmt: skip
            wall, cpu = (median(now[key] / then[key] for now, then in pairs) for key in ("wall", "cpu"))
            ours, whole = pairs[-1][0], rods == RODS
            what = f"{ours['unknowns']} unknowns, formed and popped up twice by two threads"
            rows += [
                Row(f"{what}: time on the clock, over then",
                    f"{wall:.2f} ({ours['wall']:.2f} s)", "at most 0.75" if whole else "at most 1"),
                Row("   CPU time, over then", f"{cpu:.2f} ({ours['cpu']:.2f} s)", "at most 1.05"),
                Row("   memory", f"{ours['memory'] / 2**30:.2f} GB", "under 3 GB" if whole else ""),
            ]  # fmt: skip
    return Section(f"Compared with commit {BEFORE}", said, rows)


def _run(job: str, arguments: Sequence[str], path: str, *, threads: int) -> dict[str, Any]:
    """What a job in a process of its own prints."""
    environment = os.environ | {"PYTHONPATH": path, "NUMBA_NUM_THREADS": str(threads)}
    command = [sys.executable, "-c", FORM + job, *arguments]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout))
