"""Trim and map back: rods end where the net ends, in the flat state as in the draped one.

Hanging rods are made up from the sphere's exact net, so that where they must be cut is known without a drape.
All lengths in metres.
"""

from collections.abc import Callable
from functools import cache
from itertools import product
from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import fresnel

from rodshell.errors import InputError
from rodshell.formfinding import Draped, DrapeFigures, Fall, Gravity, Trimmed, drape, map_back, trim
from rodshell.formfinding.trim import end_tangents, untrimmed
from rodshell.layout import FlatGrid, FlatRod, GridLayout, GridMesh, mesh_grid
from rodshell.layout.gridlayout import lattice_rod
from rodshell.rods.section import Circle, Material, Rod
from rodshell.targets import Disc, Ellipsoid, HeightField, Hemisphere, Paraboloid, Target
from tests.nets.sphere_net import sphere_net_end, sphere_net_rod

Floats = NDArray[np.float64]

R = 0.2
ROD = Rod(section=Circle(radius=1e-3), material=Material(youngs_modulus=1e6, density=1e3))
SWINGS = "it has fewer than 3 joints and would swing"
NEVER = "it never touches the target"


def bound(target: Target, **given: Any) -> Draped:
    return drape(GridLayout.orthogonal(**{"spacing": 0.03, "edge": 0.01, **given}), ROD, target)


DRAPES: dict[str, tuple[Target, dict[str, Any]]] = {
    "hemisphere": (Hemisphere(R), {}),
    # a joint 0.136 spacings from an end, not made; one at 0.156, made
    "hemisphere at 34 mm": (Hemisphere(R), {"spacing": 0.034}),
    "hemisphere at 46 mm": (Hemisphere(R), {"spacing": 0.046}),
    "hemisphere, 17x17": (Hemisphere(R), {"rods": (17, 17)}),
    "hemisphere, 25x16": (Hemisphere(R), {"rods": (25, 16), "offset": (0.004, 0.0)}),
    "paraboloid": (Paraboloid(R, 0.12), {}),
    "ellipsoid, unequal and turned": (Ellipsoid(R, 0.15, 0.12), {"spacing": (0.03, 0.02), "rotate": 0.5}),
}
every_drape = pytest.mark.parametrize("name", DRAPES)


@cache
def trimmed(name: str) -> Trimmed:
    target, layout = DRAPES[name]
    return trim(bound(target, **layout))


def ends_of(rods: tuple[FlatRod, ...]) -> Floats:
    """(2m, 2) start and end of each rod in the flat plane, from what its family, offset and ends mean."""
    points = []
    for rod in rods:
        points += [(s, rod.offset) if rod.family == "u" else (rod.offset, s) for s in (rod.start, rod.end)]
    return np.array(points)


# The bound drape


@every_drape
def test_rods_end_where_the_net_ends_and_are_cut_there_in_the_flat_state(name):
    cut = trimmed(name)
    assert cut.draped.net is not None
    net = {rod.name: rod for rod in cut.draped.net.rods if not rod.virtual}
    footprint = map_back(cut)
    gone = {rod for rod, _ in cut.dropped}
    built = [rod for rod in cut.draped.net.rods if not rod.virtual and rod.name not in gone]
    assert [rod.name for rod in footprint.rods] == [rod.name for rod in built]
    for rod in footprint.rods:
        assert (rod.start, rod.end) == (net[rod.name].start, net[rod.name].end)
        assert (rod.family, rod.offset) == (net[rod.name].family, net[rod.name].offset)
    np.testing.assert_allclose(footprint.points, ends_of(footprint.rods), rtol=0, atol=1e-15)
    lengths = np.bincount(cut.mesh.edge_rods, weights=cut.mesh.edge_lengths)
    np.testing.assert_allclose(lengths, [rod.length for rod in footprint.rods], rtol=0, atol=1e-14)
    assert cut.mesh.edge_lengths.max() < cut.draped.layout.edge * (1 + 1e-5)


@every_drape
def test_the_boundary_lies_on_the_target_and_near_its_base(name):
    cut = trimmed(name)
    target = cut.draped.target
    points = cut.boundary.points
    assert len(points) == 2 * len(cut.mesh.grid.rods) == len(cut.boundary.tangents)
    assert np.abs(target.implicit(points).value).max() < 1e-12 * target.size  # 2e-16 measured
    # the drape's rods end at the net's ends, so that they miss the base by what the two differ
    deviation = cut.draped.figures.net_deviation
    assert deviation is not None
    assert np.abs(deviation).max() < 3e-4  # 1.5e-4 measured, on the ellipsoid; grazing rods are the worst
    assert np.abs(target.margin(points)).max() < 1.001 * np.abs(deviation).max() + 1e-9


