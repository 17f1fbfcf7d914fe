"""Contact: nearest rods against closed forms and a search over all pairs; what meets by design is no contact."""

from itertools import combinations

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks import check
from rodshell.checks.contact import (
    APART,
    FLATTEST,
    _Edges,
    _Outline,
    contact,
    contact_of,
    nearest_points,
)
from rodshell.layout import FlatGrid, FlatRod, GridMesh, mesh_grid
from rodshell.layout.gridlayout import lattice_rod
from rodshell.layout.mesh import side_by_side as side_by_side_meshes
from tests.checks.shells import dome
from tests.checks.stress_twin import distance
from tests.checks.test_bending import rods_of_length

MATERIAL = rs.Material(youngs_modulus=1e9, density=1e3)


def round_rod(radius: float) -> rs.Rod:
    return rs.Rod(rs.Circle(radius), MATERIAL)


def test_nearest_points_of_segments_are_the_nearest() -> None:
    """Random segments; and flat ones, parallel ones, with ends in common, crossing and in one line."""
    draw = np.random.default_rng(1)
    ends = draw.normal(size=(4, 400, 3))
    ends[:, 100:200, 2] = 0.0  # many of these cross
    ends[3, 200:300] = ends[2, 200:300] + draw.normal(size=(100, 1)) * (ends[1] - ends[0])[200:300]
    ends[2, 300:350] = ends[1, 300:350]
    ends[2:, 350:] = (ends[0] + draw.normal(size=(2, 400, 1)) * (ends[1] - ends[0]))[:, 350:]
    p, q = nearest_points(*ends)
    expected = [distance(*four) for four in ends.transpose(1, 0, 2)]
    np.testing.assert_allclose(np.linalg.norm(p - q, axis=1), expected, atol=1e-12)
    assert np.count_nonzero(np.array(expected[100:200]) < 1e-12) > 10
    for point, a, b in ((p, *ends[:2]), (q, *ends[2:])):
        np.testing.assert_allclose(
            np.linalg.norm(point - a, axis=1) + np.linalg.norm(b - point, axis=1), np.linalg.norm(b - a, axis=1)
        )


def side_by_side(apart: tuple[float, float], *, angle: float = 0.0) -> tuple[GridMesh, np.ndarray, np.ndarray]:
    """Two straight rods along x, the second moved by `apart` in y and z; and z turned about x as directors."""
    mesh = rods_of_length(0.3, 0.3)
    places = np.column_stack([mesh.stations, np.zeros((len(mesh.stations), 2))])
    places[mesh.rod_slice(1), 1:] += apart
    return mesh, places, np.tile([0.0, np.sin(angle), np.cos(angle)], (len(mesh.edges), 1))


@pytest.mark.parametrize(("section", "apart", "angle", "clearance"), [
    (rs.Circle(5e-3), (0.012, 0.0), 0.0, 0.002),
    (rs.Tube(5e-3, 1e-3), (0.003, 0.004), 0.0, -0.005),
    (rs.RectangularSection(5e-3, 5e-2), (0.06, 0.0), 0.0, 0.01),
    (rs.RectangularSection(5e-3, 5e-2), (0.0, 0.012), 0.0, 0.007),
    (rs.RectangularSection(5e-3, 5e-2), (0.045, 0.010), 0.0, 0.005),  # side by side, but one over the other
    (rs.RectangularSection(5e-3, 5e-2), (0.04, 0.002), 0.0, -0.003),
    (rs.RectangularSection(5e-3, 5e-2), (0.012, 0.0), np.pi / 2, 0.007),  # on edge
    (rs.RectangularSection(1e-2, 1e-2), (0.02, 0.0), np.pi / 4, 0.02 - np.sqrt(2) * 1e-2),
    (rs.Ellipse(4e-3, 2e-2), (0.05, 0.0), 0.0, 0.01),
    (rs.Ellipse(4e-3, 2e-2), (0.0, 0.01), 0.0, 0.002),
])  # fmt: skip
def test_clearance_of_two_straight_rods_is_what_their_sections_leave(
    section: rs.Circle, apart: tuple[float, float], angle: float, clearance: float
) -> None:
    mesh, places, directors = side_by_side(apart, angle=angle)
    found = contact(mesh, places, rs.Rod(section, MATERIAL), directors=directors)
    assert found.clearance == pytest.approx(clearance, abs=1e-12)
    assert found.pairs == (clearance < 0)
    assert found.rods == ("U01", "U02")
    assert found.where is not None
    np.testing.assert_allclose(found.where[1:], 0.5 * np.array(apart), atol=1e-12)


