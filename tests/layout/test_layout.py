"""The flat grid: crossings against exact rational arithmetic, meshes against what a mesh must satisfy.

All lengths are of the order of 1; a tolerance of 1e-12 is round-off in sums and products of a few such numbers.
"""

from fractions import Fraction
from itertools import combinations, product
from math import ceil, hypot, nan, pi, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rodshell.errors import InputError
from rodshell.geometry.curves import on_curve
from rodshell.layout import FlatGrid, FlatRod, GridLayout, GridMesh, mesh_grid, straight_rods
from rodshell.layout.gridlayout import lattice_rod
from rodshell.layout.mesh import cut_mesh

ROUND_OFF = 1e-12


# Rods with integer ends: their crossings are fractions, so that touching ends, three rods through one point and
# overlaps come often, and are known exactly.
def integer_rods(fewest):
    return st.lists(st.tuples(*4 * [st.integers(-4, 4)]), min_size=fewest, max_size=10)


seeds = st.integers(0, 2**32 - 1)


def ends_of(rods):
    return np.array([[rod[:2], rod[2:]] for rod in rods], dtype=float)


def exact_crossing(first, second):
    """Point, and the places along each rod as fractions of its length; "overlap"; or None."""
    (ax, ay, bx, by), (cx, cy, dx, dy) = first, second
    ux, uy, vx, vy, wx, wy = bx - ax, by - ay, dx - cx, dy - cy, cx - ax, cy - ay
    cross = ux * vy - uy * vx
    if cross == 0:
        if ux * wy - uy * wx != 0:
            return None
        along = sorted(Fraction(x * ux + y * uy, ux**2 + uy**2) for x, y in ((wx, wy), (dx - ax, dy - ay)))
        return "overlap" if min(along[1], 1) > max(along[0], 0) else None
    s, t = Fraction(wx * vy - wy * vx, cross), Fraction(wx * uy - wy * ux, cross)
    return ((ax + s * ux, ay + s * uy), s, t) if 0 <= s <= 1 and 0 <= t <= 1 else None


def length_of(rod):
    return hypot(rod[2] - rod[0], rod[3] - rod[1])


def exact_crossings(rods):
    """All crossings, by pair of rods; a pair that overlaps has "overlap"."""
    pairs = ((a, b, exact_crossing(rods[a], rods[b])) for a, b in combinations(range(len(rods)), 2))
    return {(a, b): crossing for a, b, crossing in pairs if crossing}


@st.composite
def joined_rods(draw):
    """Rods with integer ends that can be joined: with a length, no overlap, and each crosses another."""
    rods = []
    for rod in draw(integer_rods(6)):
        if rod[:2] != rod[2:] and all(exact_crossing(rod, other) != "overlap" for other in rods):
            rods.append(rod)
    crossing = {rod for pair in exact_crossings(rods) for rod in pair}
    return [rod for k, rod in enumerate(rods) if k in crossing] or [(0, 0, 2, 0), (1, -1, 1, 1)]


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(joined_rods())
def test_crossings_are_those_of_exact_arithmetic(rods):
    expected = exact_crossings(rods)
    grid = straight_rods(ends_of(rods))
    found = {tuple(pair): tuple(at) for pair, at in zip(grid.crossings.rods.tolist(), grid.crossings.at, strict=True)}
    assert found.keys() == expected.keys()
    assert len(grid.crossings) == len(expected)
    for (a, b), (_, s, t) in expected.items():
        at = float(s) * length_of(rods[a]), float(t) * length_of(rods[b])
        np.testing.assert_allclose(found[a, b], at, rtol=0, atol=20 * ROUND_OFF)  # ends up to 11 apart
    counts = np.bincount(np.array(list(expected)).ravel(), minlength=len(rods))
    np.testing.assert_array_equal(grid.joint_counts(), counts)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(integer_rods(1))
