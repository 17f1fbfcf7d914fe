"""The same results: two runs in two processes, and one thread against two."""

import json
import os
import subprocess
import sys

import numpy as np

from benchmarks.rows import Row, Section

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
RADIUS = 0.2
JOB = """
import json, sys
import rodshell as rs
rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
layout = rs.GridLayout.orthogonal(spacing=float(sys.argv[1]), edge=float(sys.argv[1]) / 6)
form = rs.find_form(rs.Hemisphere(radius=0.2), layout, rod)
states = [form.draped.positions, *(popped.positions for popped in form.popped.values())]
print(json.dumps([[value.hex() for value in state.ravel().tolist()] for state in states]))
"""


def sameness(quick: bool) -> Section:
    """Drape and both pop-ups of the hemisphere, compared bit by bit; factorisations alone use threads."""
    spacing = 0.02 if quick else 0.01
    one, again, two = (_run(spacing, threads) for threads in (1, 1, 2))
    bitwise = "bitwise equal" if one == again else f"differ by {_apart(one, again):.1e} R"
    threads = "bitwise equal" if one == two else f"{_apart(one, two):.1e} R apart"
    rows = [
        Row("two runs", bitwise, "bitwise equal"),
        Row("one thread allowed and two", threads, "within 1e-9 R"),
    ]
    assert sameness.__doc__ is not None
    return Section("Sameness", sameness.__doc__.replace("\n    ", " "), rows)


def _run(spacing: float, threads: int) -> list[list[str]]:
    environment = os.environ | dict.fromkeys(THREADS, str(threads))
    done = subprocess.run(
        [sys.executable, "-c", JOB, str(spacing)], check=True, capture_output=True, text=True, env=environment
    )
    return list(json.loads(done.stdout))


def _apart(some: list[list[str]], others: list[list[str]]) -> float:
    return max(
        float(np.abs(np.subtract(*([float.fromhex(value) for value in state] for state in pair))).max())
        for pair in zip(some, others, strict=True)
    ) / RADIUS  # fmt: skip
