"""Targets: every derivative is that of its value, and every distance is that of the closest point."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rodshell.targets import (
    Cap,
    Disc,
    Ellipsoid,
    HeightField,
    Hemisphere,
    Paraboloid,
    Rectangle,
    Target,
)
from rodshell.targets.rim import EllipseDomain

Floats = NDArray[np.float64]

DISC, RECTANGLE = Disc(0.2), Rectangle((0.4, 0.3))
TWO_BUMPS = "0.08*(exp(-((x-.09)^2/.06^2 + y^2/.07^2)/2) + exp(-((x+.09)^2/.06^2 + y^2/.07^2)/2))"
RIDGE = (
    ".05 - .75*x^2 - .5*y^2 + .3*x*y + .06*exp(-(((x-.02)*cos(.5) + (y-.03)*sin(.5))^2/.14^2"
    " + ((y-.03)*cos(.5) - (x-.02)*sin(.5))^2/.045^2)/2)"
)


def refuses_jets(x: Floats, y: Floats) -> Floats:
    return 0.1 - np.where(x > -9, x, 0.0) ** 2 - 0.5 * np.sin(y) ** 2


TARGETS: dict[str, Target] = {
    "hemisphere": Hemisphere(0.2),
    "cap": Cap(0.25, 0.15),
    "cap below the equator": Cap(0.2, -0.05),
    "paraboloid": Paraboloid(0.2, 0.12),
    "steep paraboloid": Paraboloid(0.2, 0.4),
    "ellipsoid": Ellipsoid(0.2, 0.15, 0.12),
    "hypar": HeightField(formula="(x^2 - y^2)/0.8", domain=DISC),
    "two bumps": HeightField(formula=TWO_BUMPS, domain=DISC),
    "ridge": HeightField(formula=RIDGE, domain=DISC),
    "0/0 at the centre": HeightField(formula="0.1*cos(7*sqrt(x^2 + y^2))", domain=DISC),
    "over a rectangle": HeightField(formula="0.1 - x^2 - 2*y^2 + 0.1*x", domain=RECTANGLE),
    "continued from a disc": HeightField(formula="sqrt(.25^2 - x^2 - y^2)*exp(x)", domain=DISC),
    "continued from a rectangle": HeightField(
        formula="2*sqrt(.21^2 - x^2)*sqrt(.17^2 - y^2)*exp(x+y)", domain=RECTANGLE
    ),
    "function": HeightField(function=lambda x, y: 0.1 - x**2 * np.exp(y), domain=DISC),
    "function that refuses jets": HeightField(function=refuses_jets, domain=DISC),
}
BASED = [name for name, target in TARGETS.items() if target.base is not None]
FIELDS = [name for name, target in TARGETS.items() if target.base is None]
every_target = pytest.mark.parametrize("name", TARGETS)


def plan_points(target: Target, rng: np.random.Generator, count: int, reach: float = 0.95) -> Floats:
    """Points over which there is a surface."""
    points = rng.uniform(-reach, reach, (4 * count, 2)) * target.plan.half_extent
    return points[target.plan.distance(points)[0] < -(1 - reach) * target.size][:count]


def surface_points(target: Target, rng: np.random.Generator, count: int, reach: float = 0.95) -> Floats:
    return target.lift(plan_points(target, rng, count, reach))


def assert_taylor(value, derivative, x: Floats, rng: np.random.Generator, *, step: float, floor: float) -> None:
    """value(x + h d) - value(x) - h derivative(x) d is of second order in h, for every row of x.

    floor : round-off in the value.
    """
    direction = rng.normal(size=x.shape)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    slope = np.einsum("n...i,ni->n...", derivative, direction)
    start = value(x)

    def remainder(h: float) -> Floats:
        missing = value(x + h * direction) - start - h * slope
        return np.abs(missing).reshape(len(x), -1).max(axis=1)

    large, small = remainder(step), remainder(step / 10)
    # 100 if the second derivative is constant; near a zero of it, or across a jump of the third, somewhat less
    assert np.all(small <= np.maximum(large / 30, floor)), (small / large).max()
    assert np.median(small / np.maximum(large, floor)) < 1 / 90 or small.max() < floor


@every_target
@pytest.mark.parametrize("where", ["around", "past the end"])
def test_gradient_and_hessian_are_those_of_the_implicit_function(name, where):
    target, rng = TARGETS[name], np.random.default_rng(1)
    x = rng.uniform(-1, 1, (300, 3)) * [*target.plan.half_extent, target.size]
    if where == "past the end":
        x[:, :2] *= 1.5
        x = x[target.plan.distance(x[:, :2])[0] > 0]
    at = target.implicit(x)
    # differences: round-off in their first derivatives is 1e-16 z / step
    floor = 1e-11 if name == "function that refuses jets" else 1e-14
    assert_taylor(lambda p: target.implicit(p).value, at.gradient, x, rng, step=1e-4, floor=floor / 10)
    assert_taylor(lambda p: target.implicit(p).gradient, at.hessian, x, rng, step=1e-4, floor=floor * 10)
    np.testing.assert_array_equal(at.hessian, np.swapaxes(at.hessian, 1, 2))


@every_target
@pytest.mark.parametrize("depth", [0.0, 1e-6, 0.3])
def test_normal_and_hessian_are_those_of_the_gap(name, depth):
    target, rng = TARGETS[name], np.random.default_rng(2)
    y = surface_points(target, rng, 150, reach=0.85)
    foot = target.on_surface(y)
    sharpest = np.abs(np.linalg.eigvalsh(foot.hessian)).max(axis=1)
    offset = depth * rng.uniform(-1, 1, len(y)) / np.maximum(sharpest, 10.0)  # of the radius of curvature
    x = y + offset[:, None] * foot.normal
    gap = target.gap(x)
    np.testing.assert_allclose(gap.distance, offset, atol=1e-12)
    np.testing.assert_allclose(target.closest(x), y, atol=1e-12)
    np.testing.assert_allclose(gap.normal, foot.normal, atol=1e-11)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", gap.hessian, gap.normal), 0.0, atol=1e-9)
    floor = 1e-10 if name == "function that refuses jets" else 1e-13
    assert_taylor(lambda p: target.gap(p).distance, gap.normal, x, rng, step=1e-4, floor=floor / 10)
    assert_taylor(lambda p: target.gap(p).normal, gap.hessian, x, rng, step=1e-4, floor=floor * 10)


def dense_surface(target: Target, past: float) -> Floats:
    if isinstance(target, Hemisphere | Ellipsoid):
        axes = (target.a, target.b, target.c) if isinstance(target, Ellipsoid) else 3 * (target.radius,)
        polar, around = np.meshgrid(np.linspace(0, np.pi, 400), np.linspace(0, 2 * np.pi, 800))
        ball = [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
        return np.stack(ball, axis=-1).reshape(-1, 3) * axes
    along = [np.linspace(-past * half, past * half, 500) for half in target.plan.half_extent]
    plan = np.stack(np.meshgrid(*along), axis=-1).reshape(-1, 2)
    return target.lift(plan)


@pytest.mark.slow
@every_target
def test_closest_point_is_really_closest(name):
    target, rng = TARGETS[name], np.random.default_rng(3)
    x = surface_points(target, rng, 500)
    x[:, 2] += rng.uniform(-0.02, 0.05, len(x))
    y = target.closest(x)
    assert np.abs(target.implicit(y).value).max() < 1e-14
    dense = dense_surface(target, past=1.5)
    assert np.all(np.linalg.norm(x - y, axis=1) <= cKDTree(dense).query(x)[0] + 1e-12)


def test_closest_point_beyond_a_centre_of_curvature_is_still_a_minimum():
    """Newton alone ended on saddles there, and off the surface: contact 43 mm deep for a node in free air."""
    steep = HeightField(formula="0.3*exp(-(x^2 + y^2)/(2*.05^2))", domain=DISC)
    rng = np.random.default_rng(4)
    for target in (steep, TARGETS["two bumps"], TARGETS["ridge"]):
        x = surface_points(target, rng, 3000)
        x[:, 2] += rng.uniform(-0.02, 0.15, len(x))
        y = target.closest(x)
        assert np.abs(target.implicit(y).value).max() < 1e-12
        gap = target.gap(x)
        np.testing.assert_allclose(x - gap.distance[:, None] * gap.normal, y, atol=1e-8)
        assert np.all(np.sign(gap.distance) == np.sign(target.implicit(x).value))
        across = np.eye(3) + gap.distance[:, None, None] * target.on_surface(y).hessian
        assert np.linalg.eigvalsh(across).min() > -1e-6


@every_target
def test_points_on_the_surface_have_gap_zero_and_stay_when_retracted(name):
    target, rng = TARGETS[name], np.random.default_rng(5)
    x = surface_points(target, rng, 100)
    assert np.abs(target.gap(x).distance).max() < 1e-14
    np.testing.assert_allclose(target.retract(x), x, atol=1e-14)
    away = x + 1e-3 * rng.normal(size=x.shape)
    assert np.abs(target.implicit(target.retract(away)).value).max() < 1e-12


@every_target
def test_gap_is_positive_above(name):
    target, rng = TARGETS[name], np.random.default_rng(6)
    x = surface_points(target, rng, 100)
    up, down = x + [0, 0, 1e-3], x - [0, 0, 1e-3]
    assert (target.gap(up).distance > 0).all()
    assert (target.gap(down).distance < 0).all()
    assert (target.on_surface(x).normal[:, 2] > 0).all()


def rim_points(target: Target, rng: np.random.Generator, count: int) -> Floats:
    angle = rng.uniform(0, 2 * np.pi, count)
    a, b = target.plan.half_extent
    plan = np.column_stack([a * np.cos(angle), b * np.sin(angle)])
    if isinstance(target.plan, Rectangle):
        plan /= np.abs(plan / (a, b)).max(axis=1)[:, None]
    z = np.full(count, target.base) if target.base is not None else target.height_at(plan)
    return np.column_stack([plan, z])


@pytest.mark.slow
@every_target
def test_contact_distance_never_changes_faster_than_the_point_moves(name):
    """Straight paths around the rim: over the surface, down the wall, inside; a jump is a force out of nothing.

    Left out: the corner region of a rectangle, whose rim has vertices, and an overhang, but for its near side.
    """
    target, rng = TARGETS[name], np.random.default_rng(7)
    rim = rim_points(target, rng, 150)
    if isinstance(target.plan, Rectangle):
        rim = rim[(np.abs(rim[:, :2]) < np.array(target.plan.half_extent) - 0.05).any(axis=1)]
    overhang = name == "cap below the equator"
    reach, deepest = (0.005, 0.0) if overhang else (0.04, -0.01)  # deeper inside, the medial axis
    ends = rim[:, None, None, :] + rng.uniform(-reach, reach, (len(rim), 2, 1, 3))
    s = np.linspace(0, 1, 201)[None, :, None]
    path = (1 - s) * ends[:, 0] + s * ends[:, 1]
    distance = target.contact(path.reshape(-1, 3)).distance.reshape(path.shape[:2])
    moved = np.linalg.norm(np.diff(path, axis=1), axis=2)
    seen = np.maximum(distance[:, 1:], distance[:, :-1]) > deepest
    excess = np.abs(np.diff(distance, axis=1)) - moved
    assert excess[seen].max() < 1e-7


@every_target
def test_contact_normal_and_hessian_are_those_of_its_distance(name):
    """On the surface side and on the wall; the corner's curvature is left out on purpose."""
    target, rng = TARGETS[name], np.random.default_rng(8)
    lifted = surface_points(target, rng, 200) + [0, 0, 0.01]
    rim = rim_points(target, rng, 200)
    hanging = rim - np.column_stack([np.zeros((200, 2)), rng.uniform(0.01, 0.04, 200)])
    hanging[:, :2] *= rng.uniform(1.01, 1.05, 200)[:, None]
    for x in (lifted, hanging):
        if isinstance(target.plan, Rectangle):  # kinks of the distance: beside the corners
            beside = np.abs(np.abs(x[:, :2]) - target.plan.half_extent) < 2e-3
            x = x[~beside.any(axis=1)]
        contact = target.contact(x)
        np.testing.assert_allclose(np.linalg.norm(contact.normal, axis=1), 1.0, atol=1e-12)
        floor = 1e-10 if name == "function that refuses jets" else 1e-13
        assert_taylor(lambda p, t=target: t.contact(p).distance, contact.normal, x, rng, step=1e-4, floor=floor / 10)
        assert_taylor(lambda p, t=target: t.contact(p).normal, contact.hessian, x, rng, step=1e-4, floor=floor * 10)


