"""One shell at any size: every length, that of sections too, times a power of two, which rounds nothing.

Young's modulus stays, so that forces grow with the square of the size, energies and moments per radian with its cube.
"""

from dataclasses import dataclass
from functools import cache
from math import cos, sin

import numpy as np

import rodshell as rs
from rodshell.checks.other_shapes import OtherShapes, other_shapes
from rodshell.joints import Joint


@dataclass(frozen=True)
class Placed:
    """How a target is placed: its size, mirrored in the plane y = 0, and then turned about z [rad]."""

    size: float = 1.0
    turned: float = 0.0
    mirrored: bool = False

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the shell of size 1 where they are when it is placed so."""
        x, y, z = self.size * points.T
        y = -y if self.mirrored else y
        c, s = cos(self.turned), sin(self.turned)
        return np.column_stack([c * x - s * y, s * x + c * y, z])

    def joint(self, name: str) -> Joint:
        moments = self.size**3
        return {
            "pin": rs.Pin(),
            "spring": rs.Spring(20.0 * moments, 500.0 * moments, 500.0 * moments),
            "rigid": rs.Rigid(),
            "four linkers": rs.Linker(corners=4),
            "two layers": rs.Pin(eccentricity=0.03 * self.size),
        }[name]

    @property
    def target(self) -> rs.Target:
        """A dome without symmetry."""
        c, s, size = cos(self.turned), sin(self.turned), self.size
        u = f"(({c!r}*x + {s!r}*y)/{size!r})"
        v = f"({'-' if self.mirrored else ''}({c!r}*y - {s!r}*x)/{size!r})"
        formula = f"{size!r}*(1.2 - 0.3*{u}^2 - 0.4*{v}^2 + 0.1*{u}*{v} + 0.05*{u}^3)"
        return rs.HeightField(formula=formula, domain=rs.Disc(1.5 * size))


LATH, TUBE = "lath", "tube"


def rod(kind: str, size: float) -> rs.Rod:
    section: rs.RectangularSection | rs.Tube = rs.RectangularSection(width=0.04 * size, height=0.012 * size)
    if kind == TUBE:
        section = rs.Tube(radius=0.015 * size, thickness=0.003 * size)
    return rs.Rod(section, rs.Material(30e9, 1900.0 / size, 0.3))


@cache
def form(kind: str, joint: str, placed: Placed) -> rs.Form:
    size = placed.size
    layout = rs.GridLayout.orthogonal(spacing=0.4 * size, edge=0.4 / 3 * size, rotate=placed.turned)
    return rs.find_form(placed.target, layout, rod(kind, size), joint=placed.joint(joint), anchor=(0.0, 0.0))


@cache
def cap(size: float) -> rs.PopUp:
    """A cap over a plane edge, of tubes on pins, its ends pinned."""
    target, layout = rs.Cap(radius=1.25 * size, base=size), rs.GridLayout.orthogonal(spacing=0.2 * size, edge=size / 15)
    return rs.find_form(target, layout, rod(TUBE, size), joint=rs.Pin(), ends="pinned").popped["pinned"]


def others(found: rs.PopUp, most_factorizations: int) -> OtherShapes:
    return other_shapes(found.shell, found.equilibrium, most_factorizations=most_factorizations)


def boundary_placed(boundary: rs.Boundary, turned: float, moved: float) -> rs.Boundary:
    """A boundary turned about z [rad], and moved along x [m]."""
    turn = Placed(turned=turned)
    given = {name: getattr(boundary, name) for name in ("points", "tangents", "draped", "normals")}
    placed = {name: None if rows is None else turn(rows) for name, rows in given.items()}
    for name in ("points", "draped"):
        placed[name] = placed[name] + (moved, 0.0, 0.0)
    return rs.Boundary(**placed)
