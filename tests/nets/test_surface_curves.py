"""Geodesics and asymptotic lines against closed forms, and the points where curves cross."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import NetLimitError
from rodshell.geometry.frames import cross, unit
from rodshell.layout.lattices import Asymptotic, Geodesic
from rodshell.nets.surface_curves import SurfaceCurves, geodesic, trace
from rodshell.nets.surface_lattice import surface_net
from rodshell.targets import Target

HERE = np.linspace(0.0, 1.0, 400)


def laid(target: Target, plan: np.ndarray, heading: np.ndarray) -> SurfaceCurves:
    """Geodesics through the points over a plan, along a heading in plan."""
    seeds = target.lift(plan)
    normal = target.on_surface(seeds).normal
    across = cross(normal, np.tile([*heading, 0.0], (len(seeds), 1)))
    return trace(target, geodesic, seeds, unit(cross(across, normal)))


def along(curves: SurfaceCurves, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arc lengths, points and tangents of a curve from end to end."""
    s = curves.ends[k, 0] + HERE * np.diff(curves.ends[k])
    return s, *curves.at(np.full(len(s), k), s)


PLAN = np.array([[0.0, 0.0], [0.31, -0.2], [-0.7, 0.45], [0.2, 0.9]])


def test_on_a_sphere_they_are_great_circles_and_end_at_its_base() -> None:
    cap = rs.Cap(radius=2.0, base=1.0)
    curves = laid(cap, PLAN, np.array([0.8, 0.6]))
    for k in range(len(curves)):
        _, points, tangents = along(curves, k)
        pole = np.cross(points[0], tangents[0])
        assert np.abs(points @ pole).max() < 1e-8
        assert np.abs(np.linalg.norm(points, axis=1) - 2.0).max() < 2e-8
        np.testing.assert_allclose(points[[0, -1], 2], 1.0, atol=1e-9)
        angle = np.arccos(np.clip(points[0] @ points[-1] / 4.0, -1.0, 1.0))
        assert np.diff(curves.ends[k])[0] == pytest.approx(2.0 * angle, rel=1e-8)


@pytest.mark.parametrize("height", [0.7, 2.4])
def test_on_a_surface_of_revolution_they_keep_clairauts_constant(height: float) -> None:
    """r times the cosine of the angle with the parallel."""
    target = rs.Ellipsoid(a=1.6, b=1.6, c=height)
    curves = laid(target, PLAN, np.array([1.0, 0.2]))
    for k in range(len(curves)):
        _, points, tangents = along(curves, k)
        constant = points[:, 0] * tangents[:, 1] - points[:, 1] * tangents[:, 0]
        assert np.ptp(constant) < 1e-7 * target.size


def test_on_a_cylinder_they_are_straight_when_it_is_unrolled() -> None:
    target = rs.HeightField(formula="sqrt(4 - x^2)", domain=rs.Rectangle((3.0, 4.0)))
    curves = laid(target, PLAN, np.array([0.7, 0.5]))
    for k in range(len(curves)):
        s, points, _ = along(curves, k)
        unrolled = np.column_stack([2.0 * np.arcsin(points[:, 0] / 2.0), points[:, 1]])
        np.testing.assert_allclose(np.linalg.norm(unrolled - unrolled[0], axis=1), s - s[0], atol=1e-7 * target.size)


def test_on_a_cone_they_are_straight_when_it_is_developed() -> None:
    target = rs.HeightField(formula="3 - sqrt((x + 3)^2 + y^2)", domain=rs.Disc(1.5))
    curves = laid(target, PLAN, np.array([-0.3, 1.0]))
    for k in range(len(curves)):
        s, points, _ = along(curves, k)
        radius, angle = np.hypot(points[:, 0] + 3.0, points[:, 1]), np.arctan2(points[:, 1], points[:, 0] + 3.0)
        flat = np.sqrt(2.0) * radius * np.exp(1j * angle / np.sqrt(2.0))
        np.testing.assert_allclose(np.abs(flat - flat[0]), s - s[0], atol=1e-7 * target.size)


def test_they_do_not_depend_on_size_or_place() -> None:
    small, large = (laid(rs.Cap(radius=2.0 * k, base=1.0 * k), PLAN * k, np.array([0.6, 0.8])) for k in (1.0, 1e3))
    np.testing.assert_allclose(large.ends, 1e3 * small.ends, rtol=1e-9)


SADDLES = {
    "scherk": "0.8*(log(cos(y/0.8)) - log(cos(x/0.8)))",
    "saddle": "0.35*(x^2 - y^2) + 0.08*x^3 - 0.1*x*y^2 + 0.05*x*y",
}


@pytest.mark.parametrize("name", SADDLES)
def test_asymptotic_lines_have_no_normal_curvature(name: str) -> None:
    target = rs.HeightField(formula=SADDLES[name], domain=rs.Disc(0.9))
    net = surface_net(target, Asymptotic(spacing=0.15), anchor=(0.0, 0.0))
    for k in range(len(net.curves)):
        _, points, tangents = along(net.curves, k)
        shape = target.on_surface(points).hessian
        assert np.abs(np.einsum("ni,nij,nj->n", tangents, shape, tangents)).max() < 1e-6
    assert {name[0] for name in net.names} == {"U", "V"}
    assert len(net.crossings) > 100


