"""The bound drape: what holds for any target, material, scale and heading; its equilibrium, checked from outside.

Draped states are compared after division by the target's size. Two runs that should agree differ by what Newton
leaves (it stops at steps of 1e-6, the next of which would be 1e-12) and by round-off: 2e-15 was measured.
"""

from math import cos, pi, sin

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

import rodshell as rs
from rodshell.contact.static import BoundToTarget
from rodshell.model import Assembly, Shell
from rodshell.rods.elements import Stretch
from rodshell.solve import newton_step
from tests.formfinding.elastic_twins import ElasticTwin

SAME = 1e-9  # of the size, see above
ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
ELLIPSOID = rs.Ellipsoid(0.2, 0.15, 0.12)
TURN = 0.4  # rad, of no symmetry


def hill(x, y):
    """Convex, without any symmetry."""
    return 0.12 - 1.5 * x * x - 0.8 * y * y + 0.5 * x * y + 0.6 * x**3 + 0.1 * x


def turned_hill(x, y):
    return hill(cos(TURN) * x + sin(TURN) * y, cos(TURN) * y - sin(TURN) * x)


HILL, TURNED_HILL = (rs.HeightField(function=function, domain=rs.Disc(0.2)) for function in (hill, turned_hill))
CASES = {  # target, layout options, anchor
    "hemisphere": (rs.Hemisphere(0.2), {}, None),
    "paraboloid": (rs.Paraboloid(0.2, 0.12), {}, None),
    "ellipsoid, turned": (ELLIPSOID, {"rotate": 0.5}, None),
    "hemisphere, off-centre": (rs.Hemisphere(0.2), {}, (0.03, 0.02)),
    "hemisphere, shifted by half a spacing": (rs.Hemisphere(0.2), {"offset": (0.025, 0.025)}, None),
    "hill": (HILL, {}, (0.02, 0.01)),
}
every_case = pytest.mark.parametrize("name", CASES)


def layout_of(**options):
    return rs.GridLayout.orthogonal(**{"spacing": 0.05, "edge": 0.0125} | options)


def drape_case(name, **options):
    target, own, anchor = CASES[name]
    return rs.drape(layout_of(**own, **options), ROD, target, anchor=anchor)


def turned(points, angle):
    rotation = np.array([[cos(angle), -sin(angle), 0], [sin(angle), cos(angle), 0], [0, 0, 1]])
    return points @ rotation.T


def mismatch(points, others):
    """Largest distance from a point of `points` to its match in `others`, whatever their order; both have as many."""
    assert len(points) == len(others)
    return max(cKDTree(others).query(points)[0].max(), cKDTree(points).query(others)[0].max())


@pytest.fixture(autouse=True, scope="module")
def one_blas_thread():
    """On dense matrices of a few hundred rows more threads only wait for each other."""
    with threadpool_limits(1, user_api="blas"):
        yield


# Figures that every drape reports, checked on the positions


@every_case
def test_bound_drape_converges_in_few_factorisations_to_a_certified_state(name):
    draped = drape_case(name)
    assert draped.converged
    assert draped.report.negative_modes == 0
    assert draped.report.factorizations <= 3  # 2 or 3 measured
    assert draped.report.max_strain < 2e-5
    assert draped.figures.max_gap < 1e-12 * draped.target.size


@every_case
def test_a_drape_is_where_newtons_steps_alone_lead_to_round_off(name, monkeypatch):
    """Its last steps are chord steps, in the directions of an earlier state's tangent planes."""
    draped = drape_case(name)
    monkeypatch.setattr(newton_step, "CHORD", 0.0)
    monkeypatch.setattr(newton_step, "MULTIPLIERS", 1.0)  # so that it goes on
    newton = drape_case(name)
    assert newton.report.factorizations == newton.report.iterations > draped.report.factorizations
    # 2e-16 to 1e-13 measured: an end moves along its line of the net to first order, so that where it goes depends a
    # little on the steps
    assert np.abs(draped.positions - newton.positions).max() < 1e-12 * draped.target.size


