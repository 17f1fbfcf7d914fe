"""Linear stability of a motion about a state: the longest stable time step with explicit ties, and its slowest modes.

Implicit Euler with the forces of some springs K_e frozen at the start of the step, the others K_i implicit, is for
small motions  M (x+ - 2x + x-) + h^2 K_i x+ + h^2 K_e x = 0.  A mode x -> z x of it with the mass m, and k_i, k_e along
it, has (m + h^2 k_i) z^2 + (h^2 k_e - 2m) z + m = 0. The product of the roots is below 1, so that a root leaves the
unit circle only at z = -1, where  h^2 (k_e - k_i) = 4m.

A node in contact that is stopped at each step [HQK 3.1] has no velocity to bring along, and obeys
M (x+ - x) + h^2 K_i x+ + h^2 K_e x = 0:  at z = -1,  h^2 (k_e - k_i) = 2m. Together, with m4 of the nodes that move
freely and m2 of those that are stopped along a mode, (m4 + m2 + h^2 k_i) z^2 + (h^2 k_e - 2 m4 - m2) z + m4 = 0, and
the same argument holds. The limit is therefore exact: the longest h at which

    (4 M4 + 2 M2) / h^2 + K_i - K_e

has no negative eigenvalue, which the signs of its pivots show; what touches loses the direction along its
normal. There is no limit where the implicit springs are stiffer than the explicit ones; damping only raises it. With
the rods' stiffness left out it gives the bounds sqrt(2m/C1) of two masses m tied by C1, and sqrt(2I/C2) of two rotary
inertias I tied by C2.
"""

import numpy as np
from scipy.sparse import csc_matrix, diags, eye, triu
from scipy.sparse.linalg import LinearOperator, eigsh

from rodshell.arrays import Floats, Ints, State
from rodshell.errors import InputError, StabilityError
from rodshell.model import Assembly, Freedom, Potential
from rodshell.rods.elements import NO_HESSIANS, WithoutFrames
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.sparse_ldl import Factors, Multifrontal, SingularError
from rodshell.solve.tangent import FIRST_SHIFT, generic

NO_NODES = np.empty(0, dtype=np.intp)
LONGEST, SHORTEST = 1e6, 1e-15  # [s]; what is stable beyond has no limit, what is not even below never is
DIGITS = 1e-10  # of the limit
GROWTH = 10.0  # of the shift, until nothing is below it


class ExplicitTies:
    """Finds at one state after another which time steps are stable with explicit ties; the matrix is analysed once.

    Args:
        motion: with the elements that it has at every state.
        free: the free directions; their counts stay.
    """

    def __init__(self, motion: Motion, free: Freedom) -> None:
        self._blocks = [element.blocks for element in (*motion.elements, *motion.explicit)]
        self._assembly = Assembly.of(self._blocks, free)
        self._solver = Multifrontal(self._assembly.indptr, self._assembly.indices)
        self._factors: Factors | None = None

    def look(self, motion: Motion, state: Floats, free: Freedom, stopped: Ints = NO_NODES) -> None:
        """Assemble the matrix at a state; parameters as of `step_limit`."""
        implicit, explicit = (Potential(sets).hessians(state) for sets in (motion.elements, motion.explicit))
        self._data = self._assembly.assemble([*implicit, *(-hessians for hessians in explicit)], self._blocks, free)
        weight = np.full((len(state), 1), 4.0)
        weight[stopped] = 2.0
        self._mass, self._blocked = free.reduce_diagonal(weight * motion.mass), free.blocked

    def grows(self, step: float) -> bool:
        """Whether some motion about the state grows at a time step [s]."""
        data, diagonal = self._data.copy(), self._assembly.diagonal
        data[diagonal] += self._mass / step**2
        data[diagonal[self._blocked]] = 1.0
        try:
            self._factors = self._solver.factor(data, reuse=self._factors)
        except SingularError:
            return True
        return self._factors.negative > 0

    def limit(self) -> float:
        """Longest step [s] at which nothing grows; infinite where nothing ever does.

        Raises:
            InputError: something explicit acts on what has no mass.
        """
        high = LONGEST
        if not self.grows(high):
            return np.inf
        while self.grows(high / 8):
            high /= 8
            if high < SHORTEST:
                raise InputError(
                    "explicit ties act on nodes or twist angles without mass: give the rods mass and rotary inertia, "
                    "or use coupling=SharedDofs()"
                )
        low = high / 8
        while high > (1 + DIGITS) * low:
            middle = np.sqrt(low * high)
            low, high = (low, middle) if self.grows(middle) else (middle, high)
        return float(low)


def step_limit(motion: Motion, state: State, time: float = 0.0, *, stopped: Ints = NO_NODES) -> float:
    """Longest stable time step [s] at a state; infinite where nothing is explicit.

    Args:
        motion: its source frames being at the state.
        time: at which the constraint is taken [s].
        stopped: (k,) blocks that lose all their velocity at each step.

    Raises:
        InputError: something explicit acts on what has no mass.
    """
    if not motion.explicit:
        return np.inf
    free = motion.constraint_at(time).freedom(state)
    ties = ExplicitTies(motion, free)
    ties.look(motion, state, free, stopped)
    return ties.limit()


def refuse_unstable(motion: Motion, state: Floats, step: float) -> None:
    """Refuse a time step [s] that explicit ties make unstable by a StabilityError; parameters as of `step_limit`."""
    limit = step_limit(motion, state)
    if step > limit:
        raise StabilityError(
            f"explicit ties are unstable at a time step of {step:.4g} s (limit {limit:.4g} s): {REMEDY}"
        )


REMEDY = "use a smaller step, softer ties, or coupling=SharedDofs()"


def slowest_modes(motion: Motion, state: Floats, free: Freedom, curvature: Floats, count: int) -> Floats:
    """The slowest modes K x = s M x of a body about an equilibrium: (count,) lowest s [1/s2], ascending.

    Motions along a negative one grow as exp(sqrt(-s) t); others oscillate at sqrt(s) rad/s.

    Args:
        motion: its source frames at `state`; all free directions must have mass.
        free: the free directions, without blocked ones.
        curvature: (N, 3, 3) what constraints that turn with the state add to the stiffness [N/m].
    """
    energies = Potential((*motion.energies.sets, _Curvature(curvature)))
    root = 1.0 / np.sqrt(free.reduce_diagonal(motion.mass))
    scaled = csc_matrix(diags(root) @ energies.matrix(state, free) @ diags(root))
    identity, shift = eye(free.size, format="csc"), FIRST_SHIFT * float(np.abs(scaled.diagonal()).mean())
    upper = triu(scaled + shift * identity, format="csc")
    solver = Multifrontal(upper.indptr.astype(np.int64), upper.indices.astype(np.int64))
    while (factors := solver.factor(upper.data)).negative:
        shift *= GROWTH
        upper = triu(scaled + shift * identity, format="csc")
    inverse = LinearOperator(scaled.shape, matvec=factors.solve, dtype=float)
    start = generic(free.size, 1)[0]
    values = eigsh(scaled, k=count, sigma=-shift, OPinv=inverse, v0=start, tol=1e-6, return_eigenvectors=False)
    return np.sort(values)


class _Curvature(WithoutFrames):
    """Given (N, 3, 3) blocks as an energy, so that they are summed with the others."""

    def __init__(self, full: Floats) -> None:
        self.blocks: Ints = np.arange(len(full))[:, None]
        self._full = full

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        hessians[:] = self._full
        return 0.0
