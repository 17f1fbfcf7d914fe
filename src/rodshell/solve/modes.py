"""Linear buckling and natural frequencies of a stable structure.

Both are problems A x = mu K x with the stiffness K, which is positive definite, and a symmetric A of any kind: its
largest mu are wanted. For buckling about a permanent state under t times a load A = -Ks and t = 1/mu, for vibrations
A = M and omega^2 = 1/mu. SciPy's ARPACK finds them by Lanczos' method with the inverse of K, whose factors are at hand
[Lehoucq, Sorensen and Yang 1998]. That none is missed is certified: K - A / m has as many negative eigenvalues as
there are mu above m, and the pivots of its factorisation count them [Parlett 1998, section 3.3].

Ks is the change of the stiffness with the internal forces alone, at frozen geometry (`rods.elements.Stressed`): what
the load adds to axial forces, to torsional moments and to the bending moments of anisotropic rods, and the stiffness of
the load's own potential. Moments of joints are left out: 0.1 % of the factor where joints are locked. A linear factor
takes the state for straight on: it misses what a shell sinks before it buckles, and it may lie on either side of what
the path says.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh
from threadpoolctl import threadpool_limits

from rodshell.arrays import Floats
from rodshell.errors import ConvergenceError, InputError, StabilityError
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.load import Load, LoadedAssembly
from rodshell.solve.problem import MatrixPattern
from rodshell.solve.sparse_ldl import SingularError
from rodshell.solve.tangent import Tangent, TangentAssembly, generic, orthonormal, subspace_iteration

DENSE = 24  # unknowns up to which LAPACK solves the whole problem
SPARE = 2  # modes that are computed beyond those asked for, so that the count has a gap to stand in
GAP = 1e-6  # relative, between two eigenvalues that are not the same
TRIES = 3  # with twice as many modes each, until the count agrees
_ACCURACY = 1e-10  # of eigenvalues
ROUND_OFF = 1e-15  # of the stiffness of each unknown alone
_SOFTEST = 3  # steps of the inverse iteration, after which the softest motion is known within 10 %


@dataclass(frozen=True, eq=False)
class LinearBuckling:
    """Factors on a load at which the linearised stiffness about a permanent state is singular.

    Args:
        factors: (k,) ascending, all positive: no factor is missing below the last. Fewer than were asked for, or none,
            where there are no more up to the largest looked for.
        shapes: (k, N, 3) modes, the largest component of a node's displacement being 1.
        rate: (N, 3) how the state moves per unit of the factor at first [m, rad].
    """

    factors: Floats
    shapes: Floats
    rate: Floats


@dataclass(frozen=True, eq=False)
class Vibration:
    """Natural frequencies of small vibrations about an equilibrium.

    Args:
        frequencies: (k,) ascending [Hz]; none is missing below the last.
        shapes: (k, N, 3) modes, the largest component of a node's displacement being 1.
    """

    frequencies: Floats
    shapes: Floats


def linear_buckling(
    permanent: Equilibrium, load: Load | Floats, count: int = 1, *, most: float = 1e3
) -> LinearBuckling:
    """The lowest factors of linear buckling under a load on top of a permanent state.

    Args:
        permanent: a stable equilibrium; what it carries stays as it is, and is not multiplied.
        load: at factor 1: dead forces (N, 3) [N], or a `Load`.
        count: so many of the lowest factors.
        most: factors above this are not looked for.

    Raises:
        InputError: the load does not fit the structure.
        StabilityError: the permanent state is not stable.
        ConvergenceError: the factors that were found are not all there are.
    """
    state, applied = permanent.state, Load.of(load)
    loaded = LoadedAssembly(permanent.problem, applied, state)
    tangent, rate = loaded.tangent(loaded.problem, state, permanent.forces)
    stress = loaded.stress_values(loaded.problem, state, rate)
    values, shapes = _largest(tangent, -stress, count, 1.0 / most)
    return LinearBuckling(1.0 / values, _unit_shapes(tangent, permanent, shapes), rate)


def frequencies(
    equilibrium: Equilibrium, mass: Floats, count: int = 1, *, edge_mass: Floats | None = None
) -> Vibration:
    """The lowest natural frequencies about an equilibrium, under the loads that it carries.

    Args:
        mass: (N, 3) lumped mass of each component [kg, of a twist angle kg m2], some of which may be 0.
        count: so many of the lowest, or as many as there are.
        edge_mass: (e,) the part of the mass that is spread along each edge [kg]: it moves as the edge's points do
            between its nodes (a consistent mass), so that frequencies of bending are of fourth order in the edges'
            length. Lumped at the nodes, None, they are of second order: the k-th of a span of n edges is (k pi / n)^2 /
            12 too low.

    Raises:
        InputError: the mass has another shape, is negative, or is zero everywhere.
        StabilityError: the equilibrium is not stable.
        ConvergenceError: the frequencies that were found are not all there are.
    """
    tangent = equilibrium.tangent
    if mass.shape != equilibrium.state.shape:
        raise InputError(f"the mass has the shape {mass.shape}: give {equilibrium.state.shape}")
    weight = tangent.freedom.reduce_diagonal(mass)
    if not (mass >= 0).all() or not weight.any():
        raise InputError("the mass must not be negative, nor zero everywhere in the free directions")
    inertia = _inertia(equilibrium, tangent, weight, edge_mass)
    values, shapes = _largest(tangent, inertia, min(count, int(np.count_nonzero(weight))), 0.0)
    return Vibration(1.0 / (2 * pi * np.sqrt(values)), _unit_shapes(tangent, equilibrium, shapes))


def softest_motion(equilibrium: Equilibrium) -> tuple[float, Floats]:
    """The motion with the stiffness that is nearest to zero, every unknown measured by its own stiffness alone.

    By a few steps of the inverse iteration: as near as it takes to tell a stiffness from round-off.

    Args:
        equilibrium: stable or not; a mechanism that it has is found.

    Returns:
        Its stiffness x'Kx over that of all unknowns alone, and the motion (N, 3) so measured, its square sum being 1.
    """
    try:
        tangent = equilibrium.tangent
        scale, factors = np.sqrt(np.abs(_diagonal(tangent.pattern, tangent.values))), tangent.factors
        freedom = tangent.freedom
    except SingularError:
        assembly = TangentAssembly(equilibrium.problem, equilibrium.state)
        freedom, values = assembly.values(equilibrium.problem, equilibrium.state, equilibrium.forces)
        stiffness_alone = np.abs(_diagonal(assembly.pattern, values))
        scale = np.sqrt(stiffness_alone + (stiffness_alone == 0) * stiffness_alone.mean())
        shifted = values.copy()
        shifted[assembly.pattern.assembly.diagonal] += ROUND_OFF * scale**2
        factors = assembly.pattern.solver.factor(shifted)
    start = generic(len(scale), 1)
    values, rows, _ = subspace_iteration(
        lambda rows: scale * factors.solve(scale * rows), start, settled=1, tolerance=0.0, most_sweeps=_SOFTEST
    )
    return 1.0 / float(values[0]), freedom.expand(orthonormal(rows)[0])


def _diagonal(pattern: MatrixPattern, values: Floats) -> Floats:
    return np.asarray(values[pattern.assembly.diagonal])


def _inertia(equilibrium: Equilibrium, tangent: Tangent, weight: Floats, edge_mass: Floats | None) -> Floats:
    """(nnz,) values of the mass in the pattern of K: lumped, less a sixth of what is spread along edges times the
    squared difference of their nodes' motions."""
    pattern, blocks = tangent.pattern, equilibrium.problem.stretch.blocks
    values = np.zeros(len(tangent.values))
    if edge_mass is not None:
        if edge_mass.shape != (len(blocks),) or not (edge_mass >= 0).all():
            raise InputError(
                f"the mass of the edges has the shape {edge_mass.shape}: give {(len(blocks),)}, not negative"
            )
        apart = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(3))
        edges = -edge_mass[:, None, None] / 6.0 * apart
        pattern.assembly.add(len(pattern.blocks) - 2, edges, blocks, tangent.freedom, values)
    values[pattern.assembly.diagonal] += weight
    return values