def test_a_drape_does_not_end_before_its_axial_forces_are_found(monkeypatch):
    """They converge linearly, as multipliers of a penalty: ended after Newton's step, nodes are 2e-12 off."""
    saddle = rs.HeightField(formula="(x**2 - y**2)/0.8", domain=rs.Disc(0.2))
    draped = rs.drape(layout_of(spacing=0.03), ROD, saddle)
    monkeypatch.setattr(newton_step, "MULTIPLIERS", 1.0)
    further = rs.drape(layout_of(spacing=0.03), ROD, saddle)
    assert np.abs(draped.positions - further.positions).max() < 1e-13 * saddle.size


@every_case
def test_no_rod_is_stretched_and_every_node_lies_on_the_surface(name):
    draped = drape_case(name)
    assert np.abs(ElasticTwin(draped.mesh, ROD).strains(draped.positions)).max() < 2e-5  # 5e-10 was measured
    # |grad F| is of order 1, so that F is the gap to first order
    assert np.abs(draped.target.implicit(draped.positions).value).max() < 1e-12 * draped.target.size


def test_nodes_lie_on_the_sphere():
    assert np.abs(np.linalg.norm(drape_case("hemisphere").positions, axis=1) - 0.2).max() < 1e-15


@every_case
def test_rods_end_where_the_target_ends(name):
    """But for straight edges in place of bent rods, to second order: 4e-4 of the size at four edges a span."""
    off = []
    for edge in (0.0125, 0.00625):
        trimmed = rs.trim(drape_case(name, edge=edge))
        off.append(np.abs(trimmed.draped.target.margin(trimmed.boundary.points)).max() / trimmed.draped.target.size)
    assert off[0] < 6e-4
    assert off[1] < 0.35 * off[0]


@pytest.mark.parametrize("name", ["barrel", "saddle"])
@pytest.mark.parametrize("spacing", [1.0, 0.5])
def test_rods_that_cross_no_axis_end_on_a_rectangle(name, spacing):
    """At 45 degrees to its sides, where rods in the corners are free to slide: by 230 and 399 mm on the saddle."""
    formula = {"barrel": "3 - 0.1*y^2", "saddle": "2.5 - 0.12*y^2 + 0.02*x^2"}[name]
    target = rs.HeightField(formula=formula, domain=rs.Rectangle((24.0, 8.0)))
    trimmed = rs.trim(rs.drape(layout_of(spacing=spacing, edge=spacing / 6, rotate=pi / 4), ROD, target))
    x, y, _ = np.abs(trimmed.boundary.points).T
    assert np.minimum(np.abs(x - 12.0), np.abs(y - 4.0)).max() < 5e-4  # 0.36 mm at 1 m, a quarter at 0.5 m
    assert x.max() < 12.0005
    assert y.max() < 4.0005


@pytest.mark.parametrize("past", [-5e-8, 2e-8, 1e-7])
def test_rods_that_end_beside_a_joint_by_less_than_it_can_be_told_end_at_it(past):
    """A vault whose straight side is a line of the grid but for the rounding of a file's numbers."""
    domain = rs.Rectangle((16.0 + 2 * past, 10.0))
    target = rs.HeightField(formula="4 - y^2/12 + 1e-5*x^3/64", domain=domain)
    draped = rs.drape(layout_of(spacing=0.8, edge=0.8 / 6), ROD, target)
    assert draped.mesh.edge_lengths.min() > 1e-3
    assert draped.levels[-1].factorizations < 10
    x, y, _ = np.abs(rs.trim(draped).boundary.points).T
    assert np.minimum(np.abs(x - 8.0), np.abs(y - 5.0)).max() < 1e-4


# Equilibrium, from numpy twins of the energies


