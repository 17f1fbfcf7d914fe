"""Processor time of the jobs of a sweep, by engine and number of workers, over that of the same jobs in one process."""

import tempfile
from pathlib import Path
from statistics import median
from time import monotonic, process_time

import rodshell as rs
from benchmarks.rows import Row, Section, ms

SAID = """
The hemisphere with 13 x 13 rods, spacings of 26 to 34 mm, until the pop-up. "In a loop" is the same jobs in one
process; the coordinator is all that the sweep does in addition to its jobs.
"""
ENGINES = {
    "processes, 1 worker": {"workers": 1},
    "processes, 2 workers": {"workers": 2},
    "dask, 2 workers": {"engine": "dask", "workers": 2},
}


def sweeps(designs: int) -> Section:
    """The same designs by each engine."""
    axes = {"layout.rods": ["13x13"], "layout.spacing": {"from": "26 mm", "to": "34 mm", "count": designs}}
    base = rs.Job.load("hemisphere")
    alone = list[float]()
    for k in range(designs + 1):  # the first loads the kernels
        spacing = 0.026 + 0.008 * max(k - 1, 0) / (designs - 1)
        job = base.changed({"layout.rods": "13x13", "layout.spacing": spacing})
        begun = process_time()
        job.run(until="pop-up")
        alone.append(process_time() - begun)
    home = median(alone[1:])
    rows = [Row("in a loop, a job", ms(home))]
    for name, engine in ENGINES.items():
        with tempfile.TemporaryDirectory() as folder:
            begun, used = monotonic(), process_time()
            rs.sweep({"base": base, "axes": axes, "run": {**engine, "until": "pop-up"}}, Path(folder) / "sweep")
            lasted, spent = monotonic() - begun, process_time() - used
            seconds = rs.read_sweep(Path(folder) / "sweep")["seconds"].to_pylist()
        cost = median(seconds)
        figure = f"{cost / home:.2f} ({ms(cost)}; coordinator {ms(spent / designs)}; {designs / lasted:.2g} a second)"
        rows.append(Row(f"{name}, a job, over in a loop", figure, "within 30 % of each other"))
    return Section("Sweeps", SAID, rows)
