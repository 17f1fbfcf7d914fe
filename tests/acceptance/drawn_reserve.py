"""Realistic shells drawn at random: what is called good has its reserve on own weight by code of the tests' own."""

import random
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from math import pi

import rodshell as rs
from rodshell.results.verdict import verdict_of
from tests.acceptance.rows import Row
from tests.checks.loaded_twin import LoadedTwin

RESERVE = 1.5
CREEP = {"larch": 0.8, "plywood": 1.0}  # k_def in service class 2 [EN 1995-1-1, table 3.2]
SEED, COUNT, LEAST_GOOD = 2026, 40, 8
ALLOWED = 1.003  # both ways end up to .2 and .1 % below the factor
MM = 1e-3  # m
SOLD: dict[str, tuple[tuple[float, float], ...]] = {  # diameter and wall, or thickness and breadth [mm]
    "gfrp": ((16, 2.5), (20, 2.5), (25, 3), (32, 3), (38, 3.5), (42, 3.5), (50, 4), (60, 5)),
    "spring-steel": ((12, 1), (16, 1.5), (20, 2), (26.9, 2.3), (33.7, 2.6), (42.4, 2.6)),
    "larch": ((5, 15), (8, 20), (10, 30), (15, 40), (20, 40), (24, 50)),
    "plywood": ((6.5, 25), (9, 30), (12, 40), (15, 50), (18, 50)),
}
STRAINS = {"gfrp": 80 / 23e3, "spring-steel": 1140 / 206e3, "larch": 13.8 / 12e3, "plywood": 20.1 / 10.05e3}
"""Of which rods may be bent permanently: design strength over E."""


@dataclass(frozen=True)
class RandomShell:
    """A target, its rods and their spacing, and its supports."""

    kind: str
    target: rs.Target
    rod: rs.Rod
    material: str
    spacing: float
    ends: str

    def __str__(self) -> str:
        return f"{self.kind} {2 * self.target.size:.1f} m, {self.material}"

    @property
    def asked(self) -> float:
        return RESERVE * (1 + CREEP.get(self.material, 0.0))

    def form(self) -> rs.Form:
        turn = pi / 4 if self.kind == "barrel" else 0.0
        layout = rs.GridLayout.orthogonal(spacing=self.spacing, edge=self.spacing / 3, rotate=turn)
        return rs.find_form(self.target, layout, self.rod, ends=self.ends)


def drawn(count: int = COUNT, seed: int = SEED) -> Iterator[RandomShell]:
    """Spans of 6 to 30 m, of rods that the curvature just or nearly allows, .4 to 1.5 m apart."""
    chance = random.Random(seed)
    for number in range(count):
        kind = ("paraboloid", "cap", "ellipsoid", "height field", "barrel")[number % 5]
        span = chance.uniform(6.0, 14.0 if kind == "barrel" else 30.0)
        rise = span * chance.uniform(0.12, 0.35)
        half = span / 2
        target: rs.Target
        if kind == "paraboloid":
            target = rs.Paraboloid(radius=half, height=rise)
        elif kind == "cap":
            radius = (half**2 + rise**2) / (2 * rise)
            target = rs.Cap(radius=radius, base=radius - rise)
        elif kind == "ellipsoid":
            target = rs.Ellipsoid(a=half, b=half * chance.uniform(0.7, 1.0), c=rise)
        elif kind == "height field":
            formula = f"{rise:.4f}*cos({1.5708 / half:.6f}*x)*cos({1.5708 / (0.8 * half):.6f}*y)"
            target = rs.HeightField(formula=formula, domain=rs.Rectangle((2 * half, 1.6 * half)))
        else:
            target = rs.HeightField(
                formula=f"{rise:.4f} - {rise / half**2:.6f}*x^2", domain=rs.Rectangle((2 * half, 1.2 * span))
            )
        material = chance.choice(["gfrp", "gfrp", "spring-steel", "larch", "plywood"])
        bend = half**2 / (2 * rise)  # m, radius of the parabola's top
        sharper = {"ellipsoid": min(1.0, (rise / half) ** 2), "height field": 0.5}.get(kind, 0.9)  # near the rim
        depth = chance.uniform(0.5, 1.0) * sharper * STRAINS[material] * 2 * bend
        size = min(SOLD[material], key=lambda pair: abs(pair[0] * MM - depth))
        section = (
            rs.RectangularSection(width=size[0] * MM, height=size[1] * MM)
            if material in CREEP
            else rs.Tube(radius=size[0] / 2 * MM, thickness=size[1] * MM)
        )
        spacing = min(max(span / chance.uniform(8, 14), 0.4), 1.5)
        ends = chance.choice(["pinned", "both", "both"])
        yield RandomShell(kind, target, rs.Rod(section, rs.Material.preset(material)), material, spacing, ends)


def rows(numbers: Collection[int] = range(COUNT), least: int = LEAST_GOOD) -> Iterator[Row]:
    """Each end condition that a good verdict names by the twin; tubes that a verdict finds short of the reserve, too.

    Parameters
    ----------
    numbers : which of the random shells.
    least : so many of them are good.
    """
    good = 0
    for number, shell in enumerate(drawn()):
        if number not in numbers:
            continue
        form = shell.form()
        results = form.archive().results
        verdict = verdict_of(results)
        good += verdict.level == "good"
        only_short = verdict.level == "check" and "times are asked for" in verdict.headline
        for ends, popped in form.popped.items():
            said = results.self_weight[ends].load_factor or 100.0
            if verdict.level == "good" or (only_short and said < shell.asked and shell.material not in CREEP):
                carried, _ = LoadedTwin(popped, shell.rod).load_factor(accuracy=1e-3, most=shell.asked)
                note = f"{shell.asked:g} asked for, {said:.4g} found by the check"
                shares = (shell.asked / carried, carried / shell.asked)
                what = ("good: reserve asked over the twin's", "short: the twin's over the reserve asked")
                short = int(verdict.level != "good")
                yield Row(f"{shell}, {ends}", what[short], shares[short], ALLOWED, "", note)
    yield Row(f"{len(numbers)} random shells", "good", -good, -least)
