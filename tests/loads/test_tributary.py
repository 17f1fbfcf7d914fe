"""Tributary areas reach the surface's edge, and hand each place of it to the nearest node."""

from math import pi

import numpy as np
import pytest
from scipy.spatial import Delaunay

import rodshell as rs
from rodshell.loads.check import tributary_of
from rodshell.loads.tributary import mesh_triangles, surface_triangles, tributary_areas


def paraboloid_area(radius: float, height: float) -> float:
    return pi * radius / (6 * height**2) * ((radius**2 + 4 * height**2) ** 1.5 - radius**3)


SURFACES = [
    (rs.Hemisphere(0.2), 2 * pi * 0.2**2, pi * 0.2**2),
    (rs.Cap(10.0, 4.0), 2 * pi * 10.0 * 6.0, pi * (10.0**2 - 4.0**2)),
    (rs.Paraboloid(8.0, 4.0), paraboloid_area(8.0, 4.0), pi * 64),
    (rs.HeightField(formula="0.1*x", domain=rs.Rectangle((2.0, 1.0))), 2.0 * np.hypot(1, 0.1), 2.0),
]


@pytest.mark.parametrize(("target", "surface", "plan"), SURFACES, ids=lambda value: getattr(value, "name", None))
def test_areas_add_up_to_those_of_surface_and_plan(target: rs.Target, surface: float, plan: float) -> None:
    """To 0.1 %, whatever the nodes are: here those of a coarse ring and the middle, none of them on the edge."""
    turns = np.linspace(0, 2 * pi, 7)[:-1]
    xy = np.vstack([[0, 0], 0.4 * target.size * np.column_stack([np.cos(turns), np.sin(turns)])]) + target.summit
    points = target.lift(xy * [1.0, 0.5])
    found = tributary_areas(target, points, anchor=target.summit, rotate=0.3, spacing=0.2 * target.size)
    assert found.area.sum() == pytest.approx(surface, rel=1e-3)
    assert found.plan.sum() == pytest.approx(plan, rel=1e-3)
    assert (found.area > 0).all()


def test_vectors_of_a_surface_with_a_plane_edge_add_up_to_its_plan() -> None:
    """The vector area of a surface depends on its edge alone: without any part within the plan."""
    target = rs.Cap(10.0, 4.0)
    points = target.lift(np.random.default_rng(1).uniform(-4, 4, (40, 2)))
    found = tributary_areas(target, points, anchor=(0.0, 0.0), rotate=0.0, spacing=1.0)
    np.testing.assert_allclose(found.vectors.sum(axis=0), [0, 0, pi * 84], atol=1e-3 * pi * 84)
    np.testing.assert_allclose(found.vectors[:, 2], found.plan, rtol=1e-12)


def test_triangles_leave_out_openings() -> None:
    """A disc whose formula is known everywhere, cut by a ring of its own: the areas outside the domain do not count."""
    disc = rs.HeightField(formula="0.2 - x^2 - y^2", domain=rs.Disc(0.3))
    corners, faces = surface_triangles(disc, anchor=(0.05, 0.0), rotate=0.2, step=0.01)
    assert np.hypot(corners[:, 0], corners[:, 1]).max() <= 0.3 + 1e-9
    a, b, c = (corners[faces[:, k]] for k in range(3))
    assert 0.5 * np.cross(b - a, c - a)[:, 2].sum() == pytest.approx(pi * 0.09, rel=1e-3)


def test_areas_of_a_symmetric_shell_are_symmetric() -> None:
    """Two mirror images and a quarter turn leave a square grid on a dome as it is, and so its loads."""
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.03)
    rod = rs.Rod(rs.Circle(1e-3), rs.Material(1e6, 1e3))
    form = rs.find_form(rs.Hemisphere(0.2), layout, rod, ends=())
    stages = form.patches[0]
    areas, points = tributary_of(stages), stages.trimmed.positions
    for image in ([[-1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 0], [1, 0, 0], [0, 0, 1]]):
        moved = points @ np.array(image, dtype=float)
        partner = np.linalg.norm(points[None] - moved[:, None], axis=2).argmin(axis=1)
        np.testing.assert_allclose(areas.area[partner], areas.area, rtol=1e-6)


def test_the_middle_of_a_regular_grid_takes_one_cell_shared_among_its_edges() -> None:
    """On a plane, points of a square lattice take a cell each."""
    plane = rs.HeightField(formula="0.001*x^2", domain=rs.Rectangle((4.0, 4.0)))
    ticks = np.arange(-1.5, 2.0)
    points = plane.lift(np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2))
    found = tributary_areas(plane, points, anchor=(0.0, 0.0), rotate=0.0, spacing=1.0)
    np.testing.assert_allclose(found.plan, 1.0, rtol=1e-6)


def test_areas_of_a_surface_in_triangles_of_many_sizes_are_those_of_its_formula() -> None:
    """A paraboloid given by a mesh, finer on one side: whole, and what each of some nodes takes."""
    target = rs.Paraboloid(8.0, 4.0)
    radii, turns = 8.0 * np.linspace(0, 1, 25) ** 0.7, 2 * pi * np.linspace(0, 1, 49)[:-1] ** 1.2
    xy = np.vstack([[0, 0], *(r * np.column_stack([np.cos(turns), np.sin(turns)]) for r in radii[1:])])
    mesh = rs.Freeform.of(target.lift(xy), Delaunay(xy).simplices)
    points = target.lift(np.random.default_rng(2).uniform(-4, 4, (12, 2)))
    plain, given = (
        tributary_areas(surface, points, anchor=(0.0, 0.0), rotate=0.0, spacing=1.0) for surface in (target, mesh)
    )
    assert given.area.sum() == pytest.approx(plain.area.sum(), rel=4e-3)  # the mesh ends in chords
    np.testing.assert_allclose(given.area, plain.area, rtol=1e-2)
    np.testing.assert_allclose(given.plan_positions, plain.plan_positions, atol=0.03)


def test_long_strips_of_a_vault_are_divided_across() -> None:
    """A barrel vault of 30 m as CAD programs give it, two triangles a strip: no more triangles than its area needs."""
    turns, step = np.linspace(-1.0, 1.0, 25), 0.05
    ends = [np.column_stack([np.full(25, x), 4 * np.sin(turns), 4 * np.cos(turns)]) for x in (0.0, 30.0)]
    k = np.arange(24)
    faces = np.vstack([np.column_stack([k, k + 25, k + 26]), np.column_stack([k, k + 26, k + 1])])
    vault = rs.Freeform.of(np.vstack(ends), faces)
    corners, small = mesh_triangles(vault, step=step)
    sides = np.linalg.norm(corners[np.roll(small, -1, axis=1)] - corners[small], axis=2)
    assert sides.max() < 1.01 * step
    a, b, c = (corners[small[:, j]] for j in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert areas.sum() == pytest.approx(30.0 * 8.0, rel=1e-3)
    assert len(small) < 10 * 240.0 / step**2  # right triangles with legs of `step`: 2