def test_rods_are_refused_for_the_reasons_of_exact_arithmetic(rods):
    if any(rod[:2] == rod[2:] for rod in rods):
        reason = "has no length"
    elif "overlap" in (crossings := exact_crossings(rods)).values():
        reason = "lie on one line and overlap"
    else:
        lonely = set(range(len(rods))) - {rod for pair in crossings for rod in pair}
        if not lonely:
            assert len(straight_rods(ends_of(rods)).rods) == len(rods)
            return
        reason = rf"{len(lonely)} of {len(rods)} rods cross no other rod \(the first: R{min(lonely) + 1:02d}\)"
    with pytest.raises(InputError, match=reason):
        straight_rods(ends_of(rods))


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(joined_rods())
def test_rods_through_one_point_share_one_node(rods):
    mesh = mesh_grid(straight_rods(ends_of(rods)), 0.7)
    crossings = exact_crossings(rods)
    points = [crossings[tuple(pair)][0] for pair in mesh.grid.crossings.rods.tolist()]
    for (first, point), (second, other) in combinations(zip(mesh.joint_nodes, points, strict=True), 2):
        assert (first == second) == (point == other)
    assert_is_a_mesh_of(mesh, mesh.grid, 0.7)


def assert_is_a_mesh_of(mesh: GridMesh, grid: FlatGrid, edge: float) -> None:
    """Every rod from end to end, through the nodes of its joints; every edge positive and no longer than allowed."""
    assert len(mesh.rod_start) == len(grid.rods)
    assert mesh.node_count == len(set(mesh.rod_nodes.tolist())) == len(mesh.flat)
    assert np.all(mesh.flat[:, 2] == 0)
    for k, rod in enumerate(grid.rods):
        s, nodes = mesh.stations[mesh.rod_slice(k)], mesh.nodes_of(k)
        np.testing.assert_allclose(s[[0, -1]], [rod.start, rod.end], rtol=0, atol=1e-9 * rod.length)
        assert np.diff(s).min() > 1e-6 * rod.length
        assert np.diff(s).max() <= edge * (1 + 1e-5)
        assert len(set(nodes.tolist())) == len(nodes)
        np.testing.assert_allclose(mesh.flat[nodes, :2], rod.point(s), rtol=0, atol=1e-9 * (1 + rod.length))
        np.testing.assert_array_equal(mesh.ends[k], nodes[[0, -1]])
        joints = np.flatnonzero((grid.crossings.rods == k).any(axis=1))
        assert set(mesh.joint_nodes[joints].tolist()) <= set(nodes.tolist())
    shared = np.bincount(mesh.rod_nodes, minlength=mesh.node_count) > 1
    assert set(np.flatnonzero(shared).tolist()) == set(mesh.joint_nodes.tolist())


# Three rods and more through one point


def star(centre, length, degrees):
    half = length / 2 * np.array([[np.cos(a), np.sin(a)] for a in np.radians(degrees)])
    return np.stack([np.array(centre) - half, np.array(centre) + half], axis=1)


@pytest.mark.parametrize("length", [1.28, 0.64, 1.0, 6.4, 1.2])
def test_three_rods_through_one_point_share_a_node_wherever_it_is(length):
    """Crossings that differ by round-off were told apart where rounding to a grid cut between them."""
    for x in 0.001 * np.arange(1, 60):
        mesh = mesh_grid(straight_rods(star((x, 0.0), length, (0, 60, 120))), 0.1 * length)
        assert len(set(mesh.joint_nodes.tolist())) == 1, f"at {x}"
        assert mesh.edge_lengths.min() > 0.05 * length
        assert mesh.node_count == len(mesh.rod_nodes) - 2


def triangular_grid(spacing, count):
    """Three families at 60 degrees, all through the points of one lattice."""
    rods = []
    for angle in np.radians([0, 60, 120]):
        along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        for k in range(-count, count + 1):
            middle = k * spacing * sqrt(3) / 2 * across
            rods.append([middle - 2.3 * count * spacing * along, middle + 2.3 * count * spacing * along])
    return np.array(rods) + [0.013, 0.007]


def test_triangular_grid_has_one_node_at_each_lattice_point():
    spacing, count = 0.05, 3
    mesh = mesh_grid(straight_rods(triangular_grid(spacing, count)), 0.02)
    nodes = np.unique(mesh.joint_nodes)
    points = mesh.flat[nodes, :2]
    apart = np.linalg.norm(points[:, None] - points, axis=2)[np.triu_indices(len(points), k=1)]
    assert apart.min() == pytest.approx(spacing, abs=ROUND_OFF)
    # of the lines of three families each pair crosses; with 3 x 7 lines 37 points lie on three of them
    rods_at = np.bincount(mesh.rod_nodes, minlength=mesh.node_count)[nodes]
    assert np.count_nonzero(rods_at == 3) == 37
    assert np.count_nonzero(rods_at >= 2) == len(nodes)
    assert_is_a_mesh_of(mesh, mesh.grid, 0.02)


