"""The three methods of draping, each with its own options, and the draped grid that all of them return.

Bound     the inextensible net, to which the grid is bound: no load, no scale, no material
Gravity   static equilibrium under the rods' weight, in frictionless unilateral contact
Fall      the paper's method: the grid falls on the target in time and comes to rest there [HQK 3]
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal, get_args

import numpy as np

from rodshell.arrays import Bools, Floats, NodePositions
from rodshell.contact.modified_mass import Stopped
from rodshell.errors import InputError
from rodshell.formfinding.finite_sections import StrongBending, joint_angles
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs
from rodshell.layout import FlatRod, GridMesh, Layout
from rodshell.layout.lattices import EDGES_A_SPAN
from rodshell.nets import ChebyshevNet
from rodshell.rods.section import Rod
from rodshell.solve.equilibrium import SolveReport, Status
from rodshell.targets import Target
from rodshell.validation import choice, described, instance, keep, not_negative, positive, whole

if TYPE_CHECKING:
    from rodshell.formfinding.rest import Rest

STANDARD_GRAVITY = 9.81  # m/s2, as in the paper
STOPPED: tuple[Stopped, ...] = get_args(Stopped)

MethodName = Literal["bound", "gravity", "paper"]


@dataclass(frozen=True)
class Bound:
    """The grid slides on the target without friction; bending alone determines what the net leaves open."""

    name: ClassVar[MethodName] = "bound"
    edges_a_span: ClassVar[int] = EDGES_A_SPAN  # of the mesh per spacing, where the layout leaves its edge open


@dataclass(frozen=True, kw_only=True)
class Gravity:
    """The grid rests on the target in static equilibrium, under its weight.

    Args:
        acceleration: of gravity [m/s2].

    Raises:
        InputError: the acceleration is not a positive number.
    """

    acceleration: float = STANDARD_GRAVITY

    name: ClassVar[MethodName] = "gravity"
    edges_a_span: ClassVar[int] = EDGES_A_SPAN

    def __post_init__(self) -> None:
        keep(self, positive, "m/s2", "acceleration", what="the {} of gravity")


@dataclass(frozen=True, kw_only=True)
class Fall:
    """The grid falls on the target in time, by implicit Euler steps with impacts, until it is at rest [HQK 3].

    Args:
        acceleration: of gravity [m/s2].
        height: of the flat grid above the target's highest point [m].
        coupling: of rods at their joints: shared DOFs, implicit or explicit penalty [HQK 2.2].
        time_step: [s]; default: 10 ms on a target of 0.2 m, in proportion to the square root of its size; with explicit
            ties at most nine tenths of their stability limit, whichever nodes touch.
        duration: longest simulated time [s]; default: 6 s on a target of 0.2 m, in proportion to the root of its size.
        stopped: the part of a node's velocity that an impact removes, see `ModifiedMass`.
        friction: Coulomb's coefficient between rods and target [-].
        drag: rate at which all velocities decay [1/s]; default: 12/s on a target of 0.2 m, in inverse proportion to the
            square root of its size. The state of rest does not depend on it.
        stream: folder for the frames, which must not contain any yet, read with `TimeSeries.load`; None keeps none.
        every: number of steps from one frame to the next.
        settle: end as soon as the grid is at rest; otherwise at the end of the duration.

    Raises:
        InputError: a value is of the wrong kind or sign.
    """

    acceleration: float = STANDARD_GRAVITY
    height: float = 0.05
    coupling: Coupling = field(default_factory=SharedDofs)
    time_step: float | None = None
    duration: float | None = None
    stopped: Stopped = "all"
    friction: float = 0.0
    drag: float | None = None
    stream: str | Path | None = None
    every: int = 1
    settle: bool = True

    name: ClassVar[MethodName] = "paper"
    edges_a_span: ClassVar[int] = 2  # 15 mm on the paper's grids: its 8000 unknowns [HQK 3.3], see E21

    def __post_init__(self) -> None:
        keep(self, positive, "m/s2", "acceleration", what="the {} of gravity")
        keep(self, positive, "m", "height", what="the fall's {}")
        keep(self, positive, "s", "time_step", "duration", what="the fall's {}")
        keep(self, not_negative, "", "friction", what="the fall's {}")
        keep(self, not_negative, "1/s", "drag", what="the fall's {}")
        require_coupling("the fall's coupling", self.coupling)
        choice("the fall's stopped", self.stopped, STOPPED)
        whole("the fall's every", self.every, 1)
        if self.stream is not None:
            instance("the fall's stream", self.stream, str | Path, "the path of a folder")
        instance("the fall's settle", self.settle, bool, "True or False")


Method = Bound | Gravity | Fall
"""A method of draping."""


def require_method(value: object) -> None:
    """Refuse all but the three methods, with one sentence that names them.

    Raises:
        InputError: `value` is a word, a class, or anything else.
    """
    if not isinstance(value, Bound | Gravity | Fall):
        methods = "rodshell.Bound(), rodshell.Gravity() or rodshell.Fall()"
        raise InputError(f"method must be {methods}, not {described(value)}")


def require_coupling(name: str, value: object) -> None:
    """Refuse all but the three couplings, with one sentence that calls the argument by its `name`.

    Raises:
        InputError: `value` is a word, a class, or anything else.
    """
    kinds = "rodshell.SharedDofs(), rodshell.ImplicitPenalty() or rodshell.ExplicitPenalty()"
    instance(name, value, SharedDofs | ImplicitPenalty | ExplicitPenalty, kinds)


@dataclass(frozen=True, eq=False)
class DrapeFigures:
    """How well a grid lies on its target.

    Args:
        max_gap: largest distance between the target and a node that should touch it, or depth of a node inside [m].
        contact_pulls: number of nodes on the target that it would have to pull to hold them.
        min_angle: smallest angle between two rods at a joint on the target [rad].
        min_angle_at: x, y, z of that joint [m].
        net_deviation: (k, 2) how far past its ends in the flat grid each of the `rods` would end if this drape placed
            them, at start and end, along the rod [m]; None where the drape does place them.
        strong_bending: bending of rods with a strong axis whose joints keep them from rolling (`Bound`); else None.
    """

    max_gap: float
    contact_pulls: int
    min_angle: float
    min_angle_at: tuple[float, float, float]
    net_deviation: Floats | None = None
    strong_bending: StrongBending | None = None


@dataclass(frozen=True, eq=False)
class FlatState:
    """Rods along curves of a target, laid out in the plane such that they bend as little as they can.

    Args:
        positions: (n, 2) of the mesh's nodes [m]; where no such state was found, their plan.
        strain: the largest of a rod's fibres that bend in the plane [-], or None.
        report: of the solve; without negative modes that state is stable.
    """

    positions: Floats
    strain: float | None
    report: SolveReport


@dataclass(frozen=True, eq=False)
class Draped:
    """A flat grid lying on a target, not yet trimmed.

    Args:
        target, layout, rod, anchor: as they were given; anchor is x, y [m], or None.
        eccentricity: distance of the two layers of rods [m]; 0 where they meet.
        mesh: the whole mesh, with the lines and tails that are cut off later.
        positions: (n, 3) of its nodes [m]; of rods in two layers, of the surface between the layers.
        rods: the k rods to be built, each from end to end of the target (`Bound`), or whole (`Gravity`, `Fall`).
        levels: report of the solve on each level of refinement, the last at the layout's edge length.
        figures: how well the grid lies on the target.
        net: the net that the drape started from; None where it started from the flat grid.
        rest: how the motion ended (`Fall`); else None.
        flat_state: of rods along curves of the target, which do not form a straight lattice in the plane; else None.
    """

    method: Method
    target: Target
    layout: Layout
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
    flat_state: FlatState | None = None
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        gap = f"largest gap to the target {1e3 * self.figures.max_gap:.3g} mm"
        return f"<Draped by {self.method.name}: {len(self.rods)} rods, {gap}, {self.report.status.value}>"

    @property
    def dropped(self) -> tuple[tuple[str, str], ...]:
        """Names of the rods that have no place on the target, each with the reason."""
        return self.net.dropped if self.net is not None else ()

    @property
    def report(self) -> SolveReport:
        """The report of the solve at the layout's edge length."""
        return self.levels[-1]

    @property
    def converged(self) -> bool:
        """Whether the drape reached an equilibrium, and a fall came to rest."""
        return self.report.status is Status.CONVERGED


def smallest_joint_angle(
    mesh: GridMesh, positions: NodePositions, inside: Bools
) -> tuple[float, tuple[float, float, float]]:
    """Smallest angle between two rods at a joint [rad], and where it is [m].

    Args:
        inside: (n,) nodes whose joints are considered.
    """
    angle = np.where(inside[mesh.joint_nodes], joint_angles(mesh, positions), np.inf)
    k = int(np.argmin(angle))
    x, y, z = positions[mesh.joint_nodes[k]].tolist()
    return float(angle[k]), (x, y, z)
