"""Falls small enough for tests: single particles with closed forms, and coarse grids."""

import numpy as np
from numpy.typing import NDArray

import rodshell as rs
from rodshell.contact.modified_mass import ModifiedMass, Stopped
from rodshell.model import Freedom
from rodshell.rods.elements import Elements
from rodshell.solve.implicit_euler import ContactEuler, MakeMatrix, Motion, Step
from rodshell.solve.newton_matrix import narrow_or_sparse
from rodshell.solve.problem import GravityForce, Supports

Floats = NDArray[np.float64]

G, STEP, MASS, RADIUS = 9.81, 0.01, 1e-4, 0.2
PAPER_ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(1e6, 1e3))
HEMISPHERE = rs.Hemisphere(RADIUS)
TARGETS: dict[str, rs.Target] = {
    "hemisphere": HEMISPHERE,
    "paraboloid": rs.Paraboloid(0.2, 0.12),
    "ellipsoid": rs.Ellipsoid(0.2, 0.15, 0.12),
    "hollow": rs.HeightField(formula="0.1 + x**2 + 0.5*y**2", domain=rs.Disc(RADIUS)),
}


def slope(tangent: float) -> rs.Target:
    """A plane that falls along x by `tangent`."""
    return rs.HeightField(formula=f"0.3 - {tangent}*x", domain=rs.Disc(RADIUS))


class Particles:
    """Nodes (n, 3) and, if given, elements between them, moved one step at a time."""

    def __init__(
        self,
        target: rs.Target,
        positions: Floats,
        *,
        elements: tuple[Elements, ...] = (),
        free: Freedom | None = None,
        stopped: Stopped = "all",
        friction: float = 0.0,
        matrix: MakeMatrix = narrow_or_sparse,
    ) -> None:
        self.state = np.array(positions, dtype=float)
        self.velocity = np.zeros_like(self.state)
        nodes = np.arange(len(self.state))
        mass = np.full_like(self.state, MASS)
        self.motion = Motion(elements, mass, Supports(free or Freedom.free(len(nodes))), (GravityForce(nodes),))
        self.stepper = ContactEuler(ModifiedMass(target, nodes, stopped, friction), matrix)

    def step(self, times: int = 1) -> Step:
        for _ in range(times):
            taken = self.stepper.take(self.motion, self.state, self.velocity, time=0.0, step=STEP)
            assert isinstance(taken, Step), taken
            self.state, self.velocity = taken.state, taken.velocity
        return taken


def coarse_layout() -> rs.GridLayout:
    return rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.03, length=0.9)