@pytest.mark.parametrize("digits", [2, 3, 4, 5, 16])
def test_three_rods_that_cross_at_one_point_as_rounded_share_a_node(digits):
    """Rounding to `digits` after the point of numbers of about 1: the points come to within a hundredth of a span."""
    exact = triangular_grid(1.0, 3)
    grid = straight_rods(exact.round(digits)).with_common_joints()
    assert grid.span == pytest.approx(1.0, abs=0.02)
    mesh = mesh_grid(grid, 0.4)
    rods_at = np.bincount(mesh.rod_nodes, minlength=mesh.node_count)
    assert np.count_nonzero(rods_at == 3) == 37
    assert mesh.edge_lengths.min() > 0.2
    joints = grid.crossings.rods == 0
    along = np.sort(np.unique(grid.crossings.at[joints].round(9)))
    assert np.diff(along).min() > 0.4  # each joint at one place of a rod, also where holes are listed


def test_rods_side_by_side_are_not_joined_to_each_other():
    """Two parallel rods 2 mm apart, which cross a third: each crosses it at a point of its own."""
    rods = [[[-1, y], [1, y]] for y in (0.0, 0.002, 1.0, 2.0)] + [[[x, -0.5], [x, 2.5]] for x in (-0.7, 0.0, 0.7)]
    grid = straight_rods(rods)
    assert grid.with_common_joints() == grid


def test_the_usual_span_is_that_of_rods_whose_crossings_nearly_coincide():
    """A small triangle at each lattice point, of a twentieth of the span: not one joint, and no measure of the mesh."""
    rods = triangular_grid(1.0, 3)
    rods[:7] += [0.0, 0.05]
    grid = straight_rods(rods)
    assert grid.with_common_joints() == grid
    assert grid.span == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize(
    ("rod", "across"), [(lattice_rod(0, "U", 0.2, 0.0, 1.0), (0, 1)), (lattice_rod(1, "V", 0.2, 0.0, 1.0), (1, 0))]
)
def test_a_rod_is_moved_across_itself_and_its_offset_with_it(rod: FlatRod, across: tuple[float, float]):
    moved = rod.cut(0.1, 0.9, 0.05)
    assert rod.across == across
    assert (moved.offset, moved.start, moved.end) == (0.25, 0.1, 0.9)
    np.testing.assert_allclose(
        moved.point([0.1, 0.9]) - rod.point([0.1, 0.9]), 2 * [0.05 * np.array(across)], atol=1e-16
    )
    back = rod._replace(direction=tuple(-x for x in rod.direction))
    assert back.across == rod.across  # whichever way it runs
    assert rod._replace(offset=None).cut(0.1, 0.9, 0.05).offset is None


# Random rods


def random_rods(seed: int, count: int) -> FlatGrid:
    """Long rods across one another, their joints and ends 1 mm apart or more."""
    rng = np.random.default_rng(seed)
    while True:
        angle, half = rng.uniform(0, pi, count), rng.uniform(0.7, 1.5, count)
        middle = rng.uniform(-0.3, 0.3, (count, 2))
        along = zip(np.cos(angle).tolist(), np.sin(angle).tolist(), strict=True)
        grid = FlatGrid.of(
            [
                FlatRod(f"R{k}", "free", 0.0, -h, h, tuple(m), direction)
                for k, (m, direction, h) in enumerate(zip(middle.tolist(), along, half.tolist(), strict=True))
            ]
        )
        if len(grid.crossings) and all(np.diff(places(grid, k)).min() > 1e-3 for k in range(count)):
            return grid


def places(grid: FlatGrid, rod: int) -> np.ndarray:
    """Start, joints and end along one rod, ascending."""
    joints = np.sort(grid.crossings.at[grid.crossings.rods == rod])
    return np.concatenate([[grid.rods[rod].start], joints, [grid.rods[rod].end]])


