"""Rims: ends as they are drawn, and the signed distance against all edges and where it is known in closed form."""

from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.targets import Freeform
from rodshell.targets.rim import Rim
from tests.targets.meshes import Floats, capped_sphere, sheet


def flat(x: Floats) -> Floats:
    return np.asarray(x * [1, 1, 0])


def up(x: Floats) -> Floats:
    return np.tile([0.0, 0.0, 1.0], (len(x), 1))


def ring(radius: float, count: int = 40) -> Floats:
    angle = np.arange(count) * 2 * np.pi / count
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])


def test_between_two_circles_it_is_the_nearer_one_that_counts():
    rim = Rim.of([ring(1.0), ring(0.3)[::-1]], flat, up)
    r, angle = np.meshgrid(np.linspace(0.05, 1.4, 60), np.linspace(0, 6.2, 31))
    r, angle = r.ravel(), angle.ravel()
    x = np.column_stack([r * np.cos(angle), r * np.sin(angle), 0 * r])
    assert rim.distance(x) == pytest.approx(np.minimum(1 - r, r - 0.3), abs=2e-5)


def test_at_corners_it_is_signed_as_between_both_edges():
    """A square: inside by the nearest side; outside beside a corner by the way to it, seen along the bisector."""
    corner = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], dtype=float)
    rim = Rim.of([corner], flat, up)
    x, y = np.random.default_rng(0).uniform(-0.99, 0.99, (2, 500))
    inside = np.column_stack([x, y, 0 * x])
    assert rim.distance(inside) == pytest.approx(1 - np.maximum(np.abs(x), np.abs(y)), abs=1e-12)
    beyond = np.array([[1.3, 1.1, 0.0], [-1.2, -1.2, 0.0]])
    bisector = np.sqrt(0.5)
    assert rim.distance(beyond) == pytest.approx([-(0.3 + 0.1) * bisector, -(0.2 + 0.2) * bisector], rel=1e-12)


def test_in_any_order_of_points_the_nearest_edge_is_that_of_all_edges():
    """A curve that comes close to itself, points at random: the last point's edge misleads none."""
    t = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    curve = np.column_stack([(1 + 0.7 * np.cos(5 * t)) * np.cos(t), (1 + 0.7 * np.cos(5 * t)) * np.sin(t), 0 * t])
    rim = Rim.of([curve], flat, up)
    x = np.random.default_rng(1).uniform(-1.8, 1.8, (400, 3)) * [1, 1, 0.1]
    a, b = rim.points, rim.points[rim.after]
    along = b - a
    share = np.clip(np.einsum("nki,ki->nk", x[:, None] - a, along) / np.einsum("ki,ki->k", along, along), 0, 1)
    off = x[:, None] - a - share[..., None] * along
    away = np.linalg.norm(off, axis=2)
    edge = np.argmin(away, axis=1)
    pick = np.arange(len(x))
    within = (share[pick, edge] > 0) & (share[pick, edge] < 1)
    exact = np.einsum("ni,ni->n", off[pick, edge], rim.inward[edge])
    assert within.mean() > 0.7
    assert rim.distance(x)[within] == pytest.approx(exact[within], abs=1e-12)


# As they are drawn

POINTS_A_SIDE = (1, 2, 3, 7, 16)


def polygon(sides: int, radius: float) -> Floats:
    angle = 0.1 + np.arange(sides) * 2 * np.pi / sides
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def along(corners: Floats, count: int) -> Floats:
    """Points (n, 2) on the sides of a closed polyline, `count` on each."""
    share = np.arange(count)[:, None, None] / count
    return np.asarray((corners + share * (np.roll(corners, -1, axis=0) - corners)).swapaxes(0, 1).reshape(-1, 2))


def lifted(target: rs.Target, plan: Floats) -> Floats:
    return np.column_stack([plan, target.height_at(plan)])


def bounded(dome: Freeform, curve: Floats) -> Freeform:
    """The dome within a curve, with the field that is already fitted."""
    target = replace(dome, curves=(curve,))
    target.__dict__["_fitted"] = dome._fitted
    return target


@pytest.fixture(scope="module")
def dome() -> Freeform:
    return Freeform.of(*sheet(lambda x, y: 3 - 0.05 * (x**2 + y**2), 6.0, 31))


@pytest.fixture(scope="module")
def ball() -> Freeform:
    return Freeform.of(*capped_sphere(20, np.pi / 2))


