"""Shells in OpenSees: `python -m tests.acceptance.hosts [shell ...]`, with `pip install "rodshell[opensees]"`.

Each shell is exported and replayed in OpenSees from its flat grid, by the script that is exported with it.
RODSHELL_OPENSEES names the Python that has openseespy, where that is another.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import rodshell as rs
from rodshell.loads.structure import Structure
from tests.acceptance.rows import Row, print_table

SHAPE, STRESS, FREQUENCY, LIMIT, PULL = 2e-4, 0.01, 0.01, 0.03, 0.01
TUBE = """
[rod.section]
kind = "tube"
radius = "20.85 mm"
thickness = "3.5 mm"
[rod.material]
youngs_modulus = "25 GPa"
poisson_ratio = 0.3
density = 1750
"""
LATH = """
[rod.section]
kind = "rectangle"
width = "35 mm"
height = "50 mm"
[rod.material]
youngs_modulus = "12 GPa"
shear = "0.7 GPa"
density = 590
"""
CAP = """
[target]
kind = "cap"
radius = "10 m"
base = "4 m"
"""
PARABOLOID = """
[target]
kind = "paraboloid"
radius = "8 m"
height = "4 m"
"""
GRID = """
[layout]
spacing = "1.6 m"
edge = "0.2 m"
"""
WIDE = GRID.replace("1.6", "3.2").replace("0.2", "0.1")  # 32 edges a span: spans between cables buckle by themselves
PINNED = """
[pop_up]
ends = "pinned"
"""
SNOW = """
[[loads]]
name = "own"
kind = "self_weight"
[[loads]]
name = "snow"
kind = "snow"
value = "0.1 kN/m2"
[[combinations]]
name = "winter"
factors = { own = 1.35, snow = 1.5 }
[stability]
imperfection = 0
"""
CABLES = """
[bracing]
kind = "cables"
prestrain = 0.001
section = { kind = "circle", radius = "3 mm" }
material = { youngs_modulus = "160 GPa", density = "7850 kg/m3" }
"""
PINS = '[joint]\nkind = "pin"\n'
SHELLS = {
    "round tubes": CAP + GRID + TUBE + PINNED,
    "laths with pins": PARABOLOID + GRID + LATH + PINS + PINNED,
    "two layers": CAP + GRID + TUBE + PINS + 'eccentricity = "41.7 mm"\n' + PINNED,
    "braced": CAP + WIDE + TUBE + PINNED + CABLES + SNOW,
    "under snow": CAP + GRID + TUBE + PINNED + SNOW,
}


def python_with_opensees() -> str | None:
    """The Python in which openseespy can be imported; None: there is none."""
    python = os.environ.get("RODSHELL_OPENSEES", sys.executable)
    asked = subprocess.run([python, "-c", "import openseespy.opensees"], capture_output=True)
    return python if asked.returncode == 0 else None


@cache
def form_of(name: str) -> rs.Form:
    """The form of a shell, checked."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.toml"
        case.write_text(SHELLS[name])
        return rs.Job.load(case).run().finished()


def replayed(form: rs.Form, python: str) -> dict[str, Any]:
    """What OpenSees finds of its pinned shell."""
    with tempfile.TemporaryDirectory() as folder:
        rs.export(form.archive(), folder, "opensees")
        here = Path(folder) / "opensees"
        driver = Path(__file__).with_name("hosts_replay.py")
        # in a folder and an environment of its own: nothing of rodshell is at hand
        bare = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        command = [python, str(driver), str(here / "replay.py"), str(here / "popped_pinned.json")]
        done = subprocess.run(command, capture_output=True, text=True, env=bare, cwd=folder, timeout=900)
        lines = [line for line in done.stdout.splitlines() if line.startswith("FOUND ")]
        assert lines, done.stderr[-2000:]
        found: dict[str, Any] = json.loads(lines[0].removeprefix("FOUND "))
        return found