def _unit_shapes(tangent: Tangent, equilibrium: Equilibrium, rows: Floats) -> Floats:
    """(k, N, 3) of reduced modes (k, dofs)."""
    nodes = np.unique(equilibrium.problem.stretch.blocks)
    shapes = [tangent.freedom.expand(row) for row in rows]
    return np.array([shape / np.abs(shape[nodes]).max() for shape in shapes]).reshape(-1, *equilibrium.state.shape)


def _largest(tangent: Tangent, other: Floats, count: int, least: float) -> tuple[Floats, Floats]:
    """The largest eigenvalues mu > `least` of A x = mu K x, descending, and their vectors (k, dofs), certified.

    other : (nnz,) values of A in the pattern of K.
    """
    if tangent.negative_modes:
        raise StabilityError(
            f"the permanent state is not stable ({tangent.negative_modes} negative modes): it has no buckling factor "
            "and no natural frequencies"
        )
    size = tangent.freedom.size
    if not np.abs(other).max(initial=0.0) > 0:  # such as a load across a plane grid, which draws no rod
        return np.empty(0), np.empty((0, size))
    assembly = tangent.pattern.assembly
    matrix, stiffness = assembly.matrix(other), assembly.matrix(tangent.values)
    available = _above(tangent, other, least) if least > 0 else size  # Lanczos' method is slow to find what is smaller
    if available == 0:
        return np.empty(0), np.empty((0, size))
    count = min(count, available)
    wanted = min(count + SPARE, available)
    for number in range(TRIES):
        if size <= DENSE or wanted >= size - 1:
            values, vectors = eigh(matrix.toarray(), stiffness.toarray())
        else:
            values, vectors = _lanczos(tangent, matrix, stiffness, wanted, start=number)
        order = np.argsort(values)[::-1]
        values, vectors = values[order], vectors.T[order]
        positive = values > max(least, 1e-14 * float(np.abs(values).max(initial=0.0)))
        values, vectors = values[positive], vectors[positive]
        if not len(values) and least == 0.0:
            return values, vectors
        at, found = _between(values, count, least, complete=len(values) < wanted or wanted >= available)
        if _above(tangent, other, at) == found:
            kept = min(count, found)
            return values[:kept], vectors[:kept]
        wanted = 2 * wanted + SPARE
    raise ConvergenceError(
        f"{found} modes were found where the inertia of the stiffness counts {_above(tangent, other, at)}: "
        "ask for more or fewer modes"
    )