@pytest.mark.parametrize("name", [name for name in TARGETS if name != "cap below the equator"])
def test_contact_normal_is_the_gradient_above_the_corner(name):
    """An overhang has no corner in free air."""
    target, rng = TARGETS[name], np.random.default_rng(9)
    rim = rim_points(target, rng, 100)
    if isinstance(target.plan, Rectangle):
        rim = rim[(np.abs(rim[:, :2]) < np.array(target.plan.half_extent) - 0.02).any(axis=1)]
    n = target.on_surface(rim).normal
    outward = target.plan.distance(rim[:, :2])[1]
    into_cone = n + 0.5 * np.column_stack([outward, np.zeros(len(rim))])
    x = rim + 0.005 * into_cone
    contact = target.contact(x)
    assert_taylor(lambda p: target.contact(p).distance, contact.normal, x, rng, step=1e-5, floor=1e-12)


@pytest.mark.parametrize("name", BASED)
def test_below_the_base_contact_is_the_distance_to_a_vertical_wall(name):
    target, rng = TARGETS[name], np.random.default_rng(10)
    x = rim_points(target, rng, 100) * [1.02, 1.02, 1]
    x[:, 2] -= rng.uniform(0.1, 0.3, len(x))
    contact = target.contact(x)
    across, normal, _ = target.plan.distance(x[:, :2])
    np.testing.assert_allclose(contact.distance, across, atol=1e-14)
    np.testing.assert_allclose(contact.normal, np.column_stack([normal, np.zeros(len(x))]), atol=1e-14)


