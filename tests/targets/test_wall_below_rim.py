"""Meshes that a grid falls on: the body under them against that of formulas, and what is no such body."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.targets import Freeform
from rodshell.targets.rim import Rim
from rodshell.targets.wall_below_rim import RimPlan
from tests.acceptance.cases import ROD
from tests.targets.meshes import Floats, capped_sphere, disc, lattice, sheet
from tests.targets.test_rim import flat, ring, up

RADIUS = 0.2


def roof(x: Floats, y: Floats) -> Floats:
    return 0.12 - 1.2 * x**2 - 0.5 * y**2 + 0.2 * x * y + 0.03 * x


def ball(opening: float, base: float | None = None, rows: int = 40) -> Freeform:
    x, faces = capped_sphere(rows, opening)
    return Freeform.of(RADIUS * x, faces, base=base)


BODIES: dict[str, tuple[rs.Target, Freeform]] = {
    "base plane": (rs.Hemisphere(RADIUS), ball(np.pi / 2 + 0.3, base=0.0)),
    "level edge": (rs.Hemisphere(RADIUS), ball(np.pi / 2)),
    "overhang": (rs.Cap(radius=RADIUS, base=-0.06), ball(2.4, base=-0.06)),
    "edge in space": (
        rs.HeightField(formula="0.12 - 1.2*x^2 - 0.5*y^2 + 0.2*x*y + 0.03*x", domain=rs.Disc(RADIUS)),
        Freeform.of(*disc(roof, RADIUS, 40)),
    ),
}


@pytest.mark.parametrize("name", BODIES)
def test_contact_with_a_mesh_is_that_with_its_formula(name):
    """Over the surface, beside the wall, below it and inside; the mesh's own error is 2e-5 of the size."""
    exact, mesh = BODIES[name]
    rng = np.random.default_rng(0)
    x = rng.uniform(-0.3, 0.3, (1500, 3))
    x[:, 2] *= 0.9
    x = x[np.abs(exact.contact(x).distance - 0.02) < 0.05]
    expected, found = exact.contact(x), mesh.contact(x)
    assert (expected.distance < 0).sum() > 80
    assert (np.abs(expected.normal[:, 2]) < 1e-9).sum() > 100  # the wall
    assert np.array_equal(mesh.outside(x), exact.outside(x))
    # inside, where two feet are about as near, either may be taken
    assert np.quantile(np.abs(found.distance - expected.distance), 0.995) < 4e-6
    assert np.quantile(np.abs(found.normal - expected.normal).max(axis=1), 0.99) < 5e-3


@pytest.mark.parametrize("name", BODIES)
def test_far_from_a_mesh_too_contact_is_that_with_its_formula(name):
    """Five sizes up, beside and down, where the field of the surface says nothing."""
    exact, mesh = BODIES[name]
    rng = np.random.default_rng(1)
    x = 5 * RADIUS * rng.uniform(-1, 1, (400, 3))
    if name == "edge in space":  # far beside such an edge, the formula's own is a guess
        x[:, :2] *= 0.15
    assert np.array_equal(mesh.outside(x), exact.outside(x))
    away = exact.outside(x)
    assert away.sum() > 50
    assert mesh.contact(x[away]).distance == pytest.approx(exact.contact(x[away]).distance, abs=1e-5)


@pytest.mark.slow
def test_a_grid_may_fall_on_a_mesh_from_high_above():
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, edge=0.03, length=0.9)
    ends = []
    for target in BODIES["base plane"]:
        draped = rs.drape(layout, ROD, target, method=rs.Fall(height=0.16, drag=0.0))  # drag slows the creep to rest
        assert draped.converged
        ends.append(draped.positions)
    assert ends[1] == pytest.approx(ends[0], abs=1e-3 * RADIUS)  # as still as "at rest" is


def test_an_outline_is_the_region_that_it_encloses():
    round_one = RimPlan(Rim.of([ring(RADIUS, 200)], flat, up))
    xy = np.random.default_rng(1).uniform(-0.4, 0.4, (500, 2))
    xy = xy[np.hypot(*xy.T) > 0.05]
    found, exact = round_one.distance(xy), rs.Disc(RADIUS).distance(xy)
    assert found[0] == pytest.approx(exact[0], abs=1e-6)
    assert found[1] == pytest.approx(exact[1], abs=5e-3)  # edges of a thousandth of the way round
    outer = exact[0] > -0.3 * RADIUS  # nearer to the centre the edges' own turns count more
    assert found[2][outer] == pytest.approx(exact[2][outer], abs=0.05 / RADIUS)
    assert np.array_equal(round_one.holds(xy), rs.Disc(RADIUS).holds(xy))
    corners = np.array([[0.3, 0.2, 0], [-0.3, 0.2, 0], [-0.3, -0.2, 0], [0.3, -0.2, 0]])
    square = RimPlan(Rim.of([corners], flat, up))
    assert square.half_extent == (0.3, 0.2)
    far = np.random.default_rng(2).uniform(-0.6, 0.6, (500, 2))
    far = far[np.abs(np.abs(far[:, 0]) - np.abs(far[:, 1]) - 0.1) > 0.01]  # off the diagonals, where normals jump
    for found, exact in zip(square.distance(far), rs.Rectangle((0.6, 0.4)).distance(far), strict=True):
        assert found == pytest.approx(exact, abs=1e-9)


def test_a_plane_cuts_a_ball_in_a_circle():
    rim = ball(2.4, base=-0.06).section(0.05)
    assert rim.loops == 1
    assert rim.points[:, 2] == pytest.approx(0.05, abs=1e-12)
    assert np.hypot(*rim.points[:, :2].T) == pytest.approx(np.sqrt(RADIUS**2 - 0.05**2), abs=1e-5)
    x, y, _ = rim.points.T
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0  # counter-clockwise


def test_a_grid_hangs_on_a_mesh_as_on_its_formula():
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.02, length=0.9)
    ends = []
    for target in BODIES["base plane"]:
        draped = rs.drape(layout, ROD, target, method=rs.Gravity())
        assert draped.converged
        assert draped.report.stable
        ends.append([(rod.start, rod.end) for rod in rs.trim(draped).mesh.grid.rods])
    assert np.array(ends[1]) == pytest.approx(np.array(ends[0]), abs=5e-5 * RADIUS)


def test_what_is_no_body_is_refused_with_what_to_do():
    t, p = np.meshgrid(np.linspace(0.06, RADIUS, 25), np.linspace(0, 2 * np.pi, 121), indexing="ij")
    ringed = Freeform.of(*lattice(t * np.cos(p), t * np.sin(p), 0.1 - t**2))
    steep = Freeform.of(*sheet(lambda x, y: 0.1 - 15 * x**2 + 0.3 * y, 0.2, 90))
    twice = Freeform.of(*sheet(lambda x, y: 0.1 - 5 * x**2 + 0.1 * y, 0.2, 60), base=0.05)
    x = np.zeros((1, 3))
    for target, why in ((ringed, "has openings"), (steep, "too steep near"), (twice, "at its base and elsewhere")):
        with pytest.raises(rs.InputError, match=f'{why}.*use drape method "bound"'):
            target.contact(x)
