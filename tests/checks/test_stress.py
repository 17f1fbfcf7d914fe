"""Stress with torsion, against closed forms, tables and the section twin; curvature in parts, against helices."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks.bending import VON_MISES, bending, bending_of, largest_stress, torsion_stress
from rodshell.joints import Joint
from tests.checks.shells import dome
from tests.checks.stress_twin import largest, shear_field, stresses, twisted_shells
from tests.checks.test_bending import ROD, laid, rods_of_length

STEEL = rs.Material(youngs_modulus=2e11, density=7850, poisson_ratio=0.3)
SECTIONS = (
    rs.Circle(4e-3),
    rs.Tube(4e-3, 1e-3),
    rs.Ellipse(2e-3, 5e-3),
    rs.Ellipse(5e-3, 2e-3),
    rs.RectangularSection(3e-3, 1e-2),
    rs.RectangularSection(1e-2, 3e-3),
    rs.RectangularSection(5e-3, 5e-3),
)


def moment(rod: rs.Rod, rate: float) -> float:
    return rod.twist_stiffness * rate


@pytest.mark.parametrize(("section", "modulus"), [
    (rs.Circle(4e-3), np.pi * 4e-3**3 / 2),
    (rs.Tube(4e-3, 1e-3), np.pi * (4e-3**4 - 3e-3**4) / (2 * 4e-3)),
    (rs.Ellipse(2e-3, 5e-3), np.pi * 5e-3 * 2e-3**2 / 2),  # at the ends of the short axis
    (rs.Ellipse(5e-3, 2e-3), np.pi * 5e-3 * 2e-3**2 / 2),
])  # fmt: skip
def test_torsion_stress_is_the_moment_over_the_section_modulus(section: rs.Circle, modulus: float) -> None:
    rod = rs.Rod(section, STEEL)
    assert torsion_stress(rod, np.array([-0.3]))[0] == pytest.approx(moment(rod, 0.3) / modulus, rel=1e-12)


@pytest.mark.parametrize(("ratio", "k2"), [(1.0, 0.208), (1.5, 0.231), (2.0, 0.246), (3.0, 0.267), (10.0, 0.312)])
def test_torsion_stress_of_rectangles_is_that_of_timoshenko_and_goodier(ratio: float, k2: float) -> None:
    """Their table: tau = M / (k2 b t^2), to three digits."""
    for section in (rs.RectangularSection(2e-3, ratio * 2e-3), rs.RectangularSection(ratio * 2e-3, 2e-3)):
        rod = rs.Rod(section, STEEL)
        expected = moment(rod, 0.3) / (k2 * ratio * 2e-3 * 2e-3**2)
        assert torsion_stress(rod, np.array([0.3]))[0] == pytest.approx(expected, rel=3e-3)


def test_torsion_stress_of_a_thin_strip_is_shear_modulus_times_twist_times_thickness() -> None:
    rod = rs.Rod(rs.RectangularSection(1e-3, 0.2), STEEL)
    assert torsion_stress(rod, np.array([2.0]))[0] == pytest.approx(STEEL.shear_modulus * 2.0 * 1e-3, rel=1e-3)


def test_the_middle_of_a_strips_edge_has_three_quarters_of_its_largest_torsion_stress() -> None:
    """0.742 of it [Roark, table of torsion]: with bending within the strip that place is worse than its face."""
    rod = rs.Rod(rs.RectangularSection(1e-3, 0.02), STEEL)
    face = torsion_stress(rod, np.array([2.0]))[0]
    kappa = 40 * VON_MISES * face / (STEEL.youngs_modulus * 0.01)  # so much that only the edge counts
    edge = largest_stress(rod, np.zeros(1), np.array([kappa]), np.zeros(1), np.array([2.0]), weight=VON_MISES)[0]
    sheared = np.sqrt(edge**2 - (STEEL.youngs_modulus * 0.01 * kappa) ** 2) / VON_MISES
    assert sheared == pytest.approx(0.742 * face, rel=5e-3)


@pytest.mark.parametrize("section", SECTIONS)
def test_the_largest_stress_is_that_of_a_dense_search_over_the_whole_section(section: rs.Circle) -> None:
    rod = rs.Rod(section, STEEL)
    draw = np.random.default_rng(5)
    for _ in range(12):
        (k1, k2), axial, twist = draw.normal(size=2), draw.normal() * 1e-3, draw.normal() * 10 ** draw.uniform(-1, 1)
        weight = draw.uniform(1.0, 12.0)
        found = largest_stress(
            rod, np.array([k1]), np.array([k2]), np.array([axial]), np.array([twist]), weight=weight
        )[0]
        expected = largest(rod, np.array([k1, k2]), axial, twist, weight)
        assert found == pytest.approx(expected, rel=2e-3)  # differences over 120 cells, and points on the outline


def test_torsion_stress_of_a_rectangle_is_that_of_finite_differences() -> None:
    section = rs.RectangularSection(3e-3, 1e-2)
    found = torsion_stress(rs.Rod(section, STEEL), np.ones(1))[0]
    assert STEEL.shear_modulus * shear_field(section)[2].max() == pytest.approx(found, rel=2e-3)


def test_without_twist_nothing_is_added() -> None:
    zero = np.zeros(1)
    for section in SECTIONS:
        rod = rs.Rod(section, STEEL)
        alone = largest_stress(rod, np.array([1.5]), np.array([0.4]), np.array([-1e-4]), zero)
        tiny = largest_stress(rod, np.array([1.5]), np.array([0.4]), np.array([-1e-4]), zero + 1e-9)
        np.testing.assert_allclose(tiny, alone, rtol=1e-12)


def test_a_shear_strength_is_used_up_by_torsion_alone() -> None:
    rod = rs.Rod(rs.RectangularSection(1e-2, 3e-2), rs.Material(1.1e10, 450, shear=6.9e8))
    rate = 4e6 / torsion_stress(rod, np.ones(1))[0]  # a shear stress of 4 MPa
    zero, given = np.zeros(1), rs.OutputOptions(strength=24e6, shear_strength=4e6)
    weight = given.limits(rod, rs.Strength()).shear_weight
    used = largest_stress(rod, zero, zero, zero, np.array([rate]), weight=weight) / 24e6
    assert used[0] == pytest.approx(1.0)
    assert rs.OutputOptions(strength=24e6).limits(rod, rs.Strength()).shear_weight == VON_MISES


def helix(radius: float, rise: float, edge: float = 0.005) -> tuple[rs.GridMesh, np.ndarray, np.ndarray, np.ndarray]:
    """A rod on the top of a cylinder about x: its mesh, nodes, the cylinder's normals there, and its direction, these
    by the rod's nodes in a row; `rise` along x per radian."""
    mesh = rods_of_length(0.5, edge=edge)
    t = (mesh.stations - 0.25) / np.hypot(radius, rise)
    out = np.column_stack([0 * t, np.sin(t), np.cos(t)])
    along = np.column_stack([rise + 0 * t, radius * np.cos(t), -radius * np.sin(t)]) / np.hypot(radius, rise)
    return mesh, laid(mesh, radius * out + np.outer(rise * t, [1, 0, 0])), out, along


