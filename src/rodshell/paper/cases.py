"""The paper's rod, targets and grids [HQK 3.2]."""

from dataclasses import dataclass

from rodshell.layout import GridLayout
from rodshell.rods.materials import Material
from rodshell.rods.section import Circle, Rod
from rodshell.targets import Ellipsoid, Hemisphere, Paraboloid, Target

ROD = Rod(Circle(radius=1e-3), Material(youngs_modulus=1e6, density=1e3))  # r 1 mm, E 1 MPa, G = E/3, 1 g/cm3
LENGTH, HEIGHT = 1.2, 0.05  # [m] of the rods, and H
EDGE = 0.015  # [m]; the paper's "8000 DOFs" are this mesh, its stated 5 mm have four times as many


@dataclass(frozen=True)
class Case:
    """A target and a grid.

    Parameters
    ----------
    label : its letter in the paper's figure.
    target : the surface.
    rods : number of rods of the two families.
    spacing, edge : of the rods, and length of their edges [m].
    """

    label: str
    target: Target
    rods: tuple[int, int]
    spacing: float = 0.03
    edge: float = EDGE

    @property
    def layout(self) -> GridLayout:
        """The orthogonal grid."""
        return GridLayout.orthogonal(rods=self.rods, spacing=self.spacing, edge=self.edge, length=LENGTH)


CASES = (
    Case("a", Hemisphere(0.2), (17, 17)),
    Case("b", Paraboloid(0.2, 0.12), (15, 15)),
    Case("c", Ellipsoid(0.2, 0.15, 0.12), (11, 15)),
)
"""Of Figs 1, 6 and 8."""

WIDE_CASES = (
    Case("1", Hemisphere(0.2), (13, 13), spacing=0.04, edge=0.02),
    Case("2", Hemisphere(0.2), (11, 11), spacing=0.05, edge=0.025),
)
"""Of Fig 7."""