@settings(max_examples=100, deadline=None)
@given(seeds, st.integers(2, 8), st.floats(0.0, 0.5))
def test_joints_keep_their_margin_from_the_ends(seed, count, margin):
    whole = random_rods(seed, count)
    grid = FlatGrid.of(whole.rods, margin=margin)
    start, end = np.array([(rod.start, rod.end) for rod in whole.rods])[whole.crossings.rods].transpose(2, 0, 1)
    spare = np.minimum(whole.crossings.at - start, end - whole.crossings.at).min(axis=1) - margin
    assume(np.abs(spare).min(initial=1.0) > 1e-8)  # a joint within 1e-9 of its margin may fall either way
    np.testing.assert_array_equal(grid.crossings.rods, whole.crossings.rods[spare > 0])
    np.testing.assert_array_equal(grid.crossings.at, whole.crossings.at[spare > 0])
    for (a, b), (s, t) in zip(grid.crossings.rods, grid.crossings.at, strict=True):
        np.testing.assert_allclose(grid.rods[a].point(s), grid.rods[b].point(t), rtol=0, atol=1e-11)


@settings(max_examples=100, deadline=None)
@given(seeds, st.integers(2, 10))
def test_leaving_out_weak_rods_ends_with_the_largest_grid_of_strong_ones(seed, count):
    """The k-core of the graph of joints: found here by trying all sets of rods, the largest first."""
    grid = random_rods(seed, count)
    pairs = grid.crossings.rods.tolist()
    strong = next(
        (
            set(rods)
            for size in range(count, 0, -1)
            for rods in combinations(range(count), size)
            if all(sum(a in rods and b in rods for a, b in pairs if k in (a, b)) >= 3 for k in rods)
        ),
        set(),
    )
    kept, names = grid.without(lambda some: some.joint_counts() < 3)
    assert [rod.name for rod in kept.rods] == [f"R{k}" for k in sorted(strong)]
    assert sorted(names) == sorted(f"R{k}" for k in set(range(count)) - strong)
    again = FlatGrid.of(kept.rods) if kept.rods else kept
    np.testing.assert_array_equal(kept.crossings.rods, again.crossings.rods)
    np.testing.assert_array_equal(kept.crossings.at, again.crossings.at)


# Meshes


@settings(max_examples=100, deadline=None)
@given(seeds, st.integers(2, 8), st.floats(0.02, 0.8))
def test_spans_are_divided_into_the_fewest_equal_edges(seed, count, edge):
    grid = random_rods(seed, count)
    mesh = mesh_grid(grid, edge)
    assert_is_a_mesh_of(mesh, grid, edge)
    for k in range(count):
        lengths = np.diff(mesh.stations[mesh.rod_slice(k)])
        pieces = [(span, ceil(span / edge - 1e-6)) for span in np.diff(places(grid, k))]
        expected = [span / parts for span, parts in pieces for _ in range(parts)]
        np.testing.assert_allclose(lengths, expected, rtol=0, atol=ROUND_OFF)