@pytest.mark.parametrize("tilt", [0.0, 0.4, -1.2])
def test_a_helix_is_curved_out_of_its_cylinder_and_by_a_turned_axis_within_it_too(tilt: float) -> None:
    a, b = 0.1, 0.04
    mesh, x, normals, along = helix(a, b)
    turned = np.cos(tilt) * normals + np.sin(tilt) * np.cross(along, normals)
    bent = bending(mesh, x, ROD, normals=turned)
    kappa = a / (a**2 + b**2)
    assert bent.normal_curvature is not None
    assert bent.geodesic_curvature is not None
    np.testing.assert_allclose(bent.normal_curvature[1:-1], -kappa * np.cos(tilt), atol=2e-3 * kappa)
    np.testing.assert_allclose(np.abs(bent.geodesic_curvature[1:-1]), kappa * abs(np.sin(tilt)), atol=2e-3 * kappa)
    np.testing.assert_allclose(np.hypot(bent.normal_curvature, bent.geodesic_curvature), bent.curvature, rtol=1e-12)


def test_a_lath_laid_on_a_cylinder_at_45_degrees_bends_and_twists_by_half_the_cylinders_curvature() -> None:
    """Meusnier and Bonnet: kappa_n = cos^2/R and tau_g = sin cos/R, both 1/(2R); a helix is a geodesic."""
    radius = 0.2
    lath = rs.Rod(rs.RectangularSection(1e-3, 4e-3), STEEL)
    errors = []
    for edge in (0.01, 0.005):
        mesh, x, normals, _ = helix(radius, radius, edge)
        shell = rs.Shell.of(mesh, lath)
        state = shell.state(x, None, laid(mesh, normals))
        bent = bending_of(shell, state, lath)
        inner = slice(1, -1)
        assert bent.normal_curvature is not None
        assert bent.geodesic_curvature is not None
        assert bent.stress is not None
        half = 0.5 / radius
        assert np.abs(bent.geodesic_curvature[inner]).max() < 1e-3 * half
        errors.append(
            max(np.abs(np.abs(part[inner]) / half - 1).max() for part in (bent.normal_curvature, bent.twist_rate))
        )
        chords = np.abs(bent.axial_strain[inner])  # shorter than their arcs
        sigma, tau = 2e11 * (0.5e-3 * half + chords), torsion_stress(lath, np.array([half]))[0]
        # both are largest in the middle of the broad face; the bending also at the corners
        np.testing.assert_allclose(bent.stress[inner], np.sqrt(sigma**2 + 3 * tau**2), rtol=2e-3)
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)  # second order


