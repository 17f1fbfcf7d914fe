"""Further goals and limits of a refinement: curvature, elastic energy, angles at joints, and smooth stiffness.

They are added to the gap (`objectives.Gap`) in a list. Each weight is that of an excess of one, over a gap of the
target's size: with 0.01 an excess of 10 % everywhere counts as much as an rms gap of 0.1 %.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from rodshell.arrays import Floats
from rodshell.geometry.frames import dot
from rodshell.model.edge_properties import EI1, LENGTH, PROPERTIES
from rodshell.refining.change import STIFFNESSES
from rodshell.refining.structure import Point
from rodshell.rods.elements import BendElements, each_gradient, is_bends

PROBE = 1e-5  # of the logarithms of properties: the energy's derivative is then exact to 1e-8


@dataclass(frozen=True)
class Curvature:
    """The largest curvature of rods stays below a limit; times E and the fibres' distance it is their bending stress.

    Parameters
    ----------
    most : [1/m].
    weight : see the module.
    """

    most: float
    weight: float = 0.01

    def residuals(self, here: Point) -> Floats:
        return np.asarray(self.weight * np.maximum(curvatures(here) / self.most - 1.0, 0.0))

    def slopes(self, here: Point) -> Floats:
        over = curvatures(here) > self.most
        return np.asarray(self.weight / self.most * np.where(over[:, None], curvature_slopes(here), 0.0))


@dataclass(frozen=True)
class Energy:
    """The elastic energy, over that of the shell before; its root is the residual.

    Parameters
    ----------
    before : of the shell before [J].
    weight : see the module.
    """

    before: float
    weight: float = 0.001

    def residuals(self, here: Point) -> Floats:
        return np.array([self.weight * np.sqrt(_elastic(here, here.edges.table) / self.before)])

    def slopes(self, here: Point) -> Floats:
        """By the gradient along the motions, and at a fixed state by the properties."""
        edges, by_properties = here.edges, here.parameters.by_properties.toarray().T
        gradient = edges.shell.energies.gradient(here.state)
        change = np.einsum("pnx,nx->p", here.response.motions, gradient)
        for k, row in enumerate(by_properties.reshape(-1, *edges.table.shape)):
            ahead, behind = (_elastic(here, edges.table * np.exp(sign * PROBE * row)) for sign in (1.0, -1.0))
            change[k] += (ahead - behind) / (2.0 * PROBE)
        return np.asarray(0.5 * self.weight**2 * change / (self.before * self.residuals(here)))[None]


@dataclass(frozen=True)
class MinimumAngle:
    """Rods cross at angles that are not too small for a joint to be made.

    Parameters
    ----------
    least : smallest angle [rad].
    weight : see the module; of the cosine.
    """

    least: float
    weight: float = 0.01

    def residuals(self, here: Point) -> Floats:
        cosine, _ = self._cosines(here)
        return np.asarray(self.weight * np.maximum(np.abs(cosine) - np.cos(self.least), 0.0))

    def slopes(self, here: Point) -> Floats:
        cosine, slopes = self._cosines(here)
        over = np.sign(cosine) * (np.abs(cosine) > np.cos(self.least))
        return np.asarray(self.weight * over[:, None] * slopes)

    def _cosines(self, here: Point) -> tuple[Floats, Floats]:
        """(c,) cosine of the angle at each crossing, of the chords over the edges next to it; (c, n) slopes."""
        mesh = here.structure.mesh
        ends = mesh.rod_nodes[mesh.beside_crossings].reshape(-1, 2)
        chords = here.state[ends[:, 1]] - here.state[ends[:, 0]]
        length = np.linalg.norm(chords, axis=1)[:, None]
        unit = chords / length
        cosine = dot(unit[::2], unit[1::2])
        motions = here.response.motions[:, ends[:, 1]] - here.response.motions[:, ends[:, 0]]
        turns = (motions - np.einsum("pex,ex->pe", motions, unit)[..., None] * unit) / length
        slopes = np.einsum("pcx,cx->cp", turns[:, ::2], unit[1::2]) + np.einsum("pcx,cx->cp", turns[:, 1::2], unit[::2])
        return cosine, np.asarray(slopes)


@dataclass(frozen=True)
class SmoothStiffness:
    """Bending stiffness changes evenly along rods: second differences of the logarithm of EI from edge to edge.

    Parameters
    ----------
    weight : see the module; of a change of the slope by a factor e.
    """

    weight: float = 0.001

    def residuals(self, here: Point) -> Floats:
        return np.asarray(self.weight * (self._differences(here) @ here.change.stiffness[:, EI1]))

    def slopes(self, here: Point) -> Floats:
        rows = STIFFNESSES * np.arange(len(here.edges.table)) + EI1
        return np.asarray(
            self.weight * (self._differences(here) @ here.change.stiffness_slopes.tocsr()[rows]).toarray()
        )

    def _differences(self, here: Point) -> csr_array:
        """(d, e) second differences along each rod."""
        rods = here.structure.mesh.edge_rods
        first = np.flatnonzero(rods[2:] == rods[:-2])
        rows = np.tile(np.arange(len(first)), 3)
        columns = np.concatenate([first, first + 1, first + 2])
        return csr_array((np.repeat([1.0, -2.0, 1.0], len(first)), (rows, columns)), shape=(len(first), len(rods)))


def curvatures(here: Point) -> Floats:
    """(b,) curvature at each bend, clamps after the others [1/m].

    Parameters
    ----------
    here : a design and its equilibrium.
    """
    strains = _bending(here).strains(here.state)[:, :2]
    return np.asarray(np.linalg.norm(strains, axis=1) / _bend_lengths(here))


def curvature_slopes(here: Point) -> Floats:
    """(b, n) derivatives of the curvatures by the variables [1/m].

    Parameters
    ----------
    here : a design and its equilibrium.
    """
    element, lengths, found = _bending(here), _bend_lengths(here), curvatures(here)
    by_length = here.parameters.by_properties.tocsr()[LENGTH::PROPERTIES].toarray()
    lengthened = by_length * here.edges.table[:, [LENGTH]]
    before, after = here.edges.before[: len(lengths)], here.edges.after[: len(lengths)]
    clamp = (before == after)[:, None]
    longer = np.where(clamp, 0.5 * lengthened[before], 0.5 * (lengthened[before] + lengthened[after]))
    # a part's gradient over its stiffness is that of half its strain's square
    squares = np.zeros((len(lengths), element.blocks.shape[1], 3))
    for part, stiffness in zip(element.parts, element.bend_stiffness.T, strict=False):  # the last part is the twist
        squares += each_gradient(part, here.state) / stiffness[:, None, None]
    change = np.stack([np.einsum("bkx,bkx->b", squares, motion[element.blocks]) for motion in here.response.motions], 1)
    whole = (found * lengths)[:, None]
    return np.asarray(change / np.maximum(whole, 1e-12) / lengths[:, None] - (found / lengths)[:, None] * longer)


def _bending(here: Point) -> BendElements:
    """The energy of bending."""
    return next(element for element in filter(is_bends, here.edges.shell.within) if element.bend_stiffness.any())


def _bend_lengths(here: Point) -> Floats:
    """(b,) length of rod that each bend stands for [m]."""
    lengths, count = here.edges.table[:, LENGTH], len(_bending(here).blocks)
    before, after = here.edges.before[:count], here.edges.after[:count]
    return np.asarray(np.where(before == after, 0.5 * lengths[before], 0.5 * (lengths[before] + lengths[after])))


def _elastic(here: Point, table: Floats) -> float:
    """Elastic energy at the point's state of edges with other properties [J]."""
    return here.edges.varied(table).shell.energies.energy(here.state)