def rows_of(name: str, python: str) -> Iterator[Row]:
    """What OpenSees finds against what rodshell does."""
    form = form_of(name)
    found, archive, size = replayed(form, python), form.archive(), form.target.size
    nodes = archive.states["rod_nodes"]
    apart = np.linalg.norm(np.array(found["positions"]) - archive.states["popped_pinned"][nodes], axis=1).max()
    yield Row(name, "shape off, over the size", float(apart / size), SHAPE, "", f"{1e3 * apart:.2g} mm")
    ours, theirs = archive.states["stress_pinned"].max(), stress(form, np.array(found["forces"])).max()
    yield Row(name, "largest stress off", off(theirs, ours), STRESS, "", f"{1e-6 * theirs:.4g} MPa")
    if found["cables"]:
        loaded = archive.results.loads["winter"]["pinned"]
        pull = max(force for force in loaded.bracing_unloaded if force is not None)
        theirs = max(found["cables"])
        yield Row(name, "largest force of a cable off", off(theirs, pull), PULL, "", f"{theirs:.4g} N")
    if archive.results.loads:
        loaded = archive.results.loads["winter"]["pinned"]
        own, limit = loaded.frequencies, loaded.limit_factor
    else:
        erected = Structure.erected(form.popped["pinned"], form.rod)
        own = erected.frequencies(3, np.zeros(len(erected.mass)))
        limit = archive.results.self_weight["pinned"].load_factor
    theirs = found["frequencies"]
    worst = max(off(a, b) for a, b in zip(theirs, own, strict=True))
    yield Row(name, "three lowest frequencies off", worst, FREQUENCY, "", f"{theirs[0]:.4g} Hz")
    for what, factor in found["limits"].items():
        assert limit
        yield Row(name, f"limit factor off, {what}", off(factor, limit), LIMIT, "", f"{factor:.4g}")


def markdown(rows: Iterable[Row]) -> str:
    """Rows as a table: what OpenSees finds, and how far it is off."""
    lines = [
        f"| {row.case} | {row.what} | {100 * row.measured:.2g} % | {100 * row.bound:.2g} % | {row.note} |"
        for row in rows
    ]
    return "| shell | | off | allowed | in OpenSees |\n|---|---|---|---|---|\n" + "\n".join(lines)


def off(theirs: float, ours: float) -> float:
    return abs(float(theirs) / float(ours) - 1.0)


def stress(form: rs.Form, forces: np.ndarray) -> np.ndarray:
    """(e, 2) at both nodes of each edge, by the handbook: axial force and both bends, of a tube as vectors; torsion by
    von Mises."""
    axial, within, out, twist = forces[:, 2, None], forces[:, 3:5], forces[:, 5:7], forces[:, 7, None]
    section = form.rod.section
    if isinstance(section, rs.RectangularSection):
        b, h = section.width, section.height
        bent = 6 * np.abs(out) / (h * b**2) + 6 * np.abs(within) / (b * h**2)
        shear = 0.0 * twist
        area = b * h
    else:
        assert isinstance(section, rs.Tube)
        r, inner = section.radius, section.radius - section.thickness
        inertia = np.pi / 4 * (r**4 - inner**4)
        bent, shear, area = r * np.hypot(within, out) / inertia, twist * r / (2 * inertia), np.pi * (r**2 - inner**2)
    return np.asarray(np.sqrt((np.abs(axial) / area + bent) ** 2 + 3 * shear**2))


def main() -> int:
    """All shells, or those that are named."""
    python = python_with_opensees()
    if python is None:
        print(
            'openseespy cannot be imported: pip install "rodshell[opensees]", with the libraries libblas and liblapack'
        )
        return 1
    names = sys.argv[1:] or SHELLS
    return print_table("hosts", (row for name in names for row in rows_of(name, python)))


if __name__ == "__main__":
    sys.exit(main())