def test_the_torsion_of_round_rods_is_constant_from_joint_to_joint() -> None:
    """Straight rods that bend alike all ways take no torque between their joints: the twist moment cannot change."""
    rod, form = twisted_shells()["tubes with pins"]
    popped, mesh = form.popped["pinned"], form.footprint.mesh
    bent = bending_of(popped.shell, popped.state, rod)
    joints = np.isin(mesh.rod_nodes, mesh.joint_nodes)
    inner = np.flatnonzero(~joints[:-1] & ~joints[1:])  # neighbours that are no joints
    inner = inner[~np.isin(inner + 1, mesh.rod_start)]
    inner = inner[~np.isin(inner, mesh.rod_start) & ~np.isin(inner + 2, mesh.rod_start) & (inner + 2 < len(joints))]
    assert len(inner) > 50
    assert np.abs(bent.twist_rate).max() > 0.1
    np.testing.assert_allclose(
        bent.twist_rate[inner], bent.twist_rate[inner + 1], atol=1e-6 * np.abs(bent.twist_rate).max()
    )


def test_ball_joints_twist_no_round_rods() -> None:
    layout = rs.GridLayout.orthogonal(spacing=0.06, edge=0.015)
    form = rs.find_form(rs.Hemisphere(0.2), layout, ROD, ends=("clamped",))
    bent = bending_of(form.popped["clamped"].shell, form.popped["clamped"].state, ROD)
    assert bent.stress is not None
    assert not bent.twist_rate.any()
    np.testing.assert_allclose(bent.stress, 1e6 * (1e-3 * bent.curvature + np.abs(bent.axial_strain)), rtol=1e-12)
    assert bent.normal_curvature is not None
    assert bent.geodesic_curvature is not None
    np.testing.assert_allclose(np.hypot(bent.normal_curvature, bent.geodesic_curvature), bent.curvature, rtol=1e-12)
    # on a sphere every curve's normal curvature is 1/R; the grid is coarse and clamped
    np.testing.assert_allclose(np.median(np.abs(bent.normal_curvature)), 5.0, rtol=2e-2)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["laths with pins", "tubes with pins", "square battens with pins"])
