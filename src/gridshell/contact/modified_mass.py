"""Contact with a target in time: touching nodes lose a direction for one step [HQK Eqs 8-12, Algorithm 1].

A node that a step would leave below the surface is moved to it along its normal and has, in that step, no other
motion along it: the paper's S_i = I - n n', an infinite mass in one direction. Here the direction is taken out of the
system, which stays symmetric; where S_i also filters the rows of the forces, the paper's system is not (ERRATA to
Eq 11). Both have the same solution: along the free directions the same balance, along the normal the prescribed way.

Two more ERRATA. Eqs 8 to 10 measure along z, which is undefined beside the target, and singular at a rim with an
upright tangent, where they throw hanging nodes sideways by the square root of their depth. Here n and the way along
it are those of the closest point of the body, the target closed by a wall under its rim: no node moves further than
it is deep. And the way is counted from the start of the step: dv_pre = ((c - x_k)/h - v_k).n n, c the closest point.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gridshell.errors import InputError
from gridshell.geometry.vectors import dot
from gridshell.model import Freedom
from gridshell.targets import Target

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

ROUND_OFF = 1e-10  # of the target's size: a node is below the surface only from this depth on
SUPPORTED = 1e-6  # cosine between normal and free directions below which a node's supports hold it along the normal

Stopped = Literal["wholly", "along the normal"]


@dataclass(frozen=True)
class Touching:
    """Planes that nodes may slide on, added to their supports: a flat constraint of one step.

    The blocked directions keep their places among the unknowns (see `Freedom`), so that nodes may come and go from
    step to step in one and the same plan of the matrix.

    Parameters
    ----------
    supports : what holds the shell anyway.
    free : its free directions.
    nodes : (k,); points, normals : (k, 3) the planes [m].
    stuck : (k,) bool; nodes that friction holds in their place in the plane.
    seen, clearance : (N, 3) a state, and (N,) distances from the target there that the nodes had at least [m].
    """

    supports: Any  # a solver's `Constraint`, which is defined above this floor
    free: Freedom
    nodes: Ints
    points: Floats
    normals: Floats
    stuck: NDArray[np.bool_]
    seen: Floats
    clearance: Floats

    @staticmethod
    def none(supports: Any, state: Floats, before: "Touching | None" = None) -> "Touching":
        """Nothing touches; `before`: of another step, whose look at the target may spare one."""
        seen, clearance = (state, np.zeros(len(state))) if before is None else (before.seen, before.clearance)
        nowhere, no_nodes = np.empty((0, 3)), np.empty(0, dtype=np.intp)
        free = supports.freedom(state)
        return Touching(supports, free, no_nodes, nowhere, nowhere, np.empty(0, dtype=bool), seen, clearance)

    def freedom(self, state: Floats) -> Freedom:
        return self._freedom

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        return np.asarray(self.supports.curvature(state, gradient))

    def remaining(self, state: Floats) -> Floats | None:
        """The way to the planes, along the free part of their normals, besides what the supports prescribe."""
        given = self.supports.remaining(state)
        result = np.zeros_like(state) if given is None else given.copy()
        along, cosine = self._free_normals
        gap = dot(self.points - state[self.nodes] - result[self.nodes], self.normals)
        result[self.nodes] += (gap / cosine)[:, None] * along
        return result

    def retract(self, state: Floats) -> Floats:
        return state

    @cached_property
    def _free_normals(self) -> tuple[Floats, Floats]:
        """(k, 3) unit parts of the normals in the free directions, and (k,) their cosines with the normals."""
        own = self.own_directions(self.nodes)
        parts = np.einsum("kc,kcx->kx", np.einsum("kcx,kx->kc", own, self.normals), own)
        length = np.sqrt(dot(parts, parts))
        return parts / length[:, None], length

    @cached_property
    def _freedom(self) -> Freedom:
        """The supports' directions of each node reflected so that the last lies along the normal, and is blocked."""
        directions = self.free.directions.copy()
        own, last = self.own_directions(self.nodes), self.free.count[self.nodes] - 1
        rows = np.arange(len(self.nodes))
        mirror = np.einsum("kcx,kx->kc", own, self._free_normals[0])  # a unit vector in components
        mirror[rows, last] += np.where(mirror[rows, last] < 0, -1.0, 1.0)
        shares = 2.0 * mirror / dot(mirror, mirror)[:, None]
        turned = own - shares[:, :, None] * np.einsum("kc,kcx->kx", mirror, own)[:, None, :]
        turned[rows, last] = 0.0
        turned[self.stuck] = 0.0
        directions[self.nodes] = turned
        return Freedom(directions, self.free.count)

    def own_directions(self, nodes: Ints) -> Floats:
        """(k, 3, 3) the supports' free directions of some nodes, zero past their count."""
        used = np.arange(3) < self.free.count[nodes][:, None]
        return np.asarray(np.where(used[:, :, None], self.free.directions[nodes], 0.0))


