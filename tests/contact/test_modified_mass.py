"""Contact by modified masses [HQK Eqs 8-12, Algorithm 1]: closed forms of single nodes, and the paper's equation."""

import numpy as np
import pytest
from scipy.optimize import fsolve

import rodshell as rs
from rodshell.contact.modified_mass import ModifiedMass
from rodshell.errors import InputError
from rodshell.model import Freedom
from rodshell.rods.elements import Stretch
from rodshell.solve.newton_matrix import SparseSum
from rodshell.targets.rim import Domain, EllipseDomain
from tests.formfinding.falls import HEMISPHERE, MASS, PAPER_ROD, RADIUS, STEP, TARGETS, G, Particles, slope

ROUND_OFF = 1e-12  # of numbers of order 1


def test_a_node_that_falls_through_the_top_lands_on_it_without_velocity() -> None:
    above = 0.5 * G * STEP**2  # less than the first step falls, G h^2
    particle = Particles(HEMISPHERE, np.array([[0.0, 0.0, RADIUS + above]]))
    particle.step()
    np.testing.assert_allclose(particle.state, [[0.0, 0.0, RADIUS]], atol=ROUND_OFF)
    np.testing.assert_array_equal(particle.velocity, 0.0)


def test_a_node_above_the_target_falls_freely() -> None:
    particle = Particles(HEMISPHERE, np.array([[0.05, 0.0, 1.0]]))
    particle.step(10)
    # implicit Euler of free fall: z0 - g h^2 (1 + 2 + ... + n)
    np.testing.assert_allclose(particle.state, [[0.05, 0.0, 1.0 - G * STEP**2 * 55]], atol=ROUND_OFF)
    np.testing.assert_allclose(particle.velocity, [[0.0, 0.0, -G * STEP * 10]], atol=ROUND_OFF)


@pytest.mark.parametrize("name", list(TARGETS))
@pytest.mark.parametrize("depth", [1e-5, 1e-4, 1e-3])
def test_a_tail_inside_the_wall_is_moved_by_its_depth_and_not_thrown(name: str, depth: float) -> None:
    """Eqs 9 and 10 on the hemisphere's own surface would throw it by about sqrt(2 R depth): 20 mm for 1 mm."""
    target = TARGETS[name]
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    out = np.column_stack([np.cos(turn), np.sin(turn)])
    reach = np.array([_reach(target, way) for way in out])
    for low in (1e-6, 1e-3, 0.05, 0.3):
        rim = 0.0 if target.base is not None else 0.1
        tails = np.column_stack([(reach - depth)[:, None] * out, np.full(len(out), rim - low)])
        particles = Particles(target, tails)
        particles.step()
        fallen = tails - [0.0, 0.0, G * STEP**2]
        moved = np.linalg.norm(particles.state - fallen, axis=1)
        assert moved.max() <= depth * (1 + 1e-6)  # the depth is along `out`; the closest point of a wall is no further
        assert np.all(target.contact(particles.state).distance > -1e-9)


