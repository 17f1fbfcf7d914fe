"""Contact with a target in time: touching nodes lose a direction for one step [HQK Eqs 8-12, Algorithm 1].

A node that a step would leave below the surface is moved to it along its normal and has, in that step, no other
motion along it: the paper's S_i = I - n n', an infinite mass in one direction. Here the direction is taken out of the
system, which stays symmetric; the paper's S_i filters only the rows of the forces, and its system is not symmetric
(ERRATA to Eq 11). Both have the same solution: the same balance along the free directions, the prescribed displacement
along the normal.

Two more ERRATA. Eqs 8 to 10 measure along z, which is undefined outside the target's plan and singular at a rim with
a vertical tangent, where they throw hanging nodes sideways by the square root of their depth. Here n and the
displacement along it are those of the closest point of the body, the target closed by a wall below its rim: no node
moves further than its depth. And the displacement is counted from the start of the step:
dv_pre = ((c - x_k)/h - v_k).n n, c the closest point.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.frames import dot
from rodshell.kernels import njit
from rodshell.model import Freedom
from rodshell.targets import Target
from rodshell.validation import brief, choice, instance, not_negative

ROUND_OFF = 1e-10  # of the target's size: a node is below the surface only from this depth on
_SUPPORTED = 1e-6  # cosine between normal and free directions below which a node's supports hold it along the normal

Stopped = Literal["all", "normal"]


@dataclass(frozen=True, eq=False)
class Touching:
    """Planes that nodes may slide on, added to their supports: a flat constraint of one step.

    The blocked directions stay among the unknowns (see `Freedom`), so that nodes may come and go from step to step
    while the pattern of the matrix stays the same.

    Args:
        supports: the shell's supports, a constraint.
        free: the free directions that they leave.
        nodes: (k,) nodes that touch.
        points, normals: (k, 3) a point of each node's plane [m], and its unit normal.
        stuck: (k,) bool; nodes that friction holds at their position in the plane.
    """

    supports: Any  # a solver's `Constraint`; its type is defined in a package that imports this one
    free: Freedom
    nodes: Ints
    points: Floats
    normals: Floats
    stuck: Bools

    __repr__ = brief

    @staticmethod
    def none(supports: Any, state: Floats) -> "Touching":
        """The constraint where nothing touches, as at the start of each step, whatever touched in the one before."""
        nowhere, no_nodes = np.empty((0, 3)), np.empty(0, dtype=np.intp)
        return Touching(supports, supports.freedom(state), no_nodes, nowhere, nowhere, np.empty(0, dtype=bool))

    def freedom(self, state: Floats) -> Freedom:
        """The free directions, those along the normals blocked."""
        return self._turned[0]

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        """The curvature of the supports: planes have none."""
        return np.asarray(self.supports.curvature(state, gradient))

    def remaining(self, state: Floats) -> Floats | None:
        """(N, 3) displacement [m] to the planes along the free part of their normals, and that of the supports."""
        prescribed = self.supports.remaining(state)
        result = np.zeros_like(state) if prescribed is None else prescribed.copy()
        _, along, cosine = self._turned
        gap = dot(self.points - state[self.nodes] - result[self.nodes], self.normals)
        result[self.nodes] += (gap / cosine)[:, None] * along
        return result

    def retract(self, state: Floats) -> Floats:
        """The state itself: planes need no retraction."""
        return state

    @cached_property
    def _turned(self) -> tuple[Freedom, Floats, Floats]:
        """The supports' directions of each node turned so that the last lies along the normal, and is blocked.

        And (k, 3) the unit parts of the normals in the free directions, and (k,) their cosines with the normals.
        """
        if not len(self.nodes):
            return self.free, self.normals, np.empty(0)
        directions, along, cosine = self.free.directions.copy(), self.normals.copy(), np.empty(len(self.nodes))
        _turn(directions, self.free.count, self.nodes, self.stuck, along, cosine)
        return Freedom(directions, self.free.count), along, cosine

    def free_share(self, nodes: Ints, normals: Floats) -> Floats:
        """(k,) cosines between the unit normals (k, 3) of `nodes` (k,) and the directions that their supports leave
        free."""
        along = np.einsum("kcx,kx->kc", self.free.directions[nodes], normals)
        along[np.arange(3) >= self.free.count[nodes][:, None]] = 0.0
        return np.asarray(np.sqrt(dot(along, along)))


@dataclass(frozen=True, eq=False)
class ModifiedMass:
    """Contact with a target during a motion [HQK 3.1].

    Args:
        target: its body, closed by the wall below its rim.
        nodes: (k,) blocks that may touch it.
        stopped: which part of a touching node's velocity an inelastic impact removes: "all" of it [HQK 3.1], or the
            "normal" part. The first acts on sliding nodes as a drag m/h, which depends on the time step.
        friction: Coulomb's coefficient [-], by which touching nodes stick or slip; with friction only the normal part
            of the velocity is removed.

    Raises:
        InputError: the coefficient is negative or not finite; `stopped` is neither "all" nor "normal".
    """

    target: Target
    nodes: Ints
    stopped: Stopped = "all"
    friction: float = 0.0

    __repr__ = brief

    def __post_init__(self) -> None:
        instance("target", self.target, Target)
        choice("stopped", self.stopped, get_args(Stopped))
        not_negative("the friction coefficient", self.friction)

    @property
    def stops_all(self) -> bool:
        """Whether touching nodes lose their velocity along the surface, too."""
        return self.stopped == "all" and not self.friction

    def below(self, state: Floats, touching: Touching) -> Touching | None:
        """The constraint of a step so far with all nodes that are newly below the surface at `state`, the step's end;
        None if there are none [HQK Eq 8].

        Nodes that touch already are not tested again: above a concave surface a node on its plane is below it by an
        amount quadratic in its slide, and elsewhere by round-off (ERRATA to Algorithm 1, which could loop on them).
        """
        outside = np.ones(len(state), dtype=bool)
        outside[self.nodes] = self.target.outside(state[self.nodes])
        outside[touching.nodes] = True
        open_nodes = np.flatnonzero(~outside)
        gap = self.target.contact(state[open_nodes])
        new = gap.distance < -ROUND_OFF * self.target.size
        new &= touching.free_share(open_nodes, gap.normal) > _SUPPORTED
        if not new.any():
            return None
        points = state[open_nodes] - gap.distance[:, None] * gap.normal
        sticking = np.full(int(np.count_nonzero(new)), self.friction > 0)
        return Touching(
            touching.supports,
            touching.free,
            np.append(touching.nodes, open_nodes[new]),
            np.vstack([touching.points, points[new]]),
            np.vstack([touching.normals, gap.normal[new]]),
            np.append(touching.stuck, sticking),
        )

    def released(self, touching: Touching, reactions: Floats) -> tuple[Touching, Floats] | None:
        """The constraint without the nodes that friction cannot hold; None where it holds all.

        Args:
            reactions: (N, 3) of all supports [N]; that of a stuck node must lie in the friction cone,
                |tangential| <= friction * normal.

        Returns:
            The constraint, and the friction force (N, 3) [N] on the released nodes while they slip, against their
            motion.
        """
        if not touching.stuck.any():
            return None
        reaction = reactions[touching.nodes]
        push = np.maximum(dot(reaction, touching.normals), 0.0)
        across = reaction - dot(reaction, touching.normals)[:, None] * touching.normals
        size = np.sqrt(dot(across, across))
        slips = touching.stuck & (size > self.friction * push)
        if not slips.any():
            return None
        rubbing = np.zeros_like(reactions)
        rubbing[touching.nodes[slips]] = self.friction * (push / np.maximum(size, 1e-300))[slips, None] * across[slips]
        return replace(touching, stuck=touching.stuck & ~slips), rubbing

    def landed(self, velocity: Floats, touching: Touching) -> Floats:
        """(N, 3) the velocity after the inelastic impact of the nodes that touch [m/s]."""
        result, nodes = velocity.copy(), touching.nodes
        if self.stops_all:
            result[nodes] = 0.0
        else:
            result[nodes] -= dot(velocity[nodes], touching.normals)[:, None] * touching.normals
        return result


@njit("f3 i1 i1 b1 f2 f1")
def _turn(directions, count, nodes, stuck, along, cosine):  # type: ignore[no-untyped-def]
    """Reflect the directions of each node so that the last is the free part of the normal `along`; it becomes zero."""
    part, mirror = np.empty(3), np.empty(3)
    for m in range(len(nodes)):
        d, last, length = directions[nodes[m]], count[nodes[m]] - 1, 0.0
        for c in range(last + 1):
            part[c] = d[c, 0] * along[m, 0] + d[c, 1] * along[m, 1] + d[c, 2] * along[m, 2]
            length += part[c] * part[c]
        cosine[m] = np.sqrt(length)
        for x in range(3):
            along[m, x] = 0.0
            for c in range(last + 1):
                along[m, x] += part[c] / cosine[m] * d[c, x]
        if stuck[m]:
            d[:] = 0.0
            continue
        square = 0.0
        for c in range(last + 1):
            part[c] /= cosine[m]
            if c == last:
                part[c] += -1.0 if part[c] < 0 else 1.0
            square += part[c] * part[c]
        for x in range(3):
            mirror[x] = 0.0
            for c in range(last + 1):
                mirror[x] += part[c] * d[c, x]
        for x in range(3):
            for c in range(last):
                d[c, x] -= 2.0 * part[c] / square * mirror[x]
            d[last, x] = 0.0