@pytest.mark.parametrize("name", FIELDS)
def test_outside_its_plan_a_field_is_a_wall(name):
    """Also under the continued surface, where it rises outwards; there contact once was 36 mm deep."""
    target, rng = TARGETS[name], np.random.default_rng(11)
    rim = rim_points(target, rng, 100)
    x = rim * [1.03, 1.03, 1] - [0, 0, 0.03]
    contact = target.contact(x)
    np.testing.assert_allclose(contact.distance, target.plan.distance(x[:, :2])[0], atol=1e-14)
    assert (contact.normal[:, 2] == 0).all()
    inside = rim * [0.99, 0.99, 1] - [0, 0, 0.05]
    nearest = target.plan.distance(inside[:, :2])[0]
    assert (target.contact(inside).distance >= nearest - 1e-14).all()


@pytest.mark.parametrize("name", FIELDS)
def test_above_a_field_nothing_touches(name):
    """Above a rim that rises outwards the closest point of the continued surface lies past the edge."""
    target, rng = TARGETS[name], np.random.default_rng(12)
    for x in (surface_points(target, rng, 500, reach=0.999), rim_points(target, rng, 200) * [0.99, 0.99, 1]):
        x[:, 2] = target.height_at(x[:, :2]) + rng.uniform(1e-6, 0.04, len(x))
        assert (target.contact(x).distance > 0).all()


