"""The tangent of an equilibrium against dense linear algebra on the tests' own Hessian; and that nothing changes it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import eigh

import rodshell as rs
from rodshell.errors import InputError
from rodshell.model import Freedom
from rodshell.rods.elements import Stretch
from rodshell.rods.isotropic import IsotropicBend
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium
from rodshell.solve.problem import Problem, Supports
from rodshell.solve.sparse_ldl import SingularError
from rodshell.solve.tangent import (
    Tangent,
    TangentAssembly,
    negative_mode,
    subspace_iteration,
)
from tests.formfinding.elastic_twins import ElasticTwin

ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
RANDOM = np.random.default_rng(16)


@cache
def popped(joint: rs.Ball | rs.Pin | None = None) -> rs.PopUp:
    """A hemisphere of five rods each way, 100 nodes."""
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.08, edge=0.02)
    rod = ROD if joint is None else rs.Rod(rs.RectangularSection(width=2e-3, height=1e-3), ROD.material)
    return rs.find_form(rs.Hemisphere(0.2), layout, rod, ends=("pinned",), joint=joint).popped["pinned"]


def free_unknowns(shape: rs.PopUp) -> np.ndarray:
    mesh = shape.footprint.mesh
    free = np.setdiff1d(np.arange(mesh.node_count), mesh.ends)
    return (3 * free[:, None] + np.arange(3)).ravel()


@cache
def dense_hessian() -> np.ndarray:
    """(dofs, dofs) of the free nodes, elastic edges, by complex steps and differences of the paper's formulas."""
    shape = popped()
    unknowns = free_unknowns(shape)
    return ElasticTwin(shape.footprint.mesh, ROD).hessian(shape.positions)[np.ix_(unknowns, unknowns)]


def loads(count: int, shape: rs.PopUp) -> np.ndarray:
    """Of about 1 N on nodes, and of 1 N over half a rod's breadth on twist angles."""
    result = RANDOM.standard_normal((count, *shape.state.shape))
    result[:, shape.shell.first_angle :] *= 1e-3
    return result


def test_solutions_are_those_of_a_dense_solve_with_the_exact_hessian() -> None:
    shape, unknowns = popped(), free_unknowns(popped())
    right = loads(5, shape)  # four of them side by side
    found = shape.equilibrium.tangent.solve(right)
    for case, field in zip(found, right, strict=True):
        exact = np.linalg.solve(dense_hessian(), field.ravel()[unknowns])
        # the twin's Hessian is known to 1e-9 of its size, its condition is 2e4
        np.testing.assert_allclose(case.ravel()[unknowns], exact, atol=1e-5 * np.abs(exact).max())
        held = np.setdiff1d(np.arange(case.size), unknowns)
        assert not case.ravel()[held].any()
    np.testing.assert_array_equal(found[1], shape.equilibrium.tangent.solve(right[1]))


@pytest.mark.parametrize("joint", [None, rs.Pin()])
def test_a_tangent_solves_as_before_after_a_hundred_other_solves(joint: rs.Pin | None) -> None:
    """Of the same shell by the same pattern: loads, moved supports, descents, tangents elsewhere."""
    shape = popped(joint)
    equilibrium = replace(shape.equilibrium)  # without what other tests have cached
    tangent, right = equilibrium.tangent, loads(4, shape)
    before, inertia, values = tangent.solve(right), tangent.negative_modes, tangent.values.copy()
    last: Equilibrium = equilibrium
    weight = 1e-6 * np.abs(equilibrium.gradient).max()
    for number in range(100):
        problem = replace(last.problem, load=weight * RANDOM.standard_normal(shape.state.shape))
        last = find_equilibrium(problem, last.state, last.forces, descend=number % 2 == 1)
        assert last.problem.pattern is equilibrium.problem.pattern
        if number % 10 == 0:
            last.tangent.solve(right)
    np.testing.assert_array_equal(tangent.solve(right), before)
    np.testing.assert_array_equal(tangent.values, values)
    assert tangent.negative_modes == inertia == 0
    product = tangent.product(before)
    across = np.array([tangent.freedom.expand(tangent.freedom.reduce(field)) for field in right])
    rounded = np.finfo(float).eps * np.abs(values).max() * np.abs(before).max()  # of a sum of K times displacements
    assert np.abs(product - across).max() < 4 * rounded
    assert equilibrium.tangent is tangent


def test_a_tangent_is_that_of_its_state_to_the_last_bit() -> None:
    """Not that of the last factorisation of Newton's method, which was made a step before."""
    shape = popped()
    here = shape.equilibrium
    fresh = TangentAssembly(replace(here.problem, pattern=None), here.state).tangent(
        here.problem, here.state, here.forces
    )
    np.testing.assert_array_equal(fresh.values, here.tangent.values)