def held_ends(draped):
    """Node and direction (3,) on the net of each rod end that no other node is close to."""
    mesh, net = draped.mesh, draped.net.node_positions(draped.mesh)
    close = 0.1 * np.median(mesh.edge_lengths)
    for piece in draped.net.rods:
        for k, rod in enumerate(mesh.grid.rods):
            s, nodes = mesh.stations[mesh.rod_slice(k)], mesh.nodes_of(k)
            if (rod.family, rod.offset) == (piece.family, piece.offset) and s[0] <= piece.start and piece.end <= s[-1]:
                for end in (piece.start, piece.end):
                    i = int(np.argmin(np.abs(s - end)))
                    before, after = max(i - 1, 0), min(i + 1, len(s) - 1)
                    if min(abs(s[j] - s[i]) for j in {before, after} - {i}) > close and rod.offset != 0.0:
                        yield nodes[i], net[nodes[after]] - net[nodes[before]]


def binding(draped):
    """The constraint of a bound drape, made anew: two tangent directions, one on the axes and at the ends of rods, none
    at the anchor."""
    mesh, x = draped.mesh, draped.positions
    count, guides = np.full(len(x), 2), np.tile([0.3, 0.5, 0.8], (len(x), 1))
    for k, rod in enumerate(mesh.grid.rods):
        if rod.offset == 0.0:
            count[mesh.nodes_of(k)] -= 1
            guides[mesh.nodes_of(k)] = np.gradient(x[mesh.nodes_of(k)], axis=0)
    for node, along in held_ends(draped):
        count[node], guides[node] = 1, along
    return BoundToTarget(draped.target, count, guides)


def directions_on_a_sphere(draped):
    """T (3n, free) without the library: tangents at right angles to the radius, those of the axes in their planes, and
    those of the ends of rods along the net."""
    x = draped.positions
    columns = []
    plane = {}
    for k, rod in enumerate(draped.mesh.grid.rods):
        if rod.offset == 0.0:
            for node in draped.mesh.nodes_of(k):
                plane.setdefault(int(node), []).append([1.0, 0, 0] if rod.family == "u" else [0, 1.0, 0])
    plane.update({int(node): [along] for node, along in held_ends(draped)})
    for node, point in enumerate(x):
        if node in plane:
            axes = plane[node] if len(plane[node]) == 1 else []
        else:
            axes = [np.cross(point, [0.3, 0.5, 0.8]), np.cross(point, np.cross(point, [0.3, 0.5, 0.8]))]
        for axis in axes:
            tangent = axis - np.dot(axis, point) * point / np.dot(point, point)
            column = np.zeros(x.size)
            column[3 * node : 3 * node + 3] = tangent / np.linalg.norm(tangent)
            columns.append(column)
    return csc_matrix(np.array(columns).T)


def dense_directions(freedom):
    matrix = np.zeros((3 * len(freedom.count), freedom.size))
    for block, (directions, count, first) in enumerate(
        zip(freedom.directions, freedom.count, freedom.first, strict=True)
    ):
        matrix[3 * block : 3 * block + 3, first : first + count] = directions[:count].T
    return csc_matrix(matrix)


def held_forces(twin, free, positions):
    """Axial forces of inextensible rods (e,) that leave the least bending force, and what they leave (relative)."""
    pulls, bending = (free.T @ twin.pulls(positions)).tocsc(), free.T @ twin.bend_gradient(positions).ravel()
    normal, forces = splu((pulls.T @ pulls).tocsc()), np.zeros(pulls.shape[1])
    for _ in range(3):  # least squares with refinement
        forces -= normal.solve(pulls.T @ (pulls @ forces + bending))
    return forces, np.abs(pulls @ forces + bending).max() / np.abs(bending).max()


def test_draped_hemisphere_is_in_equilibrium_between_bending_axial_forces_and_the_sphere():
    """No displacement along the sphere that stretches no rod changes the bending energy."""
    draped = drape_case("hemisphere")
    twin, free = ElasticTwin(draped.mesh, ROD), directions_on_a_sphere(draped)
    assert free.shape[1] == draped.report.dofs
    assert held_forces(twin, free, draped.positions)[1] < 1e-8  # 3e-10 measured
    moved = draped.positions.copy()  # a node off its place by 1e-6 R would be seen
    moved[np.argmin(np.linalg.norm(moved - [0.07, 0.05, 0.18], axis=1))] += [0.0, 2e-7, 0.0]
    assert held_forces(twin, free, moved)[1] > 1e-5


