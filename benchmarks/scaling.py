"""Scaling: time and memory of a whole form with the number of rods, and with the number of edges a spacing.

Each size in a process of its own, so that the peak of memory is its own; once, after a small job that loads the
kernels.
"""

import json
import subprocess
import sys

import numpy as np

from benchmarks.rows import Row, Section

RODS = {True: (17, 31, 57), False: (17, 31, 57, 101, 171)}  # by whether it must be quick; 6 edges a spacing
EDGES = {True: (3, 6, 12), False: (3, 6, 12, 24, 48)}  # 17 rods
JOB = """
import json, re, sys, time
from pathlib import Path
import rodshell as rs
rods, edges = int(sys.argv[1]), int(sys.argv[2])
target = rs.Hemisphere(radius=0.2)
rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
def form(rods, edges):
    spacing = 3.14159 * 0.2 / (rods + 0.5)
    return rs.find_form(target, rs.GridLayout.orthogonal(spacing=spacing, edge=spacing / edges), rod)
form(9, 3)
begin = time.process_time()
found = form(rods, edges)
seconds = time.process_time() - begin
assert found.status == "converged", found.status
popped = found.popped["clamped"]
print(json.dumps({
    "dofs": popped.report.dofs, "seconds": seconds, "drape": found.draped.report.seconds,
    "pinned": found.popped["pinned"].report.seconds, "clamped": popped.report.seconds,
    "rods": len(found.footprint.rods),
    "memory": 1024 * int(re.search("VmHWM:\\s*([0-9]+)", Path("/proc/self/status").read_text())[1]),
}))
"""


def scaling(quick: bool) -> Section:
    rows = list[Row]()
    for name, sizes in (
        ("rods", [(rods, 6) for rods in RODS[quick]]),
        ("edges", [(17, edges) for edges in EDGES[quick]]),
    ):
        found = [_run(*size) for size in sizes]
        dofs, seconds = (np.array([one[key] for one in found]) for key in ("dofs", "seconds"))
        large = dofs >= 9000 if (dofs >= 9000).sum() > 1 else dofs > 0
        slope = np.polyfit(np.log(dofs[large]), np.log(seconds[large]), 1)[0]
        asked = "at most 1.35 from 10k to 1M" if name == "rods" else ""
        span = f"{dofs[large].min():.0f} to {dofs.max():.0f}"
        rows.append(Row(f"slope of time with {name}, log-log, {span} unknowns", f"{slope:.2f}", asked))
        if name == "rods":
            most, peak = found[-1], found[-1]["memory"] / 2**30
            what = f"{most['rods']:.0f} rods, {most['dofs']:.0f} unknowns: formed and popped up twice"
            rows.append(Row(what, f"{most['seconds']:.1f} s, peak {peak:.2f} GB", "under 8 GB"))
        rows += [
            Row(
                f"   {one['rods']:.0f} rods, {edges} edges a spacing, {one['dofs']:.0f} unknowns",
                f"{one['seconds']:.2f} s (solves, on the clock: drape {one['drape']:.2f}, pinned {one['pinned']:.2f}, "
                f"clamped {one['clamped']:.2f}), {one['memory'] / 2**20:.0f} MB",
            )
            for one, (_, edges) in zip(found, sizes, strict=True)
        ]
    return Section("Scaling: hemisphere, found and popped up with pinned and with clamped ends", _said(), rows)


def _said() -> str:
    assert __doc__ is not None
    return __doc__.split("\n\n", 1)[1].replace("\n", " ").strip()


def _run(rods: int, edges: int) -> dict[str, float]:
    done = subprocess.run(
        [sys.executable, "-c", JOB, str(rods), str(edges)], check=True, capture_output=True, text=True
    )
    return dict(json.loads(done.stdout))
