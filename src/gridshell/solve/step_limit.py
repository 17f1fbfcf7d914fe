"""The longest stable time step of a motion with explicit ties.

Implicit Euler with the forces of some springs K_e frozen at the start of the step, the others K_i implicit, is for
small motions  M (x+ - 2x + x-) + h^2 K_i x+ + h^2 K_e x = 0.  A mode x -> z x of it with the mass m, and k_i, k_e along
it, has (m + h^2 k_i) z^2 + (h^2 k_e - 2m) z + m = 0. The product of the roots is below 1, so that a root leaves the
unit circle only at z = -1, where  h^2 (k_e - k_i) = 4m.  The limit is hence exact:

    h = 2 / sqrt(max eigenvalue of M^-1 (K_e - K_i)),

and there is none where the implicit springs are stiffer than the explicit ones. Damping only raises it. With the
rods' stiffness left out it gives the bounds sqrt(2m/C1) of two masses m tied by C1, and sqrt(2I/C2) of two rotary
inertias I tied by C2.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, diags, triu
from scipy.sparse.linalg import eigsh

from gridshell.errors import InputError, StabilityError
from gridshell.model import Assembly, Freedom
from gridshell.rods.elements import Elements
from gridshell.solve.implicit_euler import Motion
from gridshell.solve.linear import Qdldl, SingularError

Floats = NDArray[np.float64]

DENSE = 200  # unknowns up to which all eigenvalues are cheaper than Lanczos' method


def step_limit(motion: Motion, state: Floats, time: float = 0.0) -> float:
    """Longest stable step [s] at a state (N, 3); infinite where nothing is explicit.

    Raises
    ------
    InputError : something explicit acts on what has no mass.
    """
    if not motion.explicit:
        return np.inf
    free = motion.constraint_at(time).freedom(state)
    mass = free.reduce_diagonal(motion.mass)
    difference = tangent_stiffness(motion.explicit, state, free) - tangent_stiffness(motion.elements, state, free)
    if not mass.all():
        difference, mass = _followed(difference, mass > 0), mass[mass > 0]
    scale = diags(1.0 / np.sqrt(mass))
    scaled = csc_matrix(scale @ difference @ scale)
    if len(mass) <= DENSE:
        largest = float(np.linalg.eigvalsh(scaled.toarray())[-1])
    else:
        start = np.sin(1.0 + np.arange(len(mass)) ** 2)  # the same at every run
        # The modes of a grid of equal joints crowd at the limit: more digits than these would cost a minute.
        largest = float(eigsh(scaled, k=1, which="LA", v0=start, ncv=60, tol=1e-3, return_eigenvectors=False)[0])
    return 2.0 / float(np.sqrt(largest)) if largest > 0 else np.inf


def refuse_unstable(motion: Motion, state: Floats, step: float) -> None:
    """Raise StabilityError if `step` [s] is beyond the limit at `state`."""
    limit = step_limit(motion, state)
    if step > limit:
        raise StabilityError(
            f"explicit ties are unstable at a time step of {step:.4g} s (limit {limit:.4g} s): "
            "use a smaller step, softer ties, or coupling=SharedDofs()"
        )


def _followed(difference: csc_matrix, moving: NDArray[np.bool_]) -> csc_matrix:
    """Ke - Ki of what has mass. What has none, such as the twist angle of a clamp, goes to where it is largest."""
    still = triu(-difference[~moving][:, ~moving], format="csc")
    solver = Qdldl(still.indptr.astype(np.int64), still.indices.astype(np.int64))
    try:
        definite = solver.factor(still.data) == 0
    except SingularError:
        definite = False
    if not definite:
        raise InputError(
            "explicit ties act on nodes or twist angles without mass: give the rods mass and rotary inertia, or use "
            "coupling=SharedDofs()"
        )
    across = csc_matrix(difference[~moving][:, moving])
    next_to_it = np.flatnonzero(np.diff(across.indptr))
    part = across[:, next_to_it].toarray()
    added = part.T @ np.column_stack([solver.solve(column) for column in part.T])
    rows, columns = np.meshgrid(next_to_it, next_to_it, indexing="ij")
    size = int(moving.sum())
    fill = csc_matrix((added.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
    return csc_matrix(difference[moving][:, moving] + fill)


def tangent_stiffness(elements: tuple[Elements, ...], state: Floats, free: Freedom) -> csc_matrix:
    """Hessian in the free directions, whole."""
    scrap = np.zeros_like(state)
    blocks = [one.blocks for one in elements]
    hessians = [np.zeros((len(b), 3 * b.shape[1], 3 * b.shape[1])) for b in blocks]
    for one, values in zip(elements, hessians, strict=True):
        one.evaluate(state, scrap, values)
    assembly = Assembly.of(blocks, free)
    data = assembly.assemble(hessians, blocks, free)
    upper = csc_matrix((data, assembly.indices, assembly.indptr), shape=(free.size, free.size))
    return csc_matrix(upper + upper.T - diags(upper.diagonal()))
