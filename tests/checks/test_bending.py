"""Curvature and stress along rods, against circles, helices and sections whose stress is known."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks.bending import bending, bending_of, fibre_distance, fibre_strain
from rodshell.layout import FlatGrid, GridMesh, mesh_grid
from rodshell.layout.gridlayout import lattice_rod

RADIUS = 0.2
ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))


def rods_of_length(*lengths: float, edge: float = 0.01) -> GridMesh:
    """Rods that never meet."""
    rods = [lattice_rod(0, f"U{k + 1:02}", float(k), 0.0, length) for k, length in enumerate(lengths)]
    return mesh_grid(FlatGrid.of(rods), edge)


def laid(mesh: GridMesh, points: np.ndarray) -> np.ndarray:
    """Node positions (n, 3) from points (k, 3) in the order of `rod_nodes`."""
    positions = np.empty((mesh.node_count, 3))
    positions[mesh.rod_nodes] = points
    return positions


def on_line(mesh: GridMesh, stretch: float = 1.0) -> np.ndarray:
    return laid(mesh, np.outer(stretch * mesh.stations, [1.0, 0.0, 0.0]))


def on_circle(mesh: GridMesh, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on a circle, edges being chords of their rest lengths; and the outward tangents of the ends."""
    positions, tangents = np.empty((mesh.node_count, 3)), []
    for rod in range(len(mesh.rod_start)):
        s = mesh.stations[mesh.rod_slice(rod)]
        angle = np.concatenate([[0.0], np.cumsum(2 * np.arcsin(np.diff(s) / (2 * radius)))])
        positions[mesh.nodes_of(rod)] = radius * np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
        along = np.column_stack([np.cos(angle), 0 * angle, -np.sin(angle)])
        tangents += [-along[0], along[-1]]
    return positions, np.array(tangents)


def curvatures(mesh: GridMesh, positions: np.ndarray, clamps: np.ndarray | None = None) -> np.ndarray:
    return bending(mesh, positions, ROD, clamps=clamps).curvature


def test_stress_of_a_rod_bent_to_a_circle_is_e_r_over_radius_within_a_thousandth() -> None:
    mesh = rods_of_length(0.3, 0.45, edge=RADIUS / 20)
    positions, tangents = on_circle(mesh, RADIUS)
    bent = bending(mesh, positions, ROD, clamps=tangents)
    assert bent.stress is not None
    np.testing.assert_allclose(bent.stress, 1e6 * 1e-3 / RADIUS, rtol=1e-3)  # chords of R/20: (h/R)^2/8 = 3e-4
    np.testing.assert_allclose(bent.axial_strain, 0.0, atol=1e-12)


def test_curvature_is_of_second_order_in_the_edge() -> None:
    errors = []
    for edge in (0.02, 0.01, 0.005):
        mesh = rods_of_length(0.4, edge=edge)
        positions, tangents = on_circle(mesh, RADIUS)
        errors.append(np.abs(RADIUS * curvatures(mesh, positions, clamps=tangents) - 1).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.05)


def test_curvature_of_a_helix_out_of_plane() -> None:
    mesh = rods_of_length(0.5, edge=0.005)
    a, b = 0.1, 0.04
    t = mesh.stations / np.hypot(a, b)
    positions = laid(mesh, np.column_stack([a * np.cos(t), a * np.sin(t), b * t]))
    inner = curvatures(mesh, positions)[1:-1]
    np.testing.assert_allclose(inner, a / (a**2 + b**2), rtol=1e-3)  # (h kappa)^2/12 = 2e-4 at h = 5 mm


def test_a_pinned_end_has_no_curvature_and_a_clamp_that_of_its_direction() -> None:
    mesh = rods_of_length(0.3)
    straight = on_line(mesh)
    assert np.all(curvatures(mesh, straight) == 0)
    turn = 0.1
    tangents = np.array([[-np.cos(turn), 0.0, np.sin(turn)], [1.0, 0.0, 0.0]])
    clamped = curvatures(mesh, straight, clamps=tangents)
    assert clamped[0] == pytest.approx(2 * np.tan(turn / 2) / 0.005)  # over half the first edge
    assert np.all(clamped[1:] == 0)


def test_axial_strain_adds_to_the_bending() -> None:
    mesh = rods_of_length(0.3)
    bent = bending(mesh, on_line(mesh, 1.02), ROD)
    assert bent.stress is not None
    np.testing.assert_allclose(bent.axial_strain, 0.02)
    np.testing.assert_allclose(bent.stress, 0.02e6)
    mesh = rods_of_length(0.3, edge=0.01)
    positions, tangents = on_circle(mesh, RADIUS)
    squeezed = bending(mesh, 0.99 * positions, ROD, clamps=tangents)
    assert squeezed.stress is not None
    np.testing.assert_allclose(squeezed.stress, 1e6 * (0.01 + 1e-3 / (0.99 * RADIUS)), rtol=1.2e-2)