@pytest.mark.slow
@every_case
def test_draped_state_is_an_equilibrium(name):
    draped = drape_case(name)
    twin, constraint = ElasticTwin(draped.mesh, ROD), binding(draped)
    free = dense_directions(constraint.freedom(draped.positions))
    assert free.shape[1] == draped.report.dofs
    assert held_forces(twin, free, draped.positions)[1] < 1e-6  # 2e-7 next to an edge of 0.02 mm, else 1e-8


def test_pulls_are_the_nodes_that_the_target_would_have_to_hold():
    draped = drape_case("hemisphere")
    twin, free = ElasticTwin(draped.mesh, ROD), directions_on_a_sphere(draped)
    forces, _ = held_forces(twin, free, draped.positions)
    push = np.einsum("ij,ij->i", twin.gradient(draped.positions, forces), draped.positions) / 0.2
    on_target = np.zeros(len(push), dtype=bool)
    built = {(rod.family, rod.offset): rod for rod in draped.rods}
    for k, rod in enumerate(draped.mesh.grid.rods):
        cut = built.get((rod.family, rod.offset))
        if cut is not None:
            s = draped.mesh.stations[draped.mesh.rod_slice(k)]
            on_target[draped.mesh.nodes_of(k)[(s > cut.start - 1e-9) & (s < cut.end + 1e-9)]] = True
    pulls = draped.figures.contact_pulls
    assert pulls == np.count_nonzero(push[on_target] < -1e-6 * np.abs(push).max())
    assert 0 < pulls < on_target.sum()  # rods of a net are straighter than the sphere near the rim


class Lagrangian:
    """Bending plus fixed axial forces on the surface: the library's reduced Hessian, and gradients of the twin."""

    def __init__(self, draped, weight):
        """`weight`: stiffness of the edges [N]; 0 leaves what decides on inextensible motions."""
        self.draped, self.weight = draped, weight
        self.twin, self.constraint = ElasticTwin(draped.mesh, ROD), binding(draped)
        self.freedom = self.constraint.freedom(draped.positions)
        self.free = dense_directions(self.freedom)
        self.forces, _ = held_forces(self.twin, self.free, draped.positions)

    def hessian(self):
        x, shell = self.draped.positions, Shell.of(self.draped.mesh, ROD)
        edges = shell.stretch
        stretch = Stretch(edges.blocks, edges.rest_lengths, np.full(len(edges.blocks), self.weight), self.forces)
        blocks = [shell.elements[0].blocks, stretch.blocks, np.arange(len(x))[:, None]]
        hessians = [np.zeros((len(b), 3 * b.shape[1], 3 * b.shape[1])) for b in blocks]
        gradient = np.zeros_like(x)
        shell.elements[0].evaluate(x, gradient, hessians[0])
        stretch.evaluate(x, gradient, hessians[1])
        hessians[2][:] = self.constraint.curvature(x, self.twin.gradient(x, self.forces))
        assembly = Assembly.of(blocks, self.freedom)
        data = assembly.assemble(hessians, blocks, self.freedom)
        upper = csc_matrix((data, assembly.indices, assembly.indptr), shape=(self.freedom.size,) * 2).toarray()
        return upper + np.triu(upper, 1).T

    def gradient_at(self, q):
        """T'g at the point of the surface that the displacement q along T(x) leads to."""
        x = self.draped.target.retract(self.draped.positions + (self.free @ q).reshape(-1, 3), 10)
        forces = self.forces + self.weight * self.twin.strains(x)
        return dense_directions(self.constraint.freedom(x)).T @ self.twin.gradient(x, forces).ravel()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hemisphere", "ellipsoid, turned", "hill"])
