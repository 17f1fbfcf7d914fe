"""The draped grid: what all three methods return."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.formfinding.layers import joint_tangents
from rodshell.formfinding.methods import Method
from rodshell.formfinding.section_limits import StrongBending
from rodshell.geometry.frames import cross, dot
from rodshell.layout import FlatRod, GridLayout, GridMesh
from rodshell.nets import ChebyshevNet
from rodshell.rods.section import Rod
from rodshell.solve.report import SolveReport, Status
from rodshell.targets import Target

if TYPE_CHECKING:
    from rodshell.formfinding.rest import Rest


@dataclass(frozen=True, eq=False)
class DrapeFigures:
    """How well a grid lies on its target.

    Parameters
    ----------
    max_gap : largest distance between the target and a node that should touch it, or depth of a node inside [m].
    contact_pulls : number of nodes on the target that it would have to pull to hold them.
    min_angle : smallest angle between two rods at a joint on the target [rad].
    min_angle_at : x, y, z of that joint [m].
    net_deviation : (k, 2) how far past its ends in the flat grid each of the `rods` would end by this drape alone, at
        start and end, along the rod [m]; None where both are the same.
    strong_bending : of rods with a strong axis whose joints keep them from rolling (`Bound`); else None.
    """

    max_gap: float
    contact_pulls: int
    min_angle: float
    min_angle_at: tuple[float, float, float]
    net_deviation: Floats | None = None
    strong_bending: StrongBending | None = None


@dataclass(frozen=True, eq=False)
class Draped:
    """A flat grid lying on a target, not yet trimmed.

    Parameters
    ----------
    method : how it was draped.
    target, layout, rod, anchor : as they were given; anchor is x, y [m], or None.
    eccentricity : distance of the two layers of rods [m]; 0 where they meet.
    mesh : the whole mesh, with the lines and tails that are cut off later.
    positions : (n, 3) of its nodes [m]; of rods in two layers, of the surface between the layers.
    rods : the k rods to be built, each from end to end of the target (`Bound`), or whole (`Gravity`, `Fall`).
    levels : report of the solve on each level of refinement, the last at the layout's own edge length.
    figures : how well the grid lies on the target.
    net : the net that the drape started from; None where it started from the flat grid.
    rest : how it came to rest, where it moved in time (`Fall`); else None.
    warnings : sentences for the user.
    """

    method: Method
    target: Target
    layout: GridLayout
    rod: Rod
    anchor: tuple[float, float] | None
    eccentricity: float
    mesh: GridMesh
    positions: Floats
    rods: tuple[FlatRod, ...]
    levels: tuple[SolveReport, ...]
    figures: DrapeFigures
    net: ChebyshevNet | None = None
    rest: "Rest | None" = None
    warnings: tuple[str, ...] = ()

    @property
    def dropped(self) -> tuple[tuple[str, str], ...]:
        """Names of the rods that have no place on the target, each with the reason."""
        return self.net.dropped if self.net is not None else ()

    @property
    def report(self) -> SolveReport:
        """Of the solve at the layout's own edge length."""
        return self.levels[-1]

    @property
    def converged(self) -> bool:
        """Whether the drape reached an equilibrium, and a fall came to rest."""
        return self.report.status is Status.CONVERGED


def smallest_joint_angle(mesh: GridMesh, positions: Floats, inside: Bools) -> tuple[float, tuple[float, float, float]]:
    """Smallest angle between two rods at a joint [rad], and where it is [m].

    Parameters
    ----------
    positions : (n, 3) of the mesh's nodes [m].
    inside : (n,) which nodes' joints count.
    """
    tangents = joint_tangents(mesh, positions)
    angle = np.arctan2(
        np.linalg.norm(cross(tangents[:, 0], tangents[:, 1]), axis=1), np.abs(dot(tangents[:, 0], tangents[:, 1]))
    )
    angle = np.where(inside[mesh.joint_nodes], angle, np.inf)
    k = int(np.argmin(angle))
    x, y, z = positions[mesh.joint_nodes[k]].tolist()
    return float(angle[k]), (x, y, z)