def test_a_tangent_cannot_be_written_to() -> None:
    tangent = popped().equilibrium.tangent
    for array in (tangent.state, tangent.forces, tangent.values):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(AttributeError):
        tangent.factors = None  # type: ignore[misc, assignment]


def test_the_product_is_the_derivative_of_the_gradient() -> None:
    """Edges elastic, their forces following the motion: the whole elastic structure."""
    shape = popped()
    here, free = shape.equilibrium, shape.shell.held_ends()
    motion = free.expand(RANDOM.standard_normal(free.size))
    step = 1e-8

    def gradient(state: np.ndarray) -> np.ndarray:
        stretch = here.problem.stretch
        return here.problem.gradient(state, stretch.stiffness * stretch.strains(state))

    slope = (gradient(here.state + step * motion) - gradient(here.state - step * motion)) / (2 * step)
    found = here.tangent.product(motion)
    np.testing.assert_allclose(found, free.expand(free.reduce(slope)), atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize("massive", [False, True])
def test_lowest_modes_are_numpys(massive: bool) -> None:
    """The symmetric shell has pairs of equal eigenvalues: each of them is found."""
    shape, unknowns = popped(), free_unknowns(popped())
    mass = shape.shell.mass
    weight = mass.ravel()[unknowns] if massive else np.ones(len(unknowns))
    tangent = shape.equilibrium.tangent
    whole = dense(tangent)
    exact = eigh(whole, np.diag(weight), eigvals_only=True)[:6]
    modes = tangent.lowest_modes(6, mass=mass if massive else None)
    np.testing.assert_allclose(modes.values, exact, rtol=1e-9)
    shapes = modes.shapes.reshape(6, -1)[:, unknowns]
    np.testing.assert_allclose(shapes @ np.diag(weight) @ shapes.T, np.eye(6), atol=1e-6)
    residual = shapes @ whole - modes.values[:, None] * shapes * weight
    assert np.abs(residual).max() < 1e-5 * np.abs(modes.values[-1] * shapes * weight).max()
    twin = np.linalg.eigvalsh(dense_hessian() / np.sqrt(np.outer(weight, weight)))[:6]
    np.testing.assert_allclose(modes.values, twin, rtol=1e-4)


def dense(tangent: Tangent) -> np.ndarray:
    return tangent.pattern.assembly.matrix(tangent.values).toarray()


def column(squeeze: float) -> Equilibrium:
    """A pinned column of length and EI 1 under so many times Euler's load, straight; 20 edges."""
    edges, load = 20, squeeze * np.pi**2
    state = np.zeros((edges + 1, 3))
    state[:, 2] = np.linspace(0.0, 1.0, edges + 1)
    row = np.arange(edges + 1)
    bends = IsotropicBend(np.column_stack([row[:-2], row[1:-1], row[2:]]), np.full(edges - 1, float(edges)))
    stretch = Stretch.elastic(np.column_stack([row[:-1], row[1:]]), np.full(edges, 1 / edges), np.full(edges, 1e5))
    free = Freedom.free(edges + 1).with_directions(np.array([0])).with_directions(np.array([edges]), (0.0, 0.0, 1.0))
    pull = np.zeros_like(state)
    pull[-1, 2] = -load
    state[:, 2] *= 1.0 - load / 1e5
    problem = Problem((bends,), stretch, Supports(free), 1.0, load=pull)
    return find_equilibrium(problem, state, np.full(edges, -load))


@pytest.mark.parametrize(("squeeze", "negative"), [(0.9, 0), (1.1, 2), (4.5, 4), (9.5, 6)])
def test_inertia_and_modes_of_a_column_beyond_eulers_loads(squeeze: float, negative: int) -> None:
    """It buckles to two sides at Euler's load times 1, 4, 9: so many negative modes, and they come first."""
    tangent = column(squeeze).tangent
    assert tangent.negative_modes == negative
    exact = np.linalg.eigvalsh(dense(tangent))
    assert np.count_nonzero(exact < 0) == negative
    found = tangent.lowest_modes(5).values
    np.testing.assert_allclose(found, exact[:5], atol=1e-8 * np.abs(exact[:5]).max())


def test_modes_without_mass_are_left_out_and_unstable_ones_refused() -> None:
    """Of a column whose middle alone has mass there are three modes; and none if what has no mass buckles."""
    mass = np.zeros((21, 3))
    mass[10] = 2.0
    stable = column(0.5).tangent
    modes = stable.lowest_modes(9, mass=mass)
    flexible = np.linalg.inv(dense(stable))
    at = stable.freedom.first[10] + np.arange(3)
    exact = np.sort(1.0 / (2.0 * np.linalg.eigvalsh(flexible[np.ix_(at, at)])))
    np.testing.assert_allclose(modes.values, exact, rtol=1e-8)
    with pytest.raises(SingularError, match="without mass"):
        column(4.5).tangent.lowest_modes(1, mass=mass)


def test_what_does_not_fit_is_refused() -> None:
    tangent = popped().equilibrium.tangent
    with pytest.raises(InputError, match=r"the loads have the shape \(3, 3\)"):
        tangent.solve(np.zeros((3, 3)))
    with pytest.raises(InputError, match="the mass has the shape"):
        tangent.lowest_modes(2, mass=np.ones((2, 3)))
    with pytest.raises(InputError, match="must not be negative"):
        tangent.lowest_modes(2, mass=np.zeros_like(tangent.state))


def test_a_bound_shells_tangent_counts_the_surfaces_curvature() -> None:
    """A bead without stiffness on a sphere, pressed on by a load R f: its stiffness along the sphere is f."""

    class Sphere:
        def freedom(self, state: np.ndarray) -> Freedom:
            normal = state / np.linalg.norm(state, axis=1)[:, None]
            first = np.cross(normal, [1.0, 0.0, 0.0])
            first /= np.linalg.norm(first, axis=1)[:, None]
            directions = np.stack([first, np.cross(normal, first), np.zeros_like(first)], axis=1)
            return Freedom(directions, np.full(len(state), 2))

        def curvature(self, state: np.ndarray, gradient: np.ndarray) -> np.ndarray:
            radius = np.linalg.norm(state, axis=1)
            outward = np.einsum("ij,ij->i", gradient, state) / radius
            return -(outward / radius)[:, None, None] * np.eye(3)

        def remaining(self, state: np.ndarray) -> None:
            return None

        def retract(self, state: np.ndarray) -> np.ndarray:
            return state / np.linalg.norm(state, axis=1)[:, None]

    nothing = Stretch.elastic(np.empty((0, 2), dtype=np.intp), np.empty(0), np.empty(0))
    load = np.array([[0.0, 0.0, 3.0]])
    problem = Problem((), nothing, Sphere(), 1.0, load=load)
    state = np.array([[0.0, 0.0, 1.0]])
    tangent = TangentAssembly(problem, state).tangent(problem, state, np.empty(0))
    np.testing.assert_allclose(dense(tangent), 3.0 * np.eye(2), atol=1e-15)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-6])