def test_rods_that_are_not_near_have_no_clearance() -> None:
    mesh, places, _ = side_by_side((0.05, 0.0))
    assert contact(mesh, places, round_rod(5e-3)) == APART


def test_ends_that_face_each_other_touch_only_when_they_meet() -> None:
    """Rods have flat ends: two in one line are as far apart as the gap between them, not less by their radius."""
    mesh, places, _ = side_by_side((0.0, 0.0))
    places[mesh.rod_slice(1), 0] += 0.301
    assert contact(mesh, places, round_rod(5e-3)).clearance == pytest.approx(1e-3)


def test_two_rods_of_a_family_that_cross_are_found_where_they_do() -> None:
    mesh, places, _ = side_by_side((0.0, 0.0))
    second = mesh.rod_slice(1)
    places[second, 1] = 0.5 * (places[second, 0] - 0.171)
    found = contact(mesh, places, round_rod(1e-3))
    assert found.pairs == 1
    assert found.clearance == pytest.approx(-2e-3)
    assert found.where == pytest.approx((0.171, 0.0, 0.0), abs=1e-9)


def lattice(spacing: float = 0.1, edge: float = 0.02) -> GridMesh:
    offsets = spacing * np.arange(-2, 3)
    rods = [lattice_rod(0, f"U{k + 1}", y, -0.24, 0.24) for k, y in enumerate(offsets)]
    rods += [lattice_rod(1, f"V{k + 1}", x, -0.23, 0.25) for k, x in enumerate(offsets)]
    return mesh_grid(FlatGrid.of(rods), edge)


@pytest.mark.parametrize("degrees", [20.0, 37.0, 60.0, 90.0])
@pytest.mark.parametrize("share", [0.3, 0.7, 0.99, 1.01])
@pytest.mark.parametrize("edge", [0.1, 0.013])
def test_a_sheared_lattice_touches_when_its_rods_are_wider_than_their_distance(
    degrees: float, share: float, edge: float
) -> None:
    """Parallel rods are at the spacing by the sine of the angle; rods that cross, joined or not, are no contact."""
    mesh, angle = lattice(edge=edge), np.radians(degrees)
    flat = mesh.flat[mesh.rod_nodes]
    places = np.outer(flat[:, 0], [1, 0, 0]) + np.outer(flat[:, 1], [np.cos(angle), np.sin(angle), 0])
    apart = 0.1 * np.sin(angle)
    found = contact(mesh, places, round_rod(0.5 * share * apart))
    assert found.pairs == (8 if share > 1 else 0)
    assert (None if found.clearance is None else pytest.approx(found.clearance)) == (
        (1 - share) * apart if share > 0.5 else None
    )


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_rods_that_end_at_others_or_just_short_of_them_are_no_contact(tilt: float) -> None:
    """Ends in T and L, and a crossing next to an end that is not made a joint; also when the grid is bent."""
    rods = [
        lattice_rod(0, "U1", 0.0, -0.3, 0.3), lattice_rod(0, "U2", 0.1, -0.3, 0.3),
        lattice_rod(1, "V1", -0.3, 0.0, 0.4),  # L at the end of U1
        lattice_rod(1, "V2", 0.1, 0.103, 0.4),  # ends 3 mm short of U2
        lattice_rod(1, "V3", -0.1, -0.002, 0.4),  # crosses U1 by 2 mm: no joint
    ]  # fmt: skip
    mesh = mesh_grid(FlatGrid.of(rods, margin=0.015), 0.02)
    flat = mesh.flat[mesh.rod_nodes]
    places = np.column_stack([flat[:, :2], tilt * flat[:, 0] * flat[:, 1]])
    assert contact(mesh, places, round_rod(5e-3)).pairs == 0


