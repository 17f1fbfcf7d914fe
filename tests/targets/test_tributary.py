"""Tributary areas reach the surface's end, and hand each place of it to the node that is nearest along the surface."""

import os
import subprocess
import sys
from math import pi

import numpy as np
import pytest
from numba import config
from scipy.spatial import Delaunay

import rodshell as rs
from rodshell.geometry.frames import cross
from rodshell.loads.check import tributary_of
from rodshell.targets.end_triangles import end_triangles
from rodshell.targets.tributary import divide, tributary_areas
from tests.acceptance.signed_areas import (
    DEVELOPED,
    DOMAIN,
    HIGH,
    LOW,
    cells,
    curved,
    mesh_rows,
    off,
    rectangle,
    sum_rows,
)
from tests.acceptance.test_acceptance import check_reached
from tests.targets.cells_of_nodes import areas_in_plane

ROUND_OFF = 1e-12


@pytest.mark.parametrize("name", DEVELOPED)
def test_cells_of_what_can_be_unrolled_are_polygons_of_the_plane(name: str) -> None:
    formula, unrolled = DEVELOPED[name]
    target = rs.HeightField(formula=formula, domain=DOMAIN)
    plan = np.random.default_rng(5).uniform(LOW, HIGH, (60, 2))
    found = cells(target, target.lift(plan), 0.9)
    expected = areas_in_plane(unrolled(plan), [unrolled(rectangle(LOW, HIGH))])
    # exact but for the ends' corners, and on the parabola for the distance to the nodes: of sixth order, here 0.5 m
    assert off(found.area, expected) < (1e-5 if "barrel" in name else 1e-6)


def test_cells_reach_the_ends_of_a_mesh_with_corners_and_an_opening() -> None:
    check_reached(mesh_rows())


def test_areas_add_up_to_those_of_surface_and_plan() -> None:
    check_reached(sum_rows())


def test_cells_of_a_curved_surface_are_those_that_rays_find() -> None:
    check_reached(curved("paraboloid", rs.Paraboloid(6.0, 3.0), 0.9, 240, 4))


def test_few_nodes_share_the_whole_surface() -> None:
    """Whatever the nodes are: here those of a coarse ring and the middle, none of them on the end."""
    target = rs.Hemisphere(0.2)
    turns = np.linspace(0, 2 * pi, 7)[:-1]
    xy = np.vstack([[0, 0], 0.08 * np.column_stack([np.cos(turns), np.sin(turns)])])
    found = tributary_areas(target, target.lift(xy), anchor=(0.0, 0.0), rotate=0.3, spacing=0.04)
    assert found.area.sum() == pytest.approx(2 * pi * 0.04, rel=1e-6)
    np.testing.assert_allclose(found.area[1:], found.area[1], rtol=1e-4)  # the lattice has no sixfold symmetry
    # the middle takes a cap that six great circles bound, halfway to the others: a regular hexagon on the sphere
    angle = 2 * np.arccos(np.cos(0.5 * np.arcsin(0.4)) * np.sin(pi / 6))  # at its corners, by Napier's rules
    assert found.area[0] == pytest.approx(0.04 * (6 * angle - 4 * pi), rel=1e-4)


def test_vectors_of_a_surface_with_a_plane_end_add_up_to_its_plan() -> None:
    """The vector area of a surface depends on its end alone: without any part within the plan."""
    target = rs.Cap(10.0, 4.0)
    points = target.lift(np.random.default_rng(1).uniform(-4, 4, (40, 2)))
    found = tributary_areas(target, points, anchor=(0.0, 0.0), rotate=0.0, spacing=1.0)
    np.testing.assert_allclose(found.vectors.sum(axis=0), [0, 0, pi * 84], atol=1e-6 * pi * 84)
    np.testing.assert_allclose(found.vectors[:, 2], found.plan, rtol=ROUND_OFF)


def test_nodes_in_the_same_place_share_its_area() -> None:
    """As those of rods in two layers."""
    plane = rs.HeightField(formula="0.001*x^2", domain=rs.Rectangle((4.0, 4.0)))
    ticks = np.arange(-1.5, 2.0)
    points = plane.lift(np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2))
    found = tributary_areas(plane, np.vstack([points, points[:3]]), anchor=(0.0, 0.0), rotate=0.0, spacing=1.0)
    expected = np.ones(19)
    expected[[0, 1, 2, 16, 17, 18]] = 0.5
    np.testing.assert_allclose(found.plan, expected, rtol=1e-6)
    np.testing.assert_allclose(found.plan_positions, np.vstack([points, points[:3]])[:, :2], atol=1e-5)


