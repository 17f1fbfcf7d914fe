"""How an equilibrium changes with the properties of its edges, and with where its ends are held: exact derivatives.

In equilibrium the gradient g(x, p) of the energy vanishes in the free directions. With its derivative g_p at a fixed
state and the tangent stiffness K,

    dx/dp = -K^-1 g_p,     dJ/dp = J_p - (K^-1 J_x).g_p   (the adjoint: one solve for all parameters).

Prescribed motions y_p of held nodes add K y_p to g_p. A mode, K v = s W v with v'Wv = 1, has the derivative

    ds/dp = v'K_p v + c.(dx/dp),   c = grad_x (v'Kv) = d/dh K(x + h v) v at h = 0,

c by differences of fourth order of the product of the Hessian with v; as an adjoint it costs one solve for all
parameters. Masses W are held, and those of twist angles must be zero, since such an angle is counted from a frame that
moves with the state.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array

from rodshell.arrays import Floats
from rodshell.model.edge_properties import EA, LENGTH, PROPERTIES, EdgeProperties
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.tangent import Modes, Tangent

PROBE = 3e-5  # motion: half the largest one of the differences in `_change_of_stiffness`


@dataclass(frozen=True, eq=False)
class Parameters:
    """What p parameters change, to first order.

    Args:
        by_properties: (5e, p) derivatives of the logarithms of the edges' properties, edge by edge.
        moved: (p, N, 3) prescribed motion of held blocks [m, rad a unit of each parameter]; None: none moves.
    """

    by_properties: csc_array
    moved: Floats | None = None

    @property
    def count(self) -> int:
        """Number of parameters p."""
        return int(self.by_properties.shape[1])


@dataclass(frozen=True, eq=False)
class Response:
    """Derivatives of an equilibrium by p parameters.

    Args:
        motions: (p, N, 3) of the state [m, rad].
        forces: (p, e) of the edges' axial forces [N].
    """

    motions: Floats
    forces: Floats


class Sensitivity:
    """Derivatives at one equilibrium, by its tangent's factors.

    Args:
        here: an equilibrium with elastic edges.
        edges: the shell that it belongs to; its source frames at the equilibrium.
    """

    def __init__(self, here: Equilibrium, edges: EdgeProperties) -> None:
        self.here, self.edges = here, edges.at(here.elements)
        self.tangent: Tangent = here.tangent
        self._stretch = self.edges.shell.stretch

    @cached_property
    def gradient_slopes(self) -> csr_array:
        """(3N, 5e) derivatives of the gradient by the logarithms of the edges' properties [N, N m]."""
        return self.edges.gradient_slopes(self.here.state)

    def unbalanced(self, parameters: Parameters) -> Floats:
        """(p, N, 3) derivative of the gradient by each parameter, the free nodes held still [N, N m]."""
        slopes = np.asarray((self.gradient_slopes @ parameters.by_properties).todense()).T
        result = slopes.reshape(-1, *self.here.state.shape)
        if parameters.moved is not None:
            for slope, motion in zip(result, parameters.moved, strict=True):
                if motion.any():
                    slope += self._product(motion)
        return result

    def response(self, parameters: Parameters) -> Response:
        """State and axial forces by each parameter: one solve for each, by the factors at hand."""
        motions = self.tangent.solve(-self.unbalanced(parameters))
        if parameters.moved is not None:
            motions += parameters.moved
        return Response(motions, self.forces_of(motions, parameters))

    def forces_of(self, motions: Floats, parameters: Parameters) -> Floats:
        """(p, e) change of the axial forces [N].

        Args:
            motions: (p, N, 3) change of the state [m, rad].
        """
        stretch, state = self._stretch, self.here.state
        axial = stretch.stiffness * stretch.strains(state)
        by_length = stretch.rest_lengths * stretch.by_rest_lengths(state)
        table = np.asarray(parameters.by_properties.todense()).reshape(-1, PROPERTIES, parameters.count)
        result = (axial[:, None] * table[:, EA] + by_length[:, None] * table[:, LENGTH]).T
        for change, motion in zip(result, motions, strict=True):
            change += stretch.stiffness * stretch.elongation(state, motion)
        return np.asarray(result)

    def by_adjoint(self, by_state: Floats, parameters: Parameters) -> Floats:
        """(k, p) derivatives of k functions of the state alone: one solve for each function.

        Args:
            by_state: (k, N, 3) derivatives of the functions by the state.
        """
        adjoint = self.tangent.solve(by_state).reshape(len(by_state), -1)
        result = -np.asarray((parameters.by_properties.T @ (self.gradient_slopes.T @ adjoint.T)).T)
        if parameters.moved is not None:
            moved = parameters.moved.reshape(parameters.count, -1)
            across = np.array([self._product(field.reshape(self.here.state.shape)).ravel() for field in adjoint])
            result += (by_state.reshape(len(by_state), -1) - across) @ moved.T
        return result

    def lowest_modes(self, count: int, *, mass: Floats | None = None) -> Modes:
        """The lowest modes of the tangent, as `Tangent.lowest_modes`."""
        return self.tangent.lowest_modes(count, mass=mass)

    def mode_slopes(self, modes: Modes, parameters: Parameters) -> Floats:
        """(k, p) derivatives of the modes' values by the parameters; of equal values those of their mean alone count.

        Args:
            modes: k modes of the tangent.
        """
        state = self.here.state
        direct = np.array([self.edges.curvature_slopes(state, shape) for shape in modes.shapes])
        change = np.array([self._change_of_stiffness(shape) for shape in modes.shapes])
        return np.asarray(direct @ parameters.by_properties) + self.by_adjoint(change, parameters)

    def _change_of_stiffness(self, shape: Floats) -> Floats:
        """(N, 3) gradient of v'Kv by the state, for a mode v (N, 3)."""
        step = PROBE / float(np.abs(shape / self.here.problem.unit(len(shape))).max())

        def difference(step: float) -> Floats:
            ahead = self._product(shape, self.here.state + step * shape)
            behind = self._product(shape, self.here.state - step * shape)
            return np.asarray((ahead - behind) / (2.0 * step))

        return (4.0 * difference(step) - difference(2.0 * step)) / 3.0

    def _product(self, motion: Floats, state: Floats | None = None) -> Floats:
        """(N, 3) product of the Hessian with displacements, held blocks too; at the equilibrium, or another state."""
        return self.edges.shell.energies.product(self.here.state if state is None else state, motion)
