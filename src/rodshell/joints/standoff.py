"""Stand-offs: bolts that hold a rod at a distance from a crossing, along the normal of the two rods there.

    E = C/2 |g|^2,   g = x - x_J - d n,   n = (x_1 - x_3) x (x_2 - x_4) / |...|

x is the node that is held, x_J the crossing's, x_1 and x_3 the nodes after and before it on one rod, x_2 and x_4 those
on the other. The normal turns with the rods, so that moving all nodes rigidly costs nothing. Unlike `ties.OffsetTie` it
needs no frames of the rods; the moment of its force about the crossing acts on the rods' neighbouring nodes.
"""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats, Ints, State
from rodshell.rods.elements import NO_HESSIANS, WithoutFrames
from rodshell.validation import brief

SIDES = np.kron([[0, 0, 1, 0, -1, 0], [0, 0, 0, 1, 0, -1]], np.eye(3))  # (a, b) of the six nodes' coordinates


@dataclass(frozen=True, eq=False)
class Standoffs(WithoutFrames):
    """Springs between nodes and places above crossings.

    Args:
        blocks: (m, 6) nodes x, x_J, x_1, x_2, x_3, x_4; where a rod ends at the crossing, x_J stands for the node
            missing.
        distances: (m,) d along the normal [m].
        stiffness: (m,) C [N/m].
    """

    blocks: Ints
    distances: Floats
    stiffness: Floats

    __repr__ = brief

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        x = state[self.blocks]
        a, b = x[:, 2] - x[:, 4], x[:, 3] - x[:, 5]
        c = np.cross(a, b)
        size = np.linalg.norm(c, axis=1)
        n = c / size[:, None]
        gap = x[:, 0] - x[:, 1] - self.distances[:, None] * n
        dc = np.concatenate([-_crossing(b), _crossing(a)], axis=2) @ SIDES  # (m, 3, 18): c by the coordinates
        across = np.eye(3) - n[:, :, None] * n[:, None, :]
        dn = across @ dc / size[:, None, None]
        dg = -self.distances[:, None, None] * dn
        dg[:, :, 0:3] += np.eye(3)
        dg[:, :, 3:6] -= np.eye(3)
        force = self.stiffness[:, None] * gap
        np.add.at(gradient, self.blocks, np.einsum("mi,mij->mj", force, dg).reshape(-1, 6, 3))
        if len(hessians):
            pull = -self.distances[:, None] * force  # by n
            curved = _second(pull, n, size, dc, across)
            hessians[:] = self.stiffness[:, None, None] * np.einsum("mij,mik->mjk", dg, dg) + curved
        return 0.5 * float(np.vdot(force, gap))


def _crossing(v: Floats) -> Floats:
    """(m, 3, 3) matrices that take w to v x w."""
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)


def _second(pull: Floats, n: Floats, size: Floats, dc: Floats, across: Floats) -> Floats:
    """(m, 18, 18) second derivatives of n, times `pull` (m, 3): those of c/|c| by c, and those of c by coordinates."""
    along = np.einsum("mi,mij->mj", n, dc)
    flat = np.einsum("mi,mik,mkj->mj", pull, across, dc)
    lean = np.einsum("mij,mik,mkl->mjl", dc, across, dc)
    of_size = along[:, :, None] * flat[:, None, :]
    by_c = of_size + of_size.transpose(0, 2, 1) + np.einsum("mi,mi->m", pull, n)[:, None, None] * lean
    by_x = np.zeros((len(pull), 6, 6))
    turned = _crossing(np.einsum("mi,mij->mj", pull, across) / size[:, None])  # p . (da x db) = da . (db x p)
    by_x[:, :3, 3:] = -turned
    by_x[:, 3:, :3] = turned
    return np.asarray(SIDES.T @ by_x @ SIDES - by_c / size[:, None, None] ** 2)
