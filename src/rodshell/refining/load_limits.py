"""Limits of a refinement under loads: the linear load factor, and deflections by the tangent stiffness.

Both are of the shell at hand under further dead loads f. With u = K^-1 f, the buckling factor t has A v = mu K v,
A = -Ks(u), mu = 1/t (`solve.modes`), and with v'Kv = 1

    du/dp = -K^-1 (dK/dp) u,     dmu/dp = v'(dA/dp - mu dK/dp) v.

The total derivatives of K and A, by properties, state and u at once, are differences along the parameters: no
factorisation, and one solve a parameter. Source frames are those of each side, so that both matrices stay those that
are solved there; v may stay, since mu is stationary in it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.model import Potential
from rodshell.model.potential import product, room_for
from rodshell.refining.structure import Point
from rodshell.rods.elements import is_stressed
from rodshell.solve.modes import LinearBuckling, linear_buckling

STEP, MOST_MOVED = 1e-3, 1e-4  # of a logarithm, and a motion: differences of fourth order are then exact to 1e-7
LARGEST = 1e3  # times a load: factors above are not looked for


@dataclass(frozen=True, eq=False)
class Deflection:
    """No node is displaced by more than a limit under a load, to first order.

    Args:
        load: (n, 3) on the nodes of the mesh [N].
        most: largest displacement [m].
        weight: of an excess of one at every node, over a gap of the target's size [-].
    """

    load: Floats
    most: float
    weight: float = 0.01

    def residuals(self, here: Point) -> Floats:
        """(n,) residuals [-]; parameters as of `Objective`."""
        sizes = np.linalg.norm(_Loaded(here, self.load).rate[: len(self.load)], axis=1)
        return np.asarray(self._share * np.maximum(sizes / self.most - 1.0, 0.0))

    def slopes(self, here: Point) -> Floats:
        """(n, p) slopes; parameters as of `Objective`."""
        loaded, count = _Loaded(here, self.load), len(self.load)
        moved, slopes = loaded.rate[:count], loaded.rate_slopes[:, :count]
        sizes = np.linalg.norm(moved, axis=1)
        along = np.einsum("pnx,nx->np", slopes, moved) / np.maximum(sizes, 1e-300)[:, None]
        return np.asarray(self._share / self.most * np.where((sizes > self.most)[:, None], along, 0.0))

    @property
    def _share(self) -> float:
        return float(self.weight / np.sqrt(len(self.load)))


@dataclass(frozen=True, eq=False)
class LoadFactor:
    """The lowest linear buckling factor of a load stays above a limit.

    Args:
        load: (n, 3) on the nodes of the mesh [N].
        least: smallest factor [-].
        weight: of a factor of half the limit, over a gap of the target's size [-].
    """

    load: Floats
    least: float
    weight: float = 0.01

    def residuals(self, here: Point) -> Floats:
        """(1,) residual [-]; parameters as of `Objective`."""
        found = _Loaded(here, self.load).buckling
        excess = self.least / float(found.factors[0]) - 1.0 if len(found.factors) else 0.0
        return np.array([self.weight * max(excess, 0.0)])

    def slopes(self, here: Point) -> Floats:
        """(1, p) slopes; parameters as of `Objective`."""
        loaded = _Loaded(here, self.load)
        factors = loaded.buckling.factors
        if not len(factors) or factors[0] >= self.least:
            return np.zeros((1, len(here.values)))
        return self.weight * self.least * loaded.inverse_slopes[None]


@dataclass(frozen=True, eq=False)
class _Loaded:
    """The shell at a point, under a further load (n, 3) to first order."""

    here: Point
    load: Floats

    @cached_property
    def forces(self) -> Floats:
        """(N, 3) [N]"""
        result = np.zeros_like(self.here.state)
        result[: len(self.load)] = self.load
        return result

    @cached_property
    def rate(self) -> Floats:
        """(N, 3) u [m, rad]"""
        return np.asarray(self.here.sensitivity.tangent.solve(self.forces[None])[0])

    @cached_property
    def rate_slopes(self) -> Floats:
        """(p, N, 3) du/dp [m, rad]"""
        turned = [
            self._along(k, lambda energies, state, step: energies.product(state, self.rate))
            for k in range(len(self.here.values))
        ]
        return np.asarray(self.here.sensitivity.tangent.solve(-np.array(turned)))

    @cached_property
    def buckling(self) -> LinearBuckling:
        return linear_buckling(self.here.equilibrium, self.forces, most=LARGEST)

    @cached_property
    def inverse_slopes(self) -> Floats:
        """(p,) of the inverse of the lowest factor [-]."""
        shape, rate, here = self.buckling.shapes[0], self.rate, self.here
        inverse = 1.0 / float(self.buckling.factors[0])
        result = np.zeros(len(here.values))
        for k, by_rate in enumerate(self.rate_slopes):

            def quotient(energies: Potential, state: Floats, step: float, by_rate: Floats = by_rate) -> float:
                softer = -_stressed(energies, state, rate + step * by_rate, shape)
                return softer - inverse * energies.curvature(state, shape)

            result[k] = self._along(k, quotient)
        return result / here.edges.shell.energies.curvature(here.state, shape)

    def _along(self, k: int, function: Callable[[Potential, Floats, float], Any]) -> Any:
        """Derivative by parameter k of a function of the energies and the state a step ahead, and that step; by
        differences of fourth order."""
        here, rows, motion = self.here, self._rows[k], self.here.response.motions[k]
        farthest = float(np.abs(motion / here.equilibrium.problem.unit(len(motion))).max())
        unit = min(STEP / max(float(np.abs(rows).max()), 1e-12), MOST_MOVED / max(farthest, 1e-300))
        result = 0.0
        for count, weight in ((1.0, 8.0), (2.0, -1.0)):
            for step in (count * unit, -count * unit):
                state = here.state + step * motion
                shell = here.edges.varied(here.edges.table * np.exp(step * rows)).shell
                result = result + np.sign(step) * weight * function(shell.energies.refreshed(state), state, step)
        return result / (12.0 * unit)

    @cached_property
    def _rows(self) -> Floats:
        """(p, e, 5) derivatives of the logarithms of the properties."""
        by_properties = self.here.parameters.by_properties.toarray().T
        return np.asarray(by_properties.reshape(-1, *self.here.edges.table.shape))


def _stressed(energies: Potential, state: Floats, rate: Floats, shape: Floats) -> float:
    """v'Ks(u)v of the change of the internal forces with a rate u of the state [J]."""
    stressed = [*filter(is_stressed, energies.sets)]
    blocks = [elements.blocks for elements in stressed]
    hessians = room_for(blocks)
    for elements, of_set in zip(stressed, hessians, strict=True):
        elements.stress_stiffness(state, rate, of_set)
    return float(np.sum(shape * product(hessians, blocks, shape)))
