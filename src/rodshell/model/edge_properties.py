"""A shell as a function of its edges' stiffnesses and rest lengths, with the derivatives of its forces by them.

Each edge has five properties: EA [N], EI1, EI2, GJ [N m2] and its rest length l [m]. A bend lies between two edges,
whose half edges act in series; a clamp has the half of the last edge alone:

    1/K = sum l / (2 S),   so   d log K / d log S = K l / (2 S) = -d log K / d log l   of either edge.

An energy is linear in its stiffness, so the derivative of its gradient by log K is that gradient, element by element.
The axial force of an edge changes by its rest length as -EA |e| / l^2. A joint acts in series with the half edges next
to it: its derivatives by the stiffnesses of the two sections that meet are central differences, at all joints at once.
Joints keep the lengths of these half edges.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from rodshell.arrays import Floats, Ints
from rodshell.joints import Joint
from rodshell.joints.crossings import RodNodes, stencils
from rodshell.joints.joint import elastic_joints, resists
from rodshell.joints.relative_rotation import RelativeRotation, is_elastic
from rodshell.model.shell import Shell
from rodshell.rods.elements import Elements, each_curvature, each_gradient, is_bends

EA, EI1, EI2, GJ, LENGTH = range(5)
PROPERTIES = 5
PROBE = 1e-4  # of a stiffness next to a joint: its forces' change is then exact to 1e-8


@dataclass(frozen=True, eq=False)
class EdgeProperties:
    """How a shell's energies follow from the properties of its edges. Build it with `of`.

    Args:
        shell: the shell; its blocks and source frames stay as they are.
        joint: one for all crossings, or one for each.
        before, after: (b,) edge before and after each bend; of a clamp the last edge, twice.
        table: (e, 5) its own properties, in the order EA, EI1, EI2, GJ, length.
        weight: (e,) weight per length over EA of each edge, which loads its nodes [1/m]; None: rods have no weight.
    """

    shell: Shell
    joint: Joint | Sequence[Joint]
    before: Ints
    after: Ints
    table: Floats
    weight: Floats | None = None

    @staticmethod
    def of(shell: Shell, joint: Joint | Sequence[Joint], table: Floats) -> "EdgeProperties":
        """Of a shell whose rods share their nodes or lie in layers.

        Args:
            joint: one for all its crossings, or one for each.
            table: (e, 5) its edges' EA [N], EI1, EI2, GJ [N m2] and rest length [m].
        """
        rods = shell.mesh.edge_rods
        inner = np.flatnonzero(rods[1:] == rods[:-1])
        first = np.flatnonzero(np.append(True, rods[1:] != rods[:-1]))
        last = np.append(first[1:], len(rods)) - 1
        ends = np.column_stack([first, last]).ravel()[: len(shell.ghosts)]
        return EdgeProperties(shell, joint, np.append(inner, ends), np.append(inner + 1, ends), table)

    def varied(self, table: Floats) -> "EdgeProperties":
        """The shell whose edges have other properties (e, 5)."""
        joints = iter(self._joints(self._at_nodes(table)))
        elements = tuple(self._with_stiffness(element, table, joints) for element in self.shell.elements)
        edges = self.shell.stretch
        stretch = replace(edges, stiffness=table[:, EA].copy(), rest_lengths=table[:, LENGTH].copy())
        return replace(self, shell=replace(self.shell.with_elements(elements), stretch=stretch), table=table)

    def at(self, elements: Sequence[Elements]) -> "EdgeProperties":
        """The same with the shell's `elements` as they are with their source frames at another state."""
        return replace(self, shell=self.shell.with_elements(tuple(elements)))

    def load(self, size: int) -> Floats:
        """(size, 3) weight of the edges on the blocks, half at either node, downwards [N]."""
        result = np.zeros((size, 3))
        if self.weight is not None:
            half = 0.5 * self.weight * self.table[:, EA] * self.table[:, LENGTH]
            for side in range(2):
                np.subtract.at(result[:, 2], self.shell.stretch.blocks[:, side], half)
        return result

    def gradient_slopes(self, state: Floats) -> csr_array:
        """(3N, 5e) derivatives of the gradient, less the weight, by the logarithms of the properties [N, N m].

        Args:
            state: (N, 3) node positions [m] and twist angles [rad], at or near the source frames.
        """
        stretch, edges = self.shell.stretch, np.arange(len(self.table))
        total = csr_array((state.size, self.table.size))
        for part, by_edge in self._parts():
            total += _spread(each_gradient(part, state), part.blocks, state.size) @ by_edge
        for change, blocks, by_edge in self._of_joints(lambda joint: each_gradient(joint, state)):
            total += _spread(change, blocks, state.size) @ by_edge
        pulls, by_log_length = stretch.pulls(state), stretch.rest_lengths * stretch.by_rest_lengths(state)
        for kind, force in ((EA, stretch.stiffness * stretch.strains(state)), (LENGTH, by_log_length)):
            spread = _spread(force[:, None, None] * pulls, stretch.blocks, state.size)
            total += spread @ self._columns([(edges, kind, np.ones(len(edges)))])
        if self.weight is not None:
            upwards = np.zeros((len(edges), 2, 3))
            upwards[:, :, 2] = (0.5 * self.weight * self.table[:, EA] * self.table[:, LENGTH])[:, None]
            both = self._columns([(edges, kind, np.ones(len(edges))) for kind in (EA, LENGTH)])
            total += _spread(upwards, stretch.blocks, state.size) @ both
        return total

    def curvature_slopes(self, state: Floats, motion: Floats) -> Floats:
        """(5e,) derivatives of v'Hv by the logarithms of the properties [J], H being the Hessian.

        Args:
            state: (N, 3) node positions [m] and twist angles [rad], at or near the source frames.
            motion: (N, 3) displacements v [m, rad].
        """
        stretch, result = self.shell.stretch, np.zeros(self.table.shape)
        for part, by_edge in self._parts():
            result += (each_curvature(part, state, motion) @ by_edge).reshape(self.table.shape)
        for change, _, by_edge in self._of_joints(lambda joint: each_curvature(joint, state, motion)):
            result += (change @ by_edge).reshape(self.table.shape)
        apart = motion[stretch.blocks[:, 1]] - motion[stretch.blocks[:, 0]]
        result[:, EA] += each_curvature(stretch, state, motion)
        result[:, LENGTH] -= stretch.stiffness / stretch.rest_lengths * np.einsum("ei,ei->e", apart, apart)
        return result.ravel()

    def _with_stiffness(self, element: Elements, table: Floats, joints: Iterator[RelativeRotation]) -> Elements:
        if is_bends(element):
            per_length = [self._in_series(table, kind, len(element.blocks)) for kind in (EI1, EI2, GJ)]
            return element.with_stiffness(np.column_stack(per_length))
        return element.with_stiffness_of(next(joints)) if is_elastic(element) else element

    def _in_series(self, table: Floats, kind: int, count: int) -> Floats:
        """(count,) stiffness of the half edges at the first bends [N m]."""
        half = 0.5 * table[:, LENGTH] / table[:, kind]
        before, after = self.before[:count], self.after[:count]
        return np.asarray(1.0 / (half[before] + np.where(before == after, 0.0, half[after])))

    def _parts(self) -> Iterator[tuple[Elements, csr_array]]:
        """Energies with one stiffness each, and the derivatives (b, 5e) of the logarithms of their stiffnesses."""
        for element in filter(is_bends, self.shell.elements):
            for part, modulus in zip(element.parts, element.moduli, strict=True):
                yield part, self._by_properties(EI1 + modulus, len(element.blocks))

    def _by_properties(self, kind: int, count: int) -> csr_array:
        half, before, after = 0.5 * self.table[:, LENGTH] / self.table[:, kind], self.before[:count], self.after[:count]
        whole = self._in_series(self.table, kind, count)
        entries = []
        for edge, there in ((before, np.ones(count)), (after, (before != after).astype(float))):
            share = there * half[edge] * whole
            entries += [(edge, kind, share), (edge, LENGTH, -share)]
        return self._columns(entries)

    @property
    def _rod_nodes(self) -> RodNodes:
        return RodNodes(self.shell.mesh, self.shell.node_blocks, self.shell.first_angle)

    def _shares(self, table: Floats) -> list[tuple[Ints, Ints, Floats]]:
        """Rod nodes, the edge before or after each, and how much its compliances, of EI1, EI2 and GJ, add to theirs."""
        nodes, lengths = self._rod_nodes, self.shell.mesh.edge_lengths
        every = np.arange(len(self.shell.mesh.rod_nodes))
        sides = []
        for side in range(2):
            there = every[nodes.has_edge(every, side)]
            edge = nodes.edge(there, side)
            sides.append((there, edge, lengths[edge, None] / table[edge, EI1:LENGTH]))
        return sides

    def _at_nodes(self, table: Floats) -> Floats:
        """(k, 3) EI1, EI2 and GJ at each rod node: those of the half edges next to it, in series [N m2]."""
        length, compliance = (
            np.zeros((len(self.shell.mesh.rod_nodes), 1)),
            np.zeros((len(self.shell.mesh.rod_nodes), 3)),
        )
        for there, edge, compliances in self._shares(table):
            length[there] += self.shell.mesh.edge_lengths[edge, None]
            compliance[there] += compliances
        return np.asarray(length / compliance)

    @property
    def _every_joint(self) -> Sequence[Joint]:
        """That of each crossing."""
        return self.joint if isinstance(self.joint, Sequence) else (self.joint,) * len(self.shell.mesh.grid.crossings)

    def _joints(self, at_nodes: Floats) -> tuple[RelativeRotation, ...]:
        """The elastic joints of rods with these stiffnesses (k, 3) at their nodes."""
        joints = self._every_joint
        return elastic_joints(self._rod_nodes, np.arange(len(joints)), joints, at_nodes, len(self.shell.like))

    def _of_joints(self, evaluate: Callable[[RelativeRotation], Floats]) -> Iterator[tuple[Floats, Ints, csr_array]]:
        """Derivatives (m, ..) of what is evaluated of each joint by the logarithm of one stiffness of one of its
        sections; the joints' blocks; and the derivatives (m, 5e) of that logarithm by those of the properties."""
        present = [*filter(is_elastic, self.shell.elements)]
        if not present:
            return
        nodes, at_nodes = self._rod_nodes, self._at_nodes(self.table)
        pairs = nodes.at_crossings[[resists(joint) for joint in self._every_joint]]
        rows = [pairs[stencil.members] for stencil in stencils(nodes, pairs)]
        for side in range(2):
            for kind in range(3):
                probed = []
                for sign in (1.0, -1.0):
                    changed = at_nodes.copy()
                    changed[pairs[:, side], kind] *= np.exp(sign * PROBE)
                    probed.append(self._joints(changed))
                by_edge = self._of_nodes(kind, at_nodes)
                for element, at, ahead, behind in zip(present, rows, *probed, strict=True):
                    values = [evaluate(element.with_stiffness_of(there)) for there in (ahead, behind)]
                    yield (values[0] - values[1]) / (2.0 * PROBE), element.blocks, by_edge[at[:, side]]

    def _of_nodes(self, kind: int, at_nodes: Floats) -> csr_array:
        """(k, 5e) derivatives of the logarithm of a stiffness at the rod nodes by those of the edges' properties."""
        length = np.zeros(len(at_nodes))
        sides = self._shares(self.table)
        for there, edge, _ in sides:
            length[there] += self.shell.mesh.edge_lengths[edge]
        rows = np.concatenate([there for there, _, _ in sides])
        columns = np.concatenate([PROPERTIES * edge + EI1 + kind for _, edge, _ in sides])
        parts = np.concatenate([compliances[:, kind] for _, _, compliances in sides])
        values = parts * at_nodes[rows, kind] / length[rows]
        return csr_array((values, (rows, columns)), shape=(len(at_nodes), self.table.size))

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
