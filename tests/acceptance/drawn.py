"""Prints the table of targets as they are drawn: `python -m tests.acceptance.drawn`; exit 1 on a miss."""

import random
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import radians

import numpy as np

import rodshell as rs
from rodshell.formfinding.patches import find_patched_stages
from rodshell.targets.creased import cut_at
from rodshell.targets.patch import Seam
from tests.acceptance import drawn_reserve, drawn_scale
from tests.acceptance.rows import Row, print_table
from tests.targets.meshes import CREASED, creased
from tests.targets.test_creases import SEAMS, off_crease

ROD = rs.Rod(rs.Tube(radius=0.016, thickness=0.003), rs.Material.preset("gfrp"))
SURFACES = {  # half width and half depth of the rectangle [m], formula
    "saddle, 24 m": (12.0, 4.0, "2.5 - 0.12*y^2 + 0.02*x^2"),
    "barrel, 24 m": (12.0, 4.0, "3 - 0.1*y^2"),
    "dome, 12 m": (6.0, 5.0, "3 - 0.05*x^2 - 0.06*y^2"),
    "waves, 14 m": (7.0, 4.5, "3.2 + 0.9*cos(x/4.5)*cos(y/4) + 0.15*sin(x/3)"),
    "slope, 10 m": (5.0, 4.0, "2 - 0.05*x^2 - 0.04*y^2 + 0.1*x"),
    "hypar, 8 m": (4.0, 4.0, "2 + 0.06*x*y - 0.02*x^2"),
}
HEADINGS = (0, 15, 30, 45, 60, 75, 90)  # degrees
SPACINGS = (1.0, 0.5, 0.25)  # m
ALLOWED, FARTHEST = 2e-4, 1e-3  # of the size, and m
SEED = 40


@dataclass(frozen=True)
class Drawn:
    """One combination."""

    surface: str
    heading: int
    spacing: float

    def __str__(self) -> str:
        return f"{self.surface}, {self.heading} deg, {self.spacing:g} m"

    def supports(self) -> tuple[float, float, int]:
        """How far supports are off the rectangle [m], what is allowed [m], and how many rods there are."""
        half = SURFACES[self.surface]
        target = rs.HeightField(formula=half[2], domain=rs.Rectangle((2 * half[0], 2 * half[1])))
        layout = rs.GridLayout.orthogonal(spacing=self.spacing, edge=self.spacing / 6, rotate=radians(self.heading))
        trimmed = rs.trim(rs.drape(layout, ROD, target))
        x, y = np.abs(trimmed.boundary.points[:, :2]).T - np.array(half[:2])[:, None]
        outside = np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0))
        off = np.where((x < 0) & (y < 0), np.minimum(-x, -y), outside)
        return float(off.max()), min(ALLOWED * target.size, FARTHEST), len(trimmed.mesh.grid.rods)


def combinations(count: int, seed: int = SEED) -> list[Drawn]:
    """Seeded combinations in which each value occurs about equally often."""
    chance = random.Random(seed)

    def spread(values: Sequence[object]) -> list[object]:
        often = [value for _ in range(count // len(values) + 1) for value in values][:count]
        chance.shuffle(often)
        return often

    return [Drawn(*drawn) for drawn in zip(spread([*SURFACES]), spread(HEADINGS), spread(SPACINGS), strict=True)]


def end_rows(count: int = 80) -> Iterator[Row]:
    """Supports against the rectangle that ends the target."""
    for drawn in combinations(count):
        off, allowed, rods = drawn.supports()
        yield Row(str(drawn), "supports off the rectangle", 1e3 * off, 1e3 * allowed, "mm", f"{rods} rods")


def crease_rows(names: Sequence[str] = tuple(CREASED)) -> Iterator[Row]:
    """Creased meshes in patches: rod ends against the crease, and patches against the surface of their side."""
    for name in names:
        seams = [Seam.of(line) for line in SEAMS[name]]
        target = cut_at(rs.Freeform.of(*creased(name)), seams)
        layout = rs.GridLayout.orthogonal(spacing=0.9, edge=0.225)
        form = find_patched_stages(target, seams, layout, ROD, ends=())
        points, size = np.array([meeting.point for meeting in form.meetings]), target.size
        off = np.hypot(off_crease(name, points), points[:, 2] - CREASED[name](*points[:, :2].T))
        note = f"{len(points)} meetings, {len(form.patches)} patches"
        yield Row(f"{name}, creased", "rod ends off the crease", float(off.max()) / size, ALLOWED, "of the size", note)
        apart = np.abs(form.draped[:, 2] - CREASED[name](*form.draped[:, :2].T))
        yield Row(f"{name}, creased", "patches off their surfaces", float(apart.max()) / size, 5e-4, "of the size")


def all_rows() -> Iterator[Row]:
    yield from end_rows()
    yield from crease_rows()
    yield from drawn_scale.rows()
    yield from drawn_reserve.rows()


if __name__ == "__main__":
    sys.exit(print_table("drawn", all_rows()))