def test_hessian_with_the_surfaces_curvature_is_the_derivative_of_the_gradient_along_the_surface(name):
    lagrangian = Lagrangian(drape_case(name, edge=0.017), 0.0)
    hessian = lagrangian.hessian()
    q = np.random.default_rng(5).normal(size=len(hessian))
    change = hessian @ q
    errors, steps = [], lagrangian.twin.rest.min() * np.array([1e-2, 5e-3, 2.5e-3])
    for step in steps:
        difference = (lagrangian.gradient_at(step * q) - lagrangian.gradient_at(-step * q)) / (2 * step)
        errors.append(np.linalg.norm(difference - change) / np.linalg.norm(change))
    assert errors[-1] < 2e-4  # of central differences: 6e-5 measured
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("name", ["hemisphere", "ellipsoid, turned", "hill"])
def test_draped_state_is_a_minimum_among_the_states_bound_to_the_target(name):
    draped = drape_case(name, spacing=0.08, edge=0.027)
    size = draped.target.size
    penalised = Lagrangian(draped, 1e5 / 0.15**3 * ROD.bend_stiffness / size**2)
    eigenvalues = np.linalg.eigvalsh(penalised.hessian())
    assert eigenvalues[0] > 0
    assert np.count_nonzero(eigenvalues < 0) == draped.report.negative_modes
    # and without any penalty: on the motions that stretch no rod to first order
    plain = Lagrangian(draped, 0.0)
    stretching = (plain.free.T @ plain.twin.pulls(draped.positions)).toarray()
    motions = np.linalg.qr(stretching, mode="complete")[0][:, stretching.shape[1] :]
    lowest = np.linalg.eigvalsh(motions.T @ plain.hessian() @ motions)[0]
    assert lowest > 0
    assert lowest == pytest.approx(eigenvalues[0], rel=0.02)  # the penalty outweighs bending


# Invariance


@pytest.mark.parametrize("scale", [1e-3, 100.0])
def test_scale_and_material_do_not_enter(scale):
    small = drape_case("hemisphere")
    rod = rs.Rod(section=rs.Circle(3e-3), material=rs.Material(youngs_modulus=2.5e10, density=7e3))
    target = rs.Hemisphere(0.2 * scale)
    large = rs.drape(layout_of(spacing=0.05 * scale, edge=0.0125 * scale), rod, target)
    np.testing.assert_allclose(large.positions / scale, small.positions, rtol=0, atol=SAME * 0.2)
    assert large.report.factorizations == small.report.factorizations
    assert large.figures.contact_pulls == small.figures.contact_pulls


def test_hemisphere_keeps_the_symmetry_of_the_square_grid():
    x = drape_case("hemisphere").positions
    for image in (x * [-1, 1, 1], x * [1, -1, 1], x[:, [1, 0, 2]], turned(x, pi / 2)):
        assert mismatch(image, x) < SAME * 0.2


def test_ellipsoid_keeps_its_two_mirrors():
    x = rs.drape(layout_of(), ROD, ELLIPSOID).positions
    for image in (x * [-1, 1, 1], x * [1, -1, 1]):
        assert mismatch(image, x) < SAME * 0.2
    assert mismatch(turned(x, pi / 2), x) > 0.01  # and no more


def test_heading_turns_the_grid_on_a_hemisphere():
    ahead, aside = drape_case("hemisphere"), rs.drape(layout_of(rotate=TURN), ROD, rs.Hemisphere(0.2))
    np.testing.assert_allclose(aside.positions, turned(ahead.positions, TURN), rtol=0, atol=SAME * 0.2)


def test_target_and_heading_turned_together_turn_the_grid():
    ahead = drape_case("hill")
    anchor = turned(np.array([0.02, 0.01, 0.0]), TURN)[:2]
    aside = rs.drape(layout_of(rotate=TURN), ROD, TURNED_HILL, anchor=tuple(anchor))
    np.testing.assert_allclose(aside.positions, turned(ahead.positions, TURN), rtol=0, atol=SAME * 0.2)