@pytest.mark.parametrize("where", ["in plan", "on the surface"])
@pytest.mark.parametrize("sides", range(3, 13))
def test_drawn_polygons_are_straight_in_plan_whatever_their_points(dome, where, sides):
    """On a dome of 12 m; rounded, and with chords in space, they were up to 0.68 m off."""
    line = lifted(dome, along(polygon(sides, 4.0), 40))
    for count in POINTS_A_SIDE:
        plan = along(polygon(sides, 4.0), count)
        curve = lifted(dome, plan) if where == "on the surface" else np.column_stack([plan, np.full(len(plan), -50.0)])
        target = bounded(dome, curve)
        assert np.abs(target.margin(line)).max() < 5e-6
        assert target.warnings == ()


@pytest.mark.parametrize("sides", [5, 8, 12])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_straight_sides_of_a_mesh_are_straight_in_plan(sides, count):
    """A fan over a polygon, whose edges lie across the dome: 0.1 to 0.4 m off when corners were rounded."""
    rings = [along(polygon(sides, 5.0 * k / 6), count) for k in (2, 3, 4, 5, 6)]
    n = len(rings[0])
    plan, k = np.vstack([np.zeros((1, 2)), *rings]), np.arange(n)
    after = np.roll(k, -1)
    faces = [np.column_stack([0 * k, 1 + k, 1 + after])]
    for first in 1 + n * np.arange(len(rings) - 1):
        faces += [first + np.column_stack([k, k + n, after + n]), first + np.column_stack([k, after + n, after])]
    target = Freeform.of(np.column_stack([plan, 3 - 0.05 * np.sum(plan**2, axis=1)]), np.vstack(faces))
    line = along(polygon(sides, 5.0), 30)
    line = target._settle(np.column_stack([line, 3 - 0.05 * np.sum(line**2, axis=1)]))
    assert np.abs(target.margin(line)).max() < 2e-5


@pytest.mark.parametrize("sides", [3, 4, 8])
def test_they_are_straight_in_plan_on_walls_as_steep_as_72_degrees(ball, sides):
    """Its chords lie far within the ball, where the closest points are elsewhere."""
    plan = polygon(sides, 0.95)
    line = lifted(ball, along(plan, 40))
    for z in (np.full(sides, 3.0), np.sqrt(1 - 0.95**2) + np.zeros(sides)):
        assert np.abs(bounded(ball, np.column_stack([plan, z])).rims[-1].distance(line)).max() < 1e-4


def test_corners_that_turn_by_little_are_corners():
    """By 3 to 14 degrees, with one point a corner or more: they were rounded, and sides beside them bent."""
    corners = np.array([[4, -3], [4.2, 0], [4.1, 2], [2, 3], [0, 3.2], [-2, 3.1], [-4, 2.5], [-4, -3]])
    line = along(corners, 50)
    for count in POINTS_A_SIDE:
        rim = Rim.of([np.pad(along(corners, count), ((0, 0), (0, 1)))], flat, up)
        assert np.abs(rim.distance(np.pad(line, ((0, 0), (0, 1))))).max() < 1e-6


@pytest.mark.parametrize("radius", [0.1, 1.5])
@pytest.mark.parametrize("even", [False, True])
def test_sides_are_straight_beside_rounded_corners_and_these_stay_round(radius, even):
    """A rectangle of 9 x 6 m, with sides of one edge, or of edges about as long as those of the arcs."""

    def rounded(count: int) -> list[Floats]:
        angle = np.linspace(0, np.pi / 2, count + 1) + np.arange(4)[:, None] * np.pi / 2
        middle = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [4.5 - radius, 3 - radius]
        return list(middle[:, None] + radius * np.stack([np.cos(angle), np.sin(angle)], axis=2))

    arcs = rounded(16)
    between = [np.linspace(a[-1], b[0], int(np.linalg.norm(b[0] - a[-1]) * 10 / radius) if even else 2)[1:-1]
               for a, b in zip(arcs, arcs[1:] + arcs[:1], strict=True)]  # fmt: skip
    drawn = np.vstack([part for pair in zip(arcs, between, strict=True) for part in pair])
    rim = Rim.of([np.pad(drawn, ((0, 0), (0, 1)))], flat, up)
    exact = np.pad(np.vstack(rounded(400)), ((0, 0), (0, 1)))
    side = np.column_stack([np.linspace(radius - 4.5, 4.5 - radius, 500), np.full(500, 3.0), np.zeros(500)])
    assert np.abs(rim.distance(side)).max() < 1e-9
    assert np.abs(rim.distance(exact)).max() < 1.3e-4  # of a loop with thousands of points none are added


def test_a_circle_of_26_points_is_round_and_one_of_24_is_a_polygon():
    for count, off in ((24, 0.0), (26, 1 - np.cos(np.pi / 26)), (100, 1 - np.cos(np.pi / 100))):
        rim = Rim.of([ring(1.0, count)], flat, up)
        assert rim.off == pytest.approx(off, rel=0.02, abs=1e-12)
        straight = np.pad(along(ring(1.0, count)[:, :2], 20), ((0, 0), (0, 1)))
        assert np.abs(rim.distance(ring(1.0, 1000) if off else straight)).max() < 1e-4