def test_areas_of_a_symmetric_shell_are_symmetric() -> None:
    """Two mirror images and a quarter turn leave a square grid on a dome as it is, and so its loads."""
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.03)
    form = rs.find_form(rs.Hemisphere(0.2), layout, rs.Rod(rs.Circle(1e-3), rs.Material(1e6, 1e3)), ends=())
    stages = form.patches[0]
    areas, points = tributary_of(stages), stages.trimmed.positions
    for image in ([[-1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 0], [1, 0, 0], [0, 0, 1]]):
        moved = points @ np.array(image, dtype=float)
        partner = np.linalg.norm(points[None] - moved[:, None], axis=2).argmin(axis=1)
        np.testing.assert_allclose(areas.area[partner], areas.area, rtol=0, atol=1e-5 * areas.area.mean())


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
    # the field that replaces the mesh deviates from the formula
    assert given.area.sum() == pytest.approx(plain.area.sum(), rel=1e-3)
    np.testing.assert_allclose(given.area, plain.area, rtol=3e-3)
    np.testing.assert_allclose(given.plan_positions, plain.plan_positions, atol=0.01)


def test_long_strips_of_a_vault_are_divided_across() -> None:
    """A barrel vault of 30 m as CAD programs give it, two triangles a strip: no more triangles than its area needs."""
    turns, step = np.linspace(-1.0, 1.0, 25), 0.1
    ends = [np.column_stack([np.full(25, x), 4 * np.sin(turns), 4 * np.cos(turns)]) for x in (0.0, 30.0)]
    k = np.arange(24)
    faces = np.vstack([np.column_stack([k, k + 25, k + 26]), np.column_stack([k, k + 26, k + 1])])
    vault = rs.Freeform.of(np.vstack(ends), faces)
    corners, _, small, factors = end_triangles(vault, anchor=(0.0, 0.0), rotate=0.0, step=step)
    inner = small[factors == 1]
    sides = np.linalg.norm(corners[np.roll(inner, -1, axis=1)] - corners[inner], axis=2)
    assert sides.max() < 1.01 * step
    a, b, c = (corners[small[:, j]] for j in range(3))
    assert (0.5 * factors * np.linalg.norm(cross(b - a, c - a), axis=1)).sum() == pytest.approx(30.0 * 8.0, rel=1e-3)
    assert len(small) < 20 * 240.0 / step**2  # right triangles with legs of `step`: 2


def test_triangles_are_divided_as_polygons_are_cut() -> None:
    """In a plane, a triangle that is turned over too: the slow twin cuts the same triangle."""
    rng = np.random.default_rng(6)
    corners, nodes = np.array([[-1.0, -0.8], [1.2, -0.5], [0.1, 1.1]]), rng.uniform(-1, 1, (9, 2))
    plane, up = (lambda xy: np.column_stack([xy, np.zeros(len(xy))])), np.tile([0.0, 0.0, 1.0], (9, 1))
    faces, start, every = np.array([[0, 1, 2], [2, 1, 0]]), np.array([0, 9, 18]), np.tile(np.arange(9), 2)
    sizes, parts = np.empty(2), np.zeros((18, 3))
    divide(plane(corners), up[:3], faces, start, every, plane(nodes), up, sizes, parts)
    share = parts.sum(axis=1).reshape(2, 9)
    assert sizes[1] == pytest.approx(-sizes[0], rel=ROUND_OFF)
    np.testing.assert_allclose(share[0] * sizes[0], areas_in_plane(nodes, [corners]), atol=ROUND_OFF)
    np.testing.assert_allclose(share[1], share[0], atol=ROUND_OFF)
    np.testing.assert_allclose(parts[:9].sum(axis=0), 1 / 3, rtol=ROUND_OFF)  # the triangle's own middle


@pytest.mark.slow
def test_triangles_are_divided_the_same_without_the_compiler() -> None:
    if config.DISABLE_JIT:
        pytest.skip("nothing is compiled: unset NUMBA_DISABLE_JIT")
    here = [__file__, "-k", "polygons_are_cut", "-n", "0", "-p", "no:cacheprovider"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "RODSHELL_KERNELS": "jit"}
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *here], env=environment, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stdout


@pytest.mark.slow
def test_areas_of_a_folded_roof_reach_across_its_crease() -> None:
    """Two planes bent a little, in patches: off by the triangles at the crease, whose normals are those of one side."""
    x, y = np.meshgrid(np.linspace(-4, 4, 41), np.linspace(-3, 3, 41))
    index = np.arange(41 * 41).reshape(41, 41)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    vertices = np.column_stack([x.ravel(), y.ravel(), (3 - 0.5 * abs(x) - 0.03 * y**2).ravel()])
    roof = rs.Freeform.of(vertices, np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]))
    rod = rs.Rod(rs.Tube(radius=0.01, thickness=0.002), rs.Material(23e9, 1850, 0.3))
    form = rs.find_form(roof, rs.GridLayout.orthogonal(spacing=0.8), rod, seams=[[(0, -4), (0, 4)]], ends=())
    areas, turn = tributary_of(form.stages), np.linspace(-3, 3, 2001)
    expected = 8 * np.trapezoid(np.sqrt(1.25 + (0.06 * turn) ** 2), turn)
    assert areas.area.sum() == pytest.approx(expected, rel=5e-4)
    assert areas.plan.sum() == pytest.approx(48.0, rel=1e-6)