def test_subspace_iteration_ends_where_its_eigenvalues_are_as_accurate_as_asked(tolerance: float) -> None:
    """And not long after: a hundred times more accurate ones cost another sweep or more."""
    random = np.random.default_rng(3)
    values, directions = 1.5 ** -np.arange(60.0), np.linalg.qr(random.standard_normal((60, 60)))[0]
    applied = list[int]()

    def apply(vectors: np.ndarray) -> np.ndarray:
        applied.extend([1] * len(vectors))
        return np.asarray(vectors @ directions * values @ directions.T)

    found, rows, settled = subspace_iteration(
        apply, random.standard_normal((6, 60)), settled=3, tolerance=tolerance, most_sweeps=50
    )
    assert settled
    errors = 1 - found[:3] / values[:3]
    assert (errors > -1e-12).all()
    assert tolerance / 1e4 < errors.max() < 2 * tolerance
    assert len(applied) <= 6 * 12
    across = rows[:3] @ directions[:, 6:]
    assert np.linalg.norm(across, axis=1).max() < np.sqrt(tolerance) * np.linalg.norm(rows[:3], axis=1).min()


@pytest.mark.parametrize("lowest", [1e-3, 0.5, 3.0, 40.0])
def test_the_negative_mode_nearest_to_zero_is_found_wherever_it_lies(lowest: float) -> None:
    """Among the softest modes or between stiff ones; another negative one, farther from zero, is not it."""
    random = np.random.default_rng(5)
    values = np.concatenate([[-lowest, -70.0], np.linspace(0.1, 90.0, 98)])
    directions = np.linalg.qr(random.standard_normal((100, 100)))[0]

    def inverse(vectors: np.ndarray) -> np.ndarray:
        return np.asarray(vectors @ directions / values @ directions.T)

    found = negative_mode(inverse, random.standard_normal((4, 100)), tolerance=1e-5)
    assert abs(found @ directions[:, 0]) > 0.999 * np.linalg.norm(found)
