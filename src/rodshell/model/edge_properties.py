"""A shell as a function of its edges' stiffnesses and rest lengths, with the derivatives of its forces by them.

Each edge has five properties: EA [N], EI1, EI2, GJ [N m2] and its rest length l [m]. A bend lies between two edges,
whose half edges act in series; a clamp has the half of the last edge alone:

    1/K = sum l / (2 S),   so   d log K / d log S = K l / (2 S) = -d log K / d log l   of either edge.

An energy is linear in its stiffness, so the derivative of its gradient by log K is that gradient, element by element.
The axial force of an edge changes by its rest length as -EA |e| / l^2.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from rodshell.arrays import Floats, Ints
from rodshell.model.shell import Shell
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.elements import Elements, each_curvature, each_gradient
from rodshell.rods.isotropic import IsotropicBend, IsotropicBendTwist

EA, EI1, EI2, GJ, LENGTH = range(5)
PROPERTIES = 5


@dataclass(frozen=True, eq=False)
class EdgeProperties:
    """How a shell's energies follow from the properties of its edges. Build it with `of`.

    Parameters
    ----------
    shell : the shell; its blocks and source frames stay as they are.
    before, after : (b,) edge before and after each bend; of a clamp the last edge, twice.
    table : (e, 5) its own properties, in the order EA, EI1, EI2, GJ, length.
    """

    shell: Shell
    before: Ints
    after: Ints
    table: Floats

    @staticmethod
    def of(shell: Shell, table: Floats) -> "EdgeProperties":
        """Of a shell.

        Parameters
        ----------
        shell : to be varied.
        table : (e, 5) its edges' EA [N], EI1, EI2, GJ [N m2] and rest length [m].
        """
        rods = shell.mesh.edge_rods
        inner = np.flatnonzero(rods[1:] == rods[:-1])
        first = np.flatnonzero(np.append(True, rods[1:] != rods[:-1]))
        last = np.append(first[1:], len(rods)) - 1
        ends = np.column_stack([first, last]).ravel()[: len(shell.ghosts)]
        return EdgeProperties(shell, np.append(inner, ends), np.append(inner + 1, ends), table)

    def varied(self, table: Floats) -> "EdgeProperties":
        """The shell whose edges have other properties.

        Parameters
        ----------
        table : (e, 5) the properties of the edges.
        """
        elements = tuple(self._with_stiffness(element, table) for element in self.shell.elements)
        edges = self.shell.stretch
        stretch = replace(edges, stiffness=table[:, EA].copy(), rest_lengths=table[:, LENGTH].copy())
        return replace(self, shell=replace(self.shell.with_elements(elements), stretch=stretch), table=table)

    def at(self, elements: Sequence[Elements]) -> "EdgeProperties":
        """The same with other source frames.

        Parameters
        ----------
        elements : those of the shell, with their source frames at another state.
        """
        return replace(self, shell=self.shell.with_elements(tuple(elements)))

    def gradient_slopes(self, state: Floats) -> csr_array:
        """(3N, 5e) derivatives of the gradient by the logarithms of the properties [N, at twist angles N m].

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad], at or near the source frames.
        """
        stretch, edges = self.shell.stretch, np.arange(len(self.table))
        total = csr_array((state.size, self.table.size))
        for part, by_edge in self._parts():
            total += _spread(each_gradient(part, state), part.blocks, state.size) @ by_edge
        pulls, by_log_length = stretch.pulls(state), stretch.rest_lengths * stretch.by_rest_lengths(state)
        for kind, force in ((EA, stretch.stiffness * stretch.strains(state)), (LENGTH, by_log_length)):
            spread = _spread(force[:, None, None] * pulls, stretch.blocks, state.size)
            total += spread @ self._columns([(edges, kind, np.ones(len(edges)))])
        return total

    def curvature_slopes(self, state: Floats, motion: Floats) -> Floats:
        """(5e,) derivatives of v'Hv by the logarithms of the properties [J], H being the Hessian.

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad], at or near the source frames.
        motion : (N, 3) displacements v [m, rad].
        """
        stretch, result = self.shell.stretch, np.zeros(self.table.shape)
        for part, by_edge in self._parts():
            result += (each_curvature(part, state, motion) @ by_edge).reshape(self.table.shape)
        apart = motion[stretch.blocks[:, 1]] - motion[stretch.blocks[:, 0]]
        result[:, EA] += each_curvature(stretch, state, motion)
        result[:, LENGTH] -= stretch.stiffness / stretch.rest_lengths * np.einsum("ei,ei->e", apart, apart)
        return result.ravel()

    def _with_stiffness(self, element: Elements, table: Floats) -> Elements:
        if isinstance(element, IsotropicBend):
            return replace(element, stiffness=self._in_series(table, EI1, len(element.blocks)))
        if isinstance(element, BendTwist):
            count = len(element.blocks)
            bend = np.column_stack([self._in_series(table, kind, count) for kind in (EI1, EI2)])
            if not element.bend_stiffness.any():  # its bending is another's, see `Shell`
                bend[:] = 0.0
            return replace(element, bend_stiffness=bend, twist_stiffness=self._in_series(table, GJ, count))
        return element

    def _in_series(self, table: Floats, kind: int, count: int) -> Floats:
        """(count,) stiffness of the half edges at the first bends [N m]."""
        half = 0.5 * table[:, LENGTH] / table[:, kind]
        before, after = self.before[:count], self.after[:count]
        return np.asarray(1.0 / (half[before] + np.where(before == after, 0.0, half[after])))

    def _parts(self) -> Iterator[tuple[Elements, csr_array]]:
        """Energies with one stiffness each, and the derivatives (b, 5e) of the logarithms of their stiffnesses."""
        for element in self.shell.elements:
            if isinstance(element, IsotropicBend):
                kinds: tuple[int, ...] = (EI1,)
            elif isinstance(element, IsotropicBendTwist):
                kinds = (EI1, GJ)
            elif isinstance(element, BendTwist):
                kinds = (EI1, EI2, GJ)
            else:
                continue
            parts: tuple[Elements, ...] = element.parts
            for part, kind in zip(parts, kinds, strict=True):
                yield part, self._by_properties(kind, len(element.blocks))

    def _by_properties(self, kind: int, count: int) -> csr_array:
        half, before, after = 0.5 * self.table[:, LENGTH] / self.table[:, kind], self.before[:count], self.after[:count]
        whole = self._in_series(self.table, kind, count)
        entries = []
        for edge, there in ((before, np.ones(count)), (after, (before != after).astype(float))):
            share = there * half[edge] * whole
            entries += [(edge, kind, share), (edge, LENGTH, -share)]
        return self._columns(entries)

    def _columns(self, entries: Sequence[tuple[Ints, int, Floats]]) -> csr_array:
        """(b, 5e) with `value` (b,) in the columns of a property of the edges (b,)."""
        count = len(entries[0][0])
        rows = np.tile(np.arange(count), len(entries))
        columns = np.concatenate([PROPERTIES * edge + kind for edge, kind, _ in entries])
        values = np.concatenate([value for _, _, value in entries])
        return csr_array((values, (rows, columns)), shape=(count, self.table.size))


def _spread(gradients: Floats, blocks: Ints, size: int) -> csr_array:
    """(size, m) with the gradient (m, k, 3) of each element in a column."""
    rows = (3 * blocks[:, :, None] + np.arange(3)).ravel()
    columns = np.repeat(np.arange(len(blocks)), 3 * blocks.shape[1])
    return csr_array((gradients.ravel(), (rows, columns)), shape=(size, len(blocks)))