def _between(values: Floats, count: int, least: float, *, complete: bool) -> tuple[float, int]:
    """A number in a gap below the `count`-th of the descending values, and how many are above it."""
    gaps = 1.0 - values[count:] / values[count - 1 : -1]
    if complete and not (gaps > GAP).any():  # the gap is below the last of all
        last = float(values[-1]) if len(values) else np.inf
        return (least if least > 0 else 0.5 * last), len(values)
    first = int(np.argmax(gaps > GAP)) if (gaps > GAP).any() else len(gaps) - 1
    number = count + first
    return 0.5 * float(values[number - 1] + values[number]), number


def _above(tangent: Tangent, other: Floats, value: float) -> int:
    """How many eigenvalues of A x = mu K x are above a value: negative ones of K - A / value."""
    return tangent.pattern.solver.factor(tangent.values - other / value).negative


def _lanczos(
    tangent: Tangent, matrix: csc_matrix, stiffness: csc_matrix, count: int, *, start: int
) -> tuple[Floats, Floats]:
    """From another vector for each number `start`: a vector may hide a mode that another one is as low as."""
    size = tangent.freedom.size
    inverse = LinearOperator((size, size), matvec=tangent.factors.solve, dtype=float)
    vector = generic(size, 1 + start)[-1]
    try:
        with threadpool_limits(limits=1, user_api="blas"):  # others would keep ours from the processors
            values, vectors = eigsh(matrix, k=count, M=stiffness, Minv=inverse, which="LA", v0=vector, tol=_ACCURACY)
    except ArpackError as error:
        raise ConvergenceError(f"the modes were not found: {error}; ask for fewer") from None
    return values, vectors