def _reach(target: rs.Target, way: np.ndarray) -> float:
    """How far the rim lies from the axis in a direction (2,): by bisection."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        inside = target.plan.distance(middle * way[None])[0][0] < 0  # type: ignore[attr-defined]
        low, high = (middle, high) if inside else (low, middle)
    return low


@pytest.mark.parametrize("name", list(TARGETS))
def test_no_node_is_corrected_by_more_than_its_depth(name: str) -> None:
    target, chance = TARGETS[name], np.random.default_rng(5)
    points = chance.uniform([-0.2, -0.2, -0.1], [0.2, 0.2, 0.2], (400, 3))
    particles = Particles(target, points)
    particles.step()
    fallen = points - [0.0, 0.0, G * STEP**2]
    depth = np.maximum(0.0, -target.contact(fallen).distance)
    np.testing.assert_allclose(np.linalg.norm(particles.state - fallen, axis=1), depth, atol=1e-10)
    assert (depth > 0).sum() > 100


SHAPES = {
    **TARGETS,
    "overhanging cap": rs.Cap(RADIUS, -0.1),
    "low cap": rs.Cap(RADIUS, 0.12),
    "rectangle": rs.HeightField(formula="0.1 - x**2", domain=rs.Rectangle((0.3, 0.2))),
}


@pytest.mark.parametrize("name", list(SHAPES))
def test_what_signs_say_to_be_outside_is_outside(name: str) -> None:
    target, chance = SHAPES[name], np.random.default_rng(7)
    points = chance.uniform([-0.35, -0.35, -0.3], [0.35, 0.35, 0.4], (3000, 3))
    outside, distance = target.outside(points), target.contact(points).distance
    assert distance[outside].min() > -1e-12
    # and they miss none, so that contact itself is asked for nodes inside alone
    assert distance[~outside].max() < 1e-12
    assert 100 < np.count_nonzero(~outside) < 2900


@pytest.mark.parametrize("domain", [rs.Disc(0.2), EllipseDomain(0.2, 0.1), rs.Rectangle((0.3, 0.2))])
def test_a_domain_holds_what_has_no_positive_distance_to_it(domain: Domain) -> None:
    points = np.random.default_rng(8).uniform(-0.3, 0.3, (500, 2))
    np.testing.assert_array_equal(domain.holds(points), domain.distance(points)[0] <= 0)


def test_a_node_slides_down_a_slope_as_in_the_textbook() -> None:
    tangent = 0.5
    sine, down = tangent / np.hypot(1, tangent), np.array([1.0, 0.0, -tangent]) / np.hypot(1, tangent)
    start = np.array([[-0.1, 0.0, 0.3 + 0.1 * tangent]])
    n = 20
    slides = Particles(slope(tangent), start, stopped="normal")
    slides.step(n)
    np.testing.assert_allclose(slides.velocity[0], n * STEP * G * sine * down, atol=1e-9)
    # stopped in all directions, it creeps by g sin h^2 a step, as with a drag m/h
    creeps = Particles(slope(tangent), start, stopped="all")
    creeps.step(n)
    np.testing.assert_allclose(creeps.state[0], start[0] + n * STEP**2 * G * sine * down, atol=1e-9)


@pytest.mark.parametrize("friction", [0.2, 0.45, 0.55])
def test_friction_holds_below_its_angle_and_slows_above_it(friction: float) -> None:
    tangent = 0.5
    cosine, sine = 1 / np.hypot(1, tangent), tangent / np.hypot(1, tangent)
    down = np.array([cosine, 0.0, -sine])
    start = np.array([[-0.1, 0.0, 0.3 + 0.1 * tangent]])
    particle = Particles(slope(tangent), start, friction=friction)
    n = 20
    taken = particle.step(n)
    pull = max(0.0, sine - friction * cosine)
    np.testing.assert_allclose(particle.velocity[0], n * STEP * G * pull * down, atol=1e-9)
    np.testing.assert_allclose(particle.state[0], start[0] + STEP**2 * G * pull * n * (n + 1) / 2 * down, atol=1e-9)
    # what surface and friction exert together holds the weight, less what accelerates
    np.testing.assert_allclose(taken.reactions[0], MASS * (G * pull * down + [0, 0, G]), atol=1e-12)


def test_a_node_that_is_lifted_leaves_at_once() -> None:
    particle = Particles(HEMISPHERE, np.array([[0.0, 0.0, RADIUS]]))
    particle.step(3)
    particle.velocity[0, 2] = 1.0
    particle.step()
    np.testing.assert_allclose(particle.state[0, 2] - RADIUS, STEP * (1.0 - G * STEP), atol=ROUND_OFF)
    np.testing.assert_allclose(particle.velocity[0, 2], 1.0 - G * STEP, atol=1e-9)


def test_supports_and_contact_leave_what_is_left_of_both() -> None:
    """A node on a vertical rail beside the summit stops on the tangent plane of its closest point."""
    x = 0.1
    rail = Freedom.free(1).with_directions(np.array([0]), (0.0, 0.0, 1.0))
    above = np.sqrt(RADIUS**2 - x**2) + 1e-4
    particle = Particles(HEMISPHERE, np.array([[x, 0.0, above]]), free=rail)
    particle.step()
    normal = np.array([x, 0.0, above - G * STEP**2])
    normal /= np.linalg.norm(normal)
    np.testing.assert_array_equal(particle.state[0, :2], [x, 0.0])
    assert abs(particle.state[0] @ normal - RADIUS) < ROUND_OFF
    # a wall cannot move what is held across it: nothing happens, and nothing fails
    for way in ([1.0, 0.0], [0.0, 1.0], [0.6, -0.8]):
        x, y = (RADIUS - 1e-3) * np.array(way)
        beside = Particles(HEMISPHERE, np.array([[x, y, -0.1]]), free=rail)
        beside.step()
        np.testing.assert_allclose(beside.state[0], [x, y, -0.1 - G * STEP**2], atol=ROUND_OFF)


def test_a_node_that_touches_is_not_looked_at_again_in_its_step() -> None:
    """In a hollow a node that its neighbour pulls along its plane gets below the surface: it stays on the plane."""
    hollow = TARGETS["hollow"]
    x = np.array([[0.1, 0.0, 0.11], [0.15, 0.0, 0.14]])
    pulled = Stretch.elastic(np.array([[0, 1]]), np.array([0.05]), np.array([5e-3]))
    particles = Particles(hollow, x, elements=(pulled,), stopped="normal")
    particles.step()
    touching = particles.stepper.last
    assert touching is not None
    assert touching.nodes.tolist() == [0]
    assert abs((particles.state[0] - touching.points[0]) @ touching.normals[0]) < ROUND_OFF
    assert hollow.contact(particles.state[:1]).distance[0] < -1e-10


@pytest.mark.parametrize("matrix", [None, SparseSum], ids=["banded", "sparse"])
def test_the_reduced_system_has_the_solution_of_the_papers_filtered_one(matrix: object) -> None:
    """Eq 11, whose rows S_i filters, solved by another method for a chain of three nodes of which two touch."""
    x = np.array([[-0.06, 0.02, 0.195], [0.0, 0.0, 0.2002], [0.05, -0.03, 0.193]])
    chain = Stretch.elastic(
        np.array([[0, 1], [1, 2]]), np.array([0.055, 0.06]), np.full(2, PAPER_ROD.stretch_stiffness)
    )
    options = {} if matrix is None else {"matrix": matrix}
    particles = Particles(HEMISPHERE, x, elements=(chain,), **options)  # type: ignore[arg-type]
    velocity = np.array([[0.1, 0.0, -0.2], [0.05, 0.1, 0.0], [0.0, -0.2, 0.3]])
    particles.velocity = velocity.copy()
    taken = particles.step()
    touching = particles.stepper.last
    assert touching is not None
    assert 0 < len(touching.nodes) < 3
    filtered, prescribed = np.tile(np.eye(3), (3, 1, 1)), np.zeros((3, 3))
    for node, point, normal in zip(touching.nodes, touching.points, touching.normals, strict=True):
        filtered[node] -= np.outer(normal, normal)
        prescribed[node] = normal * (((point - x[node]) / STEP - velocity[node]) @ normal)

    def equation_11(unknown: np.ndarray) -> np.ndarray:
        moved = unknown.reshape(3, 3) * 1e-2
        gradient = np.zeros((3, 3))
        chain.evaluate(x + moved, gradient)
        force = -gradient + [0.0, 0.0, -MASS * G]
        pulled = STEP / MASS * np.einsum("nij,nj->ni", filtered, force)
        return np.ravel(moved / STEP - velocity - pulled - prescribed)

    found, _, code, message = fsolve(equation_11, np.zeros(9), xtol=1e-13, full_output=True)
    assert code == 1, message
    np.testing.assert_allclose(taken.state, x + 1e-2 * found.reshape(3, 3), atol=1e-11)


def test_a_negative_friction_is_refused() -> None:
    with pytest.raises(InputError, match=r"friction coefficient must be 0 or more, not -0\.1"):
        ModifiedMass(HEMISPHERE, np.arange(1), friction=-0.1)