def test_stress_of_a_shell_is_that_of_the_twin(name: str) -> None:
    rod, form = twisted_shells()[name]
    popped = form.popped["pinned"]
    assert popped.report.converged
    bent = bending_of(popped.shell, popped.state, rod)
    expected = stresses(popped.shell, popped.state, rod)
    assert bent.stress is not None
    assert bent.torsion_stress is not None
    assert bent.torsion_stress.max() > 0.01 * bent.stress.max()
    np.testing.assert_allclose(bent.stress, expected, atol=5e-3 * expected.max())


@pytest.mark.parametrize("eccentricity", [0.0, 2e-3])
def test_rods_a_distance_apart_are_bent_along_their_own_lines(eccentricity: float) -> None:
    """The middle rods on a sphere are great circles of their own layers; there is no zigzag where rods are joined."""
    layout, joint = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.015), rs.Pin(eccentricity=eccentricity)
    form = rs.find_form(rs.Hemisphere(0.2), layout, ROD, joint=joint, ends=("clamped",))
    popped, mesh = form.popped["clamped"], form.footprint.mesh
    bent = bending_of(popped.shell, popped.state, ROD)
    middle = [mesh.rod_slice(k) for k, rod in enumerate(mesh.grid.rods) if rod.offset == 0.0]
    radii = sorted(1 / np.median(bent.curvature[here]) for here in middle)
    np.testing.assert_allclose(radii, [0.2 - eccentricity / 2, 0.2 + eccentricity / 2], rtol=2e-3)
    for here in middle:
        np.testing.assert_allclose(bent.curvature[here], np.median(bent.curvature[here]), rtol=0.05)


@pytest.mark.parametrize("coupling", [rs.SharedDofs(), rs.ImplicitPenalty()])
def test_rods_with_nodes_of_their_own_are_bent_as_those_that_share_them(coupling: object) -> None:
    """Where springs let the rods of a joint part by a millimetre, both are as straight as before."""
    mesh = dome().footprint.mesh
    shell = rs.Shell.of(mesh, ROD, coupling=coupling)  # type: ignore[arg-type]
    state = shell.state(dome().trimmed.positions)
    if len(shell.node_blocks) == shell.node_count:
        rods = np.repeat(np.arange(len(mesh.rod_start)), mesh.rod_stop - mesh.rod_start)
        state[shell.node_blocks] += 1e-3 * np.where(rods % 2, 1.0, -1.0)[:, None]
    expected = bending_of(rs.Shell.of(mesh, ROD), dome().trimmed.positions, ROD)
    np.testing.assert_allclose(bending_of(shell, state, ROD).curvature, expected.curvature, atol=1e-9)


GIVEN = {"EA": 1e5, "EI1": 1.0, "EI2": 1.0, "GJ": 0.7}


def test_a_given_section_with_its_fibres_is_checked_like_the_shape_that_it_is() -> None:
    """A circle given by its stiffnesses: the box about it is the worst that its fibres can be, here sqrt(2) too far."""
    circle = rs.Rod(rs.Circle(4e-3), STEEL)
    section = rs.GivenSection(
        EA=circle.stretch_stiffness, EI1=circle.bend_stiffness, EI2=circle.bend_stiffness, GJ=circle.twist_stiffness,
        fibre_distances=(4e-3, 4e-3), fibre_modulus=2e11, torsion_modulus=np.pi * 4e-3**3 / 2,
    )  # fmt: skip
    given, one, zero = rs.Rod(section), np.ones(1), np.zeros(1)
    for kappa, twist in ((one, 0.3 * one), (zero, one), (one, zero)):
        args = (kappa, zero, 1e-4 * one, twist)
        assert largest_stress(given, *args) == pytest.approx(largest_stress(circle, *args))
    mesh, x, *_ = helix(0.1, 0.04)
    bent = bending(mesh, x, given)
    assert bent.stress is not None
    round_one = bending(mesh, x, circle)
    assert round_one.stress is not None
    drawn = 2e11 * np.abs(round_one.axial_strain)
    np.testing.assert_allclose(bent.stress - drawn, np.sqrt(2) * (round_one.stress - drawn), rtol=1e-9)