def test_rods_do_not_see_each_other() -> None:
    """Entries belong to their own rod, also where the first of one follows the last of another."""
    mesh = rods_of_length(0.2, 0.3)
    positions, tangents = on_circle(mesh, RADIUS)
    second = mesh.nodes_of(1)
    positions[second] = on_line(mesh)[second]
    tangents[2:] = [[-1, 0, 0], [1, 0, 0]]
    kappa = curvatures(mesh, positions, clamps=tangents)
    np.testing.assert_allclose(kappa[mesh.rod_slice(0)], 1 / RADIUS, rtol=1e-3)
    np.testing.assert_allclose(kappa[mesh.rod_slice(1)], 0.0, atol=1e-9)


@pytest.mark.parametrize(
    "section", [rs.Circle(2e-3), rs.Tube(2e-3, 5e-4), rs.RectangularSection(3e-3, 1e-3), rs.Ellipse(3e-3, 1e-3)]
)
def test_fibre_strain_is_the_largest_over_the_outline(section: object) -> None:
    """Against the strain kappa1 x + kappa2 y at many points of the outline."""
    share = np.linspace(0, 2 * np.pi, 2001)
    if isinstance(section, rs.RectangularSection):
        x, y = 0.5 * section.width * np.array([1, 1, -1, -1]), 0.5 * section.height * np.array([1, -1, 1, -1])
    else:
        a, b = (section.a, section.b) if isinstance(section, rs.Ellipse) else (section.radius, section.radius)  # type: ignore[attr-defined]
        x, y = a * np.cos(share), b * np.sin(share)
    rod = rs.Rod(section, ROD.material)  # type: ignore[arg-type]
    for kappa1, kappa2 in ((3.0, 0.0), (0.0, -2.0), (1.5, 4.0), (-2.0, 1.0)):
        largest = np.abs(kappa1 * x + kappa2 * y).max()
        strain = fibre_strain(rod, np.array([kappa1]), np.array([kappa2]))
        assert strain[0] == pytest.approx(largest, rel=1e-5)
        assert fibre_distance(rod) * np.hypot(kappa1, kappa2) >= largest * (1 - 1e-12)  # type: ignore[operator]


def test_a_given_section_has_curvature_but_no_stress() -> None:
    rod = rs.Rod(rs.GivenSection(EA=1.0, EI1=1e-6, EI2=1e-6, GJ=1e-6))
    mesh = rods_of_length(0.3)
    bent = bending(mesh, on_circle(mesh, RADIUS)[0], rod)
    assert bent.stress is None
    assert bent.curvature.max() == pytest.approx(1 / RADIUS, rel=1e-3)
    with pytest.raises(rs.InputError, match="strain of a given section without fibre_distances is not known"):
        fibre_strain(rod, np.zeros(1), np.zeros(1))


def lath() -> rs.Rod:
    """Four times as broad as thick: it bends over its thickness, so that its far edge says nothing."""
    return rs.Rod(rs.RectangularSection(width=1e-3, height=4e-3), ROD.material)


def test_a_lath_on_a_shell_is_judged_by_its_own_axes() -> None:
    """Clamped on a sphere laths bend out of the grid by 1/R, and within it as their geodesic curvature says."""
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.015)
    form = rs.find_form(rs.Hemisphere(RADIUS), layout, lath(), ends=("clamped",))
    shell = form.popped["clamped"]
    assert shell.report.converged
    bent = bending_of(shell.shell, shell.state, lath())
    assert bent.normal_curvature is not None
    assert bent.geodesic_curvature is not None
    assert bent.stress is not None
    assert bent.torsion_stress is not None
    components = np.column_stack([bent.normal_curvature, bent.geodesic_curvature])
    np.testing.assert_allclose(np.hypot(*components.T), bent.curvature, rtol=2e-2, atol=1e-6)  # frames are averaged
    middle = shell.footprint.mesh.rod_slice(3)
    assert np.abs(components[middle, 1]).max() < 1e-3 / RADIUS  # a great circle, by symmetry
    np.testing.assert_allclose(np.abs(components[middle, 0]), 1 / RADIUS, rtol=5e-2)  # a coarse grid: 3 % at its ends
    outer = 0.5e-3 * np.abs(components[:, 0]) + 2e-3 * np.abs(components[:, 1]) + np.abs(bent.axial_strain)
    np.testing.assert_array_less(1e6 * outer * (1 - 1e-12), bent.stress)  # torsion comes on top, at other places
    np.testing.assert_array_less(bent.stress, np.hypot(1e6 * outer, np.sqrt(3) * bent.torsion_stress) * (1 + 1e-12))
    bound = bending(shell.footprint.mesh, shell.positions, lath()).stress
    assert bound is not None
    inner = slice(middle.start + 1, middle.stop - 1)
    assert np.all(bound[inner] > 3 * bent.stress[inner])
