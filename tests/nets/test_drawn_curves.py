"""Lines laid on a target, against circles of a sphere: by arc length, up to its end, over openings, and refused."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.nets.surface_lattice import SurfaceNet, surface_net
from rodshell.targets import Target
from tests.targets.meshes import lattice

R = 2.0
CAP = rs.Cap(radius=R, base=1.0)
ACROSS = [[(x, -3.0), (x, 3.0)] for x in np.arange(-1.5, 1.51, 0.3)]
BOTH = [*ACROSS, *[[point[::-1] for point in line] for line in ACROSS]]


def net_of(lines: list[list[tuple[float, ...]]], target: Target = CAP, **given: object) -> SurfaceNet:
    return surface_net(target, rs.Curves(lines=lines, **given).build(target))  # type: ignore[arg-type]


def between(net: SurfaceNet, k: int) -> np.ndarray:
    """Points of a rod from end to end."""
    return net.curves.at(np.full(300, k), np.linspace(*net.curves.ends[k], 300))[0]


def great_arc(
    start: tuple[float, float, float], end: tuple[float, float, float], count: int, radius: float = R
) -> np.ndarray:
    a, b = (np.array(v) / np.linalg.norm(v) for v in (start, end))
    angle, t = np.arccos(a @ b), np.linspace(0.0, 1.0, count)[:, None]
    return radius * (np.sin((1 - t) * angle) * a + np.sin(t * angle) * b) / np.sin(angle)


@pytest.mark.parametrize("base", [1.0, 1e-9])
def test_straight_lines_in_plan_are_circles_of_a_sphere_up_to_its_base(base: float) -> None:
    """Also where the sphere is upright at its base. Lengths and joints are those of the circles."""
    cap = rs.Cap(radius=R, base=base)
    net = net_of(BOTH, cap)
    for k, ((x, _), _) in enumerate(ACROSS):
        points = between(net, k)
        assert np.abs(points[:, 0] - x).max() < 2e-9
        assert np.abs(np.linalg.norm(points, axis=1) - R).max() < 2e-9
        np.testing.assert_allclose(points[[0, -1], 2], base, atol=1e-9)
        radius = np.sqrt(R**2 - x**2)
        assert np.diff(net.curves.ends[k])[0] == pytest.approx(2 * radius * np.arccos(base / radius), rel=1e-9)
    offsets = [line[0][0] for line in ACROSS]
    low, high = net.curves.ends[net.crossings.rods].transpose(2, 0, 1)
    on_both = ((low <= net.crossings.at) & (net.crossings.at <= high)).all(axis=1)  # some meet past an end
    assert on_both.sum() == sum(x**2 + y**2 < R**2 - base**2 for x in offsets for y in offsets)


def test_such_circles_bend_within_the_sphere_by_their_geodesic_curvature() -> None:
    """By which laths are cut that are curved at rest: x/(R rho) on a circle of radius rho, x from the middle."""
    net = net_of(BOTH, rs.Cap(radius=R, base=1.0))
    curve, s = net.curves.knots
    ends = net.curves.ends[curve]
    inside = (ends[:, 0] < s) & (s < ends[:, 1])
    normal, within = net.bends
    offset = np.array([line[0][0] for line in ACROSS] * 2)[curve]
    exact = np.abs(offset) / (R * np.sqrt(R**2 - offset**2))
    assert np.abs(np.abs(normal) - 1.0 / R)[inside].max() < 1e-7
    assert np.abs(np.abs(within) - exact)[inside].max() < 1e-5


def test_points_in_space_give_the_curve_between_its_ends_and_are_moved_onto_the_target() -> None:
    ends = (-0.7, 0.1, 0.6), (0.7, 0.2, 0.9)
    above = [great_arc(*ends, 30, R + 0.01), great_arc((0.1, -0.7, 0.7), (0.2, 0.7, 0.6), 30)]
    net = net_of([line.tolist() for line in above])
    points, exact = between(net, 0), great_arc(*ends, 300)
    assert np.abs(points @ np.cross(exact[0], exact[-1])).max() < 1e-6
    np.testing.assert_allclose(points[[0, -1]], exact[[0, -1]], atol=1e-6)  # both lie inside the base
    assert "lie up to 10 mm off the target" in net.warnings[0]
    assert len(net.crossings) == 1


def test_a_line_that_stops_within_half_a_per_cent_of_the_end_leads_there() -> None:
    short = np.sqrt(R**2 - 1.0) * (1 - 2e-3)
    net = net_of([[(-3.0, 0.0), (short, 0.0)], [(0.0, -3.0), (0.1, 3.0)]])
    assert between(net, 0)[-1, 2] == pytest.approx(1.0, abs=1e-9)


def test_a_line_across_an_opening_is_two_rods() -> None:
    """On a flat ring, of radii 1 and .3."""
    t, p = np.meshgrid(np.linspace(0.3, 1.0, 25), np.linspace(0, 2 * np.pi, 121), indexing="ij")
    ring = rs.Freeform.of(*lattice(t * np.cos(p), t * np.sin(p), 0 * t))
    net = net_of([[(-2.0, 0.1), (2.0, 0.1)], [(-0.6, -2.0), (-0.6, 2.0)], [(0.6, -2.0), (0.6, 2.0)]], ring, spacing=0.5)
    of, ends = net.curves.pieces
    assert of.tolist() == [0, 0, 1, 2]
    places = net.curves.at(np.repeat(of[:2], 2), ends[:2].ravel())[0]
    outer, inner = np.sqrt(1.0 - 0.01), np.sqrt(0.09 - 0.01)
    np.testing.assert_allclose(places[:, 0], [-outer, -inner, inner, outer], atol=5e-4)  # the ring's edges are polygons
    assert len(net.crossings) == 2


def test_a_turned_layout_is_turned_about_the_z_axis() -> None:
    plain, turned = net_of(BOTH), net_of(BOTH, rotate=0.4)
    spun = np.array([[np.cos(0.4), -np.sin(0.4), 0], [np.sin(0.4), np.cos(0.4), 0], [0, 0, 1]])
    np.testing.assert_allclose(between(turned, 3), between(plain, 3) @ spun.T, atol=1e-8)


def test_the_usual_spacing_is_that_of_the_lines() -> None:
    assert rs.Curves(lines=BOTH).build(CAP).spacing == pytest.approx((0.3, 0.3))


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ([(-1.0, 0.0), (0.0, 0.0), (0.0, 1.0)], r"rod R01 has a corner of 90 degrees at \(0, 0\) m"),
        ([(-1.0, 0.0), (0.0, 0.5), (1.0, 0.0), (-1.0, 0.0)], "rod R01 is closed"),
        ([(-1.0, 0.0, 1.0), (0.0, 0.0, 1.2), (1.0, 0.0, 1.0)], "rod R01 lies .* m off the target near"),
        ([(5.0, 0.0), (7.0, 0.0)], "no line of the layout lies on the target"),
    ],
)
def test_lines_that_are_no_rods_are_refused(line: list[tuple[float, ...]], says: str) -> None:
    with pytest.raises(InputError, match=says):
        net_of([line, [(8.0, -3.0), (8.0, 3.0)]], spacing=0.3)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"lines": [[(0.0, 0.0)]]}, "line 1 of the layout is of the shape \\(1, 2\\)"),
        ({"lines": [[(0.0, np.nan), (1.0, 0.0)]]}, "line 1 of the layout"),
        ({"lines": BOTH[:2], "names": ["A"]}, "layout names has 1 different names for 2 lines"),
        ({"lines": BOTH[:2], "names": ["A", "A"]}, "layout names has 1 different names for 2 lines"),
    ],
)
def test_wrong_lines_are_named(given: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        rs.Curves(**given)  # type: ignore[arg-type]


def test_lines_that_cover_no_area_have_no_spacing() -> None:
    with pytest.raises(InputError, match="cover no area"):
        rs.Curves(lines=[[(0.0, 0.0), (1.0, 0.0)], [(0.0, 0.0), (2.0, 0.0)]]).build(CAP)
    with pytest.raises(InputError, match="needs lines"):
        rs.Curves().build(CAP)