@dataclass(frozen=True)
class ModifiedMass:
    """What contact with a target does to a motion.

    Parameters
    ----------
    target : its body, closed by the wall under its rim.
    nodes : blocks that may touch it.
    stopped : what an inelastic impact takes of a touching node's velocity: all of it [HQK 3.1], or what is along
        the normal. The first acts on sliding nodes as a drag m/h, which depends on the time step.
    friction : Coulomb's coefficient, by which touching nodes stick or slip; it stops only what is along the normal.

    Raises
    ------
    InputError : the coefficient is negative or not finite.
    """

    target: Target
    nodes: Ints
    stopped: Stopped = "wholly"
    friction: float = 0.0

    def __post_init__(self) -> None:
        if not (isfinite(self.friction) and self.friction >= 0):
            raise InputError(f"the friction coefficient must be 0 or positive, not {self.friction}")

    def touching(self, supports: Any, state: Floats, before: Touching | None = None) -> Touching:
        """The constraint to start a step with: nothing touches, whatever did in the step before."""
        return Touching.none(supports, state, before)

    def below(self, state: Floats, touching: Touching) -> Touching | None:
        """The constraint with all nodes that are newly below the surface at `state`; None where no node is.

        Nodes that touch already are not looked at again: a plane's node is below a hollow by the square of its
        slide, and on the plane by round-off (ERRATA to Algorithm 1, which could loop on them).
        """
        moved = state - touching.seen
        clearance = touching.clearance - np.sqrt(dot(moved, moved))  # a distance changes by no more than the way
        looked_at = self.nodes[clearance[self.nodes] <= 0]
        open_nodes = np.setdiff1d(looked_at, touching.nodes, assume_unique=True)
        gap = self.target.contact(state[open_nodes])
        clearance[open_nodes] = gap.distance
        own = touching.own_directions(open_nodes)
        free_part = np.einsum("kcx,kx->kc", own, gap.normal)
        new = (gap.distance < -ROUND_OFF * self.target.size) & (dot(free_part, free_part) > SUPPORTED**2)
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
            state,
            clearance,
        )

    def released(self, touching: Touching, reactions: Floats) -> tuple[Touching, Floats] | None:
        """The constraint without the nodes that stick by more than friction can hold; None where none does.

        And the force (N, 3) [N] of friction on these once they slip, against the way they would go.

        reactions : (N, 3) of all supports [N]; a stuck node's lies in its cone, |tangential| <= friction * normal.
        """
        given = reactions[touching.nodes]
        push = np.maximum(dot(given, touching.normals), 0.0)
        across = given - dot(given, touching.normals)[:, None] * touching.normals
        size = np.sqrt(dot(across, across))
        slips = touching.stuck & (size > self.friction * push)
        if not slips.any():
            return None
        rubbing = np.zeros_like(reactions)
        rubbing[touching.nodes[slips]] = self.friction * (push / np.maximum(size, 1e-300))[slips, None] * across[slips]
        return replace(touching, stuck=touching.stuck & ~slips), rubbing

    def landed(self, velocity: Floats, touching: Touching) -> Floats:
        """(N, 3) the velocity after the inelastic impact."""
        result, nodes = velocity.copy(), touching.nodes
        if self.stopped == "wholly" and not self.friction:
            result[nodes] = 0.0
        else:
            result[nodes] -= dot(velocity[nodes], touching.normals)[:, None] * touching.normals
        return result