def test_crossing_rods_that_come_together_again_touch() -> None:
    """V crosses U, and bends round until it lies against it 0.2 m from their joint."""
    rods = [lattice_rod(0, "U1", 0.0, -0.5, 0.5), lattice_rod(1, "V1", 0.0, -0.1, 0.4)]
    mesh = mesh_grid(FlatGrid.of(rods), 0.01)
    places = mesh.flat[mesh.rod_nodes].copy()
    s = mesh.stations[mesh.rod_slice(1)]
    bent = s > 0
    angle = s[bent] / 0.1
    places[mesh.rod_slice(1).start + np.flatnonzero(bent), :2] = 0.1 * np.column_stack(
        [1 - np.cos(angle), np.sin(angle)]
    )
    found = contact(mesh, places, round_rod(4e-3))
    assert found.pairs == 1
    assert found.rods == ("U1", "V1")
    assert found.where is not None
    assert found.where[0] == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize(("rise", "touches"), [(7.9e-3, 1), (8.1e-3, 0)])
def test_a_coil_touches_itself_when_its_rise_is_less_than_its_thickness(rise: float, touches: int) -> None:
    mesh = rods_of_length(1.5, edge=0.005)
    t = mesh.stations / np.hypot(0.05, rise / (2 * np.pi))
    places = np.column_stack([0.05 * np.cos(t), 0.05 * np.sin(t), rise * t / (2 * np.pi)])
    found = contact(mesh, places, round_rod(4e-3))
    assert found.pairs == touches
    if touches:
        assert found.rods == ("U01", "U01")
        # the pitch by the slope of the coil: 0.03 %; edges are chords
        assert found.clearance == pytest.approx(rise - 8e-3, abs=1e-5)


def test_a_sharp_bend_does_not_touch_itself() -> None:
    """A hairpin about a pin of the rod's own thickness: as tight as it goes without touching."""
    mesh = rods_of_length(0.3, edge=0.001)
    radius, s = 8.1e-3, mesh.stations - 0.15
    arc = np.clip(s / radius, -np.pi / 2, np.pi / 2)
    straight = np.sign(s) * np.maximum(np.abs(s) - radius * np.pi / 2, 0)
    places = np.column_stack([radius * np.cos(arc) - np.abs(straight), radius * np.sin(arc), 0 * s])
    assert contact(mesh, places, round_rod(8e-3)).pairs == 0


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_nearest_rods_of_a_shell_are_those_of_a_search_over_all_pairs(ends: str) -> None:
    popped, mesh = dome().popped[ends], dome().footprint.mesh  # type: ignore[index]
    x, edges = popped.positions, mesh.edges
    radius, rods = 0.022, mesh.edge_rods
    families = [rod.family for rod in mesh.grid.rods]
    best, touching = np.inf, set()
    for i, j in combinations(range(len(edges)), 2):
        if rods[i] == rods[j] or families[rods[i]] != families[rods[j]]:
            continue
        gap = distance(*x[edges[i]], *x[edges[j]]) - 2 * radius
        best = min(best, gap)
        if gap <= 0:
            touching.add((rods[i], rods[j]))
    found = contact_of(popped.shell, popped.state, round_rod(radius))
    assert found.clearance is not None
    # nearest at their ends, which are flat: seen aslant they are farther apart than round ones would be
    assert best - 1e-9 <= found.clearance <= best + 1e-3
    assert found.pairs == len(touching) > 0