def test_on_a_minimal_surface_asymptotic_lines_cross_at_right_angles() -> None:
    target = rs.HeightField(formula=SADDLES["scherk"], domain=rs.Disc(0.9))
    net = surface_net(target, Asymptotic(spacing=0.15), anchor=(0.0, 0.0))
    (_, first), (_, second) = (net.curves.at(net.crossings.rods[:, k], net.crossings.at[:, k]) for k in (0, 1))
    assert np.abs(np.einsum("ij,ij->i", first, second)).max() < 1e-6


PARTLY = rs.HeightField(formula="0.3*x^2 - 0.2*y^2*(0.3 + x)", domain=rs.Disc(0.9))


@pytest.mark.parametrize(("target", "anchor"), [(rs.Cap(radius=2.0, base=1.0), None), (PARTLY, (0.3, 0.0))])
def test_where_the_target_is_no_saddle_the_place_is_named(target: Target, anchor: tuple[float, float] | None) -> None:
    with pytest.raises(NetLimitError, match=r"no asymptotic lines at \(.*\) m, where it is not a saddle"):
        surface_net(target, Asymptotic(spacing=0.2), anchor=anchor)


def crossing_of(first: tuple[np.ndarray, np.ndarray], second: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The point, in the direction of +z, where two great circles of a sphere of radius 2 cross."""
    line = np.cross(np.cross(*first), np.cross(*second))
    return 2.0 * line / np.linalg.norm(line) * np.sign(line[2])


@pytest.mark.parametrize("families", [2, 3])
def test_every_crossing_of_great_circles_is_found_once_and_in_its_place(families: int) -> None:
    cap = rs.Cap(radius=2.0, base=1.0)
    net = surface_net(cap, Geodesic(spacing=0.3, families=families, rotate=0.2))  # type: ignore[arg-type]
    curves = net.curves
    seeds, tangents = curves.at(np.arange(len(curves)), np.zeros(len(curves)))
    expected = dict[tuple[int, int], np.ndarray]()
    for a in range(len(curves)):
        for b in range(a + 1, len(curves)):
            place = crossing_of((seeds[a], tangents[a]), (seeds[b], tangents[b]))
            if net.names[a][0] != net.names[b][0] and place[2] > 1.0:
                expected[a, b] = place
    start, stop = curves.ends[net.crossings.rods].transpose(2, 0, 1)
    inside = net.crossings.select(((start <= net.crossings.at) & (net.crossings.at <= stop)).all(axis=1))
    assert [tuple(pair) for pair in inside.rods.tolist()] == sorted(expected)
    for side in (0, 1):
        found = curves.at(inside.rods[:, side], inside.at[:, side])[0]
        np.testing.assert_allclose(found, [expected[key] for key in sorted(expected)], atol=2e-8)


def test_rods_are_set_out_at_equal_arcs_across_each_family() -> None:
    cap = rs.Cap(radius=2.0, base=1.0)
    net = surface_net(cap, Geodesic(spacing=0.3))
    seeds = net.curves.at(np.arange(len(net.curves)), np.zeros(len(net.curves)))[0]
    for k in (0, 1):
        chosen = seeds[[name[0] == "UVW"[k] for name in net.names]]
        apart = 2.0 * np.arccos(np.clip(np.einsum("ij,ij->i", chosen[1:], chosen[:-1]) / 4.0, -1.0, 1.0))
        np.testing.assert_allclose(apart, 0.3, rtol=1e-6)


def test_corners_that_the_curve_across_does_not_reach_are_filled() -> None:
    """On a plane at 30 degrees: lines at all multiples of the spacing, up to those of three spacings in a corner."""
    half, spacing, angle = np.array([3.0, 2.0]), 0.4, np.radians(30.0)
    plane = rs.HeightField(function=lambda x, y: 1.0 + 0.0 * x, domain=rs.Rectangle((6.0, 4.0)))
    net = surface_net(plane, Geodesic(spacing=spacing, rotate=angle), anchor=(0.0, 0.0))
    across = np.array([-np.sin(angle), np.cos(angle)])
    offsets = []
    for k in np.flatnonzero(np.array(net.families) == "u"):
        _, points, _ = along(net.curves, int(k))
        assert np.ptp(points[:, :2] @ across) < 1e-9
        offsets.append(points[0, :2] @ across)
    corner = np.abs(across) @ half
    most = corner - 3.0 * spacing / (
        np.tan(angle) + 1.0 / np.tan(angle)
    )  # a line is as long, over its way to the corner
    count = int(most / spacing)
    assert count > 2.0 / np.cos(angle) // spacing  # further than the curve across through the anchor
    np.testing.assert_allclose(np.sort(offsets), spacing * np.arange(-count, count + 1), atol=1e-9)


def test_rods_of_one_family_that_cross_are_said_until_they_are_left_out() -> None:
    hill = rs.HeightField(formula="2.5*exp(-(x^2 + y^2)/4)", domain=rs.Rectangle((6.0, 6.0)))
    net = surface_net(hill, Geodesic(spacing=0.8), anchor=(0.0, 0.0))
    (said,) = net.warnings
    assert "rods of one family cross each other without a joint" in said
    assert {*net.families} == {"u", "v"}
    of = np.array(net.families)[net.crossings.rods]
    assert (of[:, 0] != of[:, 1]).all()
    kept = ("U01", "U08", "V01", "V08")  # at the rim, where the hill is flat
    left_out = [name for name in net.names if name not in kept]
    assert not surface_net(hill, Geodesic(spacing=0.8, left_out=left_out), anchor=(0.0, 0.0)).warnings
    assert not surface_net(rs.Cap(radius=2.0, base=1.0), Geodesic(spacing=0.3)).warnings
