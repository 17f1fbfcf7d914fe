"""A sum of energies: its value and derivatives, whole or in the free directions."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.sparse import csc_matrix

from rodshell.arrays import Floats, Ints
from rodshell.kernels import njit
from rodshell.model.assembly import Assembly, Freedom
from rodshell.rods.elements import Elements, evaluate_all


@dataclass(frozen=True, eq=False)
class Potential:
    """The sum of the energies of several sets of elements, at states (N, 3) [m, at twist angles rad]."""

    sets: Sequence[Elements]

    @property
    def blocks(self) -> list[Ints]:
        """(m, k) blocks of the elements of each set."""
        return [elements.blocks for elements in self.sets]

    def refreshed(self, state: Floats) -> Self:
        """The same sum, the source frames of its elements at `state`."""
        return type(self)(tuple([elements.refreshed(state) for elements in self.sets]))

    def energy(self, state: Floats) -> float:
        """[J]"""
        unused = np.zeros_like(state)
        return sum(elements.evaluate(state, unused) for elements in self.sets)

    def gradient(self, state: Floats) -> Floats:
        """(N, 3) [N, for angles N m]."""
        gradient = np.zeros_like(state)
        self.add_gradient(state, gradient)
        return gradient

    def add_gradient(self, state: Floats, gradient: Floats) -> None:
        """Add the gradient to `gradient` (N, 3)."""
        for elements in self.sets:
            elements.evaluate(state, gradient)

    def hessians(self, state: Floats) -> list[Floats]:
        """(m, 3k, 3k) Hessians of the elements of each set."""
        result = room_for(self.blocks)
        evaluate_all(self.sets, state, np.zeros_like(state), result)
        return result

    def product(self, state: Floats, motion: Floats) -> Floats:
        """(N, 3) product of the Hessian with displacements (N, 3) [m, rad]."""
        result = np.zeros_like(motion)
        for of_set, blocks in zip(self.hessians(state), self.blocks, strict=True):  # summed by rows: fewer digits lost
            forces = np.einsum("mij,mj->mi", of_set, motion[blocks].reshape(len(blocks), 3 * blocks.shape[1]))
            np.add.at(result, blocks, forces.reshape(*blocks.shape, 3))
        return result

    def curvature(self, state: Floats, motion: Floats) -> float:
        """v'Hv for displacements v = `motion` (N, 3) [J], H being the Hessian."""
        return float(np.sum(motion * self.product(state, motion)))

    def matrix(self, state: Floats, free: Freedom) -> csc_matrix:
        """(dofs, dofs) Hessian in the free directions, both triangles."""
        assembly = Assembly.of(self.blocks, free)
        return assembly.matrix(assembly.assemble(self.hessians(state), self.blocks, free))


def room_for(sets: Sequence[Ints]) -> list[Floats]:
    """Zeros for the element Hessians (m, 3k, 3k) of each set of elements on blocks (m, k)."""
    return [np.zeros((len(blocks), 3 * blocks.shape[1], 3 * blocks.shape[1])) for blocks in sets]


def product(hessians: Sequence[Floats], sets: Sequence[Ints], motion: Floats) -> Floats:
    """(N, 3) product of a sum of element Hessians, (m, 3k, 3k) on blocks (m, k) of each set, with displacements."""
    result = np.zeros_like(motion)
    for of_set, blocks in zip(hessians, sets, strict=True):
        _add_product(of_set, blocks, motion, result)
    return result


@njit("f3 i2 f2 f2")
def _add_product(hessians, blocks, motion, result):  # type: ignore[no-untyped-def]
    """Add to `result` (n, 3) what elements with `hessians` (m, 3k, 3k) on `blocks` (m, k) make of displacements."""
    for m in range(blocks.shape[0]):
        for a in range(blocks.shape[1]):
            for b in range(blocks.shape[1]):
                i, j = blocks[m, a], blocks[m, b]
                for k in range(3):
                    for d in range(3):
                        result[i, k] += hessians[m, 3 * a + k, 3 * b + d] * motion[j, d]