def test_of_straight_rods_at_random_all_that_touch_are_found() -> None:
    """Skew lines through a box, all nearest between their ends: distances of lines in closed form."""
    draw, mesh = np.random.default_rng(3), rods_of_length(*[4.0] * 30, edge=0.1)
    points, directions = draw.uniform(-0.2, 0.2, size=(30, 3)), draw.normal(size=(30, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    rods = np.repeat(np.arange(30), np.diff(np.append(mesh.rod_start, len(mesh.rod_nodes))))
    places = points[rods] + (mesh.stations - 2.0)[:, None] * directions[rods]
    apart = {}
    for a, b in combinations(range(30), 2):
        normal = np.cross(directions[a], directions[b])
        apart[a, b] = abs((points[b] - points[a]) @ normal) / np.linalg.norm(normal)
    for radius in (1e-3, 4e-3, 2e-2):
        found = contact(mesh, places, round_rod(radius))
        touching = [pair for pair, distance in apart.items() if distance <= 2 * radius]
        nearest = min(apart, key=lambda pair: apart[pair])
        assert found.pairs == len(touching)
        assert found.clearance == pytest.approx(apart[nearest] - 2 * radius, abs=1e-9)
        assert found.rods == tuple(f"U{k + 1:02}" for k in nearest)


def test_the_work_grows_with_the_rods_not_with_their_square() -> None:
    counts = []
    for size in (10, 20, 40):
        offsets = 0.1 * np.arange(size)
        rods = [lattice_rod(0, f"U{k}", y, 0.0, 0.1 * size) for k, y in enumerate(offsets)]
        rods += [lattice_rod(1, f"V{k}", x, 0.0, 0.1 * size) for k, x in enumerate(offsets)]
        mesh = mesh_grid(FlatGrid.of(rods), 0.02)
        outline = _Outline(0.024, 0.024, False)
        edges = _Edges(mesh, mesh.flat[mesh.rod_nodes], outline, None, mesh.grid.meetings(4 * outline.reach / FLATTEST))
        counts.append(len(edges.candidates()[0]) / len(mesh.edges))
    assert counts[2] < 1.2 * counts[1] < 1.5 * counts[0]


def test_every_shape_is_checked_and_the_nearest_rods_are_named() -> None:
    """44 mm rods touch at the rim of the popped dome; 70 mm ones at 60 mm in the flat grid, too."""
    checks = check(dome().popped, round_rod(0.022), stages=2)
    assert set(checks.contact) == {"pinned", "clamped"}
    assert len(checks.deployment_contact) == 3
    assert checks.deployment_contact[0].pairs == 0
    assert checks.deployment_contact[0].clearance == pytest.approx(0.06 - 0.044)
    last, popped = checks.deployment_contact[-1], checks.contact["pinned"]
    assert (last.pairs, last.rods) == (popped.pairs, popped.rods)
    assert last.clearance == pytest.approx(popped.clearance, abs=1e-12)  # the deployment begins with a solve
    assert last.where == pytest.approx(popped.where, abs=1e-12)
    wider = check(dome().popped, round_rod(0.035), stages=2)
    assert wider.deployment_contact[0].pairs == 12
    assert wider.deployment_contact[0].clearance == pytest.approx(0.06 - 0.07)


def test_rods_that_leave_no_room_for_joints_are_warned_of() -> None:
    checks = check(dome().popped, round_rod(0.012), stages=0)
    (words,) = checks.tight
    assert "hardly any room for joints" in words
    assert words in checks.warnings
    assert check(dome().popped, round_rod(0.005), stages=0).tight == ()
    assert check(dome().popped, round_rod(0.022), stages=0).tight == ()  # these touch: the verdict says so


def beside_each_other(first: list[FlatRod], second: list[FlatRod], *, gap: float = 0.2) -> rs.Shell:
    """Patches A and B of these rods as one shell."""
    meshes = {"A": mesh_grid(FlatGrid.of(first), 0.02), "B": mesh_grid(FlatGrid.of(second), 0.02)}
    return rs.Shell.of(side_by_side_meshes(meshes, gap), round_rod(5e-3))


def test_on_their_way_rods_of_two_patches_are_not_looked_at_and_those_of_each_are() -> None:
    """Two strips that lie in each other, as flat grids below their boundaries do; then two rods of B alone."""
    rods = [lattice_rod(1, f"V{k}", 0.1 * k, 0.0, 0.3) for k in range(4)]
    shell = beside_each_other(rods, rods)
    state = np.vstack([grid.flat - [*grid.flat[0, :2], 0.0] for grid in shell.mesh.grids])
    assert contact_of(shell, state, round_rod(5e-3)).pairs == 4
    assert contact_of(shell, state, round_rod(5e-3), each_grid=True) == APART
    last = shell.mesh.nodes_of(len(shell.mesh.grid.rods) - 1)
    state[last] -= [0.095, 0.0, 0.0]
    found = contact_of(shell, state, round_rod(5e-3), each_grid=True)
    assert found.rods == ("B-V2", "B-V3")
    assert found.clearance == pytest.approx(-5e-3)


def test_a_section_without_an_outline_is_not_judged() -> None:
    mesh, places, _ = side_by_side((0.001, 0.0))
    given = {"EA": 1.0, "EI1": 1.0, "EI2": 1.0, "GJ": 1.0}
    assert contact(mesh, places, rs.Rod(rs.GivenSection(**given))) == APART
    boxed = rs.Rod(rs.GivenSection(**given, fibre_distances=(0.01, 0.02)))
    found = contact(mesh, places, boxed, directors=np.tile([0.0, 0.0, 1.0], (len(mesh.edges), 1)))
    assert found.clearance == pytest.approx(-0.02)  # the least way out is up


def test_rods_of_two_patches_that_meet_at_a_seam_are_no_contact_and_others_are() -> None:
    """Two strips side by side whose U rods end together on the seam at y = 0.3, at angles; then one moved over."""
    rods = [lattice_rod(1, f"V{k}", 0.1 * k, 0.0, 0.3) for k in range(4)]
    shell, flat = beside_each_other(rods, rods), mesh_grid(FlatGrid.of(rods), 0.02).flat
    there = flat + [0.0, 0.3, 0.0]
    there[:, 2] = 0.4 * flat[:, 1]  # a ridge at the seam
    met = contact_of(shell, np.vstack([flat, there]), round_rod(5e-3))
    assert met == APART
    moved = there + [0.03, -0.05, 0.0]  # past the seam, between the others
    beside = contact_of(shell, np.vstack([flat, moved]), round_rod(1.4e-2))
    assert beside.clearance == pytest.approx(0.03 - 0.028, abs=1e-3)
    assert beside.rods is not None
    assert {name[0] for name in beside.rods} == {"A", "B"}
    through = there + [0.0, -0.05, -0.02]
    crossing = contact_of(shell, np.vstack([flat, through]), round_rod(5e-3))
    assert crossing.pairs == 4
    assert crossing.clearance == pytest.approx(-0.01)


def test_rods_that_meet_at_both_their_ends_are_no_contact() -> None:
    """Of two patches each has one arch; they stand on the same points and lean apart."""
    rods = [lattice_rod(0, "U1", 0.0, 0.0, 0.5)]
    arch = mesh_grid(FlatGrid.of(rods), 0.02).flat.copy()
    height = 0.6 * arch[:, 0] * (0.5 - arch[:, 0]) / 0.5
    arch[:, 1:] = height[:, None] * [-1.0, 1.0]
    other = arch * [1.0, -1.0, 1.0]
    assert contact_of(beside_each_other(rods, rods), np.vstack([arch, other]), round_rod(5e-3)) == APART


def test_rods_of_patches_that_cross_only_where_their_flat_grids_lie_are_a_contact() -> None:
    """Patches are laid out side by side for drawing: that their lines cross there means nothing."""
    one, other = lattice_rod(0, "U1", 0.0, 0.0, 0.5), lattice_rod(1, "V1", 0.0, -0.25, 0.25)
    shell = beside_each_other([one], [other], gap=0.01)
    flat = [mesh_grid(FlatGrid.of([rod]), 0.02).flat for rod in (one, other)]
    found = contact_of(shell, np.vstack([flat[0], flat[1] + [0.492, 0.0, 0.002]]), round_rod(5e-3))
    assert found.pairs == 1
    assert found.clearance == pytest.approx(-8e-3)


def test_fine_meshes_of_thick_rods_find_what_coarse_ones_do() -> None:
    """Edges a twentieth of the thickness are taken together: fewer pairs, and the same clearance to its sag."""
    found, sizes, outline = [], [], _Outline(0.02, 0.02, False)
    for edge in (0.02, 0.002):
        mesh = rods_of_length(0.5, 0.5, edge=edge)
        t = mesh.stations / 0.4
        places = np.column_stack([0.4 * np.sin(t), 0 * t, 0.4 * np.cos(t)])
        places[mesh.rod_slice(1), 1] = 0.05 + 0.1 * (t[mesh.rod_slice(1)] - 0.6) ** 2
        found.append(contact(mesh, places, round_rod(0.02)))
        sizes.append(len(_Edges(mesh, places, outline, None, mesh.grid.meetings(4 * outline.reach / FLATTEST)).rods))
    assert sizes[1] < 3 * sizes[0]
    assert found[0].clearance == pytest.approx(0.01, abs=2e-4)
    assert found[1].clearance == pytest.approx(0.01, abs=2e-4)
