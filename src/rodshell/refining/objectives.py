"""Goals and limits of a refinement: small values that add up to one sum of squares.

Each has residuals r (q,), whose squares are added up, and slopes J (q, n) by the variables: 2 J'r is the gradient of
the sum, exactly, and J'J stands for half of its Hessian. A limit is a residual that is zero where it is kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rodshell.arrays import Floats
from rodshell.model.edge_properties import EI1, LENGTH, PROPERTIES
from rodshell.refining.structure import Point


class Objective(Protocol):
    """A part of the sum of squares."""

    def residuals(self, here: Point) -> Floats:
        """(q,) residuals [-] at a design and its equilibrium."""
        ...

    def slopes(self, here: Point) -> Floats:
        """(q, n) slopes of the residuals by the variables."""
        ...


class Gap:
    """Distances of the rods from the target over its size, whose mean square is counted."""

    def residuals(self, here: Point) -> Floats:
        gaps = here.gaps[0]
        return np.asarray(np.sqrt(1.0 / len(gaps)) * (gaps / here.structure.target.size))

    def slopes(self, here: Point) -> Floats:
        structure, (gaps, normals) = here.structure, here.gaps
        motions = here.response.motions[:, : structure.mesh.node_count]
        by_gap = np.stack([np.einsum("qx,qx->q", normals, structure.sampled @ motion) for motion in motions], axis=1)
        return np.asarray(np.sqrt(1.0 / len(gaps)) * by_gap / structure.target.size)


@dataclass(frozen=True)
class Prestress:
    """Compression of spans over a share of their Euler loads.

    Args:
        most: share of the Euler load from which it counts [-].
        weight: of an excess of one Euler load in every span, over a gap of the target's size [-].
    """

    most: float = 0.3
    weight: float = 0.01

    def residuals(self, here: Point) -> Floats:
        excess = np.maximum(here.euler_share - self.most, 0.0)
        return np.asarray(self.weight * excess)

    def slopes(self, here: Point) -> Floats:
        table, span = here.edges.table, here.structure.span_edges
        by_property = np.asarray(here.parameters.by_properties.todense()).reshape(len(table), PROPERTIES, -1)
        lengths, count = table[:, LENGTH], span[-1] + 1
        by_length, by_bend = by_property[:, LENGTH], by_property[:, EI1]
        flexible = lengths / table[:, EI1]

        def total(values: Floats) -> Floats:
            result = np.zeros((count, *values.shape[1:]))
            np.add.at(result, span, values)
            return result

        # share = -sum(l N) sum(l/EI) / pi^2
        forces, soft = total(lengths * here.equilibrium.forces), total(flexible)
        d_forces = total(lengths[:, None] * (here.response.forces.T + by_length * here.equilibrium.forces[:, None]))
        d_soft = total(flexible[:, None] * (by_length - by_bend))
        slopes = -(d_forces * soft[:, None] + forces[:, None] * d_soft) / np.pi**2
        return np.asarray(self.weight * np.where((here.euler_share > self.most)[:, None], slopes, 0.0))


@dataclass(frozen=True)
class LowestEigenvalue:
    """The lowest modes stay above a share of the lowest one before.

    Args:
        least: share of the lowest eigenvalue before [-].
        margin: the limit is approached from so much above it [-].
        weight: of an eigenvalue of zero, over a gap of the target's size [-].
    """

    least: float
    before: float
    margin: float = 0.5
    weight: float = 0.03

    def residuals(self, here: Point) -> Floats:
        return np.asarray(self.weight * np.maximum(self._wanted - here.modes.values / self.before, 0.0))

    def slopes(self, here: Point) -> Floats:
        low = here.modes.values / self.before < self._wanted
        if not low.any():
            return np.zeros((len(low), len(here.values)))
        slopes = here.sensitivity.mode_slopes(here.modes, here.parameters)
        return np.asarray(-self.weight / self.before * np.where(low[:, None], slopes, 0.0))

    def allows(self, here: Point) -> bool:
        """Whether the lowest eigenvalue is above the limit itself."""
        return bool(here.modes.values.min() >= self.least * self.before)

    @property
    def _wanted(self) -> float:
        return (1.0 + self.margin) * self.least


def residuals(objectives: Sequence[Objective], here: Point) -> Floats:
    """(q,) residuals of all objectives, one after the other."""
    return np.concatenate([objective.residuals(here) for objective in objectives])


def slopes(objectives: Sequence[Objective], here: Point) -> Floats:
    """(q, n) slopes of the residuals of all objectives."""
    return np.concatenate([objective.slopes(here) for objective in objectives])