DOMAINS = {
    "disc": Disc(0.2),
    "ellipse": EllipseDomain(0.2, 0.15),
    "narrow ellipse": EllipseDomain(0.05, 0.2),
    "round ellipse": EllipseDomain(0.2, 0.2),
    "rectangle": Rectangle((0.4, 0.3)),
}
every_domain = pytest.mark.parametrize("name", DOMAINS)


def edge(name: str) -> Floats:
    a, b = DOMAINS[name].half_extent
    if name == "rectangle":
        side = np.linspace(-1, 1, 20001)
        sides = [(a * side, b + 0 * side), (a * side, -b + 0 * side), (a + 0 * side, b * side)]
        return np.hstack([*sides, (-a + 0 * side, b * side)]).T
    angle = np.linspace(0, 2 * np.pi, 200001)
    return np.column_stack([a * np.cos(angle), b * np.sin(angle)])


@pytest.mark.slow
@every_domain
def test_domain_distance_is_that_of_the_nearest_edge_point(name):
    rng = np.random.default_rng(13)
    a, b = DOMAINS[name].half_extent
    on_axes = [[0, 0], [0.3 * a, 0], [-0.9 * a, 0], [1.3 * a, 0], [0, 0.3 * b], [0, -0.9 * b], [0, 1.3 * b]]
    points = np.vstack([rng.uniform(-1.5, 1.5, (500, 2)) * (a, b), on_axes, [[1e-13, 0.2 * b], [0.2 * a, -1e-9]]])
    distance, normal, _ = DOMAINS[name].distance(points)
    sampled = cKDTree(edge(name)).query(points)[0]
    np.testing.assert_allclose(np.abs(distance), sampled, atol=1e-5)  # samples 1e-5 apart
    outside = (np.abs(points) > (a, b)).any(axis=1) if name == "rectangle" else ((points / (a, b)) ** 2).sum(1) > 1
    assert ((distance > 0) == outside).all()
    known = np.linalg.norm(points, axis=1) > 0 if name in ("disc", "rectangle") else slice(None)
    foot = points - distance[:, None] * normal
    assert np.abs(DOMAINS[name].distance(foot[known])[0]).max() < 1e-13