def test_points_drawn_twice_end_no_curve():
    twice = np.repeat(ring(1.0, 60), 2, axis=0)
    twice[1::2] *= 1 + 1e-9
    assert Rim.of([twice], flat, up).distance(ring(1.0, 1000)) == pytest.approx(0.0, abs=1e-5)


def test_how_far_the_shell_ends_from_what_is_drawn_is_said(dome):
    circle = lifted(dome, 4.0 * ring(1.0, 60)[:, :2])
    (words,) = bounded(dome, circle).warnings
    assert "the shell ends up to 5.89 mm from the boundary that is drawn" in words
    (words,) = bounded(dome, lifted(dome, along(polygon(4, 4.0), 3)) + [0.0, 0.0, 0.1]).warnings
    assert "the shell ends up to 99.6 mm from the boundary that is drawn" in words  # .1 m / sqrt(1 + (.1 * .943)^2)
    assert bounded(dome, lifted(dome, 4.0 * ring(1.0, 200)[:, :2])).warnings == ()


@pytest.mark.parametrize("z", [3.0, np.sqrt(1 - 0.95**2)])
@pytest.mark.parametrize("count", [30, 60])
def test_a_plan_on_a_steep_dome_is_compared_in_plan(ball, z, count):
    """At 72 degrees: along the surface the sagitta is 3.2 times as large."""
    sagitta = 0.95 * (1 - np.cos(np.pi / count))
    drawn = bounded(ball, 0.95 * ring(1.0, count) + [0.0, 0.0, z])
    cubic = 0.95 * 3 / 128 * (2 * np.pi / count) ** 4  # by which cubics through the points miss the circle
    assert drawn.rims[-1].off == pytest.approx(sagitta, rel=1e-3, abs=1.1 * cubic)
    assert f"up to {1e3 * drawn.rims[-1].off:.3g} mm from the boundary that is drawn" in drawn.warnings[-1]


@pytest.fixture(scope="module")
def hypar() -> Freeform:
    return Freeform.of(*sheet(lambda x, y: 0.25 * x * y, 6.0, 61))


@pytest.mark.parametrize("sides", [3, 4, 7])
def test_a_polygon_on_a_hypar_is_where_it_is_drawn(hypar, sides):
    """In plan, and in space at its corners, whose chords lie up to a metre from the surface."""
    plan = polygon(sides, 4.0)
    for curve in (np.pad(plan, ((0, 0), (0, 1))), np.column_stack([plan, 0.25 * plan[:, 0] * plan[:, 1]])):
        assert bounded(hypar, curve).rims[-1].off < 1e-4  # so near is the smooth surface to the hypar at its edge


@pytest.mark.parametrize("above", [0.0, 0.02, 0.2])
def test_a_curve_in_space_is_compared_with_the_edge_in_space(hypar, above):
    """z = 2 sin(2 a) + above over a circle: straight below its crests the edge is nearest, elsewhere it is nearer."""
    plan = 4.0 * ring(1.0, 400)[:, :2]
    drawn = bounded(hypar, np.column_stack([plan, 0.25 * plan[:, 0] * plan[:, 1] + above]))
    sagitta = 4.0 * (1 - np.cos(np.pi / 400)) * np.sqrt(2)  # at most, where the surface is as steep as 45 degrees
    assert drawn.rims[-1].off == pytest.approx(above, rel=1e-3, abs=sagitta)


def test_a_boundary_in_another_unit_than_its_surface_is_refused_with_both_sizes(dome):
    with pytest.raises(rs.InputError, match="is 8000 m wide and the surface 12 m: draw it in the unit of the surface"):
        bounded(dome, 4000.0 * ring(1.0, 60)).margin(np.zeros((1, 3)))


def test_an_edge_of_the_mesh_is_not_spoken_of_where_the_shell_ends_within_it(dome):
    vertices, faces = capped_sphere(6, 0.6)
    cap = Freeform.of(10.0 * vertices, faces)
    (words,) = cap.warnings
    assert "from the edge of the mesh" in words
    assert bounded(cap, lifted(cap, 4.0 * ring(1.0, 200)[:, :2])).warnings == ()
    assert replace(cap, base=9.0).warnings == ()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_boundary_of_fewer_than_three_points_is_refused(dome, count):
    few = np.repeat(lifted(dome, polygon(3, 2.0))[:count], 3, axis=0)
    with pytest.raises(rs.InputError, match="fewer than three different points"):
        Freeform.of(dome.surface.vertices, dome.surface.faces, curves=(few,))
