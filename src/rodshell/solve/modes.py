"""The slowest modes of a body about an equilibrium, K x = s M x, from the lowest s on: their s, or the modes."""

import numpy as np
from scipy.sparse import csc_matrix, diags, eye, triu
from scipy.sparse.linalg import LinearOperator, eigsh

from rodshell.arrays import Floats, Ints
from rodshell.model import Freedom
from rodshell.rods.elements import NO_HESSIANS, Elements
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.linear import LinearSolver, Qdldl
from rodshell.solve.step_limit import tangent_stiffness

SHIFT = 10.0  # [1/s2]: first guess of a shift below all s
SWEEPS = 4  # of the subspace iteration
GROWTH = 10.0  # of the shift, until nothing is below it


class _Curvature:
    """Given (N, 3, 3) blocks as an energy, so that they are summed with the others."""

    def __init__(self, full: Floats) -> None:
        self.blocks: Ints = np.arange(len(full))[:, None]
        self._full = full

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        hessians[:] = self._full
        return 0.0

    def refreshed(self, state: Floats) -> "_Curvature":
        return self


def slowest_modes(motion: Motion, state: Floats, free: Freedom, curvature: Floats, count: int) -> Floats:
    """(count,) the lowest s [1/s2], ascending: a negative one grows as exp(sqrt(-s) t), others swing at sqrt(s) rad/s.

    Parameters
    ----------
    motion : its source frames at `state`; all free directions must have mass.
    free : the free directions, without blocked ones.
    curvature : (N, 3, 3) what constraints that turn with the state add to the stiffness [N/m].
    """
    elements: tuple[Elements, ...] = (*motion.elements, *motion.explicit, _Curvature(curvature))
    stiffness = tangent_stiffness(elements, state, free)
    root = 1.0 / np.sqrt(free.reduce_diagonal(motion.mass))
    scaled = csc_matrix(diags(root) @ stiffness @ diags(root))
    identity, shift = eye(free.size, format="csc"), SHIFT
    upper = triu(scaled + shift * identity, format="csc")
    solver = Qdldl(upper.indptr.astype(np.int64), upper.indices.astype(np.int64))
    while solver.factor(upper.data) > 0:
        shift *= GROWTH
        upper = triu(scaled + shift * identity, format="csc")
    inverse = LinearOperator(scaled.shape, matvec=solver.solve, dtype=float)
    start = np.sin(1.0 + np.arange(free.size) ** 2)  # the same at every run
    values = eigsh(scaled, k=count, sigma=-shift, OPinv=inverse, v0=start, tol=1e-6, return_eigenvectors=False)
    return np.sort(values)


def softest_modes(solver: LinearSolver, free: Freedom, mass: Floats, count: int) -> list[Floats]:
    """`count` modes (n, 3) of a stable equilibrium whose stiffness `solver` has factorised, from the softest on.

    By subspace iteration, which is enough for directions to look in: the last one's s may be a quarter too high.

    mass : (n, 3) lumped mass of each component, which may be 0; where all are, modes are those of equal masses.
    """
    root = np.sqrt(free.reduce_diagonal(mass))
    if not root.any():
        root = np.ones(free.size)
    count = min(count, free.size)
    basis = np.random.default_rng(0).standard_normal((free.size, min(count + 2, free.size)))
    for _ in range(SWEEPS):
        basis = np.linalg.qr(basis)[0]
        image = np.column_stack([root * solver.solve(root * column) for column in basis.T])
        softness, turn = np.linalg.eigh(basis.T @ image)
        basis = image @ turn[:, np.argsort(-softness)]
    # the same as column / root, up to a factor, where there is mass
    return [free.expand(solver.solve(root * column)) for column in basis.T[:count]]