@every_drape
def test_the_trimmed_shell_is_a_part_of_the_drape(name):
    """The same nodes at the same places: nothing is interpolated between a drape and its footprint."""
    cut = trimmed(name)
    whole, row = cut.draped.mesh, {rod.name: k for k, rod in enumerate(cut.draped.mesh.grid.rods)}
    for k, rod in enumerate(cut.mesh.grid.rods):
        s = cut.mesh.stations[cut.mesh.rod_slice(k)]
        line = whole.rod_slice(row[rod.name])
        place = np.abs(whole.stations[line] - s[:, None]).argmin(axis=1)
        np.testing.assert_array_equal(whole.stations[line][place], s)
        np.testing.assert_array_equal(np.diff(place), 1)
        np.testing.assert_array_equal(
            cut.positions[cut.mesh.nodes_of(k)], cut.draped.positions[whole.rod_nodes[line][place]]
        )
    np.testing.assert_array_equal(cut.boundary.draped, cut.positions)
    np.testing.assert_array_equal(cut.boundary.points, cut.positions[cut.mesh.ends.ravel()])


@every_drape
def test_joints_are_all_crossings_but_those_too_close_to_an_end(name):
    cut = trimmed(name)
    rods = cut.mesh.grid.rods
    nearest = 0.15 * min(cut.draped.layout.spacing)
    expected, refused = set(), set()
    for (a, u), (b, v) in product(enumerate(rods), enumerate(rods)):
        if (u.family, v.family) == ("u", "v"):
            spare = min(v.offset - u.start, u.end - v.offset, u.offset - v.start, v.end - u.offset)
            if spare > nearest:
                expected.add((a, b))
            elif spare > 0:
                refused.add((a, b))
    assert {tuple(pair) for pair in cut.mesh.grid.crossings.rods.tolist()} == expected
    nodes = [set(cut.mesh.nodes_of(k).tolist()) for k in range(len(rods))]
    assert all(nodes[a] & nodes[b] for a, b in expected)
    assert not any(nodes[a] & nodes[b] for a, b in refused)
    if name == "hemisphere":
        # in spacings: rods at 2 end 0.5 mm past 10, those at 10 end 1 mm past 2; rods at 6 and 7: 1.8 and 1.9 mm
        close = [(2, 10), (10, 2), (6, 7), (7, 6)]
        signs = list(product((1, -1), (1, -1)))
        named = {(f"U{11 + i * u:02d}", f"V{11 + j * v:02d}") for (i, j), (u, v) in product(close, signs)}
        assert {(rods[a].name, rods[b].name) for a, b in refused} == named


@every_drape
def test_every_rod_left_has_three_joints_and_the_others_are_named(name):
    cut = trimmed(name)
    assert cut.mesh.grid.joint_counts().min() >= 3
    assert cut.draped.net is not None
    offered = {rod.name for rod in cut.draped.net.rods if not rod.virtual}
    left = {rod.name for rod in cut.mesh.grid.rods}
    assert {rod for rod, why in cut.dropped if why == SWINGS} == offered - left
    assert {rod for rod, why in cut.dropped if why == NEVER} == {rod for rod, _ in cut.draped.net.dropped}
    assert len(cut.dropped) == len(set(cut.dropped))
    expected = {
        "hemisphere": set(),
        "hemisphere, 17x17": set(),
        # 1.35 spacings long on either side, but its joints at 1 are 0.108 spacings from the end of the other rod
        "hemisphere at 34 mm": {(rod, SWINGS) for rod in ("U01", "U19", "V01", "V19")},
        "hemisphere at 46 mm": set(),
        "hemisphere, 25x16": {("U01", NEVER), ("U02", NEVER), ("U24", NEVER), ("U25", NEVER)},
        # 15 mm on either side of the middle rod alone: one joint
        "paraboloid": {(rod, SWINGS) for rod in ("U01", "U17", "V01", "V17")},
    }
    if name in expected:
        assert set(cut.dropped) == expected[name]


@pytest.mark.parametrize(("spacing", "within"), [(0.03, 1.2e-4), (0.05, 2.6e-4)])
def test_ends_of_the_hemispheres_drape_are_those_of_the_sphere_net(spacing, within):
    cut = trim(bound(Hemisphere(R), spacing=spacing))
    off = np.linalg.norm(cut.boundary.points - sphere_ends(cut.mesh.grid.rods, 0), axis=1)
    assert off.max() < within  # 6e-5 and 1.3e-4 measured: twice that


def test_a_grid_too_coarse_for_three_joints_is_refused():
    """At 0.2 m: rods at 0.2 are shorter than the spacing and go; then the middle rods have one joint each."""
    with pytest.raises(InputError, match="no rod of the grid has 3 joints on the target: use a smaller spacing"):
        trim(bound(Hemisphere(R), spacing=0.2))


# Hanging rods, from the sphere's exact net