@pytest.mark.parametrize(("known", "joint", "missing"), [
    ({}, rs.Ball(), "fibre_distances and fibre_modulus:"),
    ({"fibre_distances": (0.01, 0.01)}, rs.Ball(), "needs fibre_modulus:"),
    ({"fibre_distances": (0.01, 0.01), "fibre_modulus": 1e10}, rs.Pin(), "needs torsion_modulus:"),
    ({"fibre_distances": (0.01, 0.01), "fibre_modulus": 1e10}, rs.Ball(), None),
    ({"fibre_distances": (0.01, 0.01), "fibre_modulus": 1e10, "EI2": 2.0}, rs.Ball(), "needs torsion_modulus:"),
])  # fmt: skip
def test_a_strength_is_refused_where_a_given_section_does_not_say_what_its_stress_needs(
    known: dict[str, object], joint: Joint, missing: str | None
) -> None:
    rod = rs.Rod(rs.GivenSection(**{**GIVEN, **known}))  # type: ignore[arg-type]
    rs.OutputOptions().require_known_stress(rod, joint)  # no strength, nothing to refuse
    if missing is None:
        rs.OutputOptions(strength=1e8).require_known_stress(rod, joint)
        return
    with pytest.raises(rs.InputError, match=missing):
        rs.OutputOptions(strength=1e8).require_known_stress(rod, joint)


def test_a_reduced_strength_of_timber_has_a_shear_strength_in_the_preset_s_proportion() -> None:
    """Not by von Mises, which would grant larch nearly three times what it has."""
    larch = rs.Material.preset("larch")
    rod = rs.Rod(rs.RectangularSection(width=0.035, height=0.05), larch)
    assert larch.bending_strength is not None
    assert larch.shear_strength is not None
    preset = rs.OutputOptions().limits(rod, rs.Strength())
    reduced = rs.OutputOptions(strength=18e6).limits(rod, rs.Strength())
    assert reduced.shear_weight == pytest.approx(larch.bending_strength / larch.shear_strength)
    assert reduced.shear_weight == pytest.approx(preset.shear_weight)
    given = rs.OutputOptions(strength=18e6, shear_strength=2e6).limits(rod, rs.Strength())
    assert given.shear_weight == pytest.approx(9.0)


def test_the_stress_at_rigid_joints_does_not_depend_on_the_mesh() -> None:
    """A joint passes its moment to one side of the rod: the node, with the mean of both, was a fifth to a third low."""
    found = []
    for edge in (0.375, 0.1875, 0.09375):
        layout = rs.GridLayout.orthogonal(spacing=1.5, edge=edge)
        tube = rs.Rod(rs.Tube(radius=0.02085, thickness=0.0035), rs.Material(25e9, 1750, 0.3))
        popped = rs.find_form(rs.Cap(10.0, 4.0), layout, tube, ends="pinned", joint=rs.Rigid()).popped["pinned"]
        stress = bending_of(popped.shell, popped.state, tube).stress
        assert stress is not None
        found.append(float(stress.max()))
    first, second, third = found
    assert abs(third - second) < 0.6 * abs(second - first)  # it converges
    assert first == pytest.approx(third, rel=0.12)
    assert second == pytest.approx(third, rel=0.04)


def test_a_shear_strength_alone_is_refused() -> None:
    with pytest.raises(rs.InputError, match="give the strength too"):
        rs.OutputOptions(shear_strength=4e6)