@settings(max_examples=50, deadline=None)
@given(seeds, st.integers(2, 8), st.floats(0.05, 0.8))
def test_edges_bends_and_lengths_are_those_of_each_rod_in_turn(seed, count, edge):
    grid = random_rods(seed, count)
    mesh = mesh_grid(grid, edge)
    edges, bends, of_edge, of_bend, lengths, voronoi = [], [], [], [], [], []
    for k in range(count):
        nodes, s = mesh.nodes_of(k).tolist(), mesh.stations[mesh.rod_slice(k)]
        for i in range(len(nodes) - 1):
            edges.append(nodes[i : i + 2])
            of_edge.append(k)
            lengths.append(s[i + 1] - s[i])
        for i in range(1, len(nodes) - 1):
            bends.append(nodes[i - 1 : i + 2])
            of_bend.append(k)
            voronoi.append(((s[i] - s[i - 1]) + (s[i + 1] - s[i])) / 2)
    np.testing.assert_array_equal(mesh.edges, edges)
    np.testing.assert_array_equal(mesh.edge_rods, of_edge)
    np.testing.assert_array_equal(mesh.bends.reshape(-1, 3), np.array(bends).reshape(-1, 3))
    np.testing.assert_array_equal(mesh.bend_rods, of_bend)
    np.testing.assert_allclose(mesh.edge_lengths, lengths, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(mesh.voronoi_lengths, voronoi, rtol=0, atol=ROUND_OFF)
    total = sum(rod.length for rod in grid.rods)
    assert mesh.edge_lengths.sum() == pytest.approx(total, rel=ROUND_OFF)
    # in the flat state an edge is as long as its rest length
    flat = np.linalg.norm(np.diff(mesh.flat[mesh.edges], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(flat, mesh.edge_lengths, rtol=0, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(seeds, st.integers(2, 8), st.floats(0.05, 0.8))
def test_crossings_are_found_along_their_rods(seed, count, edge):
    """The entry of each crossing on both its rods, those beside it, and linear interpolation between crossings."""
    mesh = mesh_grid(random_rods(seed, count), edge)
    crossings = mesh.grid.crossings
    for c, side in product(range(len(crossings)), (0, 1)):
        rod, entry = crossings.rods[c, side], int(mesh.at_crossings[c, side])
        first, last = mesh.rod_slice(rod).start, mesh.rod_slice(rod).stop - 1
        assert mesh.rod_of[entry] == rod
        assert mesh.rod_nodes[entry] == mesh.joint_nodes[c]
        assert mesh.stations[entry] == pytest.approx(crossings.at[c, side], abs=ROUND_OFF)
        assert mesh.beside_crossings[c, side].tolist() == [max(entry - 1, first), min(entry + 1, last)]
    if (mesh.grid.joint_counts() == 0).any():
        with pytest.raises(ValueError, match="crosses no other"):
            mesh.between_crossings  # noqa: B018
        return
    value = np.sin(7.0 * mesh.joint_nodes)  # of each crossing, the same where three rods meet
    around, share = mesh.between_crossings
    found = (1 - share) * value[around[:, 0]] + share * value[around[:, 1]]
    for k in range(count):
        on_rod, side = np.nonzero(crossings.rods == k)
        order = np.argsort(crossings.at[on_rod, side])
        at = crossings.at[on_rod, side][order]
        expected = np.interp(mesh.stations[mesh.rod_slice(k)], at, value[on_rod[order]])
        np.testing.assert_allclose(found[mesh.rod_slice(k)], expected, rtol=0, atol=1e-9)


def test_marks_become_nodes_and_those_at_joints_or_ends_add_none():
    rods = [lattice_rod(0, "U01", 0.0, -0.5, 0.7), lattice_rod(1, "V01", 0.2, -0.4, 0.4)]
    grid = FlatGrid.of(rods)
    plain = mesh_grid(grid, 1.0)
    assert plain.node_count == 5
    marked = mesh_grid(grid, 1.0, marks=[(-0.13, 0.2, 0.7, -0.5 + 1e-12), (0.31,)])
    np.testing.assert_allclose(marked.stations, [-0.5, -0.13, 0.2, 0.7, -0.4, 0.0, 0.31, 0.4], rtol=0, atol=1e-9)
    assert marked.node_count == 7
    assert_is_a_mesh_of(marked, grid, 1.0)


def test_an_edge_a_hair_longer_than_the_span_still_counts_as_one():
    """0.3 / 0.1 is 2.9999999999999996 or 3.0000000000000004: no fourth edge, nor one edge for two."""
    for spans, edge in product(range(1, 40), (0.1, 0.005, 0.03, 1 / 3)):
        rod = lattice_rod(0, "U01", 0.0, 0.0, spans * edge)
        for length in (edge, np.nextafter(edge, 0), np.nextafter(edge, 1)):
            assert len(mesh_grid(FlatGrid.of([rod]), float(length)).edges) == spans
        assert len(mesh_grid(FlatGrid.of([rod]), edge * (1 - 1e-4 / spans)).edges) == spans + 1


@settings(max_examples=50, deadline=None)
@given(seeds, st.integers(3, 8), st.floats(0.03, 0.3))
def test_prolongation_reproduces_cubics(seed, count, fine_edge):
    """Along every rod, from a mesh of uneven edges to one that shares only its joints."""
    rng = np.random.default_rng(seed)
    grid = random_rods(seed, count)
    coarse, fine = mesh_grid(grid, 0.4), mesh_grid(grid, fine_edge)
    # a cubic in x and y is one in s along every rod, and single-valued at joints
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    factors = rng.normal(size=(len(powers), 3))

    def cubic(flat):
        return sum(f * (flat[:, :1] ** i) * (flat[:, 1:2] ** j) for f, (i, j) in zip(factors, powers, strict=True))

    # knots may lie 1 mm apart beside an edge of 0.4: the cubic's weights enlarge round-off a hundredfold and more
    np.testing.assert_allclose(coarse.prolong(cubic(coarse.flat), fine), cubic(fine.flat), rtol=0, atol=1e-9)
    chosen = [2, 0]
    part = mesh_grid(FlatGrid.of([grid.rods[2].cut(-0.3, 0.5), grid.rods[0]]), fine_edge)
    prolonged = coarse.prolong(cubic(coarse.flat), part, rods=chosen)
    np.testing.assert_allclose(prolonged, cubic(part.flat), rtol=0, atol=1e-9)


def test_a_curve_of_two_or_three_points_is_a_line_or_a_parabola():
    s = np.linspace(-0.3, 1.4, 9)
    for count, power in ((2, 1), (3, 2)):
        knots = np.array([0.0, 0.4, 1.0])[:count]
        np.testing.assert_allclose(on_curve(knots, knots[:, None] ** power, s)[:, 0], s**power, rtol=0, atol=ROUND_OFF)


def test_places_that_differ_by_round_off_are_one_node():
    """A rod's start, a mark and a joint, in this order and in another."""
    a = 0.15
    b = np.nextafter(a, 1)
    c = np.nextafter(b, 1)
    across = lattice_rod(1, "V", c, -1.0, 1.0)
    begins = mesh_grid(FlatGrid.of([lattice_rod(0, "U", 0.0, a, 1.0), across]), 0.5, marks=[[b], []])
    passes = mesh_grid(FlatGrid.of([lattice_rod(0, "U", 0.0, 0.0, 1.0), across]), 0.5, marks=[[b, a], []])
    assert min(begins.edge_lengths.min(), passes.edge_lengths.min()) > 0.1


# Cutting a mesh


def test_a_mesh_without_joints_may_be_cut():
    grid = FlatGrid.of([lattice_rod(0, "U", 0.0, 0.0, 1.0), lattice_rod(1, "V", 0.1, -1.0, 1.0)], margin=0.2)
    part, nodes = cut_mesh(mesh_grid(grid, 0.1), grid.rods)
    assert len(part.grid.crossings) == 0
    assert len(nodes) == 32


@settings(max_examples=80, deadline=None)
@given(seeds, st.integers(4, 9), st.floats(0.0, 0.2))
def test_a_cut_mesh_keeps_stations_nodes_and_the_joints_far_from_ends(seed, count, margin):
    rng = np.random.default_rng(seed)
    mesh = mesh_grid(random_rods(seed, count), 0.15)
    rods = []
    for k in sorted(rng.choice(count, count - 1, replace=False)):  # one rod is left out, the others cut at nodes
        s = mesh.stations[mesh.rod_slice(k)]
        first, last = sorted(rng.choice(len(s), 2, replace=False))
        rods.append(mesh.grid.rods[k].cut(float(s[first]), float(s[last])))
    part, nodes = cut_mesh(mesh, rods, margin=margin)
    joined = FlatGrid.of(rods, margin=margin)
    np.testing.assert_array_equal(part.grid.crossings.rods, joined.crossings.rods)
    names = [rod.name for rod in mesh.grid.rods]
    assert part.grid.rods == tuple(rods)
    for k, rod in enumerate(rods):
        whole = names.index(rod.name)
        s = mesh.stations[mesh.rod_slice(whole)]
        within = (s >= rod.start) & (s <= rod.end)
        to_end = np.minimum(np.abs(s - rod.start), np.abs(s - rod.end))  # nodes that crowd an end are left out
        joints = np.isin(mesh.nodes_of(whole), nodes[part.joint_nodes[(part.grid.crossings.rods == k).any(axis=1)]])
        within &= joints | (to_end == 0) | (to_end >= 0.01 * np.median(np.diff(s)))
        np.testing.assert_array_equal(part.stations[part.rod_slice(k)], s[within])
        np.testing.assert_array_equal(nodes[part.nodes_of(k)], mesh.nodes_of(whole)[within])
    np.testing.assert_array_equal(part.flat, mesh.flat[nodes])
    # two rods share a node where, and only where, they are joined
    shared = {
        (a, b)
        for a, b in combinations(range(len(rods)), 2)
        if set(part.nodes_of(a).tolist()) & set(part.nodes_of(b).tolist())
    }
    assert shared == {tuple(pair) for pair in joined.crossings.rods.tolist()}
    for (a, b), node in zip(part.grid.crossings.rods, part.joint_nodes, strict=True):
        assert node in part.nodes_of(a)
        assert node in part.nodes_of(b)
    assert part.edge_lengths.sum() == pytest.approx(sum(rod.length for rod in rods), rel=1e-9)


def test_of_three_rods_through_one_point_two_stay_joined_when_the_third_ends_near_it():
    mesh = mesh_grid(straight_rods(star((0.0, 0.0), 2.0, (0, 60, 120))), 0.1)
    rods = [mesh.grid.rods[0], mesh.grid.rods[1], mesh.grid.rods[2].cut(0.9, 2.0)]  # the point is at s = 1
    part, nodes = cut_mesh(mesh, rods, margin=0.15)
    assert part.grid.crossings.rods.tolist() == [[0, 1]]
    centre = mesh.joint_nodes[0]
    assert np.count_nonzero(nodes == centre) == 2  # the third rod has a node of its own there
    assert part.node_count == len(part.rod_nodes) - 1


# Input that cannot be used


@pytest.mark.parametrize(("ends", "sentence"), [
    ([[[0, 0], [1, 0]], [[0.5, 0.5], [0.5, 0.5]]], "rod R02 has no length: its two ends coincide"),
    ([[[0, 0], [1, 0]], [[0.5, -1], [0.5, nan]]], "rod 2 has an end that is not finite"),
    ([[[0, 0], [1, 0]], [[0.5, -1], [np.inf, 1]]], "rod 2 has an end that is not finite"),
    ([[[0, 0], [1, 0]], [[0.5, 0], [1.5, 0]]], "rods R01 and R02 lie on one line and overlap: keep one of them"),
    ([[[0, 0], [1, 1]], [[0, 1], [1, 0]], [[1, 0], [0, 1]]], "rods R02 and R03 lie on one line and overlap"),
    ([[[0, 0], [1, 0]], [[0, 1], [1, 1]]], r"2 of 2 rods cross no other rod \(the first: R01\)"),
    ([[[0, 0], [1, 0]], [[0.5, -1], [0.5, 1]], [[0, 2], [1, 3]]], r"1 of 3 rods cross no other rod \(the first: R03\)"),
    ([[[0, 0], [1, 0]]], r"1 of 1 rods cross no other rod"),
    ([[0, 0], [1, 0]], r"rod ends must have the shape \(rods, 2, 2\), not \(2, 2\)"),
    (np.empty((0, 2, 2)), r"rod ends must have the shape \(rods, 2, 2\), not \(0, 2, 2\)"),
    (np.zeros((3, 2, 3)), r"not \(3, 2, 3\)"),
])  # fmt: skip
def test_rods_that_cannot_be_joined_are_refused(ends, sentence):
    with pytest.raises(InputError, match=sentence):
        straight_rods(ends)


def test_rods_that_touch_end_to_end_on_one_line_are_two_rods():
    grid = straight_rods([[[0, 0], [1, 0]], [[1, 0], [2, 0]], [[0.5, -1], [0.5, 1]], [[1.5, -1], [1.5, 1]]])
    assert grid.crossings.rods.tolist() == [[0, 2], [1, 3]]


def test_rods_keep_the_names_they_are_given():
    ends = [[[0, 0], [1, 0]], [[0.5, -1], [0.5, 1]]]
    assert [rod.name for rod in straight_rods(ends, names=["bow", "stern"]).rods] == ["bow", "stern"]
    assert [rod.name for rod in straight_rods(ends).rods] == ["R01", "R02"]


LAYOUT = {"rods": (3, 4), "spacing": 0.03, "length": 1.2, "edge": 0.005}


@pytest.mark.parametrize(("changed", "sentence"), [
    ({"spacing": 0.0}, "layout spacing must be positive, not 0.0 m"),
    ({"spacing": (0.03, -1.0)}, "layout spacing must be positive, not -1.0 m"),
    ({"spacing": nan}, "layout spacing must be positive, not nan m"),
    ({"edge": -0.005}, "layout edge must be positive"),
    ({"crossing": 0.5}, "layout crossing 28.65 degrees: both families can begin at 30 to 150 degrees to each other"),
    ({"edge": 0.031}, "layout edge 0.031 m is longer than the spacing 0.03 m: use a shorter edge"),
    ({"length": 0}, "layout length must be positive, not 0 m"),
    ({"edge": "5 mm"}, "layout edge must be a number in m, not .5 mm"),
    ({"length": None}, "layout length must be a number in m, not None"),
    ({"spacing": "auto"}, "two lengths in m, not .auto"),
    ({"rods": (1, 4)}, 'layout rods must be two counts of at least 2, or "auto"'),
    ({"rods": (3, 4.5)}, "two counts"),
    ({"rods": 5}, "two counts"),
    ({"rods": (3, 4, 5)}, "two counts"),
    ({"rotate": nan}, "layout rotate must be finite, not nan rad"),
    ({"offset": (0.0, np.inf)}, "layout offset must be finite, not inf m"),
])  # fmt: skip
def test_a_layout_that_cannot_be_is_refused(changed, sentence):
    with pytest.raises(InputError, match=sentence):
        GridLayout.orthogonal(**{**LAYOUT, **changed})
    one = {**LAYOUT, "spacing": (0.03, 0.03), **changed}
    with pytest.raises(
        InputError, match=sentence if isinstance(one["spacing"], tuple) else "layout spacing must be two"
    ):
        GridLayout(**one)


@pytest.mark.parametrize(("rods", "offset"), [((3, 4), (0.0, 0.0)), ((6, 5), (0.004, -0.02))])
def test_the_whole_grid_of_a_layout_is_a_lattice(rods, offset):
    layout = GridLayout.orthogonal(**{**LAYOUT, "rods": rods, "offset": offset, "spacing": (0.03, 0.05)})
    grid = layout.flat_grid(rods, 1.2)
    assert len(grid.crossings) == rods[0] * rods[1]
    across = offset[1] + 0.03 * (np.arange(rods[0]) - (rods[0] - 1) / 2)  # y of family u
    along = offset[0] + 0.05 * (np.arange(rods[1]) - (rods[1] - 1) / 2)  # x of family v
    for rod, y in zip(grid.rods[: rods[0]], across, strict=True):
        assert rod.family == "u"
        np.testing.assert_allclose(
            [rod.point(rod.start), rod.point(rod.end)], [[offset[0] - 0.6, y], [offset[0] + 0.6, y]], atol=1e-15
        )
    for rod, x in zip(grid.rods[rods[0] :], along, strict=True):
        assert rod.family == "v"
        np.testing.assert_allclose(
            [rod.point(rod.start), rod.point(rod.end)], [[x, offset[1] - 0.6], [x, offset[1] + 0.6]], atol=1e-15
        )
    points = [grid.rods[a].point(s) for (a, _), (s, _) in zip(grid.crossings.rods, grid.crossings.at, strict=True)]
    np.testing.assert_allclose(
        sorted(map(tuple, np.round(points, 9))), sorted(product(np.round(along, 9), np.round(across, 9))), atol=1e-12
    )


@pytest.mark.parametrize(
    ("rod", "said"),
    [
        (lattice_rod(0, "A", 0.0, float("nan"), 1.0), "start and end of the rods must be finite"),
        (lattice_rod(0, "A", 0.0, "x", 1.0), "must be numbers of the shape"),
        (FlatRod("A", "free", 0.0, 0.0, 1.0, (0.0, 0.0, 0.0), (1.0, 0.0)), "must be numbers of the shape"),
        (FlatRod("A", "free", 0.0, 0.0, 1.0, (0.0, 0.0), (0.0, 0.0)), "rod A must have a direction"),
        (lattice_rod(0, "A", 0.0, 1.0, -1.0), "rod A must .* start 1 m and end -1 m"),
        (lattice_rod(0, "A", 0.0, 1.0, 1.0), "rod A must .* start 1 m and end 1 m"),
    ],
)
def test_a_rod_that_is_no_line_is_refused(rod, said):
    with pytest.raises(InputError, match=said):
        FlatGrid.of([rod, lattice_rod(1, "B", 0.0, -1.0, 1.0)])


def test_no_rods_make_an_empty_grid():
    assert len(FlatGrid.of([]).rods) == 0


def test_a_mesh_of_too_many_edges_is_counted_before_it_is_made():
    cross = straight_rods([[(-1.0, 0.0), (1.0, 0.0)], [(0.0, -1.0), (0.0, 1.0)]])
    with pytest.raises(InputError, match=r"the grid would have 40\d+ edges of 0.0001 mm: .* such as 20 mm, or set"):
        mesh_grid(cross, 1e-7)