@every_domain
def test_domain_gradient_and_hessian_are_those_of_its_distance(name):
    domain, rng = DOMAINS[name], np.random.default_rng(14)
    points = rng.uniform(-1.5, 1.5, (1000, 2)) * domain.half_extent
    a, b = domain.half_extent
    if name == "rectangle":  # kinks: its diagonals inside, its sides' continuations
        q = np.abs(points) - (a, b)
        smooth = (np.abs(q) > 1e-3).all(axis=1) & (np.abs(q[:, 0] - q[:, 1]) > 1e-3)
    else:  # the medial axis: the part of the long axis between the centres of curvature
        smooth = np.abs(points[:, 0 if a < b else 1]) > 0.02
    points = points[smooth]
    _, gradient, hessian = domain.distance(points)
    assert_taylor(lambda p: domain.distance(p)[0], gradient, points, rng, step=1e-5, floor=1e-15)
    assert_taylor(lambda p: domain.distance(p)[1], hessian, points, rng, step=1e-5, floor=1e-12)


@every_target
def test_margin_changes_sign_at_the_rim(name):
    target, rng = TARGETS[name], np.random.default_rng(15)
    rim = rim_points(target, rng, 100)
    np.testing.assert_allclose(target.margin(rim), 0.0, atol=1e-14)
    inner = rim * [0.99, 0.99, 1]
    inner[:, 2] = target.height_at(inner[:, :2]) if target.base is None else inner[:, 2] + 1e-3
    assert (target.margin(inner) > 0).all()


@every_target
def test_height_and_summit_lie_on_the_surface(name):
    target, rng = TARGETS[name], np.random.default_rng(16)
    plan = plan_points(target, rng, 200)
    assert np.abs(target.implicit(np.column_stack([plan, target.height_at(plan)])).value).max() < 1e-15
    top = target.lift(np.array([target.summit]))
    assert target.margin(top)[0] > 0
    if name != "hypar":
        nearby = np.array(target.summit) + 0.02 * rng.normal(size=(200, 2))
        flat = np.abs(target.on_surface(top).normal[0, :2]).max()
        assert flat < 1e-9
        if name != "two bumps":
            assert (target.height_at(nearby) <= top[0, 2] + 1e-15).all()
