"""Shells along every lattice against code of the tests' own: equilibrium, reactions, inertia and stress."""

from collections.abc import Iterator

import numpy as np

import rodshell as rs
from rodshell.checks.bending import bending_of
from rodshell.checks.reactions import reactions
from tests.acceptance.rows import Row
from tests.acceptance.verdict_weight import unloaded_rows
from tests.checks.loaded_twin import LoadedTwin
from tests.checks.stress_twin import stresses

GFRP = rs.Material.preset("gfrp")
CAP = rs.Cap(radius=2.0, base=1.4)
SCHERK = rs.HeightField(formula="0.8*(log(cos(y/0.8)) - log(cos(x/0.8)))", domain=rs.Disc(0.9))
FLAT, UPRIGHT = rs.RectangularSection(width=0.004, height=0.012), rs.RectangularSection(width=0.012, height=0.004)
BOWS = [[(x, -1.6), (1.1 * x, 0.0), (x, 1.6)] for x in np.arange(-1.2, 1.21, 0.4)]
BOWS += [[point[::-1] for point in line] for line in BOWS]
CASES: dict[str, tuple[rs.Target, object, rs.RectangularSection]] = {
    "two families of geodesics": (CAP, rs.Geodesic(spacing=0.4), FLAT),
    "three families of geodesics": (CAP, rs.Geodesic(spacing=0.5, families=3), FLAT),
    "asymptotic strips": (SCHERK, rs.Asymptotic(spacing=0.3), UPRIGHT),
    "given lines": (CAP, rs.Curves(lines=BOWS), FLAT),
    "given lines, curved at rest": (CAP, rs.Curves(lines=BOWS, rest="curved"), FLAT),
}


def twin_rows() -> Iterator[Row]:
    """With balls for equilibrium, as the other code has them: round rods where laths would turn over about themselves.
    With pins for stress, where laths are twisted."""
    for name, (target, lattice, section) in CASES.items():
        rod, anchor = rs.Rod(section, GFRP), (0.0, 0.0) if isinstance(target, rs.HeightField) else None
        held_by_balls = rod if isinstance(lattice, rs.Curves) else rs.Rod(rs.Circle(radius=0.004), GFRP)
        balls = rs.find_form(target, lattice, held_by_balls, joint=rs.Ball(), ends="pinned", anchor=anchor).popped[
            "pinned"
        ]  # type: ignore[arg-type]
        held = reactions(balls.shell, balls.equilibrium)
        yield from unloaded_rows(name, LoadedTwin(balls, held_by_balls), held, balls.report.negative_modes)
        if "at rest" in name:
            continue  # the code for stress is that of straight rods
        pins = rs.find_form(target, lattice, rod, joint=rs.Pin(), ends="pinned", anchor=anchor).popped["pinned"]  # type: ignore[arg-type]
        found = bending_of(pins.shell, pins.state, rod, shear_weight=np.sqrt(3.0))
        assert found.stress is not None
        expected = stresses(pins.shell, pins.state, rod)
        off = 100 * float(np.abs(found.stress - expected).max() / expected.max())
        yield Row(name, "stress off the twin's", off, 0.5, "%", f"{1e-6 * expected.max():.1f} MPa")