@cache
def sphere_end(offset: float) -> tuple[Floats, Floats]:
    """Point and tangent of the rod of family u at `offset`, where it meets z = 0 on the side of positive x."""
    length = sphere_net_end(R, offset)
    y = sphere_net_rod(R, offset, length).sol(length / R)
    return R * y[:3], y[3:]


@cache
def sphere_path(offset: float, length: float) -> Callable[[Floats], Floats]:
    return sphere_net_rod(R, offset, length).sol


def placed(x: Floats, family: str, sign: int | Floats) -> Floats:
    """Vectors (..., 3) of a rod of family u on the positive side, on the side `sign` and in its own family."""
    x = np.concatenate([x[..., :1] * np.reshape(sign, (*np.shape(sign), 1)), x[..., 1:]], axis=-1)
    return x if family == "u" else x[..., [1, 0, 2]]


def sphere_ends(rods: tuple[FlatRod, ...], which: int) -> Floats:
    """(2m, 3) exact points (0) or tangents (1) at start and end of each rod; both tangents point outwards."""
    return np.array([placed(sphere_end(rod.offset)[which], rod.family, sign) for rod in rods for sign in (-1, 1)])


def hanging(*, edge: float, count: int = 9, length: float = 0.8, low: float = 0.0) -> Draped:
    """A grid of 30 mm whose rods run on over the sphere past its base plane, as if draped; `low` m too low."""
    layout = GridLayout.orthogonal(rods=(count, count), spacing=0.03, length=length, edge=edge)
    mesh = mesh_grid(layout.flat_grid((count, count), length), edge)
    positions = np.full((mesh.node_count, 3), np.nan)
    for k, rod in enumerate(mesh.grid.rods):
        s = mesh.stations[mesh.rod_slice(k)]
        path = sphere_path(rod.offset, length / 2)(np.abs(s) / R)[:3].T * R
        positions[mesh.nodes_of(k)] = placed(path, rod.family, np.where(s < 0, -1.0, 1.0))
    positions[:, 2] -= low
    return Draped(
        method=Gravity(), target=Hemisphere(R), layout=layout, rod=ROD, anchor=None, eccentricity=0.0, mesh=mesh,
        positions=positions, rods=mesh.grid.rods, levels=(), figures=DrapeFigures(0.0, 0, 0.0, (0.0, 0.0, 0.0)),
    )  # fmt: skip


def test_hanging_rods_are_cut_at_the_base_to_fourth_order():
    errors, sideways = [], []
    for edge in (0.015, 0.0075, 0.00375):
        cut = trim(hanging(edge=edge))
        assert len(cut.mesh.grid.rods) == 18
        exact = np.array([sphere_net_end(R, rod.offset) for rod in cut.mesh.grid.rods])
        found = np.array([(rod.start, rod.end) for rod in map_back(cut).rods])
        errors.append(np.abs(found - exact[:, None] * [-1, 1]).max())
        sideways.append(np.linalg.norm(cut.boundary.points - sphere_ends(cut.mesh.grid.rods, 0), axis=1).max())
    # 4e-9, 6e-10, 4e-11 and 8e-8, 6e-9, 4e-10 measured; the error depends on where in its edge a cut lies, so that
    # of two halvings each may give less than 16, but not both
    assert errors[0] < 2e-8
    assert errors[0] / errors[2] > 60
    assert sideways[0] < 3e-7
    assert sideways[0] / sideways[2] > 60


@pytest.mark.parametrize("method", [Gravity(), pytest.param(Fall(height=0.05), marks=pytest.mark.slow)])
def test_rods_that_hang_past_the_rim_of_a_height_field_are_cut_at_the_rim(method):
    """The paraboloid by its formula, and a surface of which the rim is not level."""
    layout = GridLayout.orthogonal(rods=(7, 7), spacing=0.06, length=0.9)

    def cut(target: Target) -> Trimmed:
        return trim(drape(layout, ROD, target, method=method))

    def bowl(x: Floats, y: Floats) -> Floats:
        return 0.12 * (1 - (x**2 + y**2) / R**2)

    given, known = cut(HeightField(function=bowl, domain=Disc(R))), cut(Paraboloid(R, 0.12))
    apart = [
        [a.start - b.start, a.end - b.end] for a, b in zip(known.mesh.grid.rods, given.mesh.grid.rods, strict=True)
    ]
    assert np.abs(apart).max() < 2e-3  # the cut is within a share of an edge of 15 mm: 1.5 mm measured, 26 mm before
    for found in (given, cut(HeightField(function=lambda x, y: bowl(x, y) + 0.4 * x * y, domain=Disc(R)))):
        off_rim = np.hypot(*found.boundary.points[:, :2].T) - R
        assert np.abs(off_rim).max() < 2e-3  # 1.4 mm measured; 25 mm before