def test_heading_of_a_right_angle_swaps_the_families():
    ahead, aside = (rs.drape(layout_of(rotate=angle), ROD, ELLIPSOID) for angle in (0.0, pi / 2))
    assert mismatch(ahead.positions, aside.positions) < SAME * 0.2
    for family, other in ("uv", "vu"):
        lengths = [(rod.offset, rod.length) for rod in ahead.rods if rod.family == family]
        swapped = [(rod.offset, rod.length) for rod in aside.rods if rod.family == other]
        np.testing.assert_allclose(swapped, lengths, rtol=0, atol=SAME * 0.2)  # the ellipsoid's mirrors help


@pytest.mark.parametrize("counts", [{}, {"rods": (9, 7)}, {"rods": (8, 6)}], ids=["auto", "odd", "even"])
def test_spacings_along_x_and_y_keep_to_their_families(counts):
    """Spacing [u, v]: the rods along x lie su apart; exchanging the two turns the grid on a hemisphere."""
    wide = rs.drape(layout_of(spacing=(0.04, 0.06), **counts), ROD, rs.Hemisphere(0.2))
    offsets = {family: [rod.offset for rod in wide.rods if rod.family == family] for family in "uv"}
    for family, side, spacing in (("u", 0, 0.04), ("v", 1, 0.06)):
        np.testing.assert_allclose(np.diff(offsets[family]), spacing)
        np.testing.assert_allclose(np.sum(offsets[family]), 0.0, rtol=0, atol=1e-12)
        assert not counts or len(offsets[family]) == counts["rods"][side]
    swapped = {name: pair[::-1] for name, pair in counts.items()}
    high = rs.drape(layout_of(spacing=(0.06, 0.04), **swapped), ROD, rs.Hemisphere(0.2))
    assert mismatch(turned(wide.positions, pi / 2), high.positions) < SAME * 0.2


# Trim and map back


@every_case
def test_footprint_rods_lie_in_the_flat_plane_as_long_as_in_space(name):
    trimmed = rs.trim(drape_case(name))
    footprint = rs.map_back(trimmed)
    ends = footprint.points.reshape(-1, 2, 2)
    for rod, (start, end) in zip(footprint.rods, ends, strict=True):
        along, across = (0, 1) if rod.family == "u" else (1, 0)
        assert start[along] == pytest.approx(rod.start)
        assert end[along] == pytest.approx(rod.end)
        np.testing.assert_allclose([start[across], end[across]], rod.offset, rtol=0, atol=1e-15)
    for k, rod in enumerate(footprint.rods):
        nodes = footprint.mesh.nodes_of(k)
        chords = np.linalg.norm(np.diff(trimmed.positions[nodes], axis=0), axis=1).sum()
        assert chords == pytest.approx(rod.length, rel=2e-5)


def test_end_directions_point_outwards_and_down_along_the_rods():
    """On a sphere they are tangents; a middle rod, a great circle, goes straight down into the base."""
    trimmed = rs.trim(drape_case("hemisphere"))
    boundary = trimmed.boundary
    np.testing.assert_allclose(np.linalg.norm(boundary.tangents, axis=1), 1.0, rtol=1e-14)
    across = np.einsum("ij,ij->i", boundary.tangents, boundary.points) / 0.2
    assert np.abs(across).max() < 5e-4  # second order in the edges: 1.5e-4 measured
    assert np.all(boundary.tangents[:, 2] < 0)
    for k, rod in enumerate(trimmed.mesh.grid.rods):
        if rod.offset == 0.0:
            np.testing.assert_allclose(boundary.tangents[2 * k : 2 * k + 2], [[0, 0, -1]] * 2, rtol=0, atol=2e-3)


@pytest.mark.slow
def test_many_short_edges_take_no_more_factorisations_than_few_long_ones():
    """Bending outweighs a penalty that does not follow the edge length: forces then settle slowly."""
    few, many = (
        rs.drape(rs.GridLayout.orthogonal(spacing=spacing, edge=spacing / 6), ROD, rs.Hemisphere(0.2)).report
        for spacing in (0.03, 0.008)
    )
    assert many.dofs > 10 * few.dofs
    assert many.factorizations <= few.factorizations
