"""The draped grid: what all three methods return."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.formfinding.methods import Method
from rodshell.formfinding.thickness import StrongBending
from rodshell.geometry.vectors import cross, dot, unit
from rodshell.layout import FlatRod, GridLayout, GridMesh
from rodshell.nets import ChebyshevNet
from rodshell.rods.section import Rod
from rodshell.solve.report import SolveReport, Status
from rodshell.targets import Target

if TYPE_CHECKING:
    from rodshell.formfinding.rest import Rest


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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
        return self.levels[-1]

    @property
    def converged(self) -> bool:
        return self.report.status is Status.CONVERGED


def smallest_joint_angle(mesh: GridMesh, positions: Floats, inside: Bools) -> tuple[float, tuple[float, float, float]]:
    """Smallest angle between two rods [rad] over the joints whose node is `inside` (n,), and where it is."""
    tangents = joint_tangents(mesh, positions)
    angle = np.arctan2(
        np.linalg.norm(cross(tangents[:, 0], tangents[:, 1]), axis=1), np.abs(dot(tangents[:, 0], tangents[:, 1]))
    )
    angle = np.where(inside[mesh.joint_nodes], angle, np.inf)
    k = int(np.argmin(angle))
    x, y, z = positions[mesh.joint_nodes[k]].tolist()
    return float(angle[k]), (x, y, z)


def joint_normals(mesh: GridMesh, positions: Floats) -> Floats:
    """(c, 3) unit normals at the joints, across both rods, on the side that was up in the flat grid."""
    tangents, flat = joint_tangents(mesh, positions), joint_tangents(mesh, mesh.flat)
    up = np.sign(cross(flat[:, 0], flat[:, 1])[:, 2:])
    return unit(up * cross(tangents[:, 0], tangents[:, 1]))


def node_normals(mesh: GridMesh, positions: Floats) -> Floats:
    """(n, 3) normals at all nodes, those of the joints interpolated along the rods."""
    at_joints, total = joint_normals(mesh, positions), np.zeros((mesh.node_count, 3))
    for rod in range(len(mesh.grid.rods)):
        here = mesh.rod_slice(rod)
        on, side = np.nonzero(mesh.grid.crossings.rods == rod)
        order = np.argsort(mesh.grid.crossings.at[on, side])
        at, normals = mesh.grid.crossings.at[on, side][order], at_joints[on[order]]
        for k in range(3):
            np.add.at(total[:, k], mesh.rod_nodes[here], np.interp(mesh.stations[here], at, normals[:, k]))
    return unit(total)


def laid_in_layers(
    mesh: GridMesh, positions: Floats, normals: Floats, eccentricity: float
) -> tuple[GridMesh, Floats, Floats]:
    """A mesh in two layers, so far apart [m], with the places (k, 3) of its nodes and the normals there, from those
    (n, 3) of the surface between the layers."""
    layered = mesh.in_layers(eccentricity)
    own = normals[mesh.rod_nodes]
    return layered, positions[mesh.rod_nodes] + layered.heights[:, None] * own, own


def middle_surface(mesh: GridMesh, layered: GridMesh, positions: Floats) -> Floats:
    """(n, 3) places of the nodes of `mesh` between two layers of rods [m], whose nodes lie at `positions` (k, 3):
    `layered` is `mesh` in layers, or `mesh` itself."""
    if not layered.layered:
        return positions
    middle = positions - layered.heights[:, None] * node_normals(layered, positions)
    total = np.zeros((mesh.node_count, 3))
    np.add.at(total, mesh.rod_nodes, middle)
    return total / np.bincount(mesh.rod_nodes, minlength=mesh.node_count)[:, None]


def joint_tangents(mesh: GridMesh, positions: Floats) -> Floats:
    """(c, 2, 3) tangents of both rods at each joint, from the neighbours on either side."""
    result = np.empty((len(mesh.grid.crossings), 2, 3))
    for side in (0, 1):
        rods, at = mesh.grid.crossings.rods[:, side], mesh.grid.crossings.at[:, side]
        place = np.empty(len(rods), dtype=np.intp)
        for rod in np.unique(rods):
            here = mesh.rod_slice(int(rod))
            mine = np.flatnonzero(rods == rod)
            place[mine] = here.start + np.abs(mesh.stations[here] - at[mine, None]).argmin(axis=1)
        before = np.maximum(place - 1, mesh.rod_start[rods])
        after = np.minimum(place + 1, mesh.rod_stop[rods] - 1)
        result[:, side] = positions[mesh.rod_nodes[after]] - positions[mesh.rod_nodes[before]]
    return result