def test_ends_of_hanging_rods_are_put_on_the_target():
    cut = trim(hanging(edge=0.01))
    assert np.abs(cut.draped.target.implicit(cut.boundary.points).value).max() < 1e-12 * R  # 1e-17 measured
    np.testing.assert_allclose(cut.boundary.points[:, 2], 0.0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(map_back(cut).points, ends_of(cut.mesh.grid.rods), rtol=0, atol=1e-15)


def test_tangents_at_the_ends_of_hanging_rods_converge_to_second_order():
    errors = []
    for edge in (0.015, 0.0075, 0.00375):
        cut = trim(hanging(edge=edge))
        np.testing.assert_allclose(np.linalg.norm(cut.boundary.tangents, axis=1), 1.0, rtol=0, atol=1e-15)
        errors.append(np.linalg.norm(cut.boundary.tangents - sphere_ends(cut.mesh.grid.rods, 1), axis=1).max())
    assert errors[0] < 4e-4  # 1.5e-4, 3.2e-5 and 8.5e-6 measured; tails are not divided by exactly two
    assert errors[0] / errors[2] > 10


def test_hanging_rods_that_do_not_reach_the_target_are_dropped_and_named():
    """Sunk by 0.11 m the rod at 0.21 starts at z = -0.01: it never rises above the base."""
    draped = hanging(edge=0.01, count=15, length=0.4, low=0.11)
    cut = trim(draped)
    assert set(cut.dropped) == {(rod, NEVER) for rod in ("U01", "U15", "V01", "V15")}
    assert cut.mesh.grid.joint_counts().min() >= 3


def test_hanging_rods_too_short_to_reach_the_end_are_refused():
    with pytest.raises(InputError, match=r"rod U0\d is too short to reach the end of the target: use a longer layout"):
        trim(hanging(edge=0.01, length=0.6))  # 2 x 0.314 needed


def test_a_drape_that_stopped_is_kept_whole():
    draped = hanging(edge=0.03)
    kept = untrimmed(draped)
    assert kept.mesh is draped.mesh
    np.testing.assert_array_equal(kept.positions, draped.positions)
    np.testing.assert_array_equal(kept.boundary.points, draped.positions[draped.mesh.ends.ravel()])


# Tangents


def lone_rod(stations: Floats) -> GridMesh:
    rod = lattice_rod(0, "U01", 0.0, float(stations[0]), float(stations[-1]))
    mesh = mesh_grid(FlatGrid.of([rod]), rod.length, marks=[tuple(stations[1:-1].tolist())])
    np.testing.assert_allclose(mesh.stations, stations, rtol=0, atol=1e-15)
    return mesh


def circle(s: Floats) -> tuple[Floats, Floats]:
    """Points and tangents of a circle of radius 0.7."""
    c, d = np.cos(s / 0.7), np.sin(s / 0.7)
    return 0.7 * np.column_stack([c, d, 0 * s]), np.column_stack([-d, c, 0 * s])


def clothoid(s: Floats) -> tuple[Floats, Floats]:
    """The same of a curve whose curvature grows as 3 s, in a slanting plane."""
    a = np.sqrt(pi / 3)
    y, x = fresnel(s / a)
    along, across = np.array([0.6, 0.0, 0.8]), np.array([0.0, 1.0, 0.0])
    angle = 1.5 * s[:, None] ** 2
    return a * (x[:, None] * along + y[:, None] * across), np.cos(angle) * along + np.sin(angle) * across


@pytest.mark.parametrize(("curve", "ratio"), [(circle, 8.0), (clothoid, 4.0)])
def test_end_tangents_are_of_second_order(curve, ratio):
    """Of third order on a circle, as its chords have the direction of their middles; every other edge is longer."""
    errors = []
    for count in (10, 20, 40):
        edges = np.append(np.tile([1.0, 2.0], count), 1.0)
        stations = -0.3 + 0.8 * np.append(0.0, np.cumsum(edges)) / edges.sum()
        mesh = lone_rod(stations)
        positions, tangents = curve(stations)
        found = end_tangents(mesh, positions[np.argsort(mesh.nodes_of(0))])
        errors.append(np.linalg.norm(found - tangents[[0, -1]] * [[-1], [1]], axis=1).max())
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], ratio, rtol=0.06)  # 7.61, 7.80; 3.90, 3.95


def test_end_tangents_of_a_straight_or_undivided_rod_are_its_direction():
    mesh = lone_rod(np.array([0.0, 0.1, 0.5, 0.6]))
    along = np.array([0.6, 0.0, 0.8])
    np.testing.assert_allclose(end_tangents(mesh, mesh.flat[:, :1] * along), [-along, along], rtol=0, atol=1e-15)
    mesh = lone_rod(np.array([0.0, 0.5]))
    np.testing.assert_allclose(end_tangents(mesh, mesh.flat[:, :1] * along), [-along, along], rtol=0, atol=1e-15)
